//! Limits of a model file, so that no file can exhaust time or memory.

/// Maximum length of one expression in a model file, in bytes.
pub const MAX_EXPRESSION_BYTES: usize = 4096;
/// Maximum nesting of parentheses, signs and powers in an expression.
pub const MAX_EXPRESSION_DEPTH: usize = 64;
/// Maximum number of numbers, names and operations in all expressions of a file together.
pub const MAX_FILE_NODES: usize = 10_000;
/// Maximum length of a model file, in bytes.
pub const MAX_FILE_BYTES: usize = 1 << 20;
/// Maximum number of states of a model.
pub const MAX_STATES: usize = 64;
/// Maximum number of inputs of a model.
pub const MAX_INPUTS: usize = 64;
/// Maximum number of outputs of a model.
pub const MAX_OUTPUTS: usize = 64;
/// Maximum number of parameters of a model.
pub const MAX_PARAMETERS: usize = 256;
/// Maximum number of events of a model.
pub const MAX_EVENTS: usize = 32;
/// Maximum number of tables in a model file.
pub const MAX_TABLES: usize = 32;
/// Maximum number of `[[effect]]` blocks, and of `[[candidate]]` blocks, in a file.
pub const MAX_EFFECTS: usize = 64;
/// Maximum number of knots of a table effect, where each knot is a parameter.
pub const MAX_TABLE_KNOTS: usize = 32;
/// Maximum number of knots of a table in a model file.
pub const MAX_KNOTS: usize = 4096;
/// Maximum number of operations of a compiled system with all its derivatives.
///
/// A file of 10,000 nodes with 64 states could otherwise need millions; the largest example needs 200.
pub const MAX_OPERATIONS: usize = 200_000;
/// Maximum number of events in one window; the simulation of a window with more fails.
pub const MAX_EVENTS_PER_WINDOW: usize = 1000;
/// Maximum number of substeps per sample interval that the automatic choice of steps tries.
pub const MAX_SUBSTEPS: usize = 64;
/// Maximum number of substeps of a sample interval, whether needed for stability or declared in a file.
pub const MAX_STABLE_SUBSTEPS: usize = 1024;
