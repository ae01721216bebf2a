//! Compiles checked trees to straight-line programs for values and derivatives.

mod code;
mod derivative;
mod external;
mod graph;
mod joint_quantity;
mod lower;
mod probe;
mod robot;
mod section;

pub use code::Code;
pub(crate) use code::Operation;
pub(crate) use derivative::{Derivatives, Variable};
pub(crate) use graph::{Graph, Id};
pub(crate) use lower::{Lowering, Smoothing, Width};
pub(crate) use probe::{Point, Probe};
pub(crate) use section::{ExternalCall, Instruction, Layout, Section};
