//! From the text of an expression to a checked tree.

mod function;
mod lexer;
mod parser;
mod problem;
mod tree;

pub use function::Function;
pub(crate) use function::is_reserved;
pub use parser::{Scope, parse};
pub use problem::Problem;
pub use tree::{Comparison, Kind, Symbol, Tree, TreeNode};
