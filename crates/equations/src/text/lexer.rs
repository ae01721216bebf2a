//! Splits the text of an expression into tokens.

use super::Problem;
use std::ops::Range;

/// A token of an expression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Token<'t> {
    Number(f64),
    Name(&'t str),
    /// One of the signs `+ - * / ^ ( ) , < >`, as a byte.
    Sign(u8),
    LessOrEqual,
    GreaterOrEqual,
    End,
}

/// Reads one token after another and skips white space.
pub(crate) struct Lexer<'t> {
    text: &'t str,
    position: usize,
}

impl<'t> Lexer<'t> {
    pub(crate) fn new(text: &'t str) -> Self {
        Self { text, position: 0 }
    }

    /// Reads the next token and its byte range; returns [`Token::End`] at the end and after it.
    pub(crate) fn next(&mut self) -> Result<(Token<'t>, Range<usize>), (Problem, Range<usize>)> {
        let bytes = self.text.as_bytes();
        self.position += count(bytes, self.position, |b| b.is_ascii_whitespace());
        let begin = self.position;
        let Some(&first) = bytes.get(begin) else { return Ok((Token::End, begin..begin)) };
        let token = match first {
            b'0'..=b'9' | b'.' => return self.number(),
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => {
                self.position += count(bytes, begin, |b| b.is_ascii_alphanumeric() || b == b'_');
                Token::Name(&self.text[begin..self.position])
            }
            b'+' | b'-' | b'*' | b'/' | b'^' | b'(' | b')' | b',' => {
                self.position += 1;
                Token::Sign(first)
            }
            b'<' | b'>' => {
                let equal = bytes.get(begin + 1) == Some(&b'=');
                self.position += 1 + usize::from(equal);
                match (first, equal) {
                    (b'<', true) => Token::LessOrEqual,
                    (_, true) => Token::GreaterOrEqual,
                    _ => Token::Sign(first),
                }
            }
            _ => {
                let found = self.text[begin..].chars().next().unwrap_or('?');
                self.position += found.len_utf8();
                let problem = Problem::UnexpectedCharacter { found: found.escape_debug().to_string() };
                return Err((problem, begin..self.position));
            }
        };
        Ok((token, begin..self.position))
    }

    /// Reads a number: `digit { digit } [ "." { digit } ] [ ("e"|"E") ["+"|"-"] digit { digit } ]`.
    ///
    /// Letters or digits directly after it make it malformed, so that `3m` is not read as a product.
    fn number(&mut self) -> Result<(Token<'t>, Range<usize>), (Problem, Range<usize>)> {
        let bytes = self.text.as_bytes();
        let digits = |at: usize| count(bytes, at, |b| b.is_ascii_digit());
        let begin = self.position;
        let mut end = begin + digits(begin);
        if bytes.get(end) == Some(&b'.') {
            end += 1 + digits(end + 1);
        }
        if let Some(b'e' | b'E') = bytes.get(end) {
            let signed = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
            end += 1 + signed + digits(end + 1 + signed);
        }
        let tail = count(bytes, end, |b| b.is_ascii_alphanumeric() || b == b'_' || b == b'.');
        self.position = end + tail;
        let text = &self.text[begin..self.position];
        let value = text.parse::<f64>().ok().filter(|x| x.is_finite());
        match value {
            Some(value) if tail == 0 && text.as_bytes()[0] != b'.' => {
                Ok((Token::Number(value), begin..self.position))
            }
            _ => Err((Problem::MalformedNumber { text: shortened(text) }, begin..self.position)),
        }
    }
}

/// Number of consecutive bytes from `from` on for which `is` holds.
fn count(bytes: &[u8], from: usize, is: impl Fn(u8) -> bool) -> usize {
    bytes.get(from..).unwrap_or(&[]).iter().take_while(|b| is(**b)).count()
}

/// Shortens a text to its first 40 characters, so that no message repeats a long line.
pub(super) fn shortened(text: &str) -> String {
    match text.char_indices().nth(40) {
        Some((cut, _)) => format!("{}…", &text[..cut]),
        None => text.to_owned(),
    }
}
