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
        DescriptionError { line: Some(line), ..DescriptionError::of_file(file, problem, remedy) }
    }

    /// An error that concerns the whole file.
    pub fn of_file(file: &str, problem: impl Into<String>, remedy: impl Into<String>) -> DescriptionError {
        let [problem, remedy] = [problem.into(), remedy.into()].map(|text| printable(&text));
        DescriptionError { file: file.into(), line: None, problem, remedy }
    }
}

/// Longest part of a message, characters: a line of a file may be a single name.
const MAX_CHARS: usize = 600;

/// A text that quotes a file, cut to [`MAX_CHARS`] and with control characters escaped, which would disturb a terminal.
fn printable(text: &str) -> String {
    let mut shown = String::with_capacity(text.len().min(4 * MAX_CHARS));
    for (count, letter) in text.chars().enumerate() {
        if count == MAX_CHARS {
            shown.push('…');
            break;
        }
        match letter.is_control() {
            true => shown.extend(letter.escape_debug()),
            false => shown.push(letter),
        }
    }
    shown
}

impl fmt::Display for DescriptionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}, line {line}: {}; {}", self.file, self.problem, self.remedy),
            None => write!(f, "{}: {}; {}", self.file, self.problem, self.remedy),
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: what a message quotes is printed on a terminal without harm.

    use super::*;

    #[test]
    fn long_and_unprintable_words_of_a_file_are_shown_safely() {
        let error =
            DescriptionError::at("arm.urdf", 3, format!("`a\u{1b}[31m\0{}`", "n".repeat(5000)), "correct it");
        let message = error.to_string();
        assert!(message.starts_with("arm.urdf, line 3: `a\\u{1b}[31m\\0nnn"), "{message}");
        assert!(message.ends_with("nnn…; correct it") && message.chars().count() < 700, "{message}");
    }
}
