//! The words of a model for the loop: schema, effects and parameters.

use crate::library::{Candidate, Motion, Scales, size_unit};
use crate::model::{Hold, Model, Parameter as ModelParameter};
use crate::text::{Kind, Lexer, Symbol, Token};
use augsim_data::{Dimensions, Unit};
use augsim_physics::model::Parameter;
use augsim_physics::system::{
    Begin, Between, Channel, Effect, EffectParameter, Grammar, Input, Measure, Quantity, Schema, State,
    Target,
};

/// Bound of a parameter that has none, in its nominal value (or in 1, where that is smaller).
const MOST: f64 = 1e9;

/// The schema of a model.
pub(super) fn of(model: &Model) -> Schema {
    let text = |unit: Option<Unit>| unit.map_or_else(String::new, Unit::symbol);
    let channels = model.outputs.iter().map(|output| Channel {
        column: output.name.clone(),
        unit: text(output.unit),
        period: output.period,
        sd: output.sd,
        ..Channel::default()
    });
    let inputs = model.inputs.iter().map(|input| Input {
        columns: vec![input.name.clone()],
        between: if input.hold == Some(Hold::Zero) { Between::Held } else { Between::Linear },
        fresh: None,
    });
    let measures = model.outputs.iter().enumerate().map(|(index, output)| Measure {
        name: output.name.clone(),
        channels: vec![index],
        unit: (text(output.unit), 1.0),
        length: false,
    });
    let states = model.states.iter().take(model.declared_states());
    let rate = |unit: Option<Unit>| {
        let dimensions = unit.map(|unit| unit.dimensions() / Dimensions::TIME);
        dimensions.map_or_else(String::new, |d| if d.is_pure() { String::new() } else { of_dimensions(d) })
    };
    let rates = states.map(|state| Target {
        quantity: Quantity::new(&state.name, &rate(state.unit)),
        place: "rate".into(),
        costly: false,
        usual: 1.0,
    });
    let outputs = model.outputs.iter().map(|output| Target {
        quantity: Quantity::new(&output.name, &text(output.unit)),
        place: "output".into(),
        costly: false,
        usual: 1.0,
    });
    Schema {
        system: model.name.clone(),
        record: ["trajectory".into(), "trajectories".into()],
        states: self::states(model),
        channels: channels.collect(),
        inputs: inputs.collect(),
        features: features(model),
        targets: rates.chain(outputs).collect(),
        measures: measures.collect(),
        conditions: conditions(model),
        ..Schema::default()
    }
}

/// Declared states, then those that effects brought along.
pub(super) fn states(model: &Model) -> Vec<State> {
    let declared = model.declared_states();
    let begin = |index: usize| {
        let state = &model.states[index];
        match (&state.start.tree.nodes[..], state.sd) {
            _ if index >= declared => Begin::Fixed(0.0),
            ([node], sd) => match (&node.kind, sd) {
                (Kind::Number(mean), Some(sd)) => Begin::Prior(*mean, sd),
                // Measured is a state that an output shows as it is; another output only helps to guess.
                (Kind::Symbol(Symbol::Output(output)), _) if shows(model, *output, index) => {
                    Begin::Measured(*output)
                }
                _ => Begin::Free,
            },
            _ => Begin::Free,
        }
    };
    let quantity = |index: usize| {
        let state = &model.states[index];
        Quantity::new(&state.name, &state.unit.map_or_else(String::new, Unit::symbol))
    };
    (0..model.states.len()).map(|i| State { quantity: quantity(i), begin: begin(i) }).collect()
}

/// Whether an output is a state and nothing else.
fn shows(model: &Model, output: usize, state: usize) -> bool {
    matches!(&model.outputs[output].value.tree.nodes[..], [node] if node.kind == Kind::Symbol(Symbol::State(state)))
}

/// The shortest symbol of these dimensions.
fn of_dimensions(dimensions: Dimensions) -> String {
    Unit::of_dimensions(dimensions).map_or_else(|| dimensions.to_string(), Unit::symbol)
}

/// Quantities that a table may depend on, each by a text that is an expression of the model.
fn features(model: &Model) -> Vec<Quantity> {
    let text = |unit: Option<Unit>| unit.map_or_else(String::new, Unit::symbol);
    let declared = model.states.iter().take(model.declared_states());
    let mut list: Vec<Quantity> = declared.map(|s| Quantity::new(&s.name, &text(s.unit))).collect();
    list.extend(model.inputs.iter().map(|i| Quantity::new(&i.name, &text(i.unit))));
    let speeds = Motion::of(model).pairs.into_iter().map(|(_, v)| &model.states[v]);
    list.extend(speeds.map(|s| Quantity::new(&format!("abs({})", s.name), &text(s.unit))));
    list.extend(model.lets.iter().map(|l| {
        let unit = l.dimensions.filter(|d| !d.is_pure());
        Quantity::new(&l.name, &unit.map_or_else(String::new, of_dimensions))
    }));
    list.push(Quantity::new("t", "s"));
    list
}

/// Indices of the parameters that a fit may move.
pub(super) fn active(model: &Model) -> Vec<usize> {
    (0..model.parameters.len()).filter(|i| !model.parameters[*i].frozen).collect()
}

/// A declared parameter.
pub(super) fn parameter(p: &ModelParameter) -> Parameter {
    let bound = MOST * p.nominal.abs().max(1.0);
    let mut parameter = Parameter::free(p.name.clone(), p.nominal, p.min.max(-bound), p.max.min(bound));
    (parameter.frozen, parameter.ci95) = (p.frozen, p.ci95);
    parameter
}

/// Names, numbers and operations of an expression.
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

/// Conditions that another experiment can vary: the inputs, and the starts, which every system has.
fn conditions(model: &Model) -> Vec<String> {
    model.inputs.iter().map(|input| input.name.clone()).chain(["starts".to_owned()]).collect()
}

/// Simplicity and place of a formula that the grammar made; none for an effect that somebody described.
pub(super) fn grammar(candidate: &Candidate, model: &Model, scales: &Scales) -> Option<Grammar> {
    let of = candidate.shape.as_ref()?;
    let unit = size_unit(of, &[], model).map_or_else(String::new, Unit::symbol);
    Some(Grammar {
        nodes: count_tokens(candidate.text()?),
        of: Quantity::new(of, &unit),
        range: scales.range(of, model).unwrap_or([0.0, 0.0]),
    })
}

/// A candidate as the loop reads effects.
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
        place: candidate.on.clone(),
        parameters: parameters.collect(),
        formula: candidate.formula.clone(),
        source: candidate.source.clone(),
        stands_for: candidate.stands_for.clone(),
        excludes: candidate.excludes.clone(),
        contains: candidate.contains.clone(),
        amounts: Some(free().take_while(|p| !p.is_inner).count().max(1)),
        ..Effect::default()
    }
}
