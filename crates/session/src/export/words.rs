//! Escapes texts of a model for programs and documents, so that nothing in them can become code.

use super::Language;

/// Escapes a text for a comment: characters that might end the comment or the line become underscores.
pub(super) fn comment(text: &str) -> String {
    let is_harmless = |c: &char| c.is_alphanumeric() || " _-.,:;()+=<>'^".contains(*c);
    text.chars().map(|c| if is_harmless(&c) { c } else { '_' }).collect()
}

/// Writes a text as a string literal in Python or C.
///
/// Everything but letters, digits and a few signs is escaped: in C by octal numbers of three digits, because
/// hexadecimal ones would take the digits that follow as their own.
pub(super) fn literal(text: &str, language: Language) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        if c.is_ascii_alphanumeric() || " _-.,:;()+=".contains(c) {
            quoted.push(c);
        } else if language == Language::C {
            let mut bytes = [0; 4];
            let bytes = c.encode_utf8(&mut bytes).bytes();
            quoted.extend(bytes.map(|byte| format!("\\{byte:03o}")));
        } else {
            quoted += &format!("\\U{:08x}", u32::from(c));
        }
    }
    quoted + "\""
}

/// Escapes a text for a LaTeX document: characters with a meaning in LaTeX are printed as they are.
pub(super) fn latex(text: &str) -> String {
    let mut safe = String::new();
    for c in text.chars() {
        match c {
            '\\' => safe += "\\textbackslash{}",
            '^' => safe += "\\textasciicircum{}",
            '~' => safe += "\\textasciitilde{}",
            '{' | '}' | '_' | '#' | '$' | '%' | '&' => safe.extend(['\\', c]),
            '<' => safe += "\\textless{}",
            '>' => safe += "\\textgreater{}",
            '|' => safe += "\\textbar{}",
            '"' => safe += "\\symbol{34}",
            _ if c.is_control() => safe.push(' '),
            _ => safe.push(c),
        }
    }
    safe
}

/// Fills the places `@MARK@` of a template with their values; inserted values are not searched for marks.
pub(super) fn fill(template: &str, values: &[(&str, String)]) -> String {
    let mut text = String::new();
    for (index, part) in template.split('@').enumerate() {
        match values.iter().find(|(mark, _)| index % 2 == 1 && *mark == part) {
            Some((_, value)) => text += value,
            None => text += part,
        }
    }
    text
}

/// Replaces the prefix `law_` of the names of a C program, outside of its string literals, by that of `name`.
pub(super) fn with_prefix(program: &str, name: &str) -> String {
    let upper = name.to_ascii_uppercase();
    let (mut text, mut rest) = (String::with_capacity(program.len()), program);
    let (mut is_string, mut is_word) = (false, false);
    while let Some(c) = rest.chars().next() {
        let starts_name = !is_string && !is_word;
        let (written, length) = match rest.get(..4) {
            Some("law_") if starts_name => (name, 3),
            Some("LAW_") if starts_name => (&*upper, 3),
            _ if is_string && c == '\\' && rest.is_char_boundary(2) => (&rest[..2], 2),
            _ => (&rest[..c.len_utf8()], c.len_utf8()),
        };
        is_string ^= c == '"';
        is_word = c.is_ascii_alphanumeric() || c == '_';
        text += written;
        rest = &rest[length..];
    }
    text
}

/// Makes a C identifier from the name of a file: letters and digits, with a letter first.
pub(super) fn c_identifier(name: &str) -> String {
    let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    match plain.chars().next() {
        Some(first) if first.is_ascii_alphabetic() => plain,
        _ => format!("model_{plain}"),
    }
}

/// Makes unique program identifiers from names: letters and digits after a prefix used for nothing else.
pub(super) fn identifiers<'n>(prefix: &str, names: impl Iterator<Item = &'n str>) -> Vec<String> {
    let mut list: Vec<String> = Vec::new();
    for name in names {
        let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let mut candidate = format!("{prefix}{plain}");
        let mut number = 2;
        while list.contains(&candidate) {
            candidate = format!("{prefix}{plain}_{number}");
            number += 1;
        }
        list.push(candidate);
    }
    list
}

#[cfg(test)]
mod tests {
    //! Contract: no text can end its comment, string or paragraph, and names stay different.
    use super::*;

    const EVIL: &str = "x\"\"\" */ ??/\n\\immediate\\write18{id} @RATES@ \u{2028} % $";

    #[test]
    fn texts_stay_where_they_are() {
        let found = comment(EVIL);
        assert!(!found.contains(['"', '*', '/', '\n', '\\', '@', '\u{2028}']), "{found}");
        for language in [Language::C, Language::Python] {
            let found = literal(EVIL, language);
            assert!(
                found.is_ascii() && !found[1..found.len() - 1].contains(['"', '\n', '@', '?']),
                "{found}"
            );
        }
        assert_eq!(literal("a\"1", Language::C), "\"a\\0421\"");
        let found = latex(EVIL);
        assert!(found.contains("\\textbackslash{}write18\\{id\\}") && !found.contains('\n'), "{found}");
    }

    #[test]
    fn identifiers_are_different() {
        let names = identifiers("p_", ["a.b", "a_b", "a_b_2", "a-b"].into_iter());
        assert_eq!(names, ["p_a_b", "p_a_b_2", "p_a_b_2_2", "p_a_b_3"]);
    }

    #[test]
    fn names_get_a_prefix_outside_of_strings() {
        let program = "law_step(p->p_law_x, \"law_\\\" law_x\", LAW_N); /* law_step */ xlaw_y";
        let expected = "arm_step(p->p_law_x, \"law_\\\" law_x\", ARM_N); /* arm_step */ xlaw_y";
        assert_eq!(with_prefix(program, "arm"), expected);
        assert_eq!([c_identifier("my arm-2"), c_identifier("2")], ["my_arm_2", "model_2"]);
    }

    #[test]
    fn values_are_not_filled_again() {
        let filled = fill("@A@ and @B@", &[("A", "@B@".into()), ("B", "b".into())]);
        assert_eq!(filled, "@B@ and b");
    }
}
