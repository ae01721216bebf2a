//! Scoring of discoveries on sealed pushes: the truth is read only after the verdict.

use crate::battery::{Row, Summary};
use crate::sealed_push::{PushKind, draw_push, seal_pushes};
use augsim_data::random_stream;
use augsim_discovery::{Options, assess, discover};
use augsim_physics::model::PushModel;
use augsim_physics::system::ScatterPer;
use std::time::Instant;

/// Runs the sets with seeds `first .. first + count`, of `pushes` each, with one effect or none.
pub fn run(has_effect: bool, first: u64, count: u64, pushes: usize, on_row: &mut dyn FnMut(&Row)) -> Summary {
    let mut summary = Summary::default();
    for seed in first..first + count {
        let row = run_set(has_effect, seed, pushes, &mut summary);
        on_row(&row);
    }
    summary
}

/// Kinds that poses cannot distinguish from `kind`.
fn equivalent_kinds(kind: PushKind) -> &'static [&'static str] {
    match kind {
        PushKind::ExactSurface => &["exact-surface", "superelliptic-surface"],
        PushKind::Superellipsoid(_) => &["superelliptic-surface", "exact-surface"],
        _ => &[],
    }
}

/// Generates, discovers and scores one set.
fn run_set(has_effect: bool, seed: u64, pushes: usize, summary: &mut Summary) -> Row {
    let mut rng = random_stream(seed, "sealed truth", 0);
    let truth = draw_push(&mut rng, has_effect.then_some(seed as usize), pushes);
    let options = Options { seed, ..Options::default() };
    let failed = |text: String| Row { line: format!("{seed}: {text}"), right: false };
    let sealed = match seal_pushes(truth, seed) {
        Ok(s) => s,
        Err(e) => return failed(e.to_string()),
    };
    let model = match PushModel::parse(&sealed.model, "sealed.toml") {
        Ok(m) => m,
        Err(e) => return failed(e.to_string()),
    };
    let started = Instant::now();
    let d = match discover(&model, &sealed.data, &options, &mut |_| {}) {
        Ok(d) => d,
        Err(e) => return failed(e.to_string()),
    };
    let seconds = started.elapsed().as_secs_f64();
    summary.seconds.push(seconds);
    summary.sets += 1;
    let found: Vec<&str> = d.effects.iter().map(|e| e.kind.as_str()).collect();
    let truth = sealed.truth();
    let mut right = true;
    let mut oracle = String::new();
    match truth.effect {
        None => {
            if !found.is_empty() || !d.tests.pass {
                summary.false_alarms += 1;
                right = false;
            }
        }
        Some(kind) => {
            let assessed = match assess(&model, &sealed.data, &[kind.name()], ScatterPer::Record, &options) {
                Ok(a) => a,
                Err(e) => return failed(e.to_string()),
            };
            oracle = format!(
                "oracle gain {:.1} ({:.1}) rmse {:.3} mm",
                assessed.gain,
                assessed.penalty,
                1e3 * assessed.rmse
            );
            if assessed.is_visible() {
                summary.visible += 1;
                let exact = found == [kind.name()];
                let is_equivalent =
                    found.iter().all(|f| *f == kind.name() || equivalent_kinds(kind).contains(f));
                let is_alternative = d.alternatives.iter().any(|a| a.len() == 1 && a[0] == kind.name());
                if exact {
                    summary.exact += 1;
                } else if !found.is_empty() && (is_equivalent || is_alternative) {
                    summary.ambiguous += 1;
                } else {
                    right = false;
                }
                if let (PushKind::FrictionScatter(sd, _), true) = (kind, exact) {
                    let [low, high] = d.effects[0].parameters["sd_m"].ci95;
                    right &= low < sd && sd < high;
                }
                summary.ratios.push(d.error.augmented.rmse / assessed.rmse);
            } else if !found.is_empty() {
                summary.false_alarms += 1;
                right = false;
            }
        }
    }
    let line = format!(
        "{seed}: {} truth {:?} patches {} c {:.5} mu {:.3} | {:?} {found:?} {:?} or {:?} | mm: declared {:.2} calibrated {:.2} augmented {:.2} floor {:.2} removed {:?} | {oracle} | {:?} dispersion {:.2} {seconds:.1} s {:?}",
        if right { "ok" } else { "WRONG" },
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
    );
    Row { line, right }
}
