//! Applies a row of the effect library to a model: replaces its names by the model's and infers units.

use super::place::places;
use super::row_place::Place;
use super::size::{describe_size, size_unit};
use super::substitute::substitute;
use crate::error::{Fault, ModelError, Place as FilePlace};
use crate::model::{
    Cycle, Draft, DraftState, DraftTarget, Force, How, Model, Parameter, Row, RowParameter, Target,
    dimensions_of,
};
use augsim_data::{Dimensions, Unit, escaped_short};

/// An effect that may be added to a model at a given place.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Kind of the effect, as in model files.
    pub kind: String,
    /// Unique name among the candidates of the model: the kind, with the place where needed.
    pub name: String,
    /// Name of the rate, output, input or parameter that the effect changes.
    pub on: String,
    /// Name of a second quantity that the effect depends on or changes; `None` if there is none.
    pub with: Option<String>,
    /// Formula of the change in one line, in the names of the model.
    pub formula: String,
    /// Parameters of the effect.
    pub parameters: Vec<CandidateParameter>,
    /// Other physical explanations that the effect may be mistaken for.
    pub equivalent_causes: Vec<String>,
    /// Experiments that distinguish the effect from others: kind of the other effect, and what to do.
    pub separated_by: Vec<(String, String)>,
    /// Kinds of effects that describe the same phenomenon and are not added together with this one.
    pub excludes: Vec<String>,
    /// Kind of the simpler effect that results when the inner parameters go to their bounds; `None` if there is none.
    pub reduces_to: Option<String>,
    /// Literature reference or other origin of the formula.
    pub source: String,
    pub(super) states: Vec<DraftState>,
    pub(super) changes: Vec<(DraftTarget, String)>,
    /// The quantity that a generated formula depends on.
    ///
    /// `None` for an effect of the library or of the model file, which is not generated.
    pub shape: Option<String>,
    /// Names used in the library row, and the texts of the model that replace them.
    pub(super) names: Vec<(&'static str, String)>,
    /// Number of joints on which the effect acts with parameters of their own; 1 for any other effect.
    pub copies: usize,
    /// For an effect on all joints, the names used in the library row for each joint; otherwise empty.
    pub(super) part_names: Vec<Vec<(&'static str, String)>>,
    /// Whether the model file offers the effect, and not the library.
    pub is_offered: bool,
    line: usize,
}

/// A parameter of a candidate effect.
///
/// The numbers below are multiples of the size of a quantity, as in the library row, until
/// [`Scales::resolve`](super::Scales::resolve) converts them to the parameter's unit.
#[derive(Debug, Clone, PartialEq)]
pub struct CandidateParameter {
    /// Name of the parameter.
    pub name: String,
    /// Unit of the parameter; `None` where it cannot be inferred.
    pub unit: Option<Unit>,
    /// Whether the effect vanishes at no value of this parameter, such as a width (an inner parameter).
    pub is_inner: bool,
    /// Whether a fit keeps the parameter at its initial value.
    pub frozen: bool,
    /// Smallest allowed value of the parameter.
    pub min: f64,
    /// Largest allowed value of the parameter.
    pub max: f64,
    /// Value at which the effect vanishes (null value); for an inner parameter, the first value of its grid.
    pub null: f64,
    /// A typical value of the parameter; `None` if none is known.
    pub typical: Option<f64>,
    /// Values of an inner parameter from which fits start.
    pub grid: Vec<f64>,
    /// Values of a threshold parameter from which scans start.
    pub scan: Vec<f64>,
    /// Whether the parameter is a period or a frequency of the effect.
    pub cycle: Option<Cycle>,
    /// Periods or frequencies at which a periodogram is computed; empty for any other parameter.
    pub cycles: Vec<f64>,
    /// Largest speed in the data of the quantity that the period belongs to, per second; 1 for a frequency.
    pub cycle_speed: f64,
    /// Quantity whose size the numbers of this parameter are multiples of; `None` if they are in its unit.
    pub(super) of: Option<String>,
    /// Size in the data that the bounds and grid are raised to.
    pub(super) least: Option<String>,
}

/// Applies a library row at all its places in a model; returns the candidate effects.
///
/// # Errors
/// A place that is neither a general one nor a name of the model, or an expression that cannot be read.
pub(super) fn expand(row: &Row, model: &Model) -> Result<Vec<Candidate>, ModelError> {
    let mut candidates = Vec::new();
    for place_name in &row.on {
        let Some(found) = places(place_name, model) else {
            let (file, line) = row.place.clone();
            let place = FilePlace { file, line, key: format!("candidate.{}", row.kind) };
            let fault = Box::new(Fault::NoSuchPlace { name: escaped_short(place_name) });
            return Err(ModelError { place, fault, excerpt: None });
        };
        // The torques of the inverse dynamics are filtered and thinned out: a lag shorter than that is a delay to first order.
        let is_filtered =
            |target: Target| matches!(target, Target::Output(_)) && model.declared_states() == 0;
        for place in found.iter().filter(|place| row.states.is_empty() || !is_filtered(place.target)) {
            candidates.push(expand_at(row, place, model, "")?);
        }
        // The same effect on all joints of a robot is one hypothesis, with values of each joint's own.
        if place_name == "force"
            && let Some(robot) = model.robot.as_ref().filter(|_| found.len() > 1)
        {
            let suffixes = robot.joint_names().map(|name| format!("_{name}"));
            let parts =
                found.iter().zip(suffixes).map(|(place, suffix)| expand_at(row, place, model, &suffix));
            let parts = parts.collect::<Result<Vec<Candidate>, ModelError>>()?;
            candidates.push(all_joints(&parts, model)?);
        }
    }
    Ok(candidates)
}

/// Name of the place of an effect that acts on all joints of a robot.
pub(crate) const ALL_JOINTS: &str = "all joints";

/// Combines the same effect on each joint of a robot into one candidate effect.
///
/// The parameters are ordered by parameter, then by joint, so that coefficients come before inner parameters.
fn all_joints(parts: &[Candidate], model: &Model) -> Result<Candidate, ModelError> {
    let Some(first) = parts.first() else {
        let place = FilePlace { file: model.file.clone(), line: 1, key: "robot".into() };
        let fault = Box::new(Fault::NoSuchPlace { name: ALL_JOINTS.into() });
        return Err(ModelError { place, fault, excerpt: None });
    };
    let mut joined = Candidate { on: ALL_JOINTS.to_owned(), copies: parts.len(), ..first.clone() };
    let by_joint = |k: usize| parts.iter().map(move |part| part.parameters[k].clone());
    joined.parameters = (0..first.parameters.len()).flat_map(by_joint).collect();
    joined.states = parts.iter().flat_map(|part| part.states.clone()).collect();
    joined.changes = parts.iter().flat_map(|part| part.changes.clone()).collect();
    joined.excludes.extend(parts.iter().map(|part| format!("{} on {}", part.kind, part.on)));
    joined.part_names = parts.iter().map(|part| part.names.clone()).collect();
    joined.formula = first.formula.replacen(&format!("torque on {}", first.on), "torque on each joint", 1);
    Model { text: String::new(), ..model.clone() }.add(&joined.draft(&joined.nulls()))?;
    Ok(joined)
}

/// Applies a library row at one place of a model; `suffix` is appended to the names of its parameters and states.
fn expand_at(row: &Row, place: &Place, model: &Model, suffix: &str) -> Result<Candidate, ModelError> {
    let is_of_model = |name: &str| {
        let states = model.states.iter().any(|s| s.name == name);
        let inputs = model.inputs.iter().any(|i| i.name == name);
        let lets = model.lets.iter().any(|l| l.name == name);
        states || inputs || lets || model.parameter(name).is_some()
    };
    // A parameter or state of the row that has the same name as a quantity of the model would hide it, so it
    // is renamed.
    let own_names = row.parameters.iter().map(|p| &p.name).chain(row.states.iter().map(|s| &s.name));
    let renamed: Vec<(String, String)> = own_names
        .map(|name| {
            let mut other = format!("{name}{suffix}");
            while is_of_model(&other) {
                other.push_str("_added");
            }
            (name.clone(), other)
        })
        .collect();
    let replacement = |name: &str| {
        let renamed_to = renamed.iter().find(|(from, _)| from == name).map(|(_, to)| to.as_str());
        renamed_to.or_else(|| place.names.iter().find(|(from, _)| *from == name).map(|(_, to)| to.as_str()))
    };
    let text = |text: &str| substitute(text, replacement);
    let new_name = |name: &str| replacement(name).unwrap_or(name).to_owned();
    let mut changes = vec![((place.target, row.how), text(&row.expression))];
    for (other, expression) in place.others.iter().zip(&row.others) {
        changes.push(((*other, How::Add), text(expression)));
    }
    let substitute_state = |s: &DraftState| DraftState {
        name: new_name(&s.name),
        rate: text(&s.rate),
        start: text(&s.start),
        spread: s.spread.as_deref().map(text),
        sd: None,
    };
    let mut candidate = Candidate {
        kind: row.kind.clone(),
        name: row.kind.clone(),
        on: place.on.clone(),
        with: place.with.clone(),
        formula: String::new(),
        parameters: row
            .parameters
            .iter()
            .map(|p| CandidateParameter { name: new_name(&p.name), ..CandidateParameter::from_row(p) })
            .collect(),
        equivalent_causes: row.equivalent_causes.clone(),
        separated_by: row.separated_by.clone(),
        excludes: row.excludes.clone(),
        reduces_to: row.reduces_to.clone(),
        source: row.source.clone(),
        states: row.states.iter().map(substitute_state).collect(),
        changes,
        shape: None,
        names: place.names.clone(),
        copies: 1,
        part_names: Vec::new(),
        is_offered: false,
        line: row.place.1,
    };
    candidate.formula = formula(&candidate, model);
    candidate.infer_units(model);
    // Parse all expressions, so that an error in a user's candidate is found before anything is fitted.
    Model { text: String::new(), ..model.clone() }.add(&candidate.draft(&candidate.nulls()))?;
    Ok(candidate)
}

/// Writes the changes of a candidate effect in one line.
fn formula(candidate: &Candidate, model: &Model) -> String {
    let part = |((target, how), text): &(DraftTarget, String)| {
        let target_text = match target {
            Target::Rate(state) => format!("d({})/dt", model.states[*state].name),
            Target::Output(output) => model.outputs[*output].name.clone(),
            Target::Input(input) => model.inputs[*input].name.clone(),
            Target::Delay(input) => return format!("{0}(t - {text}) for {0}", model.inputs[*input].name),
            Target::Parameter(p) => model.parameters[*p].name.clone(),
            Target::Force(k) => model.force(*k).map_or_else(String::new, |force| force.name.clone()),
            Target::Joint(_) | Target::Inertia(..) | Target::Armature(_) | Target::Gravity(_) => {
                model.robot.as_ref().map_or_else(String::new, |robot| robot.target_name(*target))
            }
        };
        match how {
            How::Add => match text.strip_prefix('-') {
                Some(rest) if !has_sum(rest) => format!("{target_text} -= {rest}"),
                _ => format!("{target_text} += {text}"),
            },
            How::Factor => format!("{target_text} *= {text}"),
            How::Replace => format!("{target_text} = {text}"),
        }
    };
    let changes = candidate.changes.iter().map(part);
    let states = candidate.states.iter().map(|s| format!("d({})/dt = {}", s.name, s.rate));
    changes.chain(states).collect::<Vec<_>>().join(", ")
}

/// Whether an expression has a sum outside parentheses.
///
/// A minus sign before such an expression does not apply to all of it.
fn has_sum(text: &str) -> bool {
    let mut depth = 0;
    text.chars().any(|c| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        depth == 0 && matches!(c, '+' | '-')
    })
}

