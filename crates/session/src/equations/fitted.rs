//! The `fit` command: calibrates an equation model, and gives the result in the format of `result.json`.

use super::fit::{Fitted, fit, gauge_sentence};
use super::rejection::worse_than_mean;
use super::{degrees, new_unit, noise, records, unit_text};
use crate::usage::ModelFault;
use crate::{DataFrom, Subject, Usage};
use augsim_data::DataError;
use augsim_data::checks::{AcceptedChecks, CheckedData, Warning, check_data};
use augsim_discovery::{NoiseCause, NoiseSource};
use augsim_equations::Model;
use augsim_fit::Calibration;
use augsim_system::NORMAL_95;
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Instant;

/// Result of the `fit` command.
#[derive(Debug, Clone, Serialize)]
pub struct FitResult {
    /// Version of the result format.
    pub schema: &'static str,
    /// Sentence that rejects the model, with a remedy; `None` if no output is predicted worse than by its mean.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rejection: Option<String>,
    /// The declared parameters with their calibrated values.
    pub parameters: Vec<Parameter>,
    /// Residual of each output over the longest windows of the fit.
    pub rows: Vec<Row>,
    /// Stages of the fit, shortest windows first.
    pub windows: Vec<Stage>,
    /// Why the windows were not made longer; `None` if they reached the whole recording.
    pub stopped: Option<&'static str>,
    /// Sentences on sets of parameters that are identifiable only in combination.
    pub gauges: Vec<String>,
    /// Input interpolations that the fit compared.
    pub holds: Vec<TriedInterpolation>,
    /// Number of integration steps per sample interval.
    pub substeps: usize,
    /// Process noise and measurement noise of the calibrated model.
    pub noise: NoiseCause,
    /// Why the noise could not be estimated; `None` if it could.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_failure: Option<String>,
    /// Names of the columns in the data that the model does not use.
    pub unnamed_columns: Vec<String>,
    /// Warnings of the data checks.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<Warning>,
    /// Sentences on the column taken as time and on the unit conversions of the data.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub reading: Vec<String>,
}

/// A declared parameter and its calibrated value.
#[derive(Debug, Clone, Serialize)]
pub struct Parameter {
    /// Name of the parameter.
    pub name: String,
    /// Unit of the parameter; empty if dimensionless.
    pub unit: String,
    /// Value of the parameter in the model file before the fit.
    pub declared: f64,
    /// Value of the parameter after the fit; the mean over groups if it has one value per group.
    pub value: f64,
    /// Calibrated value for each group, by name; empty for a parameter with one value.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub groups: BTreeMap<String, GroupValue>,
    /// 95 % confidence interval of the calibrated value; `None` without one.
    pub ci95: Option<[f64; 2]>,
    /// Whether the parameter was fixed at its declared value.
    pub frozen: bool,
    /// Whether the fit ended at a bound of the parameter.
    pub at_bound: bool,
    /// Bound of the parameter at which the fit ended: `lower` or `upper`; `None` for neither.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bound: Option<&'static str>,
}

/// Calibrated values of a parameter by group, with their intervals; empty for a parameter with one value.
fn group_values(model: &Model, calibration: &Calibration, parameter: usize) -> BTreeMap<String, GroupValue> {
    let Some(found) = calibration.groups.iter().find(|found| found.parameter == parameter) else {
        return BTreeMap::new();
    };
    let value = |(value, error): (&f64, &Option<f64>)| {
        let error = error.filter(|e| e.is_finite() && *e > 0.0);
        let ci95 = error.map(|e| [value - NORMAL_95 * e, value + NORMAL_95 * e]);
        GroupValue { value: *value, ci95 }
    };
    let values = found.values.iter().zip(&found.standard_errors).map(value);
    model.group_names().into_iter().zip(values).collect()
}

/// Calibrated value of a parameter for one group of recordings.
#[derive(Debug, Clone, Serialize)]
pub struct GroupValue {
    /// Value of the parameter for the group.
    pub value: f64,
    /// 95 % confidence interval of the value; `None` without one.
    pub ci95: Option<[f64; 2]>,
}

/// Residual of an output after the fit.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// Name of the output.
    pub output: String,
    /// RMS of the output's residual, in the unit of the output.
    pub rmse: f64,
    /// Unit of the output; empty if dimensionless.
    pub unit: String,
}

/// Result of one stage of the fit, in which all windows have the same length.
#[derive(Debug, Clone, Serialize)]
pub struct Stage {
    /// Length of the windows of this stage, s.
    pub window_s: f64,
    /// Number of windows of this stage.
    pub windows: usize,
    /// RMS residual of each output at the end of this stage, in the unit of the output.
    pub rmse: Vec<f64>,
    /// Whether the fit converged in this stage.
    pub converged: bool,
}

