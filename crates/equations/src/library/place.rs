//! Places of a model where a library row can be applied: equations, inputs, outputs and parameters.

use super::robot;
use super::row_place::Place;
use crate::model::{External, Force, Input, Model, Output, Parameter, Target};
use crate::text::{Kind, Symbol, Tree};
use augsim_data::Unit;

/// Kinematic structure of a model: which states are rates of others, read from the equations.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Kinematics {
    /// Pairs (x, v) of states, by index: `v` is the rate of `x`, or proportional to it.
    pub pairs: Vec<(usize, usize)>,
    /// Indices of the flow states: declared states that are neither part of a pair nor a copy of a position.
    pub flows: Vec<usize>,
}

impl Kinematics {
    /// Determines the kinematic structure of the declared states of a model.
    pub fn from_model(model: &Model) -> Kinematics {
        let count = model.declared_states();
        // The coordinates of an external function are stated with its forces.
        let forces = model.external.iter().flat_map(|external| &external.forces);
        let mut pairs: Vec<(usize, usize)> = forces.map(|force| (force.position, force.speed)).collect();
        for (x, state) in model.states.iter().enumerate().take(count) {
            if let Some(v) = proportional(model, &state.rate.tree)
                && v != x
                && !pairs.iter().any(|(other, _)| *other == x)
                && v < count
                && !pairs.iter().any(|(_, other)| *other == v)
            {
                pairs.push((x, v));
            }
        }
        let is_kinematic = |state: usize| pairs.iter().any(|(x, v)| *x == state || *v == state);
        // A second state with the same speed as its rate, such as another coordinate, has no equation of its
        // own either.
        let is_copy = |state: usize| {
            let speed = proportional(model, &model.states[state].rate.tree);
            speed.is_some_and(|v| v != state && pairs.iter().any(|(_, other)| *other == v))
        };
        let flows = (0..count).filter(|state| !is_kinematic(*state) && !is_copy(*state)).collect();
        Kinematics { pairs, flows }
    }

    /// Indices of the states whose rates are force or flow equations, to which terms can be added.
    pub fn force_and_flow_states(&self) -> Vec<usize> {
        self.pairs.iter().map(|(_, v)| *v).chain(self.flows.iter().copied()).collect()
    }
}

/// The state that a rate is proportional to, with a factor of numbers and parameters only; `None` otherwise.
fn proportional(model: &Model, tree: &Tree) -> Option<usize> {
    let mut state = None;
    for node in &tree.nodes {
        match &node.kind {
            Kind::Symbol(Symbol::State(i)) if state.is_none() => state = Some(*i),
            Kind::Symbol(Symbol::Let(i)) if tree.nodes.len() == 1 => {
                return proportional(model, &model.lets.get(*i)?.value.tree);
            }
            Kind::Number(_) | Kind::Symbol(Symbol::Parameter(_)) => {}
            Kind::Negate(_) | Kind::Multiply(..) => {}
            // A quotient with the state in the divisor is not proportional to it.
            Kind::Divide(_, b) if !matches!(tree.nodes[*b].kind, Kind::Symbol(Symbol::State(_))) => {}
            _ => return None,
        }
    }
    state
}

/// Lists all places that a word stands for; `None` if it is neither a general place nor a name of the model.
///
/// The general places are explained at the top of `library.toml` and `formulas.toml`.
pub(super) fn places(word: &str, model: &Model) -> Option<Vec<Place>> {
    let motion = Kinematics::from_model(model);
    let places = match word {
        "force" => match (&model.robot, &model.external) {
            (Some(robot), _) => robot::joint_places(robot),
            (None, Some(external)) if !external.forces.is_empty() => external_places(model, external),
            _ => force_places(model, &motion),
        },
        "joint-load" | "joint-drive" | "joint-pair" | "joint-inertia-pair" | "armature" | "payload"
        | "tilt" => {
            model.robot.as_ref().map_or_else(Vec::new, |robot| robot::places(word, robot, &model.outputs))
        }
        "flow" => flow_places(model, &motion, "x"),
        "speed" => speed_places(model, &motion),
        "flow-pair" => flow_pair_places(model, &motion),
        "input" => input_places(model),
        "delay" => delay_places(model),
        "output" => output_places(model, "y"),
        "sensor-law" => output_places(model, "z"),
        "law" => law_places(model, &motion),
        "law-pair" => law_places_of_two(model, &motion, |first, second| second > first),
        "law-product" => law_places_of_two(model, &motion, |first, second| second != first),
        "output-input" => output_input_places(model),
        "output-state" => output_state_places(model),
        "parameter" => parameter_places(model, &motion),
        "reset" => reset_places(model),
        _ => vec![place_named(word, model)?],
    };
    Some(places)
}

