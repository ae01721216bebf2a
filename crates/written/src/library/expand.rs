//! A row at a place of a model: its names exchanged for those of the model, its parameters with units.

use super::place::{Place, places};
use super::size::{size_unit, size_words};
use super::substitute::substitute;
use crate::error::{Fault, ModelError, Place as FilePlace};
use crate::model::{
    Draft, DraftState, DraftTarget, How, Model, Parameter, Row, RowParameter, Target, dimensions_of,
};
use augsim_data::{Dimensions, Unit, shown};

/// An effect that may be tried on a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Kind, as model files name it.
    pub kind: String,
    /// Name among all candidates of the model: the kind, with its place where the kind has several.
    pub name: String,
    /// Rate, output, input or parameter that it changes.
    pub on: String,
    /// Second quantity that it is bound to.
    pub with: Option<String>,
    /// The law in one line, in the names of the model.
    pub formula: String,
    /// Its parameters.
    pub parameters: Vec<CandidateParameter>,
    /// Other explanations that the same term may stand for.
    pub stands_for: Vec<String>,
    /// Kinds that describe the same thing.
    pub excludes: Vec<String>,
    /// Simpler kind that it turns into where inner parameters go to their bounds.
    pub contains: Option<String>,
    /// Origin of the law.
    pub source: String,
    pub(super) states: Vec<DraftState>,
    pub(super) changes: Vec<(DraftTarget, String)>,
    /// The quantity that a formula of the grammar is a shape of; nothing for an effect that somebody described.
    pub shape: Option<String>,
    /// Names of the row, and what they stand for.
    pub(super) names: Vec<(&'static str, String)>,
    line: usize,
}

/// A parameter of a candidate. Numbers are in its unit once the scales of data are known, and in those of the row before.
#[derive(Debug, Clone, PartialEq)]
pub struct CandidateParameter {
    /// Name.
    pub name: String,
    /// Unit, where it can be inferred.
    pub unit: Option<Unit>,
    /// Whether the effect does not vanish by it: a width, a threshold.
    pub is_inner: bool,
    /// Whether the parameter stays at the value that it begins with.
    pub frozen: bool,
    /// Smallest value that makes sense.
    pub min: f64,
    /// Largest value that makes sense.
    pub max: f64,
    /// Value at which the effect vanishes; for an inner parameter the first of its grid.
    pub null: f64,
    /// A usual size, where one is known.
    pub typical: Option<f64>,
    /// Values at which fits of an inner parameter begin.
    pub grid: Vec<f64>,
    /// Values at which scans of a threshold begin.
    pub scan: Vec<f64>,
    pub(super) of: Option<String>,
}

/// All places of a row.
pub(super) fn expand(row: &Row, model: &Model) -> Result<Vec<Candidate>, ModelError> {
    let mut all = Vec::new();
    for word in &row.on {
        let Some(found) = places(word, model) else {
            let (file, line) = row.place.clone();
            let place = FilePlace { file, line, key: format!("candidate.{}", row.kind) };
            let fault = Box::new(Fault::NoSuchPlace { name: shown(word) });
            return Err(ModelError { place, fault, excerpt: None });
        };
        for place in found {
            all.push(at(row, &place, model)?);
        }
    }
    Ok(all)
}

