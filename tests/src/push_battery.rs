//! Scoring of discoveries on generated pushes whose truth is read only after the verdict ("sealed" sets).

use crate::battery::{Row, Summary};
use crate::sealed_push::{PushKind, SealedPushes, draw_push, seal_pushes};
use augsim_data::random_stream;
use augsim_discovery::{Discovery, Options, assess, discover};
use augsim_physics::model::PushModel;
use augsim_system::ScatterPer;
use std::time::Instant;

/// Scores the sets with seeds `first .. first + count`, of `pushes` pushes each, with one effect or none.
pub fn run(has_effect: bool, first: u64, count: u64, pushes: usize, on_row: &mut dyn FnMut(&Row)) -> Summary {
    let mut summary = Summary::default();
    for seed in first..first + count {
        let row = run_set(has_effect, seed, pushes, &mut summary);
        on_row(&row);
    }
    summary
}

/// Kinds of effects that measured poses cannot distinguish from `kind`.
fn equivalent_kinds(kind: PushKind) -> &'static [&'static str] {
    match kind {
        PushKind::ExactSurface => &["exact-surface", "superelliptic-surface"],
        PushKind::Superellipsoid(_) => &["superelliptic-surface", "exact-surface"],
        _ => &[],
    }
}

/// A generated set of pushes with its truth and the result of a discovery on it.
struct Trial {
    sealed: SealedPushes,
    model: PushModel,
    options: Options,
    found: Discovery,
    seconds: f64,
}

/// Whether the answer on one set is right, with a note about the fit of the true effect.
struct Score {
    right: bool,
    oracle: String,
}

/// Generates one set of pushes, runs a discovery on it, and scores the answer.
fn run_set(has_effect: bool, seed: u64, pushes: usize, summary: &mut Summary) -> Row {
    let row = run_trial(has_effect, seed, pushes, summary).and_then(|trial| {
        let score = match trial.sealed.truth().effect {
            None => score_null(&trial, summary),
            Some(kind) => score_effect(&trial, kind, summary)?,
        };
        Ok(Row { line: trial.line(seed, &score), right: score.right })
    });
    row.unwrap_or_else(|text| Row { line: format!("{seed}: {text}"), right: false })
}

/// Generates a set of pushes and runs a discovery on it; the error says why that failed.
fn run_trial(has_effect: bool, seed: u64, pushes: usize, summary: &mut Summary) -> Result<Trial, String> {
    let mut rng = random_stream(seed, "sealed truth", 0);
    let truth = draw_push(&mut rng, has_effect.then_some(seed as usize), pushes);
    let options = Options { seed, ..Options::default() };
    let sealed = seal_pushes(truth, seed).map_err(|e| e.to_string())?;
    let model = PushModel::parse(&sealed.model, "sealed.toml").map_err(|e| e.to_string())?;
    let started = Instant::now();
    let found = discover(&model, &sealed.data, &options, &mut |_| {}).map_err(|e| e.to_string())?;
    let seconds = started.elapsed().as_secs_f64();
    summary.seconds.push(seconds);
    summary.sets += 1;
    Ok(Trial { sealed, model, options, found, seconds })
}

/// Scores a set without an effect: right if no effect is claimed and the tests pass.
fn score_null(trial: &Trial, summary: &mut Summary) -> Score {
    let right = trial.found.effects.is_empty() && trial.found.tests.pass;
    summary.false_alarms += usize::from(!right);
    Score { right, oracle: String::new() }
}

/// Scores a set with one effect: compares the answer with the truth and with a fit of the true effect.
fn score_effect(trial: &Trial, kind: PushKind, summary: &mut Summary) -> Result<Score, String> {
    let d = &trial.found;
    let found = trial.found_kinds();
    let assessed =
        assess(&trial.model, &trial.sealed.data, &[kind.name()], ScatterPer::Record, &trial.options)
            .map_err(|e| e.to_string())?;
    let oracle = format!(
        "oracle gain {:.1} ({:.1}) rmse {:.3} mm",
        assessed.gain,
        assessed.penalty,
        1e3 * assessed.rmse
    );
    if !assessed.is_visible() {
        summary.false_alarms += usize::from(!found.is_empty());
        return Ok(Score { right: found.is_empty(), oracle });
    }
    summary.visible += 1;
    let exact = found == [kind.name()];
    let is_equivalent = found.iter().all(|f| *f == kind.name() || equivalent_kinds(kind).contains(f));
    let is_alternative = d.alternatives.iter().any(|a| a.len() == 1 && a[0] == kind.name());
    let ambiguous = !exact && !found.is_empty() && (is_equivalent || is_alternative);
    summary.exact += usize::from(exact);
    summary.ambiguous += usize::from(ambiguous);
    let mut right = exact || ambiguous;
    if let (PushKind::FrictionScatter(sd, _), true) = (kind, exact) {
        let [low, high] = d.effects[0].parameters["sd_m"].ci95;
        right &= low < sd && sd < high;
    }
    summary.ratios.push(d.error.augmented.rmse / assessed.rmse);
    Ok(Score { right, oracle })
}

impl Trial {
    /// Kinds of the effects that the discovery found.
    fn found_kinds(&self) -> Vec<&str> {
        self.found.effects.iter().map(|e| e.kind.as_str()).collect()
    }

    /// Formats truth, answer and score of the set in one line, for the terminal.
    fn line(&self, seed: u64, Score { right, oracle }: &Score) -> String {
        let (d, truth, found, seconds) = (&self.found, self.sealed.truth(), self.found_kinds(), self.seconds);
        format!(
            "{seed}: {} truth {:?} patches {} c {:.5} mu {:.3} | {:?} {found:?} {:?} or {:?} | mm: declared {:.2} calibrated {:.2} augmented {:.2} floor {:.2} removed {:?} | {oracle} | {:?} dispersion {:.2} {seconds:.1} s {:?}",
            if *right { "ok" } else { "WRONG" },
            truth.effect,
            truth.patches,
            truth.c_m,
            truth.contact_friction,
            d.verdict,
            d.effects
                .iter()
                .flat_map(|e| e.parameters.iter().map(|(n, e)| format!("{n} {:.4}", e.value)))
                .collect::<Vec<_>>(),
            d.alternatives,
            1e3 * d.error.declared.rmse,
            1e3 * d.error.calibrated.rmse,
            1e3 * d.error.augmented.rmse,
            1e3 * d.error.noise_floor.rmse,
            d.error.explained_share,
            d.tests,
            d.independent.unwrap_or(0.0),
            d.work,
        )
    }
}
