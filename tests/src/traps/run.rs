//! The battery of traps, as a user runs it: the binary, a model file and a table.

use super::draw::draw;
use super::judge::{Answer, Judgement, judge};
use super::kinds::{Class, KINDS, Kind};
use super::plants::{PLANTS, Plant};
use std::fmt;
use std::io;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Counts of a battery.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Sets that were run.
    pub sets: usize,
    /// Sets that were answered rightly.
    pub right: usize,
    /// Sets with an absent effect among the established ones.
    pub absent_effects: usize,
    /// Sets where only noise or sampling differs, and those of them whose verdict is not `nothing-to-add`.
    pub alarms: (usize, usize),
    /// Sets whose data were refused.
    pub refusals: usize,
    /// Sets where the program failed otherwise.
    pub failures: usize,
    /// Sets with declared effects, and those of them that were answered wrongly.
    pub declared: (usize, usize),
    /// Seconds of each set.
    pub seconds: Vec<f64>,
}

impl Summary {
    fn count(&mut self, class: Class, answer: &Answer, judged: Judgement, seconds: f64) {
        self.sets += 1;
        self.right += usize::from(judged.is_right);
        self.absent_effects += usize::from(judged.names_absent_effect);
        self.refusals += usize::from(matches!(answer, Answer::Refused(_)));
        self.failures += usize::from(matches!(answer, Answer::Failed(_)));
        let of_class = match class {
            Class::Noise => Some(&mut self.alarms),
            Class::Declared => Some(&mut self.declared),
            Class::Logging | Class::Defect => None,
        };
        if let Some((sets, wrong)) = of_class {
            *sets += 1;
            *wrong += usize::from(!judged.is_right);
        }
        self.seconds.push(seconds);
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut seconds = self.seconds.clone();
        seconds.sort_by(f64::total_cmp);
        let median = seconds.get(seconds.len() / 2).copied().unwrap_or(f64::NAN);
        let worst = seconds.last().copied().unwrap_or(f64::NAN);
        write!(
            f,
            "{} sets, {} right; {} with an absent effect named as established; alarms where only noise differs {} of {}; {} refused; \
             {} failed; wrong where the effect is declared {} of {}; seconds median {median:.2} worst {worst:.2}",
            self.sets,
            self.right,
            self.absent_effects,
            self.alarms.1,
            self.alarms.0,
            self.refusals,
            self.failures,
            self.declared.1,
            self.declared.0,
        )
    }
}

/// One set's outcome.
#[derive(Debug)]
pub struct Row {
    /// Printable: seed, plant, kind, class, answer, seconds.
    pub line: String,
    /// Whether the answer is right.
    pub is_right: bool,
}

/// Plant and kind of set `number`, which is its seed as well: every plant in turn, and the next kind behind the last plant.
pub fn chosen(number: u64) -> (&'static Plant, &'static Kind) {
    let (plants, kinds) = (PLANTS.len() as u64, KINDS.len() as u64);
    (&PLANTS[(number % plants) as usize], &KINDS[(number / plants % kinds) as usize])
}

/// Runs sets `first` to `first + count - 1` with the binary `augsim`, each in a folder of its own below `folder`.
///
/// # Errors
/// The binary cannot be run, or a file cannot be written.
pub fn run(
    (first, count): (u64, u64),
    augsim: &Path,
    folder: &Path,
    each: &mut dyn FnMut(&Row),
) -> io::Result<Summary> {
    let mut summary = Summary::default();
    for number in first..first + count {
        let (plant, kind) = chosen(number);
        let drawn = draw(plant, kind, number);
        let own = folder.join(format!("{number}"));
        std::fs::create_dir_all(&own)?;
        std::fs::write(own.join("model.toml"), &drawn.model)?;
        std::fs::write(own.join("data.csv"), &drawn.csv)?;
        let begun = Instant::now();
        let mut command = Command::new(augsim);
        command.current_dir(&own).args(["discover", "model.toml", "data.csv", "--out", "found", "--force"]);
        let out = command.arg("--json").output()?;
        let seconds = begun.elapsed().as_secs_f64();
        let answer = Answer::read(out.status.code(), &out.stdout, &out.stderr);
        let judged = judge(kind, &answer);
        summary.count(kind.class(), &answer, judged, seconds);
        each(&Row { line: line(number, &answer, seconds), is_right: judged.is_right });
    }
    Ok(summary)
}

fn line(number: u64, answer: &Answer, seconds: f64) -> String {
    let (plant, kind) = chosen(number);
    let answered = match answer {
        Answer::Found { verdict, effects } => format!("{verdict} [{}]", effects.join(" + ")),
        Answer::Refused(message) => format!("refused: {message}"),
        Answer::Failed(message) => format!("failed: {message}"),
    };
    format!("{number} {}: {} ({:?}) -> {answered}, {seconds:.2} s", plant.name, kind.name, kind.class())
}

#[cfg(test)]
mod tests {
    //! Contract: 120 sets are the first 40 kinds with each plant once, and the counts of a battery follow from its answers.
    use super::*;

    #[test]
    fn sets_take_every_kind_with_every_plant_once() {
        let whole = (KINDS.len() * PLANTS.len()) as u64;
        for (count, kinds) in [(120, 40), (whole, KINDS.len())] {
            let mut pairs: Vec<(&str, &str)> =
                (whole..whole + count).map(chosen).map(|(plant, kind)| (kind.name, plant.name)).collect();
            pairs.sort_unstable();
            pairs.dedup();
            assert_eq!(pairs.len() as u64, count);
            pairs.dedup_by_key(|pair| pair.0);
            assert_eq!(pairs.len(), kinds);
        }
    }

    #[test]
    fn the_summary_counts_each_class() {
        let mut summary = Summary::default();
        let refused = Answer::Refused(String::new());
        let (right, wrong) = (
            Judgement { is_right: true, names_absent_effect: false },
            Judgement { is_right: false, names_absent_effect: true },
        );
        let nothing = Answer::Found { verdict: String::new(), effects: Vec::new() };
        summary.count(Class::Noise, &nothing, right, 3.0);
        summary.count(Class::Noise, &nothing, wrong, 1.0);
        summary.count(Class::Declared, &nothing, wrong, 2.0);
        summary.count(Class::Logging, &refused, right, 0.5);
        assert_eq!((summary.sets, summary.right, summary.absent_effects), (4, 2, 2));
        assert_eq!((summary.alarms, summary.declared, summary.refusals), ((2, 1), (1, 1), 1));
        assert!(summary.to_string().ends_with("seconds median 2.00 worst 3.00"));
    }
}