/// Makes the names of candidate effects unique, and completes the names in `contains`.
///
/// The place is added to the name where a kind occurs several times.
pub(super) fn make_names_unique(candidates: &mut [Candidate]) {
    let kinds: Vec<String> = candidates.iter().map(|c| c.kind.clone()).collect();
    for candidate in &mut *candidates {
        if kinds.iter().filter(|kind| **kind == candidate.kind).count() > 1 {
            candidate.name = format!("{} on {}", candidate.kind, candidate.on);
            if let Some(with) = &candidate.with {
                candidate.name = format!("{} with {with}", candidate.name);
            }
        }
    }
    let place = |c: &Candidate| (c.on.clone(), c.with.clone());
    let names: Vec<_> = candidates.iter().map(|c| (c.kind.clone(), place(c), c.name.clone())).collect();
    for candidate in candidates {
        let position = place(candidate);
        let simpler =
            |kind: &String| names.iter().find(|(other, there, _)| other == kind && *there == position);
        candidate.reduces_to =
            candidate.reduces_to.as_ref().and_then(simpler).map(|(_, _, name)| name.clone());
        let complete =
            |kind: &String| simpler(kind).map_or_else(|| kind.clone(), |(_, _, name)| name.clone());
        candidate.excludes = candidate.excludes.iter().map(complete).collect();
    }
}

