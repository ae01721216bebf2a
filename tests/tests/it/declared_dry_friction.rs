//! Contract: dry friction that the model declares with `sign` is not found again as another law. The body sticks exactly in
//! the simulated data, and its residual creep in the engine is below the noise.

use crate::common::answer_to;
use augsim_discovery::Verdict;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::fmt::Write;

const MODEL: &str = r#"
scenario = "system"
name = "pendulum with a motor and dry friction"

[inputs]
command_V = { hold = "zero" }

[states]
angle_rad = { start = "angle_rad" }
speed_rad_s = { start = "slope(angle_rad)" }

[parameters]
gain_rad_per_V_s2 = { nominal = 5.0, min = 0.0, max = 1e3 }
viscous_per_s = { nominal = 1.0, min = 0.0, max = 1e2 }
gravity_per_s2 = { nominal = 15.0, min = 0.0, max = 1e3 }
dry_rad_s2 = { nominal = 5.0, min = 0.0, max = 1e3 }

[rates]
angle_rad = "speed_rad_s"
speed_rad_s = "gain_rad_per_V_s2 * command_V - gravity_per_s2 * sin(angle_rad) - viscous_per_s * speed_rad_s - dry_rad_s2 * sign(speed_rad_s)"

[outputs]
angle_rad = { value = "angle_rad", sd = "estimate" }
"#;

/// Steps between two samples of the simulation, which are 20 ms apart.
const STEPS: usize = 2000;

/// CSV text of four recordings of 100 samples, with a noise of 3 mrad: gain 6, viscous friction 2, gravity 20, dry friction 8.
fn recordings(seed: u64) -> String {
    let mut csv = "trajectory,t_s,command_V,angle_rad\n".to_owned();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    for record in 0..4 {
        let waves: [[f64; 3]; 4] = std::array::from_fn(|_| {
            [
                rng.random_range(0.5..1.6),
                rng.random_range(0.2..1.5),
                rng.random_range(0.0..std::f64::consts::TAU),
            ]
        });
        let (mut angle, mut speed) = (rng.random_range(-0.3..0.3_f64), 0.0_f64);
        for sample in 0..100 {
            let (time, noise): (f64, f64) = (0.02 * f64::from(sample), StandardNormal.sample(&mut rng));
            let wave =
                |[size, hertz, phase]: [f64; 3]| size * (std::f64::consts::TAU * hertz * time + phase).sin();
            let command: f64 = waves.into_iter().map(wave).sum();
            writeln!(csv, "{record},{time:.2},{command},{}", angle + 0.003 * noise).expect("a text");
            for _ in 0..STEPS {
                let h = 0.02 / STEPS as f64;
                let driven = 6.0 * command - 20.0 * angle.sin() - 2.0 * speed;
                // At rest it stays while the drive is below the friction; a reversal first comes to rest.
                let next = match speed == 0.0 {
                    true => h * (driven - driven.clamp(-8.0, 8.0)),
                    false => speed + h * (driven - 8.0 * speed.signum()),
                };
                speed = if next * speed < 0.0 { 0.0 } else { next };
                angle += h * speed;
            }
        }
    }
    csv
}

#[test]
fn nothing_is_added_to_declared_dry_friction() {
    let found = answer_to(MODEL, recordings(4));
    assert_eq!(found.verdict, Verdict::NothingToAdd, "{}", found.sentence);
    let [low, high] = found.parameters["dry_rad_s2"].ci95;
    assert!(low < 8.0 && 8.0 < high, "dry friction {low} to {high} rad/s^2");
}
