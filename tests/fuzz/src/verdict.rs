//! Outcomes of reading one mutated input, and classes of defects.

use crate::limits::MAX_MESSAGE_CHARS;
use std::fmt::Display;
use std::path::Path;

/// Outcome of reading one mutated input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// The input was read, and all guarantees about the result hold.
    Accepted,
    /// The reader rejected the input with a valid message.
    Refused,
    /// The reader returned, but a guarantee about the result or message does not hold; says which one.
    Broken(String),
}

/// Class of a finding (a defect of a file reader), worst first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// The process was aborted: by an allocation beyond the limit or a stack overflow.
    Abort,
    /// The reader did not answer within the time limit.
    Hang,
    /// The reader panicked.
    Panic,
    /// A guarantee about the result or message does not hold: a [`Verdict::Broken`].
    Broken,
}

impl Class {
    /// Name of the class in reports and file names.
    pub fn name(self) -> &'static str {
        match self {
            Class::Abort => "abort",
            Class::Hang => "hang",
            Class::Panic => "panic",
            Class::Broken => "broken",
        }
    }
}

/// An input that showed a defect of a file reader.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Class of the defect.
    pub class: Class,
    /// Name of the file reader.
    pub reader: String,
    /// Number of the input in its campaign.
    pub index: u64,
    /// Detail of the defect: location of the panic, message, or signal.
    pub detail: String,
}

/// Checks the message with which a reader rejected the file `path`; returns the verdict.
///
/// The message must fit on a page and must not contain control characters, because it quotes cells of the
/// file and is printed on a terminal. The path of the file is not counted.
pub fn refusal(path: &Path, message: &dyn Display) -> Verdict {
    let text = message.to_string().replace(&path.display().to_string(), "");
    if let Some(bad) = text.chars().find(|c| c.is_control() && *c != '\n') {
        return Verdict::Broken(format!(
            "the message contains the control character {bad:?}: {}",
            shortened(&text)
        ));
    }
    let length = text.chars().count();
    match length > MAX_MESSAGE_CHARS {
        true => Verdict::Broken(format!("the message has {length} characters: {}", shortened(&text))),
        false => Verdict::Refused,
    }
}

/// The first 160 characters of a text, with control characters escaped (so the result may be longer).
pub fn shortened(text: &str) -> String {
    text.chars().take(160).flat_map(char::escape_debug).collect()
}

/// Key of a finding (defect), by which duplicates are recognised.
///
/// The key is the beginning of the detail without digits, which differ between inputs with the same defect.
/// The location of a panic needs more characters than the text of a violated guarantee.
pub fn finding_key(class: Class, detail: &str) -> String {
    let length = if class == Class::Broken { 24 } else { 60 };
    detail.chars().filter(|c| !c.is_ascii_digit()).take(length).collect()
}
