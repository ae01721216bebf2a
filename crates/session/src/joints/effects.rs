//! Effects that a discovery added at a joint, with parameters in units of torque and the error that they remove.

use super::units::joint_unit;
use augsim_discovery::{Discovery, ErrorTable, Estimate, FoundEffect};
use augsim_equations::Model;
use augsim_equations::model::{Addition, Change, Target};
use augsim_equations::text::Symbol;
use serde::Serialize;

/// An added effect at a joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointEffect {
    /// Name of the effect, as under `effects` of the result.
    pub name: String,
    /// Kind of the effect in the library, such as `coulomb`.
    pub kind: String,
    /// The other joint of an effect on two joints; absent for an effect on one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub with: Option<String>,
    /// Parameters of the effect at this joint, coefficients first, with units such as N m and N m s/rad.
    pub parameters: Vec<JointParameter>,
    /// Decrease of the joint's error by the effect, in the unit of the error; absent where it was not computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub removed: Option<f64>,
    /// `removed` as a share of the joint's error of the calibrated model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub removed_share: Option<f64>,
}

/// A parameter of an effect at a joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointParameter {
    /// Name of the parameter in the library, without the name of the joint.
    pub name: String,
    /// Value with its interval and unit.
    #[serde(flatten)]
    pub estimate: Estimate,
}

impl JointEffect {
    /// Sets the error that the effect removes from the output `measure`, whose errors are in `table`.
    ///
    /// A single effect removes the difference between the calibrated and the augmented model.
    pub(super) fn complete(&mut self, found: &Discovery, measure: &str, table: &ErrorTable) {
        let own = found.effects.iter().find(|effect| effect.kind == self.name);
        let is_single = found.effects.len() == 1 && found.unexplained.is_none();
        self.removed = own.and_then(|effect| {
            let of_measure = effect.removed_by_measure.get(measure).copied();
            let of_only = effect.removed.filter(|_| found.errors.is_empty());
            of_measure.or(of_only).or_else(|| is_single.then_some(table.reduction.rmse))
        });
        let before = table.calibrated.rmse;
        self.removed_share = self.removed.filter(|_| before > 0.0).map(|removed| removed / before);
    }
}

/// Effects that the augmented model adds at joint number `joint`, in the order of the result.
pub(super) fn of_joint(model: &Model, joint: usize, found: &Discovery) -> Vec<JointEffect> {
    let at_joint = |change: &&Change| match change.target {
        Target::Joint(index) | Target::Armature(index) => index == joint,
        _ => false,
    };
    let effect = |found: &FoundEffect| {
        let addition = model.additions.iter().find(|addition| is_named(addition, &found.kind))?;
        let changes: Vec<&Change> = addition.changes.iter().filter(at_joint).collect();
        (!changes.is_empty()).then(|| joint_effect(model, joint, (addition, &changes), found))
    };
    found.effects.iter().filter_map(effect).collect()
}

/// Whether the result names an addition of the model so: its kind, alone or with the place.
fn is_named(addition: &Addition, name: &str) -> bool {
    let on = format!("{} on {}", addition.kind, addition.on);
    let with = addition.with.as_ref().map(|with| format!("{on} with {with}"));
    name == addition.kind || name == on || with.is_some_and(|with| name == with)
}

fn joint_effect(
    model: &Model,
    joint: usize,
    (addition, changes): (&Addition, &[&Change]),
    found: &FoundEffect,
) -> JointEffect {
    let joint_names: Vec<String> = model.robot.iter().flat_map(|robot| robot.joint_names()).collect();
    let own = &joint_names[joint];
    let is_prismatic = model.robot.as_ref().is_some_and(|robot| robot.is_prismatic(joint));
    // An effect on two joints is named after both; at the second one the first is the other.
    let with = addition.with.clone().filter(|with| joint_names.contains(with));
    let with = if with.as_ref() == Some(own) { Some(addition.on.clone()) } else { with };
    let is_used = |index: &usize| {
        // A state of the effect, such as that of presliding friction, has parameters of its own.
        let in_rates = || {
            let states = changes.iter().flat_map(|c| c.value.tree.symbols()).filter_map(|s| match s {
                Symbol::State(state) if addition.states.contains(&state) => Some(state),
                _ => None,
            });
            states.flat_map(|s| model.states[s].rate.tree.symbols()).any(|s| s == Symbol::Parameter(*index))
        };
        changes.iter().any(|c| c.value.tree.symbols().any(|s| s == Symbol::Parameter(*index))) || in_rates()
    };
    let parameter = |index: usize| {
        let name = addition.local_name(&model.parameters[index].name);
        let mut estimate = found.parameters.get(name)?.clone();
        let plain = name.strip_suffix(&format!("_{own}")).unwrap_or(name);
        estimate.unit = joint_unit(&addition.kind, plain, &estimate.unit, is_prismatic);
        Some(JointParameter { name: plain.to_owned(), estimate })
    };
    JointEffect {
        name: found.kind.clone(),
        kind: addition.kind.clone(),
        with,
        parameters: addition.parameters.clone().filter(is_used).filter_map(parameter).collect(),
        removed: None,
        removed_share: None,
    }
}
