//! An effect of a system's library, with everything that the loop asks about it.

use crate::effects::{EffectSpec, ParameterSpec};

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

/// An effect that may be missing.
///
/// Effects of built-in systems are described by an [`EffectSpec`] beside their law, those of written systems in their file:
/// the loop reads this form and does not know which.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// Name in model files, reports and results.
    pub kind: String,
    /// Where it acts, in the system's words.
    pub place: String,
    /// Its parameters, in order.
    pub parameters: Vec<EffectParameter>,
    /// The law in one line.
    pub formula: String,
    /// Where it is from.
    pub source: String,
    /// What the same term may stand for, when data of one apparatus cannot tell.
    pub stands_for: Vec<String>,
    /// Kinds that describe the same thing in another form; at most one of them in a model.
    pub excludes: Vec<String>,
}

impl From<&EffectSpec> for Effect {
    fn from(spec: &EffectSpec) -> Self {
        let words = |list: &[&str]| list.iter().map(|s| s.to_string()).collect();
        Self {
            kind: spec.kind.into(),
            place: spec.location.name().into(),
            parameters: spec.parameters.iter().map(EffectParameter::from).collect(),
            formula: spec.formula.into(),
            source: spec.source.into(),
            stands_for: words(spec.stands_for),
            excludes: words(spec.excludes),
        }
    }
}
