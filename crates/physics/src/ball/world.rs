//! The set of active effects of the ball, and the index of their parameters in the parameter vector.

use super::Axes;
use super::effects::{self, Law, TABLE_KIND, Table};
use crate::Scalar;

/// Names of the base parameters, in the order of the parameter vector; those of effects follow.
pub const BASE_PARAMETERS: [&str; 5] =
    ["gravity_m_s2", "restitution", "radius_m", "inertia_ratio", "floor_height_m"];
/// Index of gravity, m/s², in the parameter vector.
pub const GRAVITY: usize = 0;
/// Index of the coefficient of restitution in the parameter vector.
pub const RESTITUTION: usize = 1;
/// Index of the ball's radius, m, in the parameter vector.
pub const RADIUS: usize = 2;
/// Index of the inertia ratio `I / (m R²)` of the ball in the parameter vector.
pub const INERTIA_RATIO: usize = 3;
/// Index of the floor height in the coordinates of the data, m, in the parameter vector.
pub const FLOOR: usize = 4;

/// An active effect: one of the library, or a table.
#[derive(Clone, Debug, PartialEq)]
pub enum LawRef {
    /// An effect of the library, by its index in [`effects::all`].
    Listed(usize),
    /// A piecewise-linear function of one feature.
    Table(Table),
}

/// An active effect with the range of its parameters in the parameter vector.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// The library effect or table.
    pub law: LawRef,
    /// Index of the effect's first parameter in the parameter vector.
    pub first: usize,
    /// Number of parameters of the effect.
    pub count: usize,
}

/// The active effects of a ball model and the layout of its parameter vector.
///
/// Parameter values are not part of it: they are in a separate vector, so that all trial values of a fit
/// share one `World`.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// Coordinates that are measured.
    pub axes: Axes,
    terms: Vec<Term>,
    parameters: usize,
}

impl World {
    /// A ball without effects: gravity and constant restitution.
    pub fn new(axes: Axes) -> Self {
        Self { axes, terms: Vec::new(), parameters: BASE_PARAMETERS.len() }
    }

    /// Number of parameters in the parameter vector.
    pub fn parameter_count(&self) -> usize {
        self.parameters
    }

    /// Adds an effect with `count` parameters at the end of the vector; returns the index of the first.
    ///
    /// Effects act in the order of the registry, tables first, because additive effects on the restitution
    /// act before multiplicative ones.
    pub fn add(&mut self, law: LawRef, count: usize) -> usize {
        let first = self.parameters;
        self.parameters += count;
        self.terms.push(Term { law, first, count });
        self.terms.sort_by_key(|t| match t.law {
            LawRef::Table(_) => 0,
            LawRef::Listed(i) => i + 1,
        });
        first
    }

    /// Adds a library effect by kind; returns the index of its first parameter.
    ///
    /// `None` if there is no such kind or it is the random scatter.
    pub fn add_kind(&mut self, kind: &str) -> Option<usize> {
        let index = effects::index_of(kind)?;
        let count = effects::spec_of(kind)?.parameters.len();
        Some(self.add(LawRef::Listed(index), count))
    }

    /// Active effects with their parameter ranges, in the order in which they act.
    pub fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// Kind of the effect to which the parameter with this index belongs; `None` for a base parameter.
    pub(super) fn owner(&self, parameter: usize) -> Option<&'static str> {
        let term = self.terms.iter().find(|t| (t.first..t.first + t.count).contains(&parameter))?;
        match term.law {
            LawRef::Listed(i) => effects::all::<f64>().get(i).map(|e| e.spec().kind),
            LawRef::Table(_) => Some(TABLE_KIND),
        }
    }

    /// Active effects with their slices of `parameters`, in the order in which they act.
    pub(super) fn laws<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Vec<(&'a dyn Law<S>, &'a [S])> {
        let listed = effects::all::<S>();
        self.terms
            .iter()
            .filter_map(|t| {
                let p = parameters.get(t.first..t.first + t.count)?;
                let law: &dyn Law<S> = match &t.law {
                    LawRef::Listed(i) => *listed.get(*i)?,
                    LawRef::Table(table) => table,
                };
                Some((law, p))
            })
            .collect()
    }
}
