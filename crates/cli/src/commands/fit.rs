//! `augsim fit`: calibrates the parameters of a model of equations.

use super::note_reading;
use crate::args::Fit;
use augsim_data::{digits, estimate_digits};
use augsim_equations::Model;
use augsim_session::Subject;
use augsim_session::equations::fit::{MIN_REPORTED_DIFFERENCE, OutOfTime};
use augsim_session::equations::fitted::{FitResult, calibrate};
use augsim_session::robot::DescriptionCopy;
use augsim_terminal::Outcome;
use augsim_terminal::destination::{RESULT, Results};
use augsim_terminal::output::Output;
use augsim_terminal::progress::Steps;
use augsim_terminal::record::Record;
use augsim_terminal::time_limit::TimeLimit;
use augsim_terminal::watched::{Report, Stop, Watched, run_watched};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::Sender;

/// Name of the output file with the calibrated model.
const MODEL: &str = "model.toml";

/// Runs `augsim fit`: calibrates the parameters of a model and writes the calibrated model.
pub fn run(args: &Fit, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let subject = Subject::read(&args.model)?;
    let description = DescriptionCopy::new(&subject, &args.out);
    let mut inputs: Vec<&Path> = [&args.model].into_iter().chain(&args.data).map(PathBuf::as_path).collect();
    inputs.extend(description.as_ref().map(|copy| copy.source.as_path()));
    let record = Record::new("fit").input("model", &args.model).inputs("data", &args.data);
    let record = args.time.recorded(record);
    let record = description.iter().fold(record, |record, copy| record.input("robot", &copy.source));
    let copied = description.as_ref().filter(|copy| !copy.is_in_place).map(|copy| copy.name.as_str());
    let files: Vec<&str> = [MODEL, RESULT].into_iter().chain(copied).collect();
    let claim = Results { folder: &args.out, files: &files, inputs: &inputs, record, force }.claim()?;
    let file = args.model.display().to_string();
    let accepted = args.accept.accept.iter().copied().collect();
    let limit = TimeLimit::from_now(args.time_limit)?;
    let data = args.time.of_all(&args.data);
    // Before the fit, so that a fit that fails on a wrong unit still says which unit was taken.
    if let Subject::Equations(model) = &subject {
        note_reading(&data, model, output)?;
    }
    let is_new_unit = args.new_unit;
    let steps = Steps::new(output);
    steps.show_step("fitting the parameters".to_owned());
    let work = move |reports: &Sender<Report<(), (Model, FitResult)>>| {
        let mut interim = |model, answer| {
            // The receiver is gone if the fit was left.
            let _ = reports.send(Report::Progress(()));
            let _ = reports.send(Report::Interim((model, answer)));
        };
        calibrate(
            &subject,
            &file,
            &data,
            accepted,
            is_new_unit,
            limit.map(|limit| limit.search),
            &mut interim,
        )
    };
    let mut show = |()| steps.show_step("estimating the noise".to_owned());
    let Watched { result, stop } = run_watched(limit.map(|limit| limit.end), &mut show, work)?;
    steps.finish();
    let (fitted, answer) = result.ok_or(OutOfTime { calibrated: None })?;
    output.warn(&answer.warnings);
    if let Some(stop) = stop {
        output.notice(format!(
            "the fit was stopped {}: the noise was not estimated, and intervals of the parameters are those of the fit",
            stop.cause()
        ));
    }
    let text = fitted.to_toml()?;
    claim.begin()?;
    let path = claim.write_model(MODEL, &text, description.as_ref())?;
    claim.write(RESULT, &serde_json::to_string_pretty(&answer)?)?;
    claim.write_timing(())?;
    output.result(&answer, || format!("{}\ncalibrated model: {}", fit_text(&answer), path.display()))?;
    Ok(match (stop, &answer.rejection) {
        (Some(Stop::Signal), _) => Outcome::Interrupted,
        (_, Some(_)) => Outcome::CriterionNotMet,
        _ => Outcome::Done,
    })
}

fn fit_text(answer: &FitResult) -> String {
    let mut text = answer.rejection.as_ref().map_or_else(String::new, |sentence| format!("{sentence}\n\n"));
    // Writing to a string cannot fail.
    for p in answer.parameters.iter().filter(|p| !p.frozen) {
        let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
        let [value, low, high] = estimate_digits(p.value, p.ci95.unwrap_or([f64::NAN; 2]));
        let interval = match (p.ci95, p.bound) {
            (_, Some(bound)) => format!("at its {bound} bound"),
            (Some(_), _) => format!("95 %: {low} to {high}"),
            (None, _) if !p.groups.is_empty() => "mean over the groups".to_owned(),
            (None, _) => "no interval".to_owned(),
        };
        let declared = digits(p.declared);
        let _ = writeln!(text, "  {:<24} {value}{unit} (declared {declared}{unit}; {interval})", p.name);
        for (group, found) in &p.groups {
            let [value, low, high] = estimate_digits(found.value, found.ci95.unwrap_or([f64::NAN; 2]));
            let interval =
                found.ci95.map_or_else(|| "no interval".to_owned(), |_| format!("95 %: {low} to {high}"));
            let _ = writeln!(text, "    {group:<22} {value}{unit} ({interval})");
        }
    }
    let stage = answer.windows.last();
    for row in &answer.rows {
        let (count, seconds) = stage.map_or((0, 0.0), |s| (s.windows, s.window_s));
        let unit = if row.unit.is_empty() { String::new() } else { format!(" {}", row.unit) };
        let windows = if count == 1 { "window" } else { "windows" };
        let _ = writeln!(
            text,
            "residual of {}: RMSE {:.4e}{unit} ({count} {windows} of {seconds:.4} s)",
            row.output, row.rmse
        );
    }
    if let Some(why) = answer.stopped {
        let _ = writeln!(text, "longer windows were not fitted: {why}");
    }
    let second_best =
        answer.holds.iter().map(|h| h.relative_residual).filter(|m| *m > 1.0).fold(f64::INFINITY, f64::min);
    if let Some(best) = answer.holds.iter().find(|h| h.relative_residual <= 1.0) {
        let gain = if second_best.is_finite() && 1.0 - 1.0 / second_best > MIN_REPORTED_DIFFERENCE {
            format!("; the residual of the next best is {:.0} % larger", 100.0 * (second_best - 1.0))
        } else {
            String::new()
        };
        let _ = writeln!(text, "input interpolation: {}{gain}", best.hold);
    }
    if let Some(noise) = answer.noise.sentence() {
        let _ = writeln!(text, "{noise}");
    }
    if let Some(failure) = &answer.noise_failure {
        let _ = writeln!(text, "process noise and measurement noise could not be estimated: {failure}");
    }
    for gauge in &answer.gauges {
        let _ = writeln!(text, "{gauge}");
    }
    if !answer.unnamed_columns.is_empty() {
        let _ = writeln!(text, "columns that the model does not name: {}", answer.unnamed_columns.join(", "));
    }
    text.trim_end().to_owned()
}
