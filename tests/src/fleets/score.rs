//! Scores discoveries on generated fleets, run as a user does: binary, model file and table.

use super::{FLEETS, Truth, draw};
use crate::discover_command::discover_in;
use serde_json::Value;
use std::fmt;
use std::io;
use std::path::Path;

/// Name in results of a parameter with values by group, after the name of the parameter.
const PER_GROUP: &str = " per group";

/// A family of fleets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// All units are equal, and the model is complete.
    Equal,
    /// One or two parameters differ from unit to unit.
    Individual,
    /// As individual, with one parameter, and the model lacks an effect that all units share.
    Effect,
}

/// Counts over all fleets of one run.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Number of fleets.
    pub fleets: usize,
    /// Number of fleets on which `augsim` ended in an error.
    pub failed: usize,
    /// Number of fleets in which shared and individual parameters, and effects, were all named right.
    pub right: usize,
    /// Number of fleets in which a parameter was said to differ that does not.
    pub false_differences: usize,
    /// Number of fleets in which a parameter that differs was not named.
    pub missed: usize,
    /// Total duration of all discoveries, s.
    pub seconds: f64,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} fleets, {} failed: right {}, false differences {}, missed differences {}, {:.0} s",
            self.fleets, self.failed, self.right, self.false_differences, self.missed, self.seconds
        )
    }
}

/// Outcome of the discovery on one fleet.
#[derive(Debug)]
pub struct Row {
    /// Truth, answer and score in one line, for the terminal.
    pub line: String,
    /// Whether the discovery's answer is right.
    pub is_right: bool,
}

/// Generates and scores `count` fleets from seed `first` on with the binary `augsim`, each in a folder of its own.
///
/// # Errors
/// The binary cannot be run, or a file cannot be written.
pub fn run(
    kind: Kind,
    (first, count): (u64, u64),
    augsim: &Path,
    folder: &Path,
    on_row: &mut dyn FnMut(&Row),
) -> io::Result<Summary> {
    let mut summary = Summary::default();
    for seed in first..first + count {
        let plant = &FLEETS[(seed % FLEETS.len() as u64) as usize];
        let differing = match kind {
            Kind::Equal => 0,
            Kind::Individual => 1 + (seed / 2 % 2) as usize,
            Kind::Effect => 1,
        };
        let fleet = draw(plant, differing, kind == Kind::Effect, seed);
        let own_folder = folder.join(format!("{seed}"));
        let (out, seconds) = discover_in(&own_folder, augsim, (plant.model, &fleet.csv), &[])?;
        summary.fleets += 1;
        summary.seconds += seconds;
        let Ok(found) = serde_json::from_slice::<Value>(&out.stdout) else {
            summary.failed += 1;
            let line = format!("{seed} {}: {}", plant.name, String::from_utf8_lossy(&out.stderr).trim());
            on_row(&Row { line, is_right: false });
            continue;
        };
        let mut row = score(&fleet.truth, &found, &mut summary);
        row.line = format!("{seed} {} x{} {:.0} s: {}", plant.name, fleet.truth.units, seconds, row.line);
        on_row(&row);
    }
    Ok(summary)
}

/// Scores the answer `found` on one fleet and updates the counts.
fn score(truth: &Truth, found: &Value, summary: &mut Summary) -> Row {
    let effects = found["effects"].as_array().into_iter().flatten().filter_map(|e| e["kind"].as_str());
    let named: Vec<&str> = effects.collect();
    let differing: Vec<&str> = named.iter().filter_map(|name| name.strip_suffix(PER_GROUP)).collect();
    let others: Vec<&str> = named.iter().copied().filter(|name| !name.ends_with(PER_GROUP)).collect();
    let is_false = differing.iter().any(|name| !truth.individual.contains(name));
    let is_missed = truth.individual.iter().any(|name| !differing.contains(name));
    let denotes = |name: &str, kind: &str| name.split(" on ").next() == Some(kind);
    let effect_is_right = match truth.effect {
        None => others.is_empty(),
        Some(kind) => others.len() == 1 && denotes(others[0], kind),
    };
    let is_right = !is_false && !is_missed && effect_is_right;
    summary.right += usize::from(is_right);
    summary.false_differences += usize::from(is_false);
    summary.missed += usize::from(is_missed);
    let line = format!(
        "{:?} {} -> {} [{}]",
        truth.individual,
        truth.effect.unwrap_or("-"),
        found["verdict"].as_str().unwrap_or_default(),
        named.join(" + ")
    );
    Row { line, is_right }
}
