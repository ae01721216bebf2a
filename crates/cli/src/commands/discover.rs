//! `augsim discover`: finds the effects that a model lacks and prints the result.

use augsim_data::{digits, estimate_digits};
use augsim_discovery::{Discovery, DiscoveryError, ErrorTable, Rmse, SCHEMA, Verdict};
use augsim_session::sentence;
use augsim_terminal::Outcome;
use augsim_terminal::discover_args::Discover;
use augsim_terminal::discovery::{Ended, run_discovery};
use augsim_terminal::output::Output;
use augsim_terminal::watched::Stop;
use serde::Serialize;
use std::fmt::Write as _;

/// Runs `augsim discover`: finds the effects that a model lacks and prints the result.
pub fn run(args: &Discover, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let Ended { found, stop } = match run_discovery(args, seed, force, output) {
        Err(error) if is_system_rejection(&error) => {
            // Without a calibration there is no result to write, only the verdict.
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
        _ if stop == Some(Stop::Signal) => Outcome::Interrupted,
        Verdict::NotThisSystem => Outcome::CriterionNotMet,
        _ => Outcome::Done,
    })
}

/// Output where the data are not of the declared system, as found before any calibration.
#[derive(Debug, Serialize)]
struct Refusal {
    schema: &'static str,
    verdict: Verdict,
    sentence: String,
}

/// Whether the discovery failed because the data are not of the declared system.
fn is_system_rejection(error: &anyhow::Error) -> bool {
    let is_rejection = |cause: &DiscoveryError| matches!(cause, DiscoveryError::Objection { .. });
    error.chain().filter_map(|cause| cause.downcast_ref()).any(is_rejection)
}

/// Formats the statistical support of the effects: share of resamples with them, q-values, leads and null rate.
///
/// A lead is an effect that is not established. The null rate is the share of simulated recordings without a missing
/// effect for which the search finds one.
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
            "  null rate: {} of {} simulated recordings without a missing effect {verb} one",
            null.named, null.of
        );
    }
    out
}

/// Formats a probability with three decimals; values below 0.001 become `< 0.001`.
fn probability(p: f64) -> String {
    if p < 0.001 { "< 0.001".to_owned() } else { format!("{p:.3}") }
}

/// Whether the errors of a discovery were measured only on the fitted data, because it was stopped early.
fn is_fitted(d: &Discovery) -> bool {
    d.error.folds.is_none() && d.heldout.is_empty()
}

/// Formats the errors of one measure, with one row per model.
///
/// `fitted` states that the errors were measured on the fitted data.
fn error_rows(e: &ErrorTable, fitted: bool, has_additions: bool) -> String {
    let of = if e.measure.is_empty() { String::new() } else { format!(" of `{}`", e.measure) };
    let mut out = format!(
        "\n  error{of} on {} {} trajectories{}{} (95 % interval)\n",
        e.heldout_trajectories,
        if fitted { "fitted" } else { "held-out" },
        e.folds.map_or(String::new(), |n| format!(" ({n} folds)")),
        if e.unit.is_empty() { String::new() } else { format!(", {}", e.unit) }
    );
    let rows = [
        ("declared", e.declared),
        ("calibrated", e.calibrated),
        ("augmented", e.augmented),
        ("noise floor", e.noise_floor),
        ("reduction", e.reduction),
    ];
    for (name, r) in
        rows.into_iter().filter(|(name, _)| has_additions || !matches!(*name, "augmented" | "reduction"))
    {
        let [value, low, high] = estimate_digits(r.rmse, r.ci95);
        let note = if name == "noise floor" { ", estimate" } else { "" };
        // Writing to a string cannot fail.
        let _ = writeln!(out, "  {name:<12} {value:>10}  ({low} to {high}{note})");
    }
    out
}

/// Formats the result of a discovery as a short text.
fn text(args: &Discover, d: &Discovery) -> String {
    let mut out = format!("{}\n\n", d.sentence);
    // Writing to a string cannot fail.
    for effect in &d.effects {
        for (name, e) in &effect.parameters {
            let _ = writeln!(
                out,
                "  {}: {name} = {} {} ({}){}",
                effect.kind,
                e.value_text(),
                e.unit,
                e.interval_text(),
                if e.groups.is_empty() { "" } else { ", the mean over groups:" }
            );
            for (group, e) in &e.groups {
                let _ = writeln!(out, "    {group}: {e} {}", e.unit);
            }
        }
    }
    out += &confidence(d);
    let e = &d.error;
    out += &error_rows(e, is_fitted(d), d.has_additions());
    if let Some(run) = &e.free_run {
        let shown = |error: Option<f64>| match error {
            Some(error) => format!("{} {}", digits(error), run.unit).trim_end().to_owned(),
            None => "diverged".to_owned(),
        };
        let _ = writeln!(
            out,
            "  free run of whole recordings, scored on held-out segments: calibrated {}, augmented {}",
            shown(run.calibrated),
            shown(run.augmented)
        );
    }
    d.errors.values().for_each(|table| out += &error_rows(table, is_fitted(d), d.has_additions()));
    let row = |r: &Rmse| {
        let [value, low, high] = estimate_digits(r.rmse, r.ci95);
        format!("{value} ({low} to {high})")
    };
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
        let ([train, test], [a, b]) = (windows.fitted, windows.excluded);
        let _ = writeln!(
            out,
            "  windows: {train} fitted, {test} predicted; of these {a} and {b} were excluded: {}",
            windows.rule
        );
    }
    for (name, e) in &d.parameters {
        let _ = writeln!(out, "  {name} = {} {} ({})", e.value_text(), e.unit, e.interval_text());
    }
    if let Some(share) = e.explained_text() {
        let _ = writeln!(out, "  {share} of the squared error above the estimated noise floor removed");
    }
    if !d.next_experiment.is_empty() {
        let _ = writeln!(out, "\n  next experiment: {}", d.next_experiment);
    }
    let _ = writeln!(out, "\nreport: {}", args.out.join("report.html").display());
    out
}
