//! An effect of a system's library, with everything that the loop asks about it.

use super::quantity::Quantity;
use crate::effects::{EffectSpec, ParameterSpec, Polar, Rival as RivalSpec, Start as StartSpec};

/// One parameter of an effect.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectParameter {
    /// Name with the unit in it, as in model files.
    pub name: String,
    /// Unit in print; empty for a pure number.
    pub unit: String,
    /// Smallest value that makes sense.
    pub min: f64,
    /// Largest value that makes sense.
    pub max: f64,
    /// A size at which the effect is usually seen.
    pub typical: f64,
    /// The value at which the effect vanishes.
    pub null: f64,
}

impl From<&ParameterSpec> for EffectParameter {
    fn from(p: &ParameterSpec) -> Self {
        let (name, unit) = (p.name.into(), p.unit.into());
        Self { name, unit, min: p.min, max: p.max, typical: p.typical, null: p.null }
    }
}

/// The effect that another one acts through.
#[derive(Clone, Debug, PartialEq)]
pub struct Join {
    /// The kind that has to be in the model.
    pub kind: String,
    /// Where its parameters begin when both are tried together.
    pub start: Vec<f64>,
    /// Where the parameters of the effect itself begin then: one attempt each.
    pub own: Vec<Vec<f64>>,
}

/// Where a fit of an added effect begins.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Start {
    /// At the one-step estimate of its test.
    #[default]
    Estimate,
    /// At the one-step estimate, brought into these bounds (one pair for each parameter).
    Within(Vec<[f64; 2]>),
    /// At these values.
    At(Vec<f64>),
}

/// Another explanation, seen from an effect.
#[derive(Clone, Debug, PartialEq)]
pub enum Rival {
    /// An effect of this kind.
    Kind(String),
    /// Any kind that acts at this place.
    At(String),
    /// Any other kind.
    Any,
}

/// An effect that may be missing.
///
/// Effects of built-in systems are described by an [`EffectSpec`] beside their law, those of written systems in their file:
/// the loop reads this form and does not know which.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Effect {
    /// Name in model files, reports and results.
    pub kind: String,
    /// Where it acts, in the system's words.
    pub place: String,
    /// Parameters of the effect, in the order of its vector of values.
    pub parameters: Vec<EffectParameter>,
    /// The law in one line.
    pub formula: String,
    /// Where it is from.
    pub source: String,
    /// Other causes with the same term, which data of one apparatus cannot tell apart.
    pub stands_for: Vec<String>,
    /// Kinds that describe the same thing in another form; at most one of them in a model.
    pub excludes: Vec<String>,
    /// The effect that it acts through, if it does: the two are also tried together, because neither shows without the other.
    pub joins: Option<Join>,
    /// A simpler kind that it turns into where some of its parameters have their null.
    pub contains: Option<String>,
    /// A kind whose test promises what this one would bring: where that kind is fitted, this one is fitted too.
    pub foretold_by: Option<String>,
    /// Whether it makes every simulation dearer: such effects are tested apart from cheap ones.
    pub costly: bool,
    /// Where a fit with it begins.
    pub start: Start,
    /// Values at which it is first simulated, for a law that is singular at its null; empty: there.
    pub probe: Vec<f64>,
    /// How many of its parameters, from the first, say how much of it there is. Absent: all of them.
    pub amounts: Option<usize>,
    /// Whether its two parameters are an amount and a direction.
    pub polar: Option<Polar>,
    /// The experiment that tells it from another explanation.
    pub separated_by: Vec<(Rival, String)>,
    /// The experiment that confirms it, where there is no other explanation.
    pub confirmed_by: Option<String>,
    /// For a formula of a grammar, which is no law that somebody described: how simple it is and where it stands.
    pub grammar: Option<Grammar>,
}

/// Simplicity and place of a formula that a grammar made.
#[derive(Clone, Debug, PartialEq)]
pub struct Grammar {
    /// Numbers, names and operations in it.
    pub nodes: usize,
    /// The quantity that it is a shape of.
    pub of: Quantity,
    /// Smallest and largest value of this quantity in the data.
    pub range: [f64; 2],
}

impl From<&EffectSpec> for Effect {
    fn from(spec: &EffectSpec) -> Self {
        let words = |list: &[&str]| list.iter().map(|s| s.to_string()).collect();
        let rival = |rival: &RivalSpec| match rival {
            RivalSpec::Kind(kind) => Rival::Kind(kind.to_string()),
            RivalSpec::At(location) => Rival::At(location.name().into()),
            RivalSpec::Any => Rival::Any,
        };
        Self {
            kind: spec.kind.into(),
            place: spec.location.name().into(),
            parameters: spec.parameters.iter().map(EffectParameter::from).collect(),
            formula: spec.formula.into(),
            source: spec.source.into(),
            stands_for: words(spec.stands_for),
            excludes: words(spec.excludes),
            joins: spec.joins.map(|join| Join {
                kind: join.kind.into(),
                start: join.start.to_vec(),
                own: join.own.iter().map(|values| values.to_vec()).collect(),
            }),
            contains: spec.contains.map(Into::into),
            foretold_by: spec.foretold_by.map(Into::into),
            costly: spec.costly,
            start: match spec.start {
                StartSpec::Estimate => Start::Estimate,
                StartSpec::Within(bounds) => Start::Within(bounds.to_vec()),
                StartSpec::At(values) => Start::At(values.to_vec()),
            },
            probe: spec.probe.to_vec(),
            amounts: spec.amounts,
            polar: spec.polar,
            separated_by: spec.separated_by.iter().map(|(r, text)| (rival(r), text.to_string())).collect(),
            confirmed_by: spec.confirmed_by.map(Into::into),
            grammar: None,
        }
    }
}

/// The experiment that tells two explanations apart, by the effects that one has and the other has not: what is known of two
/// kinds before what is known of a kind and a place, and that before what tells a kind from any other.
pub fn known_separation<'e>(one: &[&'e Effect], other: &[&'e Effect]) -> Option<&'e str> {
    let sides = [(one, other), (other, one)];
    let known = |applies: &dyn Fn(&Rival, &[&Effect]) -> bool| {
        sides.iter().find_map(|(mine, theirs)| {
            let mut all = mine.iter().flat_map(|effect| &effect.separated_by);
            all.find(|(rival, _)| applies(rival, theirs)).map(|(_, text)| text.as_str())
        })
    };
    let is = |rival: &Rival, kind: &str| matches!(rival, Rival::Kind(k) if k == kind);
    let at = |rival: &Rival, place: &str| matches!(rival, Rival::At(p) if p == place);
    known(&|rival, theirs| theirs.iter().any(|e| is(rival, &e.kind)))
        .or_else(|| known(&|rival, theirs| theirs.iter().any(|e| at(rival, &e.place))))
        .or_else(|| known(&|rival, _| *rival == Rival::Any))
}