/// An input interpolation that the fit tried.
#[derive(Debug, Clone, Serialize)]
pub struct TriedInterpolation {
    /// Name of the interpolation: `zero`, `linear` or `spline`.
    pub hold: &'static str,
    /// Residual norm with this interpolation, relative to the best.
    #[serde(rename = "misfit_of_best")]
    pub relative_residual: f64,
}

/// Calibrates an equation model; returns the model with the calibrated values, and the result.
///
/// # Errors
/// [`Usage`] for another kind of model. The data do not fit the model, or fail a check that is not in
/// `accepted`. The model cannot be simulated.
///
/// With `is_new_unit` only the values by group are fitted, for a group that the model does not know
/// (empirical Bayes).
///
/// After `until` the fit ends with the best values so far. `interim` receives the result before the noise is
/// estimated, which may take as long as the fit.
pub fn calibrate(
    subject: &Subject,
    file: &str,
    data: &DataFrom,
    accepted: AcceptedChecks,
    is_new_unit: bool,
    until: Option<Instant>,
    interim: &mut dyn FnMut(Model, FitResult),
) -> anyhow::Result<(Model, FitResult)> {
    let Subject::Equations(model) = subject else {
        return Err(Usage::model(file, ModelFault::BuiltInFitted).into());
    };
    let measured = records::read(data, model)?;
    let fleet = model;
    let model = &match is_new_unit {
        true => new_unit::model_of_unit(model, &measured.data)?,
        false => records::with_groups_of(model, &measured.data),
    };
    let reading = measured.data.notes().to_vec();
    let CheckedData { data, warnings } =
        check_data(measured.data, &model.expected(), accepted).map_err(DataError::from)?;
    let records = records::records(&data, model, true)?;
    degrees::check(model, &data, &records, accepted)?;
    let mut fitted = fit(model, &records, until)?;
    if is_new_unit {
        new_unit::combine_with_distribution(&mut fitted, fleet);
    }
    let rejection = worse_than_mean(&fitted.model, fitted.calibration.rmse(), &records);
    let not_estimated = NoiseCause {
        source: NoiseSource::Sensor,
        disturbances: Vec::new(),
        correlation_time_s: 0.0,
        white_noise: Vec::new(),
    };
    let mut so_far =
        FitResult { rejection, warnings, reading, ..answer(model, &fitted, not_estimated, measured.unnamed) };
    // Process noise of a model that misses the motion has no meaning.
    if so_far.rejection.is_some() {
        return Ok((fitted.model, so_far));
    }
    interim(fitted.model.clone(), so_far.clone());
    // A model that diverges over a whole record has no noise estimate, but its values remain.
    match noise::find(&mut fitted.model, &records) {
        Ok(noise) => so_far.noise = noise,
        Err(error) => so_far.noise_failure = Some(crate::sentence(&error)),
    }
    Ok((fitted.model, so_far))
}

fn answer(declared: &Model, fitted: &Fitted, noise: NoiseCause, unnamed_columns: Vec<String>) -> FitResult {
    let calibration = &fitted.calibration;
    let parameter = |(index, p): (usize, &augsim_equations::model::Parameter)| Parameter {
        name: p.name.clone(),
        groups: group_values(&fitted.model, calibration, index),
        unit: unit_text(p.unit).trim().to_owned(),
        declared: declared.parameters[index].nominal,
        value: p.nominal,
        ci95: p.ci95,
        frozen: p.frozen,
        at_bound: calibration.at_bound[index],
        bound: calibration.at_bound[index].then_some(if p.nominal <= p.min { "lower" } else { "upper" }),
    };
    let row = |(output, rmse): (&augsim_equations::model::Output, &f64)| Row {
        output: output.name.clone(),
        rmse: *rmse,
        unit: unit_text(output.unit).trim().to_owned(),
    };
    let stages = calibration.stages.iter().map(|s| Stage {
        window_s: s.window_s,
        windows: s.windows,
        rmse: s.rmse.clone(),
        converged: s.converged,
    });
    FitResult {
        schema: "augsim.fit/1",
        rejection: None,
        parameters: fitted.model.parameters.iter().enumerate().map(parameter).collect(),
        rows: fitted.model.outputs.iter().zip(calibration.rmse()).map(row).collect(),
        windows: stages.collect(),
        stopped: calibration.stopped,
        gauges: calibration.gauges.iter().map(|g| gauge_sentence(&fitted.model, g)).collect(),
        holds: fitted
            .holds
            .iter()
            .map(|(hold, residual)| TriedInterpolation { hold: hold.word(), relative_residual: *residual })
            .collect(),
        substeps: fitted.substeps,
        noise,
        noise_failure: None,
        unnamed_columns,
        warnings: Vec::new(),
        reading: Vec::new(),
    }
}
