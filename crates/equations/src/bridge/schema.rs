//! Describes a model to calibration and discovery: schema, effects and parameters.

use crate::library::{Candidate, Kinematics, Scales, size_unit};
use crate::model::{Hold, Model, Parameter as ModelParameter};
use crate::text::{Kind, Lexer, Symbol, Token};
use augsim_data::{Dimensions, Unit};
use augsim_system::{
    Channel, Effect, EffectParameter, ErrorFigure, FormulaDomain, InitialValue, Input, InputInterpolation,
    Parameter, Per, Quantity, Rival, Schema, State, Target,
};

/// Bound of a parameter for which the file declares none, as a multiple of its nominal value (or of 1 if larger).
const DEFAULT_BOUND_RATIO: f64 = 1e9;

/// Describes a model as a schema: states, channels, inputs, features and targets.
pub(super) fn schema_of(model: &Model) -> Schema {
    let symbol_of = |unit: Option<Unit>| unit.map_or_else(String::new, Unit::symbol);
    let channels = model.outputs.iter().map(|output| Channel {
        column: output.name.clone(),
        unit: symbol_of(output.unit),
        period: output.period,
        sd: output.sd,
        ..Channel::default()
    });
    let inputs = model.inputs.iter().map(|input| Input {
        columns: vec![input.name.clone()],
        interpolation: if input.hold == Some(Hold::Zero) {
            InputInterpolation::ZeroOrderHold
        } else {
            InputInterpolation::Linear
        },
        update_column: None,
    });
    let measures = model.outputs.iter().enumerate().map(|(index, output)| ErrorFigure {
        name: output.name.clone(),
        channels: vec![index],
        unit: (symbol_of(output.unit), 1.0),
        is_euclidean: false,
    });
    // The joints of a robot are one motion: all their errors together decide, if they have one unit.
    let first_unit = model.outputs.first().map(|output| symbol_of(output.unit)).unwrap_or_default();
    let has_one_unit = model.outputs.iter().all(|output| symbol_of(output.unit) == first_unit);
    let together = (model.robot.is_some() && has_one_unit && model.outputs.len() > 1).then(|| ErrorFigure {
        name: "all joints".to_owned(),
        channels: (0..model.outputs.len()).collect(),
        unit: (first_unit, 1.0),
        is_euclidean: false,
    });
    let states = model.states.iter().take(model.declared_states());
    let rate_unit = |unit: Option<Unit>| {
        let dimensions = unit.map(|unit| unit.dimensions() / Dimensions::TIME);
        dimensions.map_or_else(String::new, |d| if d.is_pure() { String::new() } else { symbol_for(d) })
    };
    let rates = states.map(|state| Target {
        quantity: Quantity::new(&state.name, &rate_unit(state.unit)),
        location: "rate".into(),
        costly: false,
        typical: 1.0,
    });
    let outputs = model.outputs.iter().map(|output| Target {
        quantity: Quantity::new(&output.name, &symbol_of(output.unit)),
        location: "output".into(),
        costly: false,
        typical: 1.0,
    });
    Schema {
        system: model.name.clone(),
        record: ["trajectory".into(), "trajectories".into()],
        states: self::states(model),
        channels: channels.collect(),
        inputs: inputs.collect(),
        features: features(model),
        targets: rates.chain(outputs).collect(),
        error_figures: together.into_iter().chain(measures).collect(),
        conditions: conditions(model),
        ..Schema::default()
    }
}

/// Describes the declared states of a model, then the states of its effects.
pub(super) fn states(model: &Model) -> Vec<State> {
    let declared = model.declared_states();
    let begin = |index: usize| {
        let state = &model.states[index];
        match (&state.start.tree.nodes[..], state.sd) {
            (_, Some(sd)) if index >= declared => InitialValue::PriorAboutRecord(sd),
            _ if index >= declared => InitialValue::FromRecord,
            ([node], sd) => match (&node.kind, sd) {
                (Kind::Number(mean), Some(sd)) => InitialValue::Prior(*mean, sd),
                // Only a state that is itself an output is measured; other outputs only help to guess it. A
                // prior about its own reading would count that reading twice.
                (Kind::Symbol(Symbol::Output(output)), _) if equals_state(model, *output, index) => {
                    InitialValue::Measured(*output)
                }
                (_, Some(sd)) => InitialValue::PriorAboutExpression(sd),
                _ => InitialValue::Free,
            },
            (_, Some(sd)) => InitialValue::PriorAboutExpression(sd),
            _ => InitialValue::Free,
        }
    };
    let quantity = |index: usize| {
        let state = &model.states[index];
        Quantity::new(&state.name, &state.unit.map_or_else(String::new, Unit::symbol))
    };
    (0..model.states.len()).map(|i| State { quantity: quantity(i), initial: begin(i) }).collect()
}

/// Whether an output has the value of a state.
fn equals_state(model: &Model, output: usize, state: usize) -> bool {
    model.state_of_output(output) == Some(state)
}

/// Finds the shortest symbol of a unit with these dimensions.
fn symbol_for(dimensions: Dimensions) -> String {
    Unit::from_dimensions(dimensions).map_or_else(|| dimensions.to_string(), Unit::symbol)
}

