//! Texts of expressions with names exchanged.

use crate::text::{Lexer, Token};

/// `text` with every name for which `by` has another one exchanged. A text that is no sequence of tokens stays as it is: its
/// parser says what is wrong.
pub(crate) fn substitute<'b>(text: &str, by: impl Fn(&str) -> Option<&'b str>) -> String {
    let mut lexer = Lexer::new(text);
    let mut out = String::with_capacity(text.len());
    let mut done = 0;
    loop {
        match lexer.next() {
            Ok((Token::End, _)) => break,
            Ok((Token::Name(name), span)) => {
                if let Some(other) = by(name) {
                    out.push_str(text.get(done..span.start).unwrap_or(""));
                    out.push_str(other);
                    done = span.end;
                }
            }
            Ok(_) => {}
            Err(_) => return text.to_owned(),
        }
    }
    out.push_str(text.get(done..).unwrap_or(""));
    out
}

#[cfg(test)]
mod tests {
    //! Contract: names are exchanged as a whole, and nothing else is.
    use super::*;

    #[test]
    fn whole_names_are_exchanged() {
        let by = |name: &str| match name {
            "v" => Some("speed_m_s"),
            "z" => Some("abs(x_m)"),
            _ => None,
        };
        assert_eq!(substitute("-c * abs(v) * v_2 + z^2", by), "-c * abs(speed_m_s) * v_2 + abs(x_m)^2");
        assert_eq!(substitute("v ? v", by), "v ? v");
    }
}
