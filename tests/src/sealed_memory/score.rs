//! Scores discoveries on sets with and without a hidden state, run as a user does: binary, model file, table.

use super::effects::{MEMORY_KINDS, Memory};
use super::plants::{Case, MEMORY_CASES, NULL_CASES, PLANTS};
use super::simulate::draw;
use crate::discover_command::discover_in;
use serde_json::Value;
use std::fmt;
use std::io;
use std::path::Path;

/// Counts over all sets of one run.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Number of sets.
    pub sets: usize,
    /// Number of sets on which `augsim` ended in an error.
    pub failed: usize,
    /// Number of sets whose effect, or an equivalent of it, is named and nothing else.
    pub named: usize,
    /// Number of other sets in which it is the only effect of an alternative.
    pub in_alternatives: usize,
    /// Number of other sets in which it is named beside effects that are not there.
    pub beside_others: usize,
    /// Number of sets in which an effect is named that is not there.
    pub absent_effects: usize,
    /// Number of sets without memory in which an effect with a hidden state or a delay is named.
    pub false_memory: usize,
    /// Number of sets whose result says that the residual depends on the past.
    pub past: usize,
    /// Number of complete models to which something is added.
    pub false_alarms: usize,
    /// Total duration of all discoveries, s.
    pub seconds: f64,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} sets, {} failed: named {}, in the alternatives {}, beside others {}; an absent effect named in {}; without memory: a hidden \
             state named in {}, something added to a complete model in {}; residual said to depend on the past in {}; {:.0} s",
            self.sets,
            self.failed,
            self.named,
            self.in_alternatives,
            self.beside_others,
            self.absent_effects,
            self.false_memory,
            self.false_alarms,
            self.past,
            self.seconds
        )
    }
}

/// Outcome of the discovery on one set.
#[derive(Debug)]
pub struct Row {
    /// Truth, answer and score in one line, for the terminal.
    pub line: String,
    /// Whether the answer is right.
    pub is_right: bool,
}

/// The case of the set with this seed; cases take turns.
fn case_of(has_memory: bool, seed: u64) -> Case {
    let cases: &[Case] = if has_memory { &MEMORY_CASES } else { &NULL_CASES };
    cases[(seed % cases.len() as u64) as usize]
}

/// Generates and scores the sets `first` to `first + count - 1`, with or without memory, with the binary `augsim`.
///
/// Each set has its own folder below `folder`.
///
/// # Errors
/// The binary cannot be run, or a file cannot be written.
pub fn run(
    has_memory: bool,
    (first, count): (u64, u64),
    augsim: &Path,
    folder: &Path,
    on_row: &mut dyn FnMut(&Row),
) -> io::Result<Summary> {
    let mut summary = Summary::default();
    for seed in first..first + count {
        let case = case_of(has_memory, seed);
        let set_folder = folder.join(format!("{seed}"));
        let (out, seconds) =
            discover_in(&set_folder, augsim, (PLANTS[case.0].model, &draw(case, seed)), &[])?;
        summary.sets += 1;
        summary.seconds += seconds;
        let name = format!("{seed} {} {:?}", PLANTS[case.0].name, case.1);
        let Ok(found) = serde_json::from_slice::<Value>(&out.stdout) else {
            summary.failed += 1;
            let line = format!("{name}: {}", String::from_utf8_lossy(&out.stderr).trim());
            on_row(&Row { line, is_right: false });
            continue;
        };
        let is_right = score(case, &found, &mut summary);
        let answer = format!("{} {:?}, also {:?}", found["verdict"], effects(&found), alternatives(&found));
        let past = if depends_on_past(&found) { ", depends on the past" } else { "" };
        on_row(&Row { line: format!("{name} -> {answer}{past}, {seconds:.1} s"), is_right });
    }
    Ok(summary)
}

/// Kinds of the effects that an answer names, without their places.
fn effects(found: &Value) -> Vec<String> {
    let kind = |effect: &Value| effect["kind"].as_str().map(without_place);
    found["effects"].as_array().into_iter().flatten().filter_map(kind).collect()
}