fn at(row: &Row, place: &Place, model: &Model) -> Result<Candidate, ModelError> {
    let is_of_model = |name: &str| {
        let states = model.states.iter().any(|s| s.name == name);
        let inputs = model.inputs.iter().any(|i| i.name == name);
        let lets = model.lets.iter().any(|l| l.name == name);
        states || inputs || lets || model.parameter(name).is_some()
    };
    // A name of the row's own that the model has too would hide it: it gets another one.
    let own = row.parameters.iter().map(|p| &p.name).chain(row.states.iter().map(|s| &s.name));
    let renamed: Vec<(String, String)> = own
        .map(|name| {
            let mut other = name.clone();
            while is_of_model(&other) {
                other.push_str("_added");
            }
            (name.clone(), other)
        })
        .collect();
    let by = |name: &str| {
        let own = renamed.iter().find(|(from, _)| from == name).map(|(_, to)| to.as_str());
        own.or_else(|| place.names.iter().find(|(from, _)| *from == name).map(|(_, to)| to.as_str()))
    };
    let text = |text: &str| substitute(text, by);
    let new_name = |name: &str| by(name).unwrap_or(name).to_owned();
    let mut changes = vec![((place.target, row.how), text(&row.expression))];
    if let (Some(other), Some(expression)) = (place.other, &row.other) {
        changes.push(((other, How::Add), text(expression)));
    }
    let of_state =
        |s: &DraftState| DraftState { name: new_name(&s.name), rate: text(&s.rate), start: text(&s.start) };
    let mut candidate = Candidate {
        kind: row.kind.clone(),
        name: row.kind.clone(),
        on: place.on.clone(),
        with: place.with.clone(),
        formula: String::new(),
        parameters: row
            .parameters
            .iter()
            .map(|p| CandidateParameter { name: new_name(&p.name), ..CandidateParameter::of(p) })
            .collect(),
        stands_for: row.stands_for.clone(),
        excludes: row.excludes.clone(),
        contains: row.contains.clone(),
        source: row.source.clone(),
        states: row.states.iter().map(of_state).collect(),
        changes,
        shape: None,
        names: place.names.clone(),
        line: row.place.1,
    };
    candidate.formula = formula(&candidate, model);
    candidate.infer_units(model);
    // Reads all expressions, so that a mistake in a user's candidate is found before anything is fitted.
    Model { text: String::new(), ..model.clone() }.add(&candidate.draft(&candidate.nulls()))?;
    Ok(candidate)
}

/// The law in one line.
fn formula(candidate: &Candidate, model: &Model) -> String {
    let part = |((target, how), text): &(DraftTarget, String)| {
        let of = match target {
            Target::Rate(state) => format!("d({})/dt", model.states[*state].name),
            Target::Output(output) => model.outputs[*output].name.clone(),
            Target::Input(input) => model.inputs[*input].name.clone(),
            Target::Delay(input) => return format!("{0}(t - {text}) for {0}", model.inputs[*input].name),
            Target::Parameter(p) => model.parameters[*p].name.clone(),
        };
        match how {
            How::Add => match text.strip_prefix('-') {
                Some(rest) if !has_sum(rest) => format!("{of} -= {rest}"),
                _ => format!("{of} += {text}"),
            },
            How::Factor => format!("{of} *= {text}"),
            How::Replace => format!("{of} = {text}"),
        }
    };
    let changes = candidate.changes.iter().map(part);
    let states = candidate.states.iter().map(|s| format!("d({})/dt = {}", s.name, s.rate));
    changes.chain(states).collect::<Vec<_>>().join(", ")
}

/// Whether a text has a sum outside brackets, so that the sign before it is not that of the whole.
fn has_sum(text: &str) -> bool {
    let mut depth = 0;
    text.chars().any(|c| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        depth == 0 && matches!(c, '+' | '-')
    })
}

/// Gives candidates of the same kind names of their own, by their places.
pub(super) fn name_apart(all: &mut [Candidate]) {
    let kinds: Vec<String> = all.iter().map(|c| c.kind.clone()).collect();
    for candidate in &mut *all {
        if kinds.iter().filter(|kind| **kind == candidate.kind).count() > 1 {
            candidate.name = format!("{} on {}", candidate.kind, candidate.on);
            if let Some(with) = &candidate.with {
                candidate.name = format!("{} with {with}", candidate.name);
            }
        }
    }
    let place = |c: &Candidate| (c.on.clone(), c.with.clone());
    let named: Vec<_> = all.iter().map(|c| (c.kind.clone(), place(c), c.name.clone())).collect();
    for candidate in all {
        let here = place(candidate);
        let simpler = |kind: &String| named.iter().find(|(other, there, _)| other == kind && *there == here);
        candidate.contains = candidate.contains.as_ref().and_then(simpler).map(|(_, _, name)| name.clone());
    }
}

impl CandidateParameter {
    fn of(p: &RowParameter) -> Self {
        Self {
            name: p.name.clone(),
            unit: p.unit,
            is_inner: p.is_inner(),
            frozen: p.frozen,
            min: p.min,
            max: p.max,
            null: p.null.or(p.grid.first().copied()).unwrap_or(0.0),
            typical: p.typical,
            grid: p.grid.clone(),
            scan: p.scan.clone(),
            of: p.of.clone(),
        }
    }
}

impl Candidate {
    /// The expression of its first change.
    pub fn text(&self) -> Option<&str> {
        self.changes.first().map(|(_, text)| text.as_str())
    }

    /// The size that the numbers of a parameter are multiples of, in words; nothing where they are in its unit.
    pub fn size_of(&self, parameter: &CandidateParameter) -> Option<String> {
        size_words(parameter.of.as_ref()?, &self.names)
    }

