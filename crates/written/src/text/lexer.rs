//! Cuts the text of an expression into tokens.

use super::Problem;
use std::ops::Range;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Token<'t> {
    Number(f64),
    Name(&'t str),
    /// One of `+ - * / ^ ( ) , < >`.
    Sign(u8),
    LessOrEqual,
    GreaterOrEqual,
    End,
}

/// Reads one token after another; blanks between them have no meaning.
pub(crate) struct Lexer<'t> {
    text: &'t str,
    at: usize,
}

impl<'t> Lexer<'t> {
    pub(crate) fn new(text: &'t str) -> Self {
        Self { text, at: 0 }
    }

    /// The next token and its bytes; [`Token::End`] from the end on.
    pub(crate) fn next(&mut self) -> Result<(Token<'t>, Range<usize>), (Problem, Range<usize>)> {
        let bytes = self.text.as_bytes();
        self.at += count(bytes, self.at, |b| b.is_ascii_whitespace());
        let begin = self.at;
        let Some(&first) = bytes.get(begin) else { return Ok((Token::End, begin..begin)) };
        let token = match first {
            b'0'..=b'9' | b'.' => return self.number(),
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => {
                self.at += count(bytes, begin, |b| b.is_ascii_alphanumeric() || b == b'_');
                Token::Name(&self.text[begin..self.at])
            }
            b'+' | b'-' | b'*' | b'/' | b'^' | b'(' | b')' | b',' => {
                self.at += 1;
                Token::Sign(first)
            }
            b'<' | b'>' => {
                let equal = bytes.get(begin + 1) == Some(&b'=');
                self.at += 1 + usize::from(equal);
                match (first, equal) {
                    (b'<', true) => Token::LessOrEqual,
                    (_, true) => Token::GreaterOrEqual,
                    _ => Token::Sign(first),
                }
            }
            _ => {
                let found = self.text[begin..].chars().next().unwrap_or('?');
                self.at += found.len_utf8();
                let problem = Problem::UnexpectedCharacter { found: found.escape_debug().to_string() };
                return Err((problem, begin..self.at));
            }
        };
        Ok((token, begin..self.at))
    }

    /// `digit { digit } [ "." { digit } ] [ ("e"|"E") ["+"|"-"] digit { digit } ]`, and nothing of a name behind it.
    fn number(&mut self) -> Result<(Token<'t>, Range<usize>), (Problem, Range<usize>)> {
        let bytes = self.text.as_bytes();
        let digits = |at: usize| count(bytes, at, |b| b.is_ascii_digit());
        let begin = self.at;
        let mut end = begin + digits(begin);
        if bytes.get(end) == Some(&b'.') {
            end += 1 + digits(end + 1);
        }
        if let Some(b'e' | b'E') = bytes.get(end) {
            let signed = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
            end += 1 + signed + digits(end + 1 + signed);
        }
        let tail = count(bytes, end, |b| b.is_ascii_alphanumeric() || b == b'_' || b == b'.');
        self.at = end + tail;
        let text = &self.text[begin..self.at];
        let value = text.parse::<f64>().ok().filter(|x| x.is_finite());
        match value {
            Some(value) if tail == 0 && text.as_bytes()[0] != b'.' => {
                Ok((Token::Number(value), begin..self.at))
            }
            _ => Err((Problem::MalformedNumber { text: shortened(text) }, begin..self.at)),
        }
    }
}

fn count(bytes: &[u8], from: usize, is: impl Fn(u8) -> bool) -> usize {
    bytes.get(from..).unwrap_or(&[]).iter().take_while(|b| is(**b)).count()
}

/// The first 40 characters, so that no message repeats a long line.
pub(super) fn shortened(text: &str) -> String {
    match text.char_indices().nth(40) {
        Some((cut, _)) => format!("{}…", &text[..cut]),
        None => text.to_owned(),
    }
}
