//! Contract: measurements that saturate at the end of a sensor's range are distinguished from a state that
//! stops there. Both test tanks leak, which the model does not know. One tank is full where its sensor's
//! range ends; in the other the level rises above it.

use crate::common::answer_to;
use augsim_discovery::Discovery;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::fmt::Write;

const MODEL: &str = r#"
scenario = "system"
name = "tank"

[inputs]
pump_V = { hold = "zero" }

[states]
full_V = { start = "level_V", min = 0.0 }

[parameters]
k1 = { nominal = 0.05, min = 0.0, max = 1.0, unit = "V^0.5/s" }
k2_per_s = { nominal = 0.04, min = 0.0, max = 1.0 }

[rates]
full_V = "k2_per_s * pump_V - k1 * sqrt(full_V)"

[outputs]
level_V = { value = "full_V", sd = "estimate", range = [0.0, 8.0] }
"#;

/// CSV text of one recording of a leaking tank whose level cannot exceed `full`.
///
/// The pump changes every minute.
fn recording(full: f64) -> String {
    let mut csv = "trajectory,t_s,pump_V,level_V\n".to_owned();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(12_345);
    let (mut level, mut pump) = (3.0_f64, 3.0);
    for sample in 0..800 {
        if sample % 15 == 0 {
            pump = rng.random_range(0.0..6.0);
        }
        let noise: f64 = StandardNormal.sample(&mut rng);
        let read = (level + 0.02 * noise).clamp(0.0, 8.0);
        writeln!(csv, "1,{},{pump},{read}", 4 * sample).expect("a text takes everything");
        for _ in 0..400 {
            let rate = 0.05 * pump - 0.03 * level.sqrt() - 0.006 * level;
            level = (level + 0.01 * rate).clamp(0.0, full);
        }
    }
    csv
}

fn answer(full: f64) -> Discovery {
    answer_to(MODEL, recording(full))
}

#[test]
fn a_tank_that_is_full_where_its_sensor_ends_has_a_ceiling() {
    let found = answer(8.0);
    let ceiling = found.effects.iter().find(|effect| effect.kind == "ceiling");
    assert!(ceiling.is_some(), "{}", found.sentence);
}

#[test]
fn a_tank_that_rises_beyond_the_end_of_its_sensor_has_none() {
    let found = answer(f64::INFINITY);
    assert!(found.effects.iter().all(|effect| effect.kind == "leak"), "{}", found.sentence);
}
