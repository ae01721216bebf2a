//! Contract: a hidden state is named, with those that fit equally well and the experiment that separates them;
//! and none is named where there is none. One slow recording of two time constants gets no law of present values,
//! also where a `[[candidate]]` offers the true law. Rates over many sets come from
//! `discover_battery memory` and `memory-null`.

use crate::common::answer_to;
use augsim_data::random_stream;
use augsim_discovery::{Discovery, Verdict};
use augsim_tests::sealed_memory::{MEMORY_CASES, NULL_CASES, PLANTS, draw};
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write as _;

/// Newton's cooling with one time constant.
const ONE_TIME_CONSTANT: &str = r#"
scenario = "system"
name = "bead, Newton's cooling"
[states]
temp_K = { start = "temp_K" }
[parameters]
tau_s = { nominal = 100.0, min = 1.0, max = 3000.0 }
room_K = { nominal = 24.0, min = 0.0, max = 60.0 }
[rates]
temp_K = "(room_K - temp_K) / tau_s"
[outputs]
temp_K = { value = "temp_K", sd = "estimate" }
"#;

/// A body behind the bead that warms up by itself.
const BODY_BEHIND: &str = r#"
[[candidate]]
kind = "body-behind"
on = "temp_K"
add = "c * (z - temp_K)"
c = { min = 0.0 }
T = { of = "step", min = 1.0, max = 2000.0, grid = [8.0, 32.0, 128.0] }
states = { z = { rate = "(room_K - z) / T", start = "temp_K" } }
"#;

/// One recording of 200 samples, every 2 s, of a bead that warms up with time constants of 16 s and 250 s.
fn one_slow_recording() -> String {
    let mut rng = random_stream(1, "one slow recording", 0);
    let mut csv = "trajectory,t_s,temp_K\n".to_owned();
    for t in (0..200).map(|k| 2.0 * f64::from(k)) {
        let noise: f64 = StandardNormal.sample(&mut rng);
        let temp_k = 24.0 - 9.5 * (-t / 16.0).exp() - 12.5 * (-t / 250.0).exp() + 0.015 * noise;
        // Writing to a string cannot fail.
        let _ = writeln!(csv, "warm,{t},{temp_k:.2}");
    }
    csv
}

fn kinds(found: &Discovery) -> Vec<&str> {
    found.effects.iter().map(|effect| &*effect.kind).collect()
}

/// The answer to set `seed` of the generator of sets with or without hidden states.
fn answer(has_memory: bool, seed: u64) -> Discovery {
    let cases: &[_] = if has_memory { &MEMORY_CASES } else { &NULL_CASES };
    let case = cases[(seed % cases.len() as u64) as usize];
    answer_to(PLANTS[case.0].model, draw(case, seed))
}

/// Whether an answer names no law that is absent from a system of two time constants.
fn names_no_false_law(found: &Discovery) -> bool {
    let states = ["second-capacity", "sensor-lag", "body-behind"];
    let is_open = [Verdict::Unknown, Verdict::Explained, Verdict::PartlyExplained].contains(&found.verdict);
    is_open && kinds(found).iter().all(|kind| states.contains(kind))
}

#[test]
fn one_slow_recording_gets_no_law_of_present_values() {
    let found = answer_to(ONE_TIME_CONSTANT, one_slow_recording());
    assert!(names_no_false_law(&found), "{}", found.sentence);
}

#[test]
fn one_slow_recording_gets_no_false_law_beside_the_true_one() {
    let found = answer_to(&format!("{ONE_TIME_CONSTANT}{BODY_BEHIND}"), one_slow_recording());
    assert!(names_no_false_law(&found), "{}", found.sentence);
}

#[test]
fn lags_of_sensor_and_input_are_listed_together() {
    let found = answer(true, 3008);
    let mut named: Vec<String> = kinds(&found).iter().map(|kind| (*kind).to_owned()).collect();
    assert_eq!(named.len(), 1, "{}", found.sentence);
    named.extend(found.alternatives.iter().flatten().cloned());
    assert!(
        ["input-lag", "sensor-lag"].iter().all(|lag| named.iter().any(|n| n == lag)),
        "{}",
        found.sentence
    );
    assert!(found.next_experiment.contains("faster sensor"), "{}", found.next_experiment);
}

#[test]
fn a_complete_model_depends_on_no_past() {
    let found = answer(false, 2);
    assert_eq!(found.verdict, Verdict::NothingToAdd, "{}", found.sentence);
    assert!(!found.tests.memory.depends_on_past, "{:?}", found.tests.memory);
}
