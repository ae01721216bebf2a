#![doc = include_str!("../README.md")]

mod cholesky;
mod eigen;
mod rows;

pub use cholesky::{PositiveInverse, invert_positive_definite, solve_positive_definite};
pub use eigen::{SymmetricEigen, gram, symmetric_eigen};
pub use faer::Mat;
pub use rows::gram_of_rows;
