//! Friction, springs and rotors of joints as a description file can state them, and notes on what it cannot state.

use super::{described_joint, first_joint};
use crate::export::number;
use augsim_data::Unit;
use augsim_equations::Model;
use augsim_equations::model::{Addition, Change, How, Parameter, RobotModel, Target};
use augsim_robot::{Changes, JointChange};

/// Adds the values of the joints that the model's parameters and effects give, and notes on all other effects.
pub(super) fn change(model: &Model, robot: &RobotModel, changes: &mut Changes) {
    let properties = model.robot_properties(&model.nominals());
    for joint in 0..robot.joints.len() {
        let Some(described) = described_joint(robot, joint) else { continue };
        let stated = &robot.description.joints[described];
        let armature = properties.as_ref().map(|p| p.armature[joint]);
        let change = JointChange {
            damping: joint_value(model, joint, "viscous", Some(("linear-damping", "c"))),
            friction_loss: joint_value(model, joint, "coulomb", Some(("coulomb", "f"))),
            armature: armature.filter(|value| *value != stated.armature),
            stiffness: joint_value(model, joint, "stiffness", None),
        };
        if change != JointChange::default() {
            changes.joints.push((described, change));
        }
    }
    for addition in &model.additions {
        notes(model, robot, addition, changes);
    }
    let others = other_parameters(model, robot);
    if !others.is_empty() {
        let text = format!("the format cannot state these parameters of the model: {}", others.join(", "));
        changes.notes.push((first_joint(robot), text));
    }
    if let Some(gravity) = properties.map(|p| p.gravity_m_s2) {
        let stated = robot.description.gravity_m_s2.unwrap_or([0.0, 0.0, -9.81]);
        // Standard gravity and 9.81 m/s2 count as the same.
        if gravity.iter().zip(stated).any(|(a, b)| (a - b).abs() > 0.01) {
            let text = format!("gravity of the model: {} m/s2", gravity.map(number).join(" "));
            changes.notes.push((first_joint(robot), text));
        }
    }
}

/// Value of a joint's property: its parameter `JOINT_ending`, plus the coefficient of the effect that adds to it.
///
/// `None` if the model has neither, so that the value of the description file stays.
fn joint_value(model: &Model, joint: usize, ending: &str, effect: Option<(&str, &str)>) -> Option<f64> {
    let robot = model.robot.as_ref()?;
    let declared = model.parameter(&format!("{}_{ending}", robot.joints[joint].name));
    let declared = declared.map(|index| model.parameters[index].nominal);
    let added = model.additions.iter().flat_map(|addition| {
        addition.changes.iter().filter_map(|change| {
            let is_own = effect.is_some_and(|(kind, _)| kind == addition.kind) && is_on(change, joint);
            is_own.then(|| coefficient(model, addition, change, effect?.1)).flatten()
        })
    });
    let added: Vec<f64> = added.collect();
    (declared.is_some() || !added.is_empty()).then(|| declared.unwrap_or(0.0) + added.iter().sum::<f64>())
}

fn is_on(change: &Change, joint: usize) -> bool {
    change.target == Target::Joint(joint) && change.how == How::Add
}

/// Value of the parameter of an effect whose name is `letter`, or begins with it and an underscore, in a change.
fn coefficient(model: &Model, addition: &Addition, change: &Change, letter: &str) -> Option<f64> {
    own_parameters(model, addition, change).into_iter().find_map(|parameter| {
        let rest = addition.local_name(&parameter.name).strip_prefix(letter)?;
        (rest.is_empty() || rest.starts_with('_')).then_some(parameter.nominal)
    })
}

/// Parameters of an effect that a change uses.
fn own_parameters<'m>(model: &'m Model, addition: &Addition, change: &Change) -> Vec<&'m Parameter> {
    let symbols: Vec<augsim_equations::text::Symbol> = change.value.tree.symbols().collect();
    let is_used = |index: &usize| symbols.contains(&augsim_equations::text::Symbol::Parameter(*index));
    addition.parameters.clone().filter(is_used).map(|index| &model.parameters[index]).collect()
}

/// Adds a note for each change of an effect that the description file does not state.
fn notes(model: &Model, robot: &RobotModel, addition: &Addition, changes: &mut Changes) {
    for change in &addition.changes {
        let values: Vec<String> =
            own_parameters(model, addition, change).into_iter().map(|p| value_text(addition, p)).collect();
        let (text, values) = (&change.value.tree.text, values.join(", "));
        let (joint, note) = match (change.target, change.how) {
            (Target::Inertia(..) | Target::Armature(_), How::Add) => continue,
            (Target::Joint(joint), How::Add) => match addition.kind.as_str() {
                "linear-damping" => continue,
                "coulomb" => {
                    (joint, format!("friction changes its sign as {text} in the model, with {values}"))
                }
                kind => (
                    joint,
                    format!(
                        "effect {kind}, which the format cannot state: the torque {text} is added, with {values}"
                    ),
                ),
            },
            (_, how) => {
                let on = &addition.on;
                let note = format!(
                    "effect {} on {on}, which the format cannot state: {} = {text}, with {values}",
                    addition.kind,
                    how.key()
                );
                (0, note)
            }
        };
        changes.notes.push((described_joint(robot, joint).unwrap_or_else(|| first_joint(robot)), note));
    }
}

/// Name, value and unit of a parameter of an effect.
fn value_text(addition: &Addition, parameter: &Parameter) -> String {
    format!(
        "{} = {}{}",
        addition.local_name(&parameter.name),
        number(parameter.nominal),
        unit_text(parameter.unit)
    )
}

fn unit_text(unit: Option<Unit>) -> String {
    // A torque has the dimensions of an energy, whose symbol is J.
    let symbol = unit.map_or_else(String::new, Unit::symbol).replace('J', "N m");
    if symbol.is_empty() || symbol == "1" { String::new() } else { format!(" {symbol}") }
}

/// Free parameters of the model, other than those of effects, that no value of the description file stands for.
fn other_parameters(model: &Model, robot: &RobotModel) -> Vec<String> {
    let properties: Vec<usize> = robot.parameters().collect();
    let is_of_joint = |name: &str| {
        let endings = ["viscous", "coulomb", "stiffness"];
        robot.joint_names().any(|joint| endings.iter().any(|ending| name == format!("{joint}_{ending}")))
    };
    let of_effect = |index: usize| model.additions.iter().any(|a| a.parameters.contains(&index));
    let listed = model.parameters.iter().enumerate().filter(|(index, p)| {
        !p.frozen && !properties.contains(index) && !is_of_joint(&p.name) && !of_effect(*index)
    });
    listed.map(|(_, p)| format!("{} = {}{}", p.name, number(p.nominal), unit_text(p.unit))).collect()
}
