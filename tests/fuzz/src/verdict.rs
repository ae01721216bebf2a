//! Outcomes of reading one input.

use crate::limits::LONGEST_MESSAGE;
use std::fmt::Display;
use std::path::Path;

/// A reader's answer to one input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// The input was read, and all that was asked of the result holds.
    Accepted,
    /// The reader refused the input with a message in order.
    Refused,
    /// The reader returned, but a promise does not hold.
    Broken(String),
}

/// Classes of findings, worst first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// The process died: an allocation beyond the limit, a stack overflow.
    Abort,
    /// No answer within the time.
    Hang,
    /// A panic.
    Panic,
    /// A [`Verdict::Broken`].
    Broken,
}

impl Class {
    /// Name in reports and file names.
    pub fn name(self) -> &'static str {
        match self {
            Class::Abort => "abort",
            Class::Hang => "hang",
            Class::Panic => "panic",
            Class::Broken => "broken",
        }
    }
}

/// An input that showed a defect.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Kind of defect.
    pub class: Class,
    /// The reader's name.
    pub reader: String,
    /// Number of the input in its campaign.
    pub index: u64,
    /// Place of the panic, message, or signal.
    pub detail: String,
}

/// The verdict on a refusal: its message must fit on a page and hold no control characters, because cells of the file
/// are quoted in it and it goes to a terminal. `path` is the file's name, which is not counted.
pub fn refusal(path: &Path, message: &dyn Display) -> Verdict {
    let text = message.to_string().replace(&path.display().to_string(), "");
    if let Some(bad) = text.chars().find(|c| c.is_control() && *c != '\n') {
        return Verdict::Broken(format!(
            "the message holds the control character {bad:?}: {}",
            shortened(&text)
        ));
    }
    let length = text.chars().count();
    match length > LONGEST_MESSAGE {
        true => Verdict::Broken(format!("the message has {length} characters: {}", shortened(&text))),
        false => Verdict::Refused,
    }
}

/// The first characters of a text, printable.
pub fn shortened(text: &str) -> String {
    text.chars().take(160).flat_map(char::escape_debug).collect()
}

/// Key under which findings count as one: the beginning of the detail without its numbers, which differ from input to
/// input where the defect is the same. A panic's place takes more characters than the complaint of a broken promise.
pub fn kind(class: Class, detail: &str) -> String {
    let length = if class == Class::Broken { 24 } else { 60 };
    detail.chars().filter(|c| !c.is_ascii_digit()).take(length).collect()
}
