//! Text from files made fit for a terminal: nothing in a cell, a name or a path may move the cursor, change
//! colours, reverse the reading direction or fill the screen.

use std::fmt;

/// Most characters of a cell or name that a message repeats.
const LONGEST: usize = 60;
/// Most characters of what a parser or the system said; `invalid type: string "…"` repeats the whole string.
const LONGEST_CAUSE: usize = 300;
/// Most names of a list that a message repeats.
const MOST_NAMES: usize = 20;

/// The whole text with everything that a terminal could obey written out (`\u{1b}`); line ends and tabs stay.
///
/// ```
/// use augsim_data::printable;
/// // A name that would clear the terminal is shown as text.
/// assert_eq!(printable("drop\u{1b}[2J"), "drop\\u{1b}[2J");
/// ```
pub fn printable(text: &str) -> String {
    escaped(text.chars(), |c| matches!(c, '\n' | '\t'))
}

/// One cell or name for a message: written out like [`printable`], line ends and tabs too, and cut after 60
/// characters with its length in bytes.
pub fn shown(text: &str) -> String {
    cut(text, LONGEST)
}

/// The words of a parser or of the system on one line, written out like a cell and cut after 300 characters.
pub fn shown_cause(cause: &impl fmt::Display) -> String {
    cut(&cause.to_string(), LONGEST_CAUSE)
}

fn cut(text: &str, longest: usize) -> String {
    let mut rest = text.char_indices();
    let Some((end, _)) = rest.nth(longest) else { return escaped(text.chars(), |_| false) };
    format!("{}… ({} bytes)", escaped(text[..end].chars(), |_| false), text.len())
}

/// A list of names for a message: each one [`shown`], the first 20 and the number of the others.
pub fn shown_list<T: AsRef<str>>(names: &[T]) -> String {
    let mut texts: Vec<String> = names.iter().take(MOST_NAMES).map(|name| shown(name.as_ref())).collect();
    if let Some(more) = names.len().checked_sub(MOST_NAMES).filter(|more| *more > 0) {
        texts.push(format!("and {more} more"));
    }
    texts.join(", ")
}

fn escaped(text: impl Iterator<Item = char>, stays: fn(char) -> bool) -> String {
    let mut out = String::new();
    for c in text {
        if obeyed(c) && !stays(c) {
            out.extend(c.escape_default());
        } else {
            out.push(c);
        }
    }
    out
}

/// Control characters (C0, DEL, C1), and the invisible ones that reorder or break a line.
fn obeyed(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
}

#[cfg(test)]
mod tests {
    //! Contract: no character that a terminal obeys comes through, ordinary text of any script does, and length
    //! is bounded where a message repeats a cell.
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_written_out() {
        assert_eq!(shown("\u{1b}[31mred\u{7}\r\n"), "\\u{1b}[31mred\\u{7}\\r\\n");
        assert_eq!(shown("\u{9b}2J \u{202e}txt"), "\\u{9b}2J \\u{202e}txt");
        assert_eq!(printable("a\n\tb\u{1b}c\u{7f}"), "a\n\tb\\u{1b}c\\u{7f}");
        assert_eq!(shown("Fußball µ 重力 e\u{301} \"x\" \\"), "Fußball µ 重力 e\u{301} \"x\" \\");
    }

    #[test]
    fn a_message_repeats_sixty_characters_and_twenty_names() {
        assert_eq!(shown(&"é".repeat(60)), "é".repeat(60));
        assert_eq!(shown(&"é".repeat(100)), format!("{}… (200 bytes)", "é".repeat(60)));
        let names: Vec<String> = (0..25).map(|k| format!("c{k}")).collect();
        let text = shown_list(&names);
        assert!(text.starts_with("c0, c1, ") && text.ends_with("c19, and 5 more"), "{text}");
        assert_eq!(shown_list(&names[..2]), "c0, c1");
    }
}