impl CandidateParameter {
    fn from_row(p: &RowParameter) -> Self {
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
            cycle: p.cycle,
            cycles: Vec::new(),
            cycle_speed: 1.0,
            of: p.of.clone(),
            least: p.least.clone(),
        }
    }
}

impl Candidate {
    /// Text of the expression of the effect's first change; `None` without a change.
    pub fn text(&self) -> Option<&str> {
        self.changes.first().map(|(_, text)| text.as_str())
    }

    /// Describes the size that the numbers of a parameter are multiples of; `None` if they are in the parameter's unit.
    pub fn size_of(&self, parameter: &CandidateParameter) -> Option<String> {
        describe_size(parameter.of.as_ref()?, &self.names)
    }

    /// Parameter values at which the effect vanishes; inner parameters take the first value of their grids.
    pub fn nulls(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.null).collect()
    }

    /// All combinations of the grids of inner parameters, with the other parameters at their null values.
    pub fn null_points(&self) -> Vec<Vec<f64>> {
        self.points(|p| if p.is_inner { p.grid.clone() } else { vec![p.null] })
    }

    /// Start values of a scan over thresholds: parameters at whose null value the effect has zero slope.
    ///
    /// Empty if the effect has no such parameter.
    ///
    /// Inner parameters take the values of their grids, and the other parameters their typical values.
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

    /// Parameter values at which a periodogram of the residuals is computed; empty for an effect that is not periodic.
    ///
    /// The period or frequency takes the values of [`CandidateParameter::cycles`], and all others are at their null values.
    pub fn cycle_points(&self) -> Vec<Vec<f64>> {
        if self.copies > 1 || self.parameters.iter().all(|p| p.cycles.is_empty()) {
            return Vec::new();
        }
        self.points(|p| if p.cycles.is_empty() { vec![p.null] } else { p.cycles.clone() })
    }

    /// Lists all combinations of the values that `values_of` gives for each parameter.
    fn points(&self, values_of: impl Fn(&CandidateParameter) -> Vec<f64>) -> Vec<Vec<f64>> {
        // All joints take the same place in their grids.
        let mut points = vec![Vec::new()];
        for joints in self.parameters.chunks(self.copies.max(1)) {
            let values: Vec<Vec<f64>> = joints.iter().map(&values_of).collect();
            let count = values.iter().map(Vec::len).min().unwrap_or(0);
            let at = |k: usize| values.iter().map(|list| list[k]).collect::<Vec<f64>>();
            points = points
                .iter()
                .flat_map(|point: &Vec<f64>| (0..count).map(move |k| [&point[..], &at(k)].concat()))
                .collect();
        }
        points
    }

    /// Whether the effect brings states of its own into the model.
    pub fn has_states(&self) -> bool {
        !self.states.is_empty()
    }

    /// Whether the effect delays an input.
    pub fn is_delay(&self) -> bool {
        self.changes.iter().any(|((target, _), _)| matches!(target, Target::Delay(_)))
    }

    /// Whether the effect changes an output.
    pub fn is_on_output(&self) -> bool {
        self.changes.iter().any(|((target, _), _)| matches!(target, Target::Output(_)))
    }

    /// Builds the effect with these parameter values, ready to be added to the model.
    pub fn draft(&self, values: &[f64]) -> Draft {
        let parameter = |(p, value): (&CandidateParameter, &f64)| Parameter {
            name: p.name.clone(),
            unit: p.unit,
            nominal: *value,
            min: p.min,
            max: p.max,
            frozen: p.frozen,
            ci95: None,
            by_group: None,
            line: self.line,
        };
        Draft {
            kind: self.kind.clone(),
            on: self.on.clone(),
            with: self.with.clone(),
            parameters: self.parameters.iter().zip(values).map(parameter).collect(),
            states: self.states.clone(),
            changes: self.changes.clone(),
            equivalent_expressions: Vec::new(),
            table: None,
            line: self.line,
        }
    }

    /// Infers the units of a candidate's parameters: first inner parameters, then coefficients.
    ///
    /// The unit of a coefficient follows from the term that it multiplies.
    fn infer_units(&mut self, model: &Model) {
        for p in &mut self.parameters {
            if let (None, Some(of)) = (p.unit, &p.of) {
                p.unit = size_unit(of, &self.names, model);
            }
        }
        let coefficients: Vec<usize> = (0..self.parameters.len())
            .filter(|i| self.parameters[*i].unit.is_none() && !self.parameters[*i].is_inner)
            .collect();
        if coefficients.is_empty() {
            return;
        }
        // The dimensions of the term with dimensionless coefficients; the target's dimensions over these are
        // the coefficients'.
        let mut plain = self.clone();
        coefficients.iter().for_each(|i| plain.parameters[*i].unit = Some(Unit::DIMENSIONLESS));
        let mut scratch = Model { text: String::new(), ..model.clone() };
        if scratch.add(&plain.draft(&plain.nulls())).is_err() {
            return;
        }
        let Some(addition) = scratch.additions.last() else { return };
        let Some(change) = addition.changes.first() else { return };
        let target_unit = match (change.target, change.how) {
            (Target::Delay(_), _) => Some(Unit::SECOND),
            (_, How::Factor) => Some(Unit::DIMENSIONLESS),
            (Target::Rate(i), _) => {
                let per_second = |u: Unit| Unit::from_dimensions(u.dimensions() / Dimensions::TIME);
                model.states[i].unit.and_then(per_second)
            }
            (Target::Output(i), _) => model.outputs[i].unit,
            (Target::Input(i), _) => model.inputs[i].unit,
            (Target::Parameter(i), _) => model.parameters[i].unit,
            (Target::Force(k), _) => model.force(k).and_then(Force::unit),
            (target, _) => model.robot.as_ref().and_then(|robot| robot.target_unit(target)),
        };
        let term = match change.how {
            // `1 + c z` is a pure number, so that the unit of c is one over that of z.
            How::Factor => {
                self.names.first().and_then(|(_, z)| size_unit(z, &[], model)).map(Unit::dimensions)
            }
            _ => dimensions_of(&scratch, &change.value.tree),
        };
        let unit = target_unit.zip(term).and_then(|(target, term)| {
            let dimensions = target.dimensions() / term;
            if dimensions.is_pure() {
                return Some(Unit::DIMENSIONLESS);
            }
            // A torque has the dimensions of an energy, but nobody states it in joules.
            let is_torque = target.dimensions() == torque_dimensions() && target.symbol() != "J";
            if is_torque { target.over(term) } else { Unit::from_dimensions(dimensions) }
        });
        coefficients.iter().for_each(|i| self.parameters[*i].unit = unit);
    }
}

/// Dimensions of a torque: those of a force times a length.
fn torque_dimensions() -> Dimensions {
    Unit::parse("N m").map_or(Dimensions::NONE, Unit::dimensions)
}