/// Kinds of the effects of each alternative, without their places.
fn alternatives(found: &Value) -> Vec<Vec<String>> {
    let kinds = |set: &Value| -> Vec<String> {
        set.as_array().into_iter().flatten().filter_map(|kind| kind.as_str().map(without_place)).collect()
    };
    found["alternatives"].as_array().into_iter().flatten().map(kinds).collect()
}

/// Kind of an effect without its place: `sensor-lag` of `sensor-lag on temp_K`.
fn without_place(kind: &str) -> String {
    kind.split(" on ").next().unwrap_or(kind).to_owned()
}

/// Whether the answer says that the residual depends on the past.
fn depends_on_past(found: &Value) -> bool {
    found["tests"]["memory"]["depends_on_past"].as_bool().unwrap_or(false)
}

/// Judges the answer to one set and updates the counts; returns whether it is right.
fn score((plant, memory): Case, found: &Value, summary: &mut Summary) -> bool {
    let plant = &PLANTS[plant];
    let named = effects(found);
    let verdict = found["verdict"].as_str().unwrap_or_default();
    summary.past += usize::from(depends_on_past(found));
    if memory.is_without_memory() {
        let has_memory = named.iter().any(|kind| MEMORY_KINDS.contains(&kind.as_str()));
        summary.false_memory += usize::from(has_memory);
        summary.false_alarms += usize::from(memory == Memory::None && verdict != "nothing-to-add");
        return !has_memory && (memory != Memory::None || verdict == "nothing-to-add");
    }
    let has_feedthrough = (plant.output)(&[0.0; 2], 1.0) != (plant.output)(&[0.0; 2], 0.0);
    let equivalents = memory.equivalents(plant.is_linear, plant.input.1 > 0.0, has_feedthrough);
    let is_true = |kind: &String| equivalents.contains(&kind.as_str());
    let is_true_set = |set: &[String]| matches!(set, [one] if is_true(one));
    let is_named = is_true_set(&named);
    let is_alternative = !is_named && alternatives(found).iter().any(|set| is_true_set(set));
    summary.named += usize::from(is_named);
    summary.in_alternatives += usize::from(is_alternative);
    summary.beside_others += usize::from(!is_named && !is_alternative && named.iter().any(is_true));
    summary.absent_effects += usize::from(!named.iter().all(is_true));
    is_named || is_alternative
}

#[cfg(test)]
mod tests {
    //! Contract: an answer is right if it names only the effect or an equivalent, or lists it alone as an
    //! alternative; without memory, if it names no hidden state, and nothing for a complete model.
    use super::*;

    fn is_right(case: Case, text: &str) -> bool {
        score(case, &serde_json::from_str(text).expect("JSON"), &mut Summary::default())
    }

    #[test]
    fn equivalent_and_alternative_answers_are_right() {
        let lag = (2, Memory::SensorLag);
        let named = |kinds: &str| format!(r#"{{"verdict": "explained", "effects": [{kinds}]}}"#);
        assert!(is_right(lag, &named(r#"{"kind": "input-lag on heater_W"}"#)));
        assert!(!is_right(lag, &named(r#"{"kind": "second-capacity on temp_K"}"#)));
        assert!(!is_right(lag, &named(r#"{"kind": "sensor-lag"}, {"kind": "leak"}"#)));
        assert!(!is_right(lag, &named("")));
        let other = r#"{"effects": [{"kind": "leak"}], "alternatives": [["sensor-lag on sensor_K"]]}"#;
        assert!(is_right(lag, other));
        // In the tank, which is not linear, the lags differ.
        assert!(!is_right((4, Memory::SensorLag), &named(r#"{"kind": "input-lag"}"#)));
    }

    #[test]
    fn a_hidden_state_is_wrong_without_memory() {
        let named = |kind: &str| format!(r#"{{"verdict": "explained", "effects": [{{"kind": "{kind}"}}]}}"#);
        let missing = (0, Memory::Static("dry friction"));
        assert!(is_right(missing, &named("coulomb on v_m_s")));
        assert!(!is_right(missing, &named("presliding on v_m_s")));
        let complete = (0, Memory::None);
        assert!(!is_right(complete, &named("coulomb on v_m_s")));
        assert!(is_right(complete, r#"{"verdict": "nothing-to-add", "effects": []}"#));
    }
}