fn place(target: Target, on: String, with: Option<String>, names: Vec<(&'static str, String)>) -> Place {
    Place { target, others: Vec::new(), on, with, names }
}

fn state_name(model: &Model, state: usize) -> String {
    model.states[state].name.clone()
}

/// Places `force`: the equation of every speed, with its position.
fn force_places(model: &Model, motion: &Kinematics) -> Vec<Place> {
    let to_place = |&(x, v): &(usize, usize)| {
        let (x, speed) = (state_name(model, x), state_name(model, v));
        place(Target::Rate(v), speed.clone(), None, vec![("x", x), ("v", speed)])
    };
    motion.pairs.iter().map(to_place).collect()
}

/// Places `force` of a model with generalised forces: each of them, with the position and speed of its coordinate.
fn external_places(model: &Model, external: &External) -> Vec<Place> {
    let to_place = |(index, force): (usize, &Force)| {
        let names = vec![("x", state_name(model, force.position)), ("v", state_name(model, force.speed))];
        place(Target::Force(index), force.name.clone(), None, names)
    };
    external.forces.iter().enumerate().map(to_place).collect()
}

/// Places `flow`: the equation of every flow state, which the row calls `argument`.
fn flow_places(model: &Model, motion: &Kinematics, argument: &'static str) -> Vec<Place> {
    let to_place = |&x: &usize| {
        let name = state_name(model, x);
        place(Target::Rate(x), name.clone(), None, vec![(argument, name)])
    };
    motion.flows.iter().map(to_place).collect()
}

/// Places `speed`: the equation of every flow state whose unit is a speed or an angular speed. Its position is no state.
fn speed_places(model: &Model, motion: &Kinematics) -> Vec<Place> {
    let speeds = ["m/s", "rad/s"].map(|unit| Unit::parse(unit).map(Unit::dimensions));
    let is_speed = |&state: &usize| {
        let dimensions = model.states[state].unit.map(Unit::dimensions);
        dimensions.is_some() && speeds.contains(&dimensions)
    };
    let flows = motion.flows.iter().copied().filter(is_speed).collect();
    flow_places(model, &Kinematics { flows, ..Kinematics::default() }, "v")
}

/// Places for every ordered pair of flow equations.
fn flow_pair_places(model: &Model, motion: &Kinematics) -> Vec<Place> {
    let mut list = Vec::new();
    for &x in &motion.flows {
        for &w in motion.flows.iter().filter(|w| **w != x) {
            let (name, other_name) = (state_name(model, x), state_name(model, w));
            let names = vec![("x", name.clone()), ("w", other_name.clone())];
            let mut found = place(Target::Rate(x), name, Some(other_name), names);
            found.others = vec![Target::Rate(w)];
            list.push(found);
        }
    }
    list
}

/// Places `input`: every input of a model.
fn input_places(model: &Model) -> Vec<Place> {
    let to_place = |(i, input): (usize, &Input)| place_of_input(Target::Input(i), input);
    free_inputs(model).map(to_place).collect()
}

/// Lists the inputs of a model, without those that are measured positions, speeds or accelerations of a robot's joints.
///
/// These belong together: a change of one of them alone would be no motion.
fn free_inputs(model: &Model) -> impl Iterator<Item = (usize, &Input)> {
    let motion: Vec<Symbol> = model.robot.iter().flat_map(|robot| robot.motion_symbols()).collect();
    model.inputs.iter().enumerate().filter(move |(index, _)| !motion.contains(&Symbol::Input(*index)))
}

/// Places for the delay of every input that has no delay.
fn delay_places(model: &Model) -> Vec<Place> {
    let free = free_inputs(model).filter(|(_, input)| input.delay.is_none());
    free.map(|(i, input)| place_of_input(Target::Delay(i), input)).collect()
}

fn place_of_input(target: Target, input: &Input) -> Place {
    place(target, input.name.clone(), None, vec![("u", input.name.clone())])
}

/// Places for every output, which the row calls `argument`.
fn output_places(model: &Model, argument: &'static str) -> Vec<Place> {
    let to_place = |(i, o): (usize, &Output)| {
        place(Target::Output(i), o.name.clone(), None, vec![(argument, o.name.clone())])
    };
    model.outputs.iter().enumerate().map(to_place).collect()
}

/// Places for every force and flow equation, combined with every quantity and with time.
fn law_places(model: &Model, motion: &Kinematics) -> Vec<Place> {
    let quantities = [quantities(model), vec!["t".to_owned()]].concat();
    let mut list = Vec::new();
    for v in motion.force_and_flow_states() {
        for z in &quantities {
            list.push(place(Target::Rate(v), state_name(model, v), None, vec![("z", z.clone())]));
        }
    }
    list
}

/// Places for every force and flow equation, combined with two quantities whose indices `is_pair` accepts.
fn law_places_of_two(
    model: &Model,
    motion: &Kinematics,
    is_pair: impl Fn(usize, usize) -> bool,
) -> Vec<Place> {
    let mut list = Vec::new();
    let quantities = quantities(model);
    for v in motion.force_and_flow_states() {
        for (i, z) in quantities.iter().enumerate() {
            for (_, q) in quantities.iter().enumerate().filter(|(k, _)| is_pair(i, *k)) {
                let names = vec![("z", z.clone()), ("q", q.clone())];
                list.push(place(Target::Rate(v), state_name(model, v), None, names));
            }
        }
    }
    list
}

/// Places for every output, combined with every input.
fn output_input_places(model: &Model) -> Vec<Place> {
    let mut list = Vec::new();
    for (i, output) in model.outputs.iter().enumerate() {
        list.extend(free_inputs(model).map(|(_, u)| place_of_output(i, output, u.name.clone())));
    }
    list
}

/// Places for every output, combined with every declared state that the output does not depend on.
fn output_state_places(model: &Model) -> Vec<Place> {
    let mut list = Vec::new();
    for (i, output) in model.outputs.iter().enumerate() {
        let uses = |state: usize| output.value.tree.symbols().any(|s| s == Symbol::State(state));
        let others = (0..model.declared_states()).filter(|state| !uses(*state));
        list.extend(others.map(|state| place_of_output(i, output, state_name(model, state))));
    }
    list
}

fn place_of_output(index: usize, output: &Output, other: String) -> Place {
    let names = vec![("y", output.name.clone()), ("q", other.clone())];
    place(Target::Output(index), output.name.clone(), Some(other), names)
}

/// Places for every parameter that is not frozen, combined with every quantity that it may depend on.
fn parameter_places(model: &Model, motion: &Kinematics) -> Vec<Place> {
    let speeds = motion.pairs.iter().map(|(_, v)| format!("abs({})", model.states[*v].name));
    let mut quantities = vec!["t".to_owned()];
    quantities.extend((0..model.declared_states()).map(|state| state_name(model, state)));
    quantities.extend(model.inputs.iter().map(|u| u.name.clone()));
    quantities.extend(speeds);
    // The inertias of a robot are constants of rigid bodies, and the law of each joint in its motion is an effect on the
    // joint: only time and further inputs, such as a temperature, may change the other parameters.
    let mut constants = Vec::new();
    if let Some(robot) = &model.robot {
        constants.extend(robot.parameters());
        quantities =
            ["t".to_owned()].into_iter().chain(free_inputs(model).map(|(_, u)| u.name.clone())).collect();
    }
    let mut list = Vec::new();
    // A name with a dot is the delay of an input.
    let is_free = |p: usize, parameter: &Parameter| {
        !parameter.frozen && !parameter.name.contains('.') && !constants.contains(&p)
    };
    let declared = model.parameters[..model.declared_parameters()].iter().enumerate();
    for (p, parameter) in declared.filter(|(p, parameter)| is_free(*p, parameter)) {
        for z in &quantities {
            let (on, names) = (parameter.name.clone(), vec![("z", z.clone())]);
            list.push(place(Target::Parameter(p), on, Some(z.clone()), names));
        }
    }
    list
}

/// Names of the quantities that a formula may depend on: declared states, inputs and `[let]` values.
fn quantities(model: &Model) -> Vec<String> {
    let states = model.states.iter().take(model.declared_states()).map(|s| &s.name);
    let inputs = model.inputs.iter().map(|i| &i.name);
    states.chain(inputs).chain(model.lets.iter().map(|l| &l.name)).cloned().collect()
}

/// Parameters in the resets of events that an effect may change, with the absolute value of the reset state as the
/// quantity on which the change depends.
fn reset_places(model: &Model) -> Vec<Place> {
    let mut places: Vec<Place> = Vec::new();
    for (state, value) in model.events.iter().flat_map(|e| &e.set) {
        let z = format!("abs({})", model.states[*state].name);
        for symbol in value.tree.symbols() {
            let Symbol::Parameter(p) = symbol else { continue };
            let parameter = &model.parameters[p];
            let candidate =
                place(Target::Parameter(p), parameter.name.clone(), Some(z.clone()), vec![("z", z.clone())]);
            if !parameter.frozen && !places.contains(&candidate) {
                places.push(candidate);
            }
        }
    }
    places
}

/// The target that a name of the model stands for; `None` for an unknown name.
///
/// The name is looked up among states (whose rate is the target), inputs, outputs, parameters, joints and forces, in this
/// order.
pub(crate) fn target_named(name: &str, model: &Model) -> Option<Target> {
    let input = || model.inputs.iter().position(|i| i.name == name).map(Target::Input);
    let output = || model.outputs.iter().position(|o| o.name == name).map(Target::Output);
    let parameter = || model.parameter(name).map(Target::Parameter);
    let joint = || model.robot.as_ref().and_then(|robot| robot.joint(name)).map(Target::Joint);
    let force = || {
        let forces = &model.external.as_ref()?.forces;
        forces.iter().position(|force| force.name == name).map(Target::Force)
    };
    let state = model.state(name).map(Target::Rate);
    state.or_else(input).or_else(output).or_else(parameter).or_else(joint).or_else(force)
}

/// The place that a name of the model stands for; `None` for an unknown name.
fn place_named(name: &str, model: &Model) -> Option<Place> {
    let target = target_named(name, model)?;
    Some(Place { target, others: Vec::new(), on: name.to_owned(), with: None, names: Vec::new() })
}
