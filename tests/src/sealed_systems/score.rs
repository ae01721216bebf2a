//! Scores discoveries on generated systems of equations, run as a user does: binary, model file and table.

use super::laws::{Law, grammar_laws, library_laws, unlisted_laws};
use super::plants::{PLANTS, Plant};
use super::simulate::{GeneratedSet, draw};
use crate::discover_command::discover_in;
use serde_json::Value;
use std::fmt;
use std::io;
use std::path::Path;

/// A family of generated data sets, named by the effects that the model lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// No effect is missing from the model.
    Null,
    /// One effect of the library is missing; small, medium and large sizes in turn.
    Single,
    /// Two effects of the library are missing.
    Pair,
    /// A formula of the search grammar is missing, and the library is empty.
    Inside,
    /// An effect outside library and grammar is missing.
    Outside,
}

/// Sizes of true effects, relative to the RMS rate of their equation: small, medium, large.
const RELATIVE_SIZES: [f64; 3] = [0.05, 0.15, 0.4];

/// Counts over all generated sets of one run.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Number of generated sets.
    pub sets: usize,
    /// Number of sets on which `augsim` ended in an error.
    pub failed: usize,
    /// Number of sets in which exactly the true effects were found.
    pub exact: usize,
    /// Number of other sets in which the true effects are one of the alternatives.
    pub named: usize,
    /// Number of other sets in which some of the true effects were found.
    pub partly: usize,
    /// Number of sets without a missing effect in which one was found.
    pub false_alarms: usize,
    /// Number of sets with the verdict `unknown` or `partly-explained`.
    pub unexplained: usize,
    /// `(covered, all)`: number of 95 % intervals of effect coefficients that contain the truth, and of all.
    pub covered: (usize, usize),
    /// Total duration of all discoveries, s.
    pub seconds: f64,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (covered, total) = self.covered;
        write!(
            f,
            "{} sets, {} failed: exact {}, in the named alternatives {}, partly {}, false alarms {}, unknown or partly explained \
             {}, intervals that contain the true coefficient {covered} of {total}, {:.0} s",
            self.sets,
            self.failed,
            self.exact,
            self.named,
            self.partly,
            self.false_alarms,
            self.unexplained,
            self.seconds
        )
    }
}

/// Outcome of the discovery on one generated set.
#[derive(Debug)]
pub struct Row {
    /// Truth, answer and score in one line, for the terminal.
    pub line: String,
    /// Whether the discovery's answer is right.
    pub right: bool,
}

/// Generates and scores `count` sets from seed `first` on with the binary `augsim`.
///
/// Each set has its own folder below `folder`. With `is_long` it is one long recording with process noise.
///
/// # Errors
/// The binary cannot be run, or a file cannot be written.
pub fn run(
    kind: Kind,
    (first, count): (u64, u64),
    is_long: bool,
    augsim: &Path,
    folder: &Path,
    on_row: &mut dyn FnMut(&Row),
) -> io::Result<Summary> {
    let mut summary = Summary::default();
    for seed in first..first + count {
        let plant = PLANTS[(seed % 8) as usize];
        let plant = &if is_long { plant.as_one_long_recording() } else { plant };
        let truth = truth(kind, plant, seed);
        let set = draw(plant, &truth, seed);
        let set_folder = folder.join(format!("{seed}"));
        let options: &[&str] = if kind == Kind::Inside { &["--library", "none"] } else { &[] };
        let (out, seconds) = discover_in(&set_folder, augsim, (plant.model, &set.csv), options)?;
        summary.sets += 1;
        summary.seconds += seconds;
        let Ok(found) = serde_json::from_slice::<Value>(&out.stdout) else {
            summary.failed += 1;
            let line = format!("{seed} {}: {}", plant.name, String::from_utf8_lossy(&out.stderr).trim());
            on_row(&Row { line, right: false });
            continue;
        };
        let mut row = score(kind, plant, &truth, &set, &found, &mut summary);
        // The seed that repeats the set, also where it was drawn again with another.
        row.line.insert_str(0, &format!("{seed} "));
        on_row(&row);
    }
    Ok(summary)
}

/// True effects of the set with this seed, and their relative sizes; kinds, sizes and pairs take turns.
pub fn truth(kind: Kind, plant: &Plant, seed: u64) -> Vec<(Law, f64)> {
    let turn = (seed / 8) as usize;
    let pick = |list: &[Law], k: usize, share: f64| {
        let missing: Vec<&Law> = list.iter().filter(|law| !plant.declares.contains(&law.name)).collect();
        (*missing[k % missing.len()], share)
    };
    let list = library_laws(plant.is_force);
    match kind {
        Kind::Null => Vec::new(),
        Kind::Single => vec![pick(list, turn, RELATIVE_SIZES[turn % 3])],
        Kind::Pair => vec![pick(list, turn, RELATIVE_SIZES[2]), pick(list, turn + 1, RELATIVE_SIZES[1])],
        Kind::Inside => vec![pick(grammar_laws(plant.is_force), turn, RELATIVE_SIZES[1 + turn % 2])],
        Kind::Outside => vec![pick(unlisted_laws(plant.is_force), turn, RELATIVE_SIZES[1 + turn % 2])],
    }
}

/// Whether the name of an effect in an answer denotes the effect `law`.
fn denotes(name: &str, law: &Law) -> bool {
    if !law.name.contains('z') {
        return name == law.name || name.strip_prefix(law.name).is_some_and(|rest| rest.starts_with(" on "));
    }
    // A formula: only its shape is compared, because the quantity has another name in every plant.
    let shape = name.split(" on ").next().unwrap_or(name);
    let plain: String = shape_of(shape);
    plain == shape_of(law.name)
}

