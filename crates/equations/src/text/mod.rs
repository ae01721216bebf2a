//! Parses the text of an expression into a checked tree.

mod evaluate;
mod function;
mod lexer;
mod parser;
mod problem;
mod tree;

pub(crate) use evaluate::Bindings;
pub use function::Function;
pub(crate) use function::is_reserved;
pub(crate) use lexer::{Lexer, Token};
pub use parser::{Scope, parse};
pub(crate) use problem::suggest;
pub use problem::{Problem, Side};
pub use tree::{Comparison, Kind, Symbol, Tree, TreeNode};
