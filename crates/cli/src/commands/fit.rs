//! `augsim fit`: declared parameters of a system of equations.

use crate::args::Fit;
use crate::destination::{RESULT, Results};
use crate::exit::{Outcome, Usage};
use crate::output::Output;
use crate::record::Record;
use crate::written::fit::{Fitted, TELLING, fit, gauge_sentence};
use crate::written::{self, records, unit_text};
use serde::Serialize;
use std::fmt::Write;

/// Name of the file with the calibrated model.
const MODEL: &str = "model.toml";

/// Results of `fit`.
#[derive(Debug, Serialize)]
struct Answer {
    schema: &'static str,
    parameters: Vec<Parameter>,
    rows: Vec<Row>,
    windows: Vec<Stage>,
    stopped: Option<&'static str>,
    /// Sentences about parameters that cannot be found one by one.
    gauges: Vec<String>,
    holds: Vec<HoldTried>,
    substeps: usize,
    /// Columns of the data that the model does not name.
    unnamed_columns: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Parameter {
    name: String,
    unit: String,
    declared: f64,
    value: f64,
    ci95: Option<[f64; 2]>,
    frozen: bool,
    at_bound: bool,
}

#[derive(Debug, Serialize)]
struct Row {
    output: String,
    rmse: f64,
    unit: String,
}

#[derive(Debug, Serialize)]
struct Stage {
    window_s: f64,
    windows: usize,
    rmse: Vec<f64>,
    converged: bool,
}

#[derive(Debug, Serialize)]
struct HoldTried {
    hold: &'static str,
    misfit_of_best: f64,
}

/// Runs the subcommand.
pub fn run(args: &Fit, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    if !written::is_model(&args.model) {
        // Whatever is wrong with the file is said before what kind of model it is.
        augsim_physics::model::ModelFile::read(&args.model)?;
        let text = format!(
            "{}: fit takes models of equations (scenario = \"system\"); use augsim discover for a ball or pushes",
            args.model.display()
        );
        return Err(Usage(text).into());
    }
    let model = written::read(&args.model)?;
    let measured = records::read(&args.data, &model)?;
    let inputs = [args.model.as_path(), args.data.as_path()];
    let record = Record::new("fit").input("model", &args.model).input("data", &args.data);
    let files = [MODEL, RESULT];
    let claim = Results { folder: &args.out, files: &files, inputs: &inputs, record, force }.claim()?;
    let list = records::records(&measured.data, &model, true)?;
    let fitted = fit(&model, &list)?;
    let text = fitted.model.to_toml()?;
    let answer = answer(&model, &fitted, measured.unnamed);
    claim.begin()?;
    let path = claim.write(MODEL, &text)?;
    claim.write(RESULT, &serde_json::to_string_pretty(&answer)?)?;
    claim.write_timing(())?;
    output.result(&answer, || format!("{}\ncalibrated model: {}", told(&answer), path.display()))?;
    Ok(Outcome::Done)
}

fn answer(declared: &augsim_written::Model, fitted: &Fitted, unnamed_columns: Vec<String>) -> Answer {
    let calibration = &fitted.calibration;
    let of = |(index, p): (usize, &augsim_written::model::Parameter)| Parameter {
        name: p.name.clone(),
        unit: unit_text(p.unit).trim().to_owned(),
        declared: declared.parameters[index].nominal,
        value: p.nominal,
        ci95: p.ci95,
        frozen: p.frozen,
        at_bound: calibration.at_bound[index],
    };
    let row = |(output, rmse): (&augsim_written::model::Output, &f64)| Row {
        output: output.name.clone(),
        rmse: *rmse,
        unit: unit_text(output.unit).trim().to_owned(),
    };
    let stages = calibration.stages.iter().map(|s| Stage {
        window_s: s.window_s,
        windows: s.windows,
        rmse: s.rms.clone(),
        converged: s.converged,
    });
    Answer {
        schema: "augsim.fit/1",
        parameters: fitted.model.parameters.iter().enumerate().map(of).collect(),
        rows: fitted.model.outputs.iter().zip(calibration.rms()).map(row).collect(),
        windows: stages.collect(),
        stopped: calibration.stopped,
        gauges: calibration.gauges.iter().map(|g| gauge_sentence(&fitted.model, g)).collect(),
        holds: fitted
            .holds
            .iter()
            .map(|(hold, misfit)| HoldTried { hold: hold.word(), misfit_of_best: *misfit })
            .collect(),
        substeps: fitted.substeps,
        unnamed_columns,
    }
}

fn told(answer: &Answer) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    for p in answer.parameters.iter().filter(|p| !p.frozen) {
        let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
        let interval = match (p.ci95, p.at_bound) {
            (_, true) => "at its bound".to_owned(),
            (Some([low, high]), _) => format!("95 %: {low:.5} to {high:.5}"),
            (None, _) => "no interval".to_owned(),
        };
        let _ = writeln!(
            text,
            "  {:<24} {:.6}{unit} (declared {}{unit}; {interval})",
            p.name, p.value, p.declared
        );
    }
    let stage = answer.windows.last();
    for row in &answer.rows {
        let (count, seconds) = stage.map_or((0, 0.0), |s| (s.windows, s.window_s));
        let unit = if row.unit.is_empty() { String::new() } else { format!(" {}", row.unit) };
        let windows = if count == 1 { "window" } else { "windows" };
        let _ = writeln!(
            text,
            "misfit of {}: {:.4e}{unit} (root mean square, {count} {windows} of {seconds:.4} s)",
            row.output, row.rmse
        );
    }
    if let Some(why) = answer.stopped {
        let _ = writeln!(text, "windows end there: {why}");
    }
    let worst =
        answer.holds.iter().map(|h| h.misfit_of_best).filter(|m| *m > 1.0).fold(f64::INFINITY, f64::min);
    if let Some(best) = answer.holds.iter().find(|h| h.misfit_of_best <= 1.0) {
        let gain = if worst.is_finite() && 1.0 - 1.0 / worst > TELLING {
            format!("; the next best misses by {:.0} % more", 100.0 * (worst - 1.0))
        } else {
            String::new()
        };
        let _ = writeln!(text, "hold of the inputs: {}{gain}", best.hold);
    }
    for gauge in &answer.gauges {
        let _ = writeln!(text, "{gauge}");
    }
    if !answer.unnamed_columns.is_empty() {
        let _ = writeln!(text, "columns that the model does not name: {}", answer.unnamed_columns.join(", "));
    }
    text.trim_end().to_owned()
}
