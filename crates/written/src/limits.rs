//! Bounds on what a model file may hold, so that no file can exhaust time or memory.

/// Longest expression, in bytes.
pub const EXPRESSION_BYTES: usize = 4096;
/// Deepest nesting of brackets, signs and powers in an expression.
pub const EXPRESSION_DEPTH: usize = 64;
/// Numbers, names and operations in all expressions of a file together.
pub const FILE_NODES: usize = 10_000;
/// Longest model file, in bytes.
pub const FILE_BYTES: usize = 1 << 20;
/// States of a system.
pub const STATES: usize = 64;
/// Inputs of a system.
pub const INPUTS: usize = 64;
/// Outputs of a system.
pub const OUTPUTS: usize = 64;
/// Parameters of a system.
pub const PARAMETERS: usize = 256;
/// Events of a system.
pub const EVENTS: usize = 32;
/// Tables of a system.
pub const TABLES: usize = 32;
/// Blocks `[[effect]]`, and blocks `[[candidate]]`, of a file.
pub const EFFECTS: usize = 64;
/// Knots of a table that is an effect: each is a parameter.
pub const TABLE_KNOTS: usize = 32;
/// Knots of a table.
pub const KNOTS: usize = 4096;
/// Operations of the compiled system with all its derivatives. A file of 10,000 nodes in 64 states could otherwise ask
/// for millions; the largest example needs 200.
pub const OPERATIONS: usize = 200_000;
/// Events that one window may see before the engine gives up.
pub const EVENTS_PER_WINDOW: usize = 1000;
/// Most substeps of a sample interval that are tried before the explicit integrator gives up.
pub const SUBSTEPS: usize = 64;
