//! `augsim discover`.

use augsim_discovery::{Discovery, DiscoveryError, Rmse, SCHEMA, Verdict};
use augsim_session::sentence;
use augsim_terminal::Outcome;
use augsim_terminal::discover_args::Discover;
use augsim_terminal::discovery::close_loop;
use augsim_terminal::output::Output;
use serde::Serialize;
use std::fmt::Write as _;

/// Runs the subcommand.
pub fn run(args: &Discover, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let found = match close_loop(args, seed, force, output) {
        Err(error) if is_objection(&error) => {
            // Nothing could be calibrated, so there is no result to write beside the sentence.
            let (verdict, sentence) =
                (Verdict::NotThisSystem, format!("Not this system: {}", sentence(&error)));
            let refusal = Refusal { schema: SCHEMA, verdict, sentence };
            output.result(&refusal, || refusal.sentence.clone())?;
            return Ok(Outcome::CriterionNotMet);
        }
        found => found?,
    };
    output.result(&found, || text(args, &found))?;
    Ok(match found.verdict {
        Verdict::NotThisSystem => Outcome::CriterionNotMet,
        _ => Outcome::Done,
    })
}

/// An answer without a result: the data are not those of the declared system.
#[derive(Debug, Serialize)]
struct Refusal {
    schema: &'static str,
    verdict: Verdict,
    sentence: String,
}

/// Whether the system itself objects to the data.
fn is_objection(error: &anyhow::Error) -> bool {
    let objects = |cause: &DiscoveryError| matches!(cause, DiscoveryError::Objection { .. });
    error.chain().filter_map(|cause| cause.downcast_ref()).any(objects)
}

/// Decimals that show three digits of the smallest of these errors: five at least.
fn decimals(errors: impl Iterator<Item = f64>) -> usize {
    let least = errors.map(f64::abs).filter(|e| *e > 0.0).fold(1.0, f64::min);
    (2.0 - least.log10().floor()).clamp(5.0, 12.0) as usize
}

/// How firmly the data hold what was found: resamples and q-values of established effects, leads, the null rate.
fn confidence(d: &Discovery) -> String {
    let mut out = String::new();
    let percent = |share: f64| 100.0 * share;
    // Writing to a string cannot fail.
    for effect in &d.effects {
        let Some(share) = effect.inclusion else { continue };
        let _ = write!(out, "  {}: established, in {:.0} % of resamples", effect.kind, percent(share));
        let _ = effect.q_value.map_or(Ok(()), |q| write!(out, ", q-value {}", probability(q)));
        let _ = match effect.folds {
            Some([found, folds]) => writeln!(out, ", found again in {found} of {folds} folds"),
            None => writeln!(out),
        };
    }
    for lead in &d.leads {
        let chance = lead.chance.map_or_else(String::new, |p| format!(", chance {}", probability(p)));
        let _ = writeln!(
            out,
            "  lead, not established: {} (in {:.0} % of resamples{chance}): {}; to establish it: {}",
            lead.kind,
            percent(lead.inclusion),
            lead.why,
            lead.next
        );
    }
    if let Some(null) = d.null_records {
        let verb = if null.named == 1 { "names" } else { "name" };
        let _ = writeln!(
            out,
            "  {} of {} records like these, made without an effect, {verb} one",
            null.named, null.of
        );
    }
    out
}

/// A probability in print: small ones as a bound.
fn probability(p: f64) -> String {
    if p < 0.001 { "< 0.001".to_owned() } else { format!("{p:.3}") }
}

/// The result in a few lines.
fn text(args: &Discover, d: &Discovery) -> String {
    let mut out = format!("{}\n\n", d.sentence);
    // Writing to a string cannot fail.
    for effect in &d.effects {
        for (name, e) in &effect.parameters {
            let ([low, high], d) = (e.ci95, e.decimals());
            let _ = writeln!(
                out,
                "  {}: {name} = {:.d$} {} (95 % interval {low:.d$} to {high:.d$}){}",
                effect.kind,
                e.value,
                e.unit,
                if e.groups.is_empty() { "" } else { ", the mean over groups:" }
            );
            for (group, e) in &e.groups {
                let _ = writeln!(out, "    {group}: {e} {}", e.unit);
            }
        }
    }
    out += &confidence(d);
    let e = &d.error;
    let _ = writeln!(
        out,
        "\n  error on {} trajectories that no fit has seen{}, {} (95 % interval)",
        e.heldout_trajectories,
        e.folds.map_or(String::new(), |n| format!(" ({n} folds)")),
        e.unit
    );
    let rows = [
        ("declared", e.declared),
        ("calibrated", e.calibrated),
        ("augmented", e.augmented),
        ("noise floor", e.noise_floor),
        ("reduction", e.reduction),
    ];
    let d5 = decimals(rows.iter().map(|(_, r)| r.rmse));
    for (name, r) in
        rows.into_iter().filter(|(name, _)| d.adds() || !matches!(*name, "augmented" | "reduction"))
    {
        let _ = writeln!(out, "  {name:<12} {:>10.d5$}  ({:.d5$} to {:.d5$})", r.rmse, r.ci95[0], r.ci95[1]);
    }
    if let Some(run) = &e.free_run {
        let shown = |error: Option<f64>| match error {
            Some(error) => format!("{error:.d5$} {}", run.unit).trim_end().to_owned(),
            None => "no end of it".to_owned(),
        };
        let _ = writeln!(
            out,
            "  free run of whole recordings, over parts that no fit has seen: calibrated {}, augmented {}",
            shown(run.calibrated),
            shown(run.augmented)
        );
    }
    for (measure, e) in &d.errors {
        let _ = writeln!(
            out,
            "  {measure}, {}: declared {:.3}, calibrated {:.3}, augmented {:.3}, noise floor {:.3}",
            e.unit, e.declared.rmse, e.calibrated.rmse, e.augmented.rmse, e.noise_floor.rmse
        );
    }
    let row = |r: &Rmse| format!("{:.3} ({:.3} to {:.3})", r.rmse, r.ci95[0], r.ci95[1]);
    for h in &d.horizons {
        let _ = writeln!(out, "  after {} s, {} forecasts:", h.horizon_s, h.forecasts);
        for (measure, e) in &h.errors {
            let _ = writeln!(
                out,
                "    {measure}, {}: declared {}, calibrated {}, augmented {}, gain {}",
                e.unit,
                row(&e.declared),
                row(&e.calibrated),
                row(&e.augmented),
                row(&e.reduction)
            );
        }
    }
    if let Some(windows) = &d.windows {
        let ([train, test], [a, b]) = (windows.fitted, windows.left_out);
        let _ = writeln!(
            out,
            "  windows: {train} fitted, {test} predicted; of these {a} and {b} {}",
            windows.rule
        );
    }
    for (name, e) in &d.parameters {
        let _ = writeln!(
            out,
            "  {name} = {:.5} {} (95 % interval {:.5} to {:.5})",
            e.value, e.unit, e.ci95[0], e.ci95[1]
        );
    }
    if let Some(share) = e.explained_share {
        let _ = writeln!(out, "  removed {:.1} % of the removable squared error", 100.0 * share);
    }
    if !d.next_experiment.is_empty() {
        let _ = writeln!(out, "\n  next experiment: {}", d.next_experiment);
    }
    let _ = writeln!(out, "\nreport: {}", args.out.join("report.html").display());
    out
}