/// Shape of a formula: every name that is neither a function nor a parameter is replaced by `z`.
fn shape_of(text: &str) -> String {
    let mut out = String::new();
    let mut word = String::new();
    for c in text.chars().chain([' ']) {
        if c.is_ascii_alphanumeric() || c == '_' {
            word.push(c);
            continue;
        }
        let known_words =
            ["abs", "tanh", "exp", "relu", "sqrt", "sign", "ln", "sin", "cos", "deadzone", "s", "c"];
        let is_name = word.chars().next().is_some_and(|c| c.is_ascii_alphabetic());
        out.push_str(if is_name && !known_words.contains(&word.as_str()) { "z" } else { &word });
        word.clear();
        if c != ' ' {
            out.push(c);
        }
    }
    out
}

/// Scores the answer `found` on one set and updates the counts.
fn score(
    kind: Kind,
    plant: &Plant,
    truth: &[(Law, f64)],
    set: &GeneratedSet,
    found: &Value,
    summary: &mut Summary,
) -> Row {
    let kinds = |list: &Value| -> Vec<String> {
        let names = list.as_array().into_iter().flatten();
        names.filter_map(|k| k.as_str().map(str::to_owned)).collect()
    };
    let effects: Vec<&Value> = found["effects"].as_array().into_iter().flatten().collect();
    let named: Vec<String> = effects.iter().filter_map(|e| e["kind"].as_str()).map(str::to_owned).collect();
    let is_truth = |set: &[String]| {
        set.len() == truth.len() && truth.iter().all(|(law, _)| set.iter().any(|name| denotes(name, law)))
    };
    let exact = is_truth(&named);
    let alternatives: Vec<Vec<String>> =
        found["alternatives"].as_array().into_iter().flatten().map(kinds).collect();
    let in_alternatives = alternatives.iter().any(|set| is_truth(set));
    let partly = truth.iter().any(|(law, _)| named.iter().any(|name| denotes(name, law)));
    let verdict = found["verdict"].as_str().unwrap_or_default();
    let unexplained = ["unknown", "partly-explained"].contains(&verdict);
    summary.exact += usize::from(exact);
    summary.named += usize::from(!exact && in_alternatives);
    summary.partly += usize::from(!exact && !in_alternatives && partly);
    summary.false_alarms += usize::from(truth.is_empty() && verdict != "nothing-to-add");
    summary.unexplained += usize::from(unexplained);
    let mut interval = String::new();
    if exact && kind == Kind::Single {
        // The coefficient of an effect depends on the size of its quantity to the power of its degree.
        let amount = effects[0]["parameters"].as_object().into_iter().flatten().next();
        if let Some(ci) = amount.and_then(|(_, e)| e["ci95"].as_array())
            && let (Some(low), Some(high)) = (ci[0].as_f64(), ci[1].as_f64())
            && let Some(value) = super::simulate::coefficient(plant, &truth[0].0, set.amounts[0], set.seed)
        {
            interval = format!(", coefficient {value:.4e} in [{low:.4e}, {high:.4e}]");
            summary.covered.1 += 1;
            summary.covered.0 += usize::from((low..=high).contains(&value));
        }
    }
    let right = match kind {
        Kind::Null => verdict == "nothing-to-add",
        Kind::Outside => unexplained,
        _ => exact || in_alternatives,
    };
    let names =
        truth.iter().map(|(law, share)| format!("{} {share}", law.name)).collect::<Vec<_>>().join(" + ");
    let line = format!(
        "{}: [{names}] -> {verdict} [{}], also {alternatives:?}{interval}",
        plant.name,
        named.join(" + ")
    );
    Row { line, right }
}

#[cfg(test)]
mod tests {
    //! Contract: an answer denotes an effect by its kind, with or without its place; or by its formula, for
    //! any name of its quantity. Effects that a model declares are never missing from it.
    use super::*;

    #[test]
    fn declared_effects_are_never_missing() {
        let seeds = 0..400;
        for (kind, seed) in [Kind::Single, Kind::Pair, Kind::Inside]
            .into_iter()
            .flat_map(|k| seeds.clone().map(move |s| (k, s)))
        {
            let plant = &PLANTS[(seed % 8) as usize];
            let laws = truth(kind, plant, seed);
            assert!(laws.iter().all(|(law, _)| !plant.declares.contains(&law.name)), "{seed}");
            assert!(laws.len() < 2 || laws[0].0.name != laws[1].0.name, "{seed}");
        }
    }

    #[test]
    fn names_in_answers_denote_effects() {
        let law = |name| {
            *library_laws(true).iter().chain(grammar_laws(true)).find(|law| law.name == name).expect("a law")
        };
        assert!(denotes("coulomb on v_m_s", &law("coulomb")) && denotes("coulomb", &law("coulomb")));
        assert!(!denotes("coulomb-like", &law("coulomb")));
        assert!(denotes("x_m^3 on v_m_s", &law("z^3")) && !denotes("x_m^2 on v_m_s", &law("z^3")));
        assert!(denotes("tanh(omega_rad_s / s) on omega_rad_s", &law("tanh(z / s)")));
        assert!(denotes("abs(v_m_s) * v_m_s on v_m_s", &law("abs(z) * z")));
    }
}
