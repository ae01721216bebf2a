//! Contract: in generated fleets the parameters that differ from unit to unit are named, with a distribution that
//! contains the true spread, and shared ones are not; units that are equal lack nothing. Rates over many fleets come
//! from `discover_battery fleets-individual`, ….

use crate::common::answer_to;
use augsim_discovery::{Discovery, Verdict};
use augsim_tests::fleets::{FLEETS, Fleet, draw};

fn answer(fleet: &Fleet, seed: u64) -> Discovery {
    answer_to(FLEETS[(seed % 4) as usize].model, fleet.csv.clone())
}

#[test]
fn the_parameter_that_differs_is_named_with_its_spread() {
    // Eight heaters with one run each.
    let seed = 970_008;
    let fleet = draw(&FLEETS[0], 1, false, seed);
    let found = answer(&fleet, seed);
    let kinds: Vec<&str> = found.effects.iter().map(|e| &*e.kind).collect();
    assert_eq!(
        (kinds, found.verdict),
        (vec!["gain_K_per_W per group"], Verdict::Explained),
        "{}",
        found.sentence
    );
    let gain = &found.effects[0].parameters["gain_K_per_W"];
    for (unit, values) in fleet.truth.values.iter().enumerate() {
        let estimate = &gain.groups[&format!("unit {}", unit + 1)];
        assert!((estimate.value - values[0]).abs() < 0.01 * values[0], "unit {}: {estimate}", unit + 1);
    }
    let over_groups = gain.distribution.as_ref().expect("eight groups");
    let mean = fleet.truth.values.iter().map(|v| v[0]).sum::<f64>() / 8.0;
    let variance = fleet.truth.values.iter().map(|v| (v[0] - mean).powi(2)).sum::<f64>() / 7.0;
    let [low, high] = over_groups.sd_ci95;
    assert!((low..high).contains(&variance.sqrt()), "{over_groups:?}");
    assert!(found.sentence.contains("in 8 groups, mean 0.711"), "{}", found.sentence);
    assert!(found.model_toml.contains("per = \"group\"") && found.model_toml.contains("group_sd = 0.09"));
}

#[test]
fn an_effect_that_all_units_share_is_found_beside_the_difference() {
    // Four tanks.
    let seed = 972_003;
    let found = answer(&draw(&FLEETS[3], 1, true, seed), seed);
    let mut kinds: Vec<&str> = found.effects.iter().map(|e| &*e.kind).collect();
    kinds.sort_unstable();
    assert_eq!(kinds, ["leak", "pump_gain_m_s per group"], "{}", found.sentence);
}

#[test]
fn equal_units_lack_nothing() {
    for seed in [971_006, 971_016] {
        let found = answer(&draw(&FLEETS[(seed % 4) as usize], 0, false, seed), seed);
        assert_eq!(found.verdict, Verdict::NothingToAdd, "{seed}: {}", found.sentence);
    }
}
