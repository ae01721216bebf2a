//! A user-defined candidate effect that discovery finds: `cargo run --release -p augsim-session --example
//! own_effect`.
//!
//! A pendulum swings over a magnet that its model does not contain (`docs/recipes/data`, simulated by a
//! program that shares no code with augsim). The library has no magnet, so the model file declares it as a
//! candidate.

use augsim_session::{DataFrom, DiscoverRequest, Subject, discover};
use std::path::PathBuf;

/// Model file of a damped pendulum, without the magnet.
const PENDULUM: &str = r#"
scenario = "system"
name = "pendulum"

[states]
theta_rad = { start = "angle_rad" }
omega_rad_s = { start = "slope(angle_rad)" }

[parameters]
gravity_m_s2 = { nominal = 9.81, frozen = true }
length_m = { nominal = 0.28, min = 0.05, max = 1.0 }
damping_per_s = { nominal = 0.05, min = 0.0, max = 10.0 }

[rates]
theta_rad = "omega_rad_s"
omega_rad_s = "-gravity_m_s2 / length_m * sin(theta_rad) - damping_per_s * omega_rad_s"

[outputs]
angle_rad = { value = "theta_rad", sd = "estimate" }
"#;

/// Declaration of the candidate effect: an attraction to the centre with range `w`. It vanishes at `k = 0`.
const MAGNET: &str = r#"
[[candidate]]
kind = "magnet"
on = "force"
add = "-k * x * exp(-(x / w)^2)"
k = {}
w = { of = "span(x)", min = 0.01, max = 2.0, grid = [0.05, 0.1, 0.3] }
stands_for = ["a spring with a short reach"]
source = "a bell-shaped attraction"
"#;

/// Runs a discovery with the candidate effect and prints the result.
#[expect(clippy::print_stdout, reason = "an example prints its result")]
pub fn main() -> anyhow::Result<()> {
    let swings = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/recipes/data/swings.csv"));
    let model = Subject::parse(&[PENDULUM, MAGNET].concat(), "pendulum over a magnet")?;
    let found = discover(&model, &DataFrom::File(swings), &DiscoverRequest::default(), &mut |_| {})?;
    println!("{}", found.sentence);
    anyhow::ensure!(found.effects.iter().any(|e| e.kind == "magnet"), "the magnet was not found");
    Ok(())
}
