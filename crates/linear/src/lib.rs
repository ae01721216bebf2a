#![doc = include_str!("../README.md")]

mod cholesky;
mod eigen;

pub use cholesky::{PositiveInverse, invert_positive_definite, solve_positive_definite};
pub use eigen::{SymmetricEigen, gram, symmetric_eigen};
pub use faer::Mat;
