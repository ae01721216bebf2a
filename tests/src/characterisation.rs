//! Answers of the loop, short enough to keep: a hash of the numbers that matter, and the work that they took.

use augsim_discovery::{Discovery, Verdict, Work};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// Significant digits of a number in a hash. The functions of the system's library (sine, exponential) differ in the last
/// place from processor to processor; the fits carry that to the tenth digit or so.
const DIGITS: usize = 7;

/// One answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// Kinds of the effects, largest share first.
    pub effects: Vec<String>,
    /// 64-bit FNV-1a hash of [`canonical`] in hexadecimal digits.
    pub hash: String,
    /// The work that it took.
    pub work: Work,
}

impl Answer {
    /// The short form of a discovery.
    ///
    /// # Panics
    /// If the discovery is no JSON, which no discovery is.
    pub fn of(d: &Discovery) -> Self {
        let text = canonical(d).to_string();
        let fnv = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
        let hash = text.as_bytes().iter().fold(0xcbf2_9ce4_8422_2325, fnv);
        Self {
            verdict: d.verdict,
            effects: d.effects.iter().map(|e| e.kind.clone()).collect(),
            hash: format!("{hash:016x}"),
            work: d.work,
        }
    }
}

/// Answers by the name of their set, and why they last changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answers {
    /// Why the answers are these and no longer those before.
    pub reason: String,
    /// Answers by set.
    pub sets: BTreeMap<String, Answer>,
}

impl Answers {
    /// Answers to keep, with the reason why they are these.
    ///
    /// # Panics
    /// If the reason is too short to be one.
    pub fn minted(reason: String, sets: BTreeMap<String, Answer>) -> Self {
        assert!(reason.len() > 10, "AUGSIM_MINT says why the answers change");
        Self { reason, sets }
    }

    /// One line for each answer that is not the one kept, for each that is missing, and for each that is new.
    pub fn differences(&self, found: &BTreeMap<String, Answer>) -> Vec<String> {
        let missing = self.sets.keys().filter(|name| !found.contains_key(*name));
        let missing = missing.map(|name| format!("{name}: kept, and not found"));
        let changed = found.iter().filter_map(|(name, answer)| match self.sets.get(name) {
            Some(kept) if kept == answer => None,
            Some(kept) => Some(format!("{name}:\n  kept  {kept:?}\n  found {answer:?}")),
            None => Some(format!("{name}: found, and not kept")),
        });
        missing.chain(changed).collect()
    }
}

/// The numbers of a discovery that a change of structure must not change, rounded to seven digits: words, times and the
/// model file's text are left out.
///
/// # Panics
/// If the discovery is no JSON, which no discovery is.
pub fn canonical(d: &Discovery) -> Value {
    let candidates: Vec<Value> = d
        .candidates
        .iter()
        .map(|c| json!([c.kinds, c.gain, c.penalty, c.fitted, c.chosen, c.parameters]))
        .collect();
    rounded(json!({
        "verdict": d.verdict,
        "effects": d.effects,
        "leads": d.leads,
        "calibrated": d.calibrated,
        "parameters": d.parameters,
        "noise": [d.noise.sd, d.noise.by_channel, d.noise.findings],
        "alternatives": d.alternatives,
        "unexplained": d.unexplained,
        "candidates": candidates,
        "error": d.error,
        "tests": d.tests,
        "correlations": d.correlations,
        "horizons": json!([d.windows, d.errors, d.horizons]),
    }))
}

/// Every number as text of [`DIGITS`] digits; entries that are absent or null are dropped.
fn rounded(value: Value) -> Value {
    match value {
        Value::Number(n) => {
            let x = n.as_f64().unwrap_or(f64::NAN);
            // Rounding noise about zero has no digits to keep.
            let x = if x.abs() < 1e-12 { 0.0 } else { x };
            Value::String(format!("{x:.0$e}", DIGITS - 1))
        }
        Value::Array(list) => list.into_iter().map(rounded).collect(),
        Value::Object(map) => {
            let kept = map.into_iter().filter(|(_, v)| !v.is_null());
            Value::Object(kept.map(|(k, v)| (k, rounded(v))).collect::<Map<_, _>>())
        }
        other => other,
    }
}
