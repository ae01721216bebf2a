//! Scoring of the discovery loop on sealed systems, run as a user does: binary, model file and table.

use super::laws::{Law, grammar_laws, library_laws, unlisted_laws};
use super::plants::{PLANTS, Plant};
use super::simulate::draw;
use serde_json::Value;
use std::fmt;
use std::io;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// A family of sealed data sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// No effect.
    Null,
    /// One effect of the library; small, medium and large sizes in turn.
    Single,
    /// Two effects of the library.
    Pair,
    /// A formula of the search grammar, with an empty library.
    Inside,
    /// An effect outside library and grammar.
    Outside,
}

/// Sizes of effects, relative to the rate of their equation: small, medium, large.
const RELATIVE_SIZES: [f64; 3] = [0.05, 0.15, 0.4];

/// Counts over all sets of a battery.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Number of sets.
    pub sets: usize,
    /// Number of sets that ended in an error.
    pub failed: usize,
    /// Number of sets in which exactly the truth was found.
    pub exact: usize,
    /// Number of other sets in which the truth is one of the alternatives.
    pub named: usize,
    /// Number of other sets in which a part of the truth was found.
    pub partly: usize,
    /// Number of sets without an effect in which one was found.
    pub false_alarms: usize,
    /// Number of sets with the verdict `unknown` or `partly-explained`.
    pub unexplained: usize,
    /// Number of intervals of the coefficient that contain the truth, and number of all.
    pub covered: (usize, usize),
    /// Duration of all runs, s.
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

/// Outcome of one set.
#[derive(Debug)]
pub struct Row {
    /// Text for the terminal.
    pub line: String,
    /// Whether the answer is right.
    pub right: bool,
}

/// Runs `count` sets from seed `first` on with the binary `augsim`, each in its own folder below `folder`.
///
/// With `is_long` each set is one long recording with process noise.
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
        std::fs::create_dir_all(&set_folder)?;
        std::fs::write(set_folder.join("model.toml"), plant.model)?;
        std::fs::write(set_folder.join("data.csv"), &set.csv)?;
        let started = Instant::now();
        let mut command = Command::new(augsim);
        command.current_dir(&set_folder).args([
            "discover",
            "model.toml",
            "data.csv",
            "--out",
            "found",
            "--force",
            "--json",
        ]);
        if kind == Kind::Inside {
            command.args(["--library", "none"]);
        }
        let out = command.output()?;
        summary.sets += 1;
        summary.seconds += started.elapsed().as_secs_f64();
        let Ok(found) = serde_json::from_slice::<Value>(&out.stdout) else {
            summary.failed += 1;
            let line = format!("{seed} {}: {}", plant.name, String::from_utf8_lossy(&out.stderr).trim());
            on_row(&Row { line, right: false });
            continue;
        };
        on_row(&score(kind, plant, &truth, &set.amounts, &found, seed, &mut summary));
    }
    Ok(summary)
}

/// The effects of a set with their relative sizes: kinds, sizes and pairs in turn.
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

/// Whether a name in an answer denotes a law.
fn denotes(name: &str, law: &Law) -> bool {
    if !law.name.contains('z') {
        return name == law.name || name.strip_prefix(law.name).is_some_and(|rest| rest.starts_with(" on "));
    }
    // A formula: only its shape is compared, because the quantity has another name in every plant.
    let shape = name.split(" on ").next().unwrap_or(name);
    let plain: String = shape_of(shape);
    plain == shape_of(law.name)
}

/// The expression with every name that is neither a function nor a parameter replaced by `z`.
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

/// Scores one answer and updates the counts.
fn score(
    kind: Kind,
    plant: &Plant,
    truth: &[(Law, f64)],
    amounts: &[f64],
    found: &Value,
    seed: u64,
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
            && let Some(value) = super::simulate::coefficient(plant, &truth[0].0, amounts[0], seed)
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
        "{seed} {}: [{names}] -> {verdict} [{}], also {alternatives:?}{interval}",
        plant.name,
        named.join(" + ")
    );
    Row { line, right }
}

#[cfg(test)]
mod tests {
    //! Contract: an answer denotes an effect by its kind, with or without its place, and by its shape for any
    //! name of its quantity. Effects that a model declares are never missing from it.
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