    /// Values at which the effect vanishes, inner parameters at the first of their grids.
    pub fn nulls(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.null).collect()
    }

    /// All points of the grids of inner parameters, amounts at their nulls.
    pub fn null_points(&self) -> Vec<Vec<f64>> {
        self.points(|p| if p.is_inner { p.grid.clone() } else { vec![p.null] })
    }

    /// Starts of thresholds that have no slope at their null, with inner parameters on their grids and amounts that have no
    /// scan of their own at their usual sizes; none for an effect without such a threshold.
    pub fn scan_points(&self) -> Vec<Vec<f64>> {
        if self.parameters.iter().all(|p| p.scan.is_empty()) {
            return Vec::new();
        }
        self.points(|p| match (p.scan.is_empty(), p.is_inner) {
            (false, _) => p.scan.clone(),
            (true, true) => p.grid.clone(),
            (true, false) => vec![p.typical.unwrap_or(p.null)],
        })
    }

    fn points(&self, of: impl Fn(&CandidateParameter) -> Vec<f64>) -> Vec<Vec<f64>> {
        let mut points = vec![Vec::new()];
        for p in &self.parameters {
            let values = of(p);
            points = points
                .iter()
                .flat_map(|point: &Vec<f64>| values.iter().map(move |v| [&point[..], &[*v]].concat()))
                .collect();
        }
        points
    }

    /// The effect with these values, ready to be added to the model that it was expanded for.
    pub fn draft(&self, values: &[f64]) -> Draft {
        let parameter = |(p, value): (&CandidateParameter, &f64)| Parameter {
            name: p.name.clone(),
            unit: p.unit,
            nominal: *value,
            min: p.min,
            max: p.max,
            frozen: p.frozen,
            ci95: None,
            line: self.line,
        };
        Draft {
            kind: self.kind.clone(),
            on: self.on.clone(),
            with: self.with.clone(),
            parameters: self.parameters.iter().zip(values).map(parameter).collect(),
            states: self.states.clone(),
            changes: self.changes.clone(),
            also_fits: Vec::new(),
            table: None,
            line: self.line,
        }
    }

    /// Units of inner parameters by what they are measured in, then of amounts by what they multiply.
    fn infer_units(&mut self, model: &Model) {
        for p in &mut self.parameters {
            if let (None, Some(of)) = (p.unit, &p.of) {
                p.unit = size_unit(of, &self.names, model);
            }
        }
        let amounts: Vec<usize> = (0..self.parameters.len())
            .filter(|i| self.parameters[*i].unit.is_none() && !self.parameters[*i].is_inner)
            .collect();
        if amounts.is_empty() {
            return;
        }
        // What the term would be in if the amounts were pure numbers.
        let mut plain = self.clone();
        amounts.iter().for_each(|i| plain.parameters[*i].unit = Some(Unit::DIMENSIONLESS));
        let mut scratch = Model { text: String::new(), ..model.clone() };
        if scratch.add(&plain.draft(&plain.nulls())).is_err() {
            return;
        }
        let Some(addition) = scratch.additions.last() else { return };
        let Some(change) = addition.changes.first() else { return };
        let of_target = match (change.target, change.how) {
            (Target::Delay(_), _) => Some(Dimensions::TIME),
            (_, How::Factor) => Some(Dimensions::NONE),
            (Target::Rate(i), _) => model.states[i].unit.map(|u| u.dimensions() / Dimensions::TIME),
            (Target::Output(i), _) => model.outputs[i].unit.map(Unit::dimensions),
            (Target::Input(i), _) => model.inputs[i].unit.map(Unit::dimensions),
            (Target::Parameter(i), _) => model.parameters[i].unit.map(Unit::dimensions),
        };
        let term = match change.how {
            // In `1 + c z` the pure number decides: what c multiplies is what stands in its own product.
            How::Factor => {
                self.names.first().and_then(|(_, z)| size_unit(z, &[], model)).map(Unit::dimensions)
            }
            _ => dimensions_of(&scratch, &change.value.tree),
        };
        let unit = of_target.zip(term).and_then(|(target, term)| {
            let dimensions = target / term;
            if dimensions.is_pure() {
                return Some(Unit::DIMENSIONLESS);
            }
            Unit::of_dimensions(dimensions)
        });
        amounts.iter().for_each(|i| self.parameters[*i].unit = unit);
    }
}
