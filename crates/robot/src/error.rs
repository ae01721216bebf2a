//! Error of a description file: what is wrong, where, and what to do.

use std::fmt;

use thiserror::Error;

/// A description file that cannot be read, or that contradicts itself.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub struct DescriptionError {
    /// Name of the file.
    pub file: String,
    /// Line of the element, from 1; `None` if the error concerns the whole file.
    pub line: Option<usize>,
    /// What is wrong, with the names of the element and the attribute.
    pub problem: String,
    /// What the user can do.
    pub remedy: String,
}

impl DescriptionError {
    /// An error at a line of a file.
    pub fn at(
        file: &str,
        line: usize,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> DescriptionError {
        DescriptionError {
            file: file.into(),
            line: Some(line),
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }

    /// An error that concerns the whole file.
    pub fn of_file(file: &str, problem: impl Into<String>, remedy: impl Into<String>) -> DescriptionError {
        DescriptionError { file: file.into(), line: None, problem: problem.into(), remedy: remedy.into() }
    }
}

impl fmt::Display for DescriptionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}, line {line}: {}; {}", self.file, self.problem, self.remedy),
            None => write!(f, "{}: {}; {}", self.file, self.problem, self.remedy),
        }
    }
}
