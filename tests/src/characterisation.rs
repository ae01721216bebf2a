//! Short form of the discovery's answers, for regression tests.
//!
//! An answer is reduced to its verdict, its effects, a hash of its numbers, and the amount of work.

use augsim_discovery::{Discovery, Verdict, Work};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// Number of significant digits to which numbers are rounded before they are hashed.
///
/// Functions of the system library (sine, exponential) differ in the last place between processors; fits
/// carry that to about the tenth digit.
const DIGITS: usize = 7;

/// Short form of the answer of one discovery, which regression tests compare.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Verdict of the discovery.
    pub verdict: Verdict,
    /// Kinds of the effects found, largest share first.
    pub effects: Vec<String>,
    /// 64-bit FNV-1a hash of [`canonical`] in hexadecimal digits.
    pub hash: String,
    /// Computational work of the discovery (numbers of fits and simulations).
    pub work: Work,
}

impl Answer {
    /// Makes the short form of a discovery.
    ///
    /// # Panics
    /// If the discovery cannot be written as JSON, which does not happen.
    pub fn from_discovery(d: &Discovery) -> Self {
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

/// Expected answers by name of the data set, and the reason for their last change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answers {
    /// Reason why the expected answers were last changed.
    pub reason: String,
    /// Expected answers by name of the data set.
    pub sets: BTreeMap<String, Answer>,
}

impl Answers {
    /// Makes expected answers to store, with the reason for the change.
    ///
    /// # Panics
    /// If the reason has ten characters or fewer.
    pub fn keep(reason: String, sets: BTreeMap<String, Answer>) -> Self {
        assert!(reason.len() > 10, "AUGSIM_MINT says why the answers change");
        Self { reason, sets }
    }

    /// Describes each answer that differs from the expected one, is missing, or is new, in one text.
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

/// JSON of the numbers of a discovery that a refactoring must not change, rounded to seven digits.
///
/// Texts, run times and the text of the model file are left out.
///
/// # Panics
/// If the discovery cannot be written as JSON, which does not happen.
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

/// Replaces every number in a JSON value by text with [`DIGITS`] digits, and drops null entries.
fn rounded(value: Value) -> Value {
    match value {
        Value::Number(n) => {
            let x = n.as_f64().unwrap_or(f64::NAN);
            // Rounding errors around zero have no digits that could be compared.
            let x = if x.abs() < 1e-12 { 0.0 } else { x };
            Value::String(format!("{x:.0$e}", DIGITS - 1))
        }
        Value::Array(list) => list.into_iter().map(rounded).collect(),
        Value::Object(map) => {
            let non_null = map.into_iter().filter(|(_, v)| !v.is_null());
            Value::Object(non_null.map(|(k, v)| (k, rounded(v))).collect::<Map<_, _>>())
        }
        other => other,
    }
}
