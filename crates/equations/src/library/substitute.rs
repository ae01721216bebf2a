//! Replaces names in the text of an expression.

use crate::text::{Lexer, Token};

/// Replaces every name in an expression for which `replacement` returns another text.
///
/// A text that is not a sequence of tokens stays as it is; the parser reports what is wrong with it.
pub(crate) fn substitute<'b>(text: &str, replacement: impl Fn(&str) -> Option<&'b str>) -> String {
    let mut lexer = Lexer::new(text);
    let mut out = String::with_capacity(text.len());
    let mut copied_to = 0;
    loop {
        match lexer.next() {
            Ok((Token::End, _)) => break,
            Ok((Token::Name(name), span)) => {
                if let Some(other) = replacement(name) {
                    out.push_str(text.get(copied_to..span.start).unwrap_or(""));
                    out.push_str(other);
                    copied_to = span.end;
                }
            }
            Ok(_) => {}
            Err(_) => return text.to_owned(),
        }
    }
    out.push_str(text.get(copied_to..).unwrap_or(""));
    out
}

#[cfg(test)]
mod tests {
    //! Contract: only whole names are replaced.
    use super::*;

    #[test]
    fn whole_names_are_replaced() {
        let replacement = |name: &str| match name {
            "v" => Some("speed_m_s"),
            "z" => Some("abs(x_m)"),
            _ => None,
        };
        assert_eq!(
            substitute("-c * abs(v) * v_2 + z^2", replacement),
            "-c * abs(speed_m_s) * v_2 + abs(x_m)^2"
        );
        assert_eq!(substitute("v ? v", replacement), "v ? v");
    }
}