/// Lists the quantities that a table effect may depend on, each named by an expression of the model.
fn features(model: &Model) -> Vec<Quantity> {
    let symbol_of = |unit: Option<Unit>| unit.map_or_else(String::new, Unit::symbol);
    let declared = model.states.iter().take(model.declared_states());
    let mut list: Vec<Quantity> = declared.map(|s| Quantity::new(&s.name, &symbol_of(s.unit))).collect();
    list.extend(model.inputs.iter().map(|i| Quantity::new(&i.name, &symbol_of(i.unit))));
    let speeds = Kinematics::from_model(model).pairs.into_iter().map(|(_, v)| &model.states[v]);
    list.extend(speeds.map(|s| Quantity::new(&format!("abs({})", s.name), &symbol_of(s.unit))));
    list.extend(model.lets.iter().map(|l| {
        let unit = l.dimensions.filter(|d| !d.is_pure());
        Quantity::new(&l.name, &unit.map_or_else(String::new, symbol_for))
    }));
    list.push(Quantity::new("t", "s"));
    list
}

/// Indices of the parameters that a fit may change, because they are not frozen.
pub(super) fn active(model: &Model) -> Vec<usize> {
    (0..model.parameters.len()).filter(|i| !model.parameters[*i].frozen).collect()
}

/// Converts the parameters of a model file to those of the system interface.
pub(super) fn parameters(model: &Model) -> Vec<Parameter> {
    let mut parameters: Vec<Parameter> = model.parameters.iter().map(parameter).collect();
    let tables = model.additions.iter().filter(|addition| addition.table.is_some());
    tables.flat_map(|table| table.parameters.clone()).for_each(|i| parameters[i].is_knot = true);
    parameters
}

/// Converts a parameter of a model file to one of the system interface.
fn parameter(p: &ModelParameter) -> Parameter {
    let bound = DEFAULT_BOUND_RATIO * p.nominal.abs().max(1.0);
    let mut parameter = Parameter::free(p.name.clone(), p.nominal, p.min.max(-bound), p.max.min(bound));
    (parameter.frozen, parameter.ci95) = (p.frozen, p.ci95);
    if let Some(by_group) = &p.by_group {
        (parameter.per, parameter.groups) = (Per::Group, by_group.values.clone());
    }
    parameter
}

/// Counts the names, numbers and operators of an expression; parentheses and commas do not count.
fn count_tokens(text: &str) -> usize {
    let mut lexer = Lexer::new(text);
    let mut count = 0;
    loop {
        match lexer.next() {
            Ok((Token::End, _)) | Err(_) => return count,
            Ok((Token::Sign(b'(' | b')' | b','), _)) => {}
            Ok(_) => count += 1,
        }
    }
}

/// Names the conditions that another experiment could vary: the inputs, and the initial states.
fn conditions(model: &Model) -> Vec<String> {
    if let Some(robot) = &model.robot {
        // The positions, speeds and accelerations of a robot are one motion, which is varied as a whole.
        let motion: Vec<Symbol> = robot.motion_symbols().collect();
        let others = model.inputs.iter().enumerate().filter(|(i, _)| !motion.contains(&Symbol::Input(*i)));
        let joints = ["joint positions", "joint speeds"].map(str::to_owned).into_iter();
        return joints.chain(others.map(|(_, input)| input.name.clone())).collect();
    }
    model.inputs.iter().map(|input| input.name.clone()).chain(["starts".to_owned()]).collect()
}

/// Complexity and argument of a formula of the grammar; `None` for any other candidate effect.
pub(super) fn grammar(candidate: &Candidate, model: &Model, scales: &Scales) -> Option<FormulaDomain> {
    let argument = candidate.shape.as_ref()?;
    let unit = size_unit(argument, &[], model).map_or_else(String::new, Unit::symbol);
    Some(FormulaDomain {
        nodes: count_tokens(candidate.text()?),
        variable: Quantity::new(argument, &unit),
        range: scales.range(argument, model).unwrap_or([0.0, 0.0]),
    })
}

/// Converts a candidate effect to an effect of the library.
pub(super) fn effect(candidate: &Candidate) -> Effect {
    let free = || candidate.parameters.iter().filter(|p| !p.frozen);
    let parameters = free().map(|p| EffectParameter {
        name: p.name.clone(),
        unit: p.unit.map_or_else(String::new, Unit::symbol),
        min: p.min,
        max: p.max,
        typical: p.typical.unwrap_or(1.0),
        null: p.null,
    });
    Effect {
        kind: candidate.name.clone(),
        location: candidate.on.clone(),
        parameters: parameters.collect(),
        formula: candidate.formula.clone(),
        source: candidate.source.clone(),
        equivalent_causes: candidate.equivalent_causes.clone(),
        separated_by: candidate
            .separated_by
            .iter()
            .map(|(kind, text)| (Rival::Kind(kind.clone()), text.clone()))
            .collect(),
        excludes: candidate.excludes.clone(),
        reduces_to: candidate.reduces_to.clone(),
        has_states: candidate.has_states(),
        depends_on_past: candidate.has_states() || candidate.is_delay(),
        is_offered: candidate.is_offered,
        added_to_reading: candidate.with.clone().filter(|_| candidate.is_on_output()),
        amplitude_count: Some(free().take_while(|p| !p.is_inner).count().max(1)),
        ..Effect::default()
    }
}
