//! The loop on sealed systems, as a user runs it: the binary, a model file and a table.

use super::laws::{Law, inside, listed, outside};
use super::plants::{PLANTS, Plant};
use super::simulate::draw;
use serde_json::Value;
use std::fmt;
use std::io;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// A family of sealed sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Nothing to find.
    Null,
    /// One effect of the library, small, middling and large in turn.
    Single,
    /// Two effects of the library.
    Pair,
    /// A formula of the grammar, with the library emptied.
    Inside,
    /// A law outside library and grammar.
    Outside,
}

/// Shares of the equation's rate that laws have: small, middling, large.
const SHARES: [f64; 3] = [0.05, 0.15, 0.4];

/// Counts of a battery.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Sets that were run.
    pub sets: usize,
    /// Sets that ended in an error.
    pub failed: usize,
    /// The truth was named and nothing else.
    pub exact: usize,
    /// The truth is among the alternatives that were named as well.
    pub named: usize,
    /// The truth was named with something beside it, or a part of it.
    pub partly: usize,
    /// Effects were named where there are none.
    pub false_alarms: usize,
    /// `unknown` or `partly-explained`.
    pub unexplained: usize,
    /// Intervals of the amount that hold the truth, and how many there were.
    pub covered: (usize, usize),
    /// Seconds of all.
    pub seconds: f64,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (held, all) = self.covered;
        write!(
            f,
            "{} sets, {} failed: exact {}, in the named alternatives {}, partly {}, false alarms {}, unknown or partly explained \
             {}, intervals that hold the amount {held} of {all}, {:.0} s",
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

/// One set's outcome.
#[derive(Debug)]
pub struct Row {
    /// Printable.
    pub line: String,
    /// Whether the answer is as good as it can be.
    pub right: bool,
}

/// Runs `count` sets from seed `first` on with the binary `augsim`, in folders of their own below `folder`; with `is_long` each is one
/// long recording of a shaken motion.
///
/// # Errors
/// The binary cannot be run, or a file cannot be written.
pub fn run(
    kind: Kind,
    (first, count): (u64, u64),
    is_long: bool,
    augsim: &Path,
    folder: &Path,
    each: &mut dyn FnMut(&Row),
) -> io::Result<Summary> {
    let mut summary = Summary::default();
    for seed in first..first + count {
        let plant = PLANTS[(seed % 8) as usize];
        let plant = &if is_long { plant.in_one_recording() } else { plant };
        let truth = truth(kind, plant, seed);
        let drawn = draw(plant, &truth, seed);
        let own = folder.join(format!("{seed}"));
        std::fs::create_dir_all(&own)?;
        std::fs::write(own.join("model.toml"), plant.model)?;
        std::fs::write(own.join("data.csv"), &drawn.csv)?;
        let begun = Instant::now();
        let mut command = Command::new(augsim);
        command.current_dir(&own).args([
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
        summary.seconds += begun.elapsed().as_secs_f64();
        let Ok(found) = serde_json::from_slice::<Value>(&out.stdout) else {
            summary.failed += 1;
            let line = format!("{seed} {}: {}", plant.name, String::from_utf8_lossy(&out.stderr).trim());
            each(&Row { line, right: false });
            continue;
        };
        each(&score(kind, plant, &truth, &drawn.amounts, &found, seed, &mut summary));
    }
    Ok(summary)
}

/// The laws of a set, each with its share of the rate: kinds, sizes and pairs in turn.
pub fn truth(kind: Kind, plant: &Plant, seed: u64) -> Vec<(Law, f64)> {
    let turn = (seed / 8) as usize;
    let one = |list: &[Law], k: usize, share: f64| {
        let missing: Vec<&Law> = list.iter().filter(|law| !plant.declares.contains(&law.name)).collect();
        (*missing[k % missing.len()], share)
    };
    let list = listed(plant.is_force);
    match kind {
        Kind::Null => Vec::new(),
        Kind::Single => vec![one(list, turn, SHARES[turn % 3])],
        Kind::Pair => vec![one(list, turn, SHARES[2]), one(list, turn + 1, SHARES[1])],
        Kind::Inside => vec![one(inside(plant.is_force), turn, SHARES[1 + turn % 2])],
        Kind::Outside => vec![one(outside(plant.is_force), turn, SHARES[1 + turn % 2])],
    }
}

/// Whether a name of the answer means a law.
fn means(name: &str, law: &Law) -> bool {
    if !law.name.contains('z') {
        return name == law.name || name.strip_prefix(law.name).is_some_and(|rest| rest.starts_with(" on "));
    }
    // A shape: its quantity has another name in every plant.
    let shape = name.split(" on ").next().unwrap_or(name);
    let plain: String = tokens(shape);
    plain == tokens(law.name)
}

/// An expression with every name that is no function and no parameter as `z`.
fn tokens(text: &str) -> String {
    let mut out = String::new();
    let mut word = String::new();
    for c in text.chars().chain([' ']) {
        if c.is_ascii_alphanumeric() || c == '_' {
            word.push(c);
            continue;
        }
        let known = ["abs", "tanh", "exp", "relu", "sqrt", "sign", "ln", "sin", "cos", "deadzone", "s", "c"];
        let is_name = word.chars().next().is_some_and(|c| c.is_ascii_alphabetic());
        out.push_str(if is_name && !known.contains(&word.as_str()) { "z" } else { &word });
        word.clear();
        if c != ' ' {
            out.push(c);
        }
    }
    out
}

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
        set.len() == truth.len() && truth.iter().all(|(law, _)| set.iter().any(|name| means(name, law)))
    };
    let exact = is_truth(&named);
    let alternatives: Vec<Vec<String>> =
        found["alternatives"].as_array().into_iter().flatten().map(kinds).collect();
    let in_alternatives = alternatives.iter().any(|set| is_truth(set));
    let partly = truth.iter().any(|(law, _)| named.iter().any(|name| means(name, law)));
    let verdict = found["verdict"].as_str().unwrap_or_default();
    let unexplained = ["unknown", "partly-explained"].contains(&verdict);
    summary.exact += usize::from(exact);
    summary.named += usize::from(!exact && in_alternatives);
    summary.partly += usize::from(!exact && !in_alternatives && partly);
    summary.false_alarms += usize::from(truth.is_empty() && verdict != "nothing-to-add");
    summary.unexplained += usize::from(unexplained);
    if exact && kind == Kind::Single {
        // The amount of a law is that of its kind times a power of the size that its quantity has.
        let amount = effects[0]["parameters"].as_object().into_iter().flatten().next();
        if let Some(ci) = amount.and_then(|(_, e)| e["ci95"].as_array())
            && let (Some(low), Some(high)) = (ci[0].as_f64(), ci[1].as_f64())
            && let Some(value) = super::simulate::amount(plant, &truth[0].0, amounts[0], seed)
        {
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
        "{seed} {}: [{names}] -> {verdict} [{}], also {alternatives:?}",
        plant.name,
        named.join(" + ")
    );
    Row { line, right }
}

#[cfg(test)]
mod tests {
    //! Contract: an answer means a law by its kind, with or without its place, and by its shape whatever its quantity is called.
    //! More of a law that the model has is not asked for.
    use super::*;

    #[test]
    fn what_a_model_declares_is_never_missing() {
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
    fn names_mean_laws() {
        let law =
            |name| *listed(true).iter().chain(inside(true)).find(|law| law.name == name).expect("a law");
        assert!(means("coulomb on v_m_s", &law("coulomb")) && means("coulomb", &law("coulomb")));
        assert!(!means("coulomb-like", &law("coulomb")));
        assert!(means("x_m^3 on v_m_s", &law("z^3")) && !means("x_m^2 on v_m_s", &law("z^3")));
        assert!(means("tanh(omega_rad_s / s) on omega_rad_s", &law("tanh(z / s)")));
        assert!(means("abs(v_m_s) * v_m_s on v_m_s", &law("abs(z) * z")));
    }
}
