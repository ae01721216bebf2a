//! Checks that parameters are used, outputs depend on the state, and declared widths apply.

use super::toml_reader::Reader;
use super::{Expression, Model, State};
use crate::error::{Fault, ModelError};
use crate::text::{Kind, Symbol};

/// Checks that parameters are used, outputs depend on a state, and declared smoothing widths apply.
pub(super) fn check(model: &Model, reader: Reader<'_>) -> Result<(), ModelError> {
    let mut used = vec![false; model.parameters.len()];
    for symbol in expressions(model).flat_map(|e| e.tree.symbols()) {
        if let Symbol::Parameter(i) = symbol {
            used[i] = true;
        }
    }
    model.inputs.iter().filter_map(|i| i.delay).for_each(|delay| used[delay] = true);
    model.robot.iter().flat_map(|robot| robot.parameters()).for_each(|index| used[index] = true);
    if model.external.is_some() {
        model.external_parameters().for_each(|index| used[index] = true);
    }
    let is_unused = |i: &usize| !used[*i] && !model.parameters[*i].frozen;
    if let Some(index) = (0..model.parameters.len()).find(is_unused) {
        let p = &model.parameters[index];
        let has_parameter =
            |s: &&State| s.start.tree.symbols().any(|s| matches!(s, Symbol::Parameter(i) if i == index));
        let fault = match model.states.iter().find(has_parameter) {
            Some(state) => Fault::UsedInStart { state: state.name.clone() },
            None => Fault::Unused,
        };
        return Err(reader.error(p.line, &format!("parameters.{}", p.name), fault));
    }
    let mut state_dependent = Vec::with_capacity(model.lets.len());
    for value in &model.lets {
        let depends = depends_on_state(&value.value, &state_dependent);
        state_dependent.push(depends);
    }
    if let Some(o) = model.outputs.iter().find(|o| !depends_on_state(&o.value, &state_dependent)) {
        return Err(reader.error(o.value.line, &o.value.key, Fault::NeverChanges));
    }
    check_dynamics(model, reader)?;
    check_external(model, reader)?;
    for text in model.numerics.widths.keys() {
        if !smoothed_arguments(model).any(|argument| argument == text) {
            let line = reader.text.find("sign_width").map_or(1, |position| reader.line(position));
            let fault = Fault::UnusedWidth { text: augsim_data::escaped_short(text) };
            return Err(reader.error(line, "numerics.sign_width", fault));
        }
    }
    Ok(())
}

/// Checks that the joints have what the dynamics of a robot are computed from: accelerations, or torques of the drives.
fn check_dynamics(model: &Model, reader: Reader<'_>) -> Result<(), ModelError> {
    let Some(robot) = &model.robot else { return Ok(()) };
    let has_acceleration = robot.joints.iter().all(|joint| joint.acceleration.is_some());
    let has_torque = robot.joints.iter().all(|joint| joint.torque.is_some());
    for expression in expressions(model) {
        let cause = expression.tree.symbols().find_map(|symbol| match symbol {
            Symbol::JointTorque(_) if !has_acceleration => Some(
                "inverse_dynamics needs the acceleration of every joint; add acceleration = [\"a1_rad_s2\"] to [robot], with \
                 one expression for each joint",
            ),
            Symbol::JointAcceleration(_) if !has_torque => Some(
                "forward_dynamics needs the torque of every drive; add torque = [\"tau1_N_m\"] to [robot], with one expression \
                 for each joint",
            ),
            _ => None,
        });
        if let Some(cause) = cause {
            return Err(reader.error(expression.line, &expression.key, Fault::Robot { cause: cause.into() }));
        }
    }
    Ok(())
}

/// Checks that `external_rate` is used only in a model with an external function, and for a declared state.
fn check_external(model: &Model, reader: Reader<'_>) -> Result<(), ModelError> {
    for expression in expressions(model).filter(|_| model.external.is_none()) {
        if expression.tree.symbols().any(|symbol| matches!(symbol, Symbol::ExternalRate(_))) {
            let cause = "external_rate needs the section [external]; models with it are made by augsim.Model.from_rates and \
                         augsim.Model.from_step in Python";
            return Err(reader.error(
                expression.line,
                &expression.key,
                Fault::External { cause: cause.into() },
            ));
        }
    }
    Ok(())
}

/// Whether an expression uses a state, directly or through a `[let]` value that `state_dependent` marks.
fn depends_on_state(expression: &Expression, state_dependent: &[bool]) -> bool {
    expression.tree.symbols().any(|symbol| match symbol {
        Symbol::State(_)
        | Symbol::JointTorque(_)
        | Symbol::JointAcceleration(_)
        | Symbol::ExternalRate(_) => true,
        Symbol::Let(i) => state_dependent.get(i).copied().unwrap_or(false),
        _ => false,
    })
}

/// Lists all expressions of a model that the engine evaluates, those of initial states excepted.
fn expressions(model: &Model) -> impl Iterator<Item = &Expression> {
    let lets = model.lets.iter().map(|l| &l.value);
    let rates = model.states.iter().map(|s| &s.rate);
    let outputs = model.outputs.iter().map(|o| &o.value);
    let events = model.events.iter().flat_map(|e| {
        let until = e.rest.iter().filter_map(|r| r.until.as_ref());
        std::iter::once(&e.when).chain(e.set.iter().map(|(_, value)| value)).chain(until)
    });
    let added = model.additions.iter().flat_map(|a| a.changes.iter().map(|c| &c.value));
    let robot = model.robot.iter().flat_map(|robot| robot.expressions());
    lets.chain(rates).chain(outputs).chain(events).chain(robot).chain(added)
}

/// Texts of the arguments of all smoothed functions and conditions in a model.
fn smoothed_arguments(model: &Model) -> impl Iterator<Item = &str> {
    expressions(model).flat_map(|e| {
        e.tree.nodes.iter().filter_map(|node| match &node.kind {
            Kind::Call(f, arguments) if f.jumps() => arguments.first().map(|a| e.tree.text_of(*a)),
            Kind::If { left, .. } => Some(e.tree.text_of(*left)),
            _ => None,
        })
    })
}
