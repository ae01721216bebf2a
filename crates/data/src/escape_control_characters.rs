//! Escapes and shortens text from files before it is printed on a terminal.
//!
//! Nothing in a cell, a name or a path may move the cursor, change colours, reverse the reading direction or
//! fill the screen.

use std::fmt;

/// Maximum number of characters of a cell or name that a message shows.
const MAX_TEXT_CHARS: usize = 60;
/// Maximum number of characters of a library's error text that a message shows; it may repeat a whole cell.
const MAX_CAUSE_CHARS: usize = 300;
/// Maximum number of names of a list that a message shows.
const MAX_NAMES: usize = 20;

/// Escapes the control characters of a text (as `\u{1b}`), except line ends and tabs.
///
/// ```
/// use augsim_data::escape_control_characters;
/// // A name that would clear the terminal is escaped.
/// assert_eq!(escape_control_characters("drop\u{1b}[2J"), "drop\\u{1b}[2J");
/// ```
pub fn escape_control_characters(text: &str) -> String {
    escape(text.chars(), |c| matches!(c, '\n' | '\t'))
}

/// Prepares a cell or name for a message: escapes all control characters and cuts after 60 characters.
///
/// A text that was cut is followed by its length in bytes.
pub fn escaped_short(text: &str) -> String {
    cut(text, MAX_TEXT_CHARS)
}

/// Prepares an error text of a library or the system for a message: on one line, escaped, at most 300 characters.
pub fn escaped_cause(cause: &impl fmt::Display) -> String {
    cut(&cause.to_string(), MAX_CAUSE_CHARS)
}

fn cut(text: &str, max_chars: usize) -> String {
    let Some((end, _)) = text.char_indices().nth(max_chars) else { return escape(text.chars(), |_| false) };
    format!("{}… ({} bytes)", escape(text[..end].chars(), |_| false), text.len())
}

/// Prepares a list of names for a message: the first 20, each by [`escaped_short`], and the number of the others.
pub fn escaped_list<T: AsRef<str>>(names: &[T]) -> String {
    let mut texts: Vec<String> =
        names.iter().take(MAX_NAMES).map(|name| escaped_short(name.as_ref())).collect();
    if let Some(more) = names.len().checked_sub(MAX_NAMES).filter(|more| *more > 0) {
        texts.push(format!("and {more} more"));
    }
    texts.join(", ")
}

/// Escapes the control characters of `text` except those that `is_kept` accepts.
fn escape(text: impl Iterator<Item = char>, is_kept: fn(char) -> bool) -> String {
    let mut out = String::new();
    for c in text {
        if is_control(c) && !is_kept(c) {
            out.extend(c.escape_default());
        } else {
            out.push(c);
        }
    }
    out
}

/// Whether `c` is a control character (C0, DEL, C1) or an invisible one that reorders or breaks a line.
fn is_control(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
}

#[cfg(test)]
mod tests {
    //! Contract: control characters are escaped, and ordinary text of any script is unchanged.
    //!
    //! The length is bounded where a message repeats a cell.
    use super::*;

    #[test]
    fn control_characters_are_escaped() {
        assert_eq!(escaped_short("\u{1b}[31mred\u{7}\r\n"), "\\u{1b}[31mred\\u{7}\\r\\n");
        assert_eq!(escaped_short("\u{9b}2J \u{202e}txt"), "\\u{9b}2J \\u{202e}txt");
        assert_eq!(escape_control_characters("a\n\tb\u{1b}c\u{7f}"), "a\n\tb\\u{1b}c\\u{7f}");
        assert_eq!(escaped_short("Fußball µ 重力 e\u{301} \"x\" \\"), "Fußball µ 重力 e\u{301} \"x\" \\");
    }

    #[test]
    fn a_message_shows_at_most_sixty_characters_and_twenty_names() {
        assert_eq!(escaped_short(&"é".repeat(60)), "é".repeat(60));
        assert_eq!(escaped_short(&"é".repeat(100)), format!("{}… (200 bytes)", "é".repeat(60)));
        let names: Vec<String> = (0..25).map(|k| format!("c{k}")).collect();
        let text = escaped_list(&names);
        assert!(text.starts_with("c0, c1, ") && text.ends_with("c19, and 5 more"), "{text}");
        assert_eq!(escaped_list(&names[..2]), "c0, c1");
    }
}
