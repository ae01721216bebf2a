//! Result of the fit of a written system, as `result.json` has it.

use super::fit::{Fitted, fit, gauge_sentence};
use super::{noise, records, unit_text};
use crate::usage::ModelFault;
use crate::{DataFrom, Subject, Usage};
use augsim_discovery::NoiseCause;
use augsim_written::Model;
use serde::Serialize;

/// Results of `fit`.
#[derive(Debug, Serialize)]
pub struct Answer {
    /// Version of the format.
    pub schema: &'static str,
    /// Declared parameters.
    pub parameters: Vec<Parameter>,
    /// Misfit of each output over the longest windows.
    pub rows: Vec<Row>,
    /// Windows, shortest first.
    pub windows: Vec<Stage>,
    /// Why windows ended there, where they did not reach the whole recording.
    pub stopped: Option<&'static str>,
    /// Sentences about parameters that cannot be found one by one.
    pub gauges: Vec<String>,
    /// Holds of the inputs that were tried.
    pub holds: Vec<HoldTried>,
    /// Steps of a sample interval.
    pub substeps: usize,
    /// Noise by which records differ from runs of the calibrated model.
    pub noise: NoiseCause,
    /// Columns of the data that the model does not name.
    pub unnamed_columns: Vec<String>,
}

/// A parameter.
#[derive(Debug, Serialize)]
pub struct Parameter {
    /// Name.
    pub name: String,
    /// Unit; empty for a pure number.
    pub unit: String,
    /// Value in the model file.
    pub declared: f64,
    /// Value that was found.
    pub value: f64,
    /// 95 % interval.
    pub ci95: Option<[f64; 2]>,
    /// Whether it was held.
    pub frozen: bool,
    /// Whether it came to lie on a bound.
    pub at_bound: bool,
}

/// Misfit of an output.
#[derive(Debug, Serialize)]
pub struct Row {
    /// Output.
    pub output: String,
    /// Root mean square misfit, in the unit.
    pub rmse: f64,
    /// Unit; empty for a pure number.
    pub unit: String,
}

/// Windows of one length.
#[derive(Debug, Serialize)]
pub struct Stage {
    /// Length, s.
    pub window_s: f64,
    /// Number of windows.
    pub windows: usize,
    /// Root mean square misfit of each output.
    pub rmse: Vec<f64>,
    /// Whether the fit converged.
    pub converged: bool,
}

/// A hold of the inputs that was tried.
#[derive(Debug, Serialize)]
pub struct HoldTried {
    /// Hold in a word.
    pub hold: &'static str,
    /// Misfit in that of the best.
    pub misfit_of_best: f64,
}

/// Calibrates the declared parameters of a model of equations: the model with the values that were found, and the result.
///
/// # Errors
/// [`Usage`] for another kind of model; data that do not go with the model, or a model that cannot be simulated.
pub fn calibrate(subject: &Subject, file: &str, data: &DataFrom) -> anyhow::Result<(Model, Answer)> {
    let Subject::Written(model) = subject else {
        return Err(Usage::model(file, ModelFault::BuiltInFitted).into());
    };
    let measured = records::read(data, model)?;
    let records = records::records(&measured.data, model, true)?;
    let mut fitted = fit(model, &records)?;
    let noise = noise::find(&mut fitted.model, &records)?;
    let answer = answer(model, &fitted, noise, measured.unnamed);
    Ok((fitted.model, answer))
}

fn answer(declared: &Model, fitted: &Fitted, noise: NoiseCause, unnamed_columns: Vec<String>) -> Answer {
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
        noise,
        unnamed_columns,
    }
}
