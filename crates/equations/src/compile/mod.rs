//! Compiles checked trees to straight-line programs for values and derivatives.

mod code;
mod derivative;
mod graph;
mod lower;
mod probe;
mod section;

pub(crate) use code::{Code, Operation};
pub(crate) use derivative::{Derivatives, Variable};
pub(crate) use graph::{Graph, Id};
pub(crate) use lower::{Lowering, Smoothing, Width};
pub(crate) use probe::{Point, Probe};
pub(crate) use section::{Layout, Section};
