//! Which laws act, and where each finds its parameters in one flat vector.

use super::Axes;
use crate::Scalar;
use crate::effects::{self, Law, TABLE_KIND, Table};

/// The parameters that every ball world has, in the order of the parameter vector; those of the terms follow.
pub const BASE_PARAMETERS: [&str; 5] =
    ["gravity_m_s2", "restitution", "radius_m", "inertia_ratio", "floor_height_m"];
/// Index of the gravity, m/s².
pub const GRAVITY: usize = 0;
/// Index of the coefficient of restitution.
pub const RESTITUTION: usize = 1;
/// Index of the ball's radius, m.
pub const RADIUS: usize = 2;
/// Index of `I / (m R²)`.
pub const INERTIA_RATIO: usize = 3;
/// Index of the height of the floor in the coordinates of the data, m.
pub const FLOOR: usize = 4;

/// A law: one of the library, or a table of its own.
#[derive(Clone, Debug, PartialEq)]
pub enum LawRef {
    /// Position in [`effects::all`].
    Listed(usize),
    /// A tabulated law.
    Table(Table),
}

/// A law with its place in the parameter vector.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// The law.
    pub law: LawRef,
    /// Index of its first parameter.
    pub first: usize,
    /// Number of its parameters.
    pub count: usize,
}

/// The laws that act. Parameter values live outside, in a flat vector, so that one world serves many fits.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// Which coordinates exist.
    pub axes: Axes,
    terms: Vec<Term>,
    parameters: usize,
}

impl World {
    /// A world of gravity and constant restitution.
    pub fn new(axes: Axes) -> Self {
        Self { axes, terms: Vec::new(), parameters: BASE_PARAMETERS.len() }
    }

    /// Length of the parameter vector.
    pub fn parameter_count(&self) -> usize {
        self.parameters
    }

    /// Adds a law with `count` parameters at the end of the vector; returns the index of its first parameter.
    ///
    /// Terms act in the order of the registry, tables first: additive laws of restitution before multiplicative ones.
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

    /// Adds an effect of the library by kind; `None` if there is no such kind (or it is no law, as scatter).
    pub fn add_kind(&mut self, kind: &str) -> Option<usize> {
        let index = effects::index_of(kind)?;
        let count = effects::spec_of(kind)?.parameters.len();
        Some(self.add(LawRef::Listed(index), count))
    }

    /// The terms in the order in which they act.
    pub fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// Kind of the law that owns the parameter of this index; `None` for a base parameter.
    pub(super) fn owner(&self, parameter: usize) -> Option<&'static str> {
        let term = self.terms.iter().find(|t| (t.first..t.first + t.count).contains(&parameter))?;
        match term.law {
            LawRef::Listed(i) => effects::all::<f64>().get(i).map(|e| e.spec().kind),
            LawRef::Table(_) => Some(TABLE_KIND),
        }
    }

    /// The laws with their slices of `parameters`, in the order in which they act.
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
