//! Runs `augsim discover` on trap sets (see [`super`]) as a user does, and counts right answers.

use super::draw::draw;
use super::judge::{Answer, Judgement, judge};
use super::kinds::{Class, KINDS, Kind};
use super::plants::{PLANTS, Plant};
use crate::discover_command::discover_in;
use std::fmt;
use std::io;
use std::path::Path;

/// Counts over all data sets with a peculiarity in one run.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Number of data sets.
    pub sets: usize,
    /// Number of data sets with a right answer.
    pub right: usize,
    /// Number of sets in which an effect was claimed that is not in the truth.
    pub absent_effects: usize,
    /// `(sets, alarms)`: sets with only unusual noise or sampling; of these, verdicts not `nothing-to-add`.
    pub alarms: (usize, usize),
    /// Number of sets whose data were rejected.
    pub refusals: usize,
    /// Number of sets in which the program failed in another way.
    pub failures: usize,
    /// `(sets, wrong)`: number of sets whose model declares the true effect; of these, wrong answers.
    pub declared: (usize, usize),
    /// Duration of the discovery on each set, s.
    pub seconds: Vec<f64>,
}

impl Summary {
    /// Adds one judged answer to the counts.
    fn count(&mut self, class: Class, answer: &Answer, judged: Judgement, seconds: f64) {
        self.sets += 1;
        self.right += usize::from(judged.is_right);
        self.absent_effects += usize::from(judged.names_absent_effect);
        self.refusals += usize::from(matches!(answer, Answer::Refused(_)));
        self.failures += usize::from(matches!(answer, Answer::Failed(_)));
        let class_counts = match class {
            Class::Noise => Some(&mut self.alarms),
            Class::Declared => Some(&mut self.declared),
            Class::Logging | Class::Defect => None,
        };
        if let Some((sets, wrong)) = class_counts {
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

/// Outcome of the discovery on one data set with a peculiarity.
#[derive(Debug)]
pub struct Row {
    /// Line for the terminal: seed, plant, kind, class, answer, duration.
    pub line: String,
    /// Whether the discovery's answer is right.
    pub is_right: bool,
}

/// Plant and kind of set `number`, which is also its seed.
///
/// The three plants take turns, and each round has the next kind.
pub fn plant_and_kind(number: u64) -> (&'static Plant, &'static Kind) {
    let (plants, kinds) = (PLANTS.len() as u64, KINDS.len() as u64);
    (&PLANTS[(number % plants) as usize], &KINDS[(number / plants % kinds) as usize])
}

/// Generates and judges the sets `first` to `first + count - 1` with the binary `augsim`.
///
/// Each set has its own folder below `folder`.
///
/// # Errors
/// The binary cannot be run, or a file cannot be written.
pub fn run(
    (first, count): (u64, u64),
    augsim: &Path,
    folder: &Path,
    on_row: &mut dyn FnMut(&Row),
) -> io::Result<Summary> {
    let mut summary = Summary::default();
    for number in first..first + count {
        let (plant, kind) = plant_and_kind(number);
        let set = draw(plant, kind, number);
        let set_folder = folder.join(format!("{number}"));
        let (out, seconds) = discover_in(&set_folder, augsim, (&set.model, &set.csv), &[])?;
        let answer = Answer::read(out.status.code(), &out.stdout, &out.stderr);
        let judged = judge(kind, &answer);
        summary.count(kind.class(), &answer, judged, seconds);
        on_row(&Row { line: line(number, &answer, seconds), is_right: judged.is_right });
    }
    Ok(summary)
}

/// Line for the terminal on one set: plant, kind, class, answer, duration.
fn line(number: u64, answer: &Answer, seconds: f64) -> String {
    let (plant, kind) = plant_and_kind(number);
    let answered = match answer {
        Answer::Found { verdict, effects } => format!("{verdict} [{}]", effects.join(" + ")),
        Answer::Refused(message) => format!("refused: {message}"),
        Answer::Failed(message) => format!("failed: {message}"),
    };
    format!("{number} {}: {} ({:?}) -> {answered}, {seconds:.2} s", plant.name, kind.name, kind.class())
}

#[cfg(test)]
mod tests {
    //! Contract: 120 sets are the first 40 kinds with each plant once, and the counts follow from the
    //! answers.
    use super::*;

    #[test]
    fn sets_take_every_kind_with_every_plant_once() {
        let set_count = (KINDS.len() * PLANTS.len()) as u64;
        for (count, kinds) in [(120, 40), (set_count, KINDS.len())] {
            let mut pairs: Vec<(&str, &str)> = (set_count..set_count + count)
                .map(plant_and_kind)
                .map(|(plant, kind)| (kind.name, plant.name))
                .collect();
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
