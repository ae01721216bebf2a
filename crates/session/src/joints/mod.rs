//! Results of a discovery for each joint of a robot: prediction errors and effects in units of torque.

mod effects;
mod friction;
mod units;

use crate::Subject;
use augsim_data::Dataset;
use augsim_discovery::{Discovery, ErrorTable, Rmse};
use augsim_equations::Model;
use augsim_equations::model::{Joint, Output};
use augsim_equations::text::Symbol;
pub use effects::{JointEffect, JointParameter};
pub use friction::{FrictionCurve, friction_curves};
use serde::Serialize;

/// Content of `result.json` of a discovery: its result, and the results of the joints of a robot.
#[derive(Debug, Serialize)]
pub struct ResultFile<'a> {
    #[serde(flatten)]
    found: &'a Discovery,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    joints: Vec<JointResult>,
}

impl<'a> ResultFile<'a> {
    /// Adds the results of the joints to the result of a discovery; `data` as for [`joint_results`].
    pub fn new(subject: &Subject, found: &'a Discovery, data: Option<&Dataset>) -> Self {
        Self { found, joints: joint_results(subject, found, data) }
    }
}

/// Errors of the models at one joint on held-out data, and the effects found there.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointResult {
    /// Name of the joint in expressions.
    pub joint: String,
    /// Output that is compared: the joint's torque, or its position in the forward formulation.
    pub measure: String,
    /// What is compared.
    pub quantity: Quantity,
    /// Unit of the errors and of `measured_sd`.
    pub unit: String,
    /// Standard deviation of the measured values on the held-out trajectories; absent if the data were not read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured_sd: Option<f64>,
    /// Error of the model as declared.
    pub declared: Rmse,
    /// Error of the model after calibration of the declared parameters.
    pub calibrated: Rmse,
    /// Error of the model with the added effects.
    pub augmented: Rmse,
    /// Added effects that act on this joint.
    pub effects: Vec<JointEffect>,
}

/// The measured quantity of a joint that a model predicts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Torque of the drive, or its force, by inverse dynamics.
    Torque,
    /// Position of the joint, by forward dynamics.
    Position,
}

impl Quantity {
    /// Word for the quantity in texts.
    pub fn word(self) -> &'static str {
        match self {
            Quantity::Torque => "torque",
            Quantity::Position => "position",
        }
    }
}

impl JointResult {
    /// A root mean square error in % of the standard deviation of the measured values; `None` without one.
    pub fn percent(&self, error: Rmse) -> Option<f64> {
        self.measured_sd.filter(|sd| *sd > 0.0).map(|sd| 100.0 * error.rmse / sd)
    }
}

/// Determines the results of all joints; empty for a model without `[robot]`.
///
/// `data` are the data of the discovery in the columns of the model, from which standard deviations are computed.
/// Joints that no output of the model measures are left out.
pub fn joint_results(subject: &Subject, found: &Discovery, data: Option<&Dataset>) -> Vec<JointResult> {
    let Some(augmented) = augmented_model(subject, found) else { return Vec::new() };
    let Some(robot) = &augmented.robot else { return Vec::new() };
    let result = |(index, joint): (usize, &Joint)| {
        let (output, quantity) = measured_output(&augmented, index, joint)?;
        let table = error_table(found, &output.name)?;
        let mut effects = effects::of_joint(&augmented, index, found);
        effects.iter_mut().for_each(|effect| effect.complete(found, &output.name, table));
        Some(JointResult {
            joint: joint.name.clone(),
            measure: output.name.clone(),
            quantity,
            unit: table.unit.clone(),
            measured_sd: data.and_then(|data| measured_sd(found, data, output, &table.unit)),
            declared: table.declared,
            calibrated: table.calibrated,
            augmented: table.augmented,
            effects,
        })
    };
    robot.joints.iter().enumerate().filter_map(result).collect()
}

/// Names of added effects that act on no single joint but on the whole arm: a payload, a tilt of the base.
pub fn effects_on_whole_arm(subject: &Subject, found: &Discovery, joints: &[JointResult]) -> Vec<String> {
    let is_robot = matches!(subject, Subject::Equations(model) if model.robot.is_some());
    let at_joint = |kind: &String| joints.iter().any(|j| j.effects.iter().any(|e| e.name == *kind));
    let others = found.effects.iter().map(|e| e.kind.clone()).filter(|kind| !at_joint(kind));
    others.filter(|_| is_robot).collect()
}

/// Parses the augmented model of a discovery of a robot; `None` for another model.
fn augmented_model(subject: &Subject, found: &Discovery) -> Option<Model> {
    let Subject::Equations(declared) = subject else { return None };
    declared.robot.as_ref()?;
    augsim_equations::model::parse(&found.model_toml, &declared.file).ok()
}

/// The output that measures a joint's torque, or else its position.
fn measured_output<'m>(model: &'m Model, index: usize, joint: &Joint) -> Option<(&'m Output, Quantity)> {
    let with = |symbol: Symbol| {
        model.outputs.iter().find(move |output| output.value.tree.symbols().any(|s| s == symbol))
    };
    if let Some(output) = with(Symbol::JointTorque(index)) {
        return Some((output, Quantity::Torque));
    }
    let position = joint.position.tree.symbols().find(|s| matches!(s, Symbol::State(_)))?;
    with(position).map(|output| (output, Quantity::Position))
}

/// Error table of an output: that of the deciding measure, or of a further one.
fn error_table<'d>(found: &'d Discovery, output: &str) -> Option<&'d ErrorTable> {
    let first = &found.error;
    let is_first = first.measure == output || (first.measure.is_empty() && found.errors.is_empty());
    if is_first { Some(first) } else { found.errors.get(output) }
}

/// Standard deviation of an output's measured values on the held-out trajectories, in `unit`.
///
/// If all trajectories take turns as held-out ones, all count. Of a trajectory that is held out in parts all samples count.
fn measured_sd(found: &Discovery, data: &Dataset, output: &Output, unit: &str) -> Option<f64> {
    let own = output.unit.map_or_else(String::new, |u| u.symbol());
    let scale = match (own.as_str(), unit) {
        (a, b) if a == b => 1.0,
        ("m", "mm") => 1e3,
        _ => return None,
    };
    let column = data.column_index(&output.name).ok()?;
    let is_part = |id: &str, name: &String| {
        name.strip_prefix(id).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
    };
    let is_held_out =
        |id: &str| found.heldout.is_empty() || found.heldout.iter().any(|name| is_part(id, name));
    let trajectories = data.trajectories().iter().filter(|t| is_held_out(t.id()));
    let values: Vec<f64> =
        trajectories.flat_map(|t| t.column(column)).copied().filter(|v| v.is_finite()).collect();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / count;
    Some(scale * variance.sqrt()).filter(|sd| sd.is_finite())
}
