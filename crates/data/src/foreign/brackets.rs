//! Removes the brackets of lists that programs print: `{0.00, 0.40},` or `[0.00, 0.40]`.

/// Number of non-empty lines at the start of a file that are tested for being lists in brackets.
const CHECKED_LINES: usize = 50;

/// Text of the numbers in a line such as `{…},`, `[…]`, `{{…},` or `(…);`; `None` for other lines.
fn inner(line: &str) -> Option<&str> {
    const OPEN: [char; 3] = ['{', '[', '('];
    const CLOSE: [char; 3] = ['}', ']', ')'];
    let line = line.trim();
    if !line.starts_with(OPEN) || !line.trim_end_matches([',', ';']).ends_with(CLOSE) {
        return None;
    }
    let numbers = line.trim_start_matches(OPEN).trim_end_matches([',', ';', '}', ']', ')']).trim();
    numbers.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.')).then_some(numbers)
}

/// Removes the brackets from a file where most lines are lists of numbers; other files are unchanged.
///
/// Other lines, such as `double log[][2] = {`, become empty, so that line numbers remain those of the file.
pub(super) fn without_brackets(bytes: Vec<u8>) -> Vec<u8> {
    let Ok(text) = std::str::from_utf8(&bytes) else { return bytes };
    // A list of lists on one line has no line ends to split at.
    let text = text.replace("},{", "},\n{").replace("}, {", "},\n{");
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).take(CHECKED_LINES).collect();
    if 2 * lines.iter().filter(|line| inner(line).is_some()).count() <= lines.len() {
        return bytes;
    }
    let rows = text.lines().map(|line| format!("{}\n", inner(line).unwrap_or_default()));
    rows.collect::<String>().into_bytes()
}

#[cfg(test)]
mod tests {
    //! Contract: printed lists become rows of numbers; other text is unchanged.
    use super::*;

    fn shown(text: &str) -> String {
        String::from_utf8(without_brackets(text.into())).expect("text")
    }

    #[test]
    fn printed_lists_become_rows() {
        assert_eq!(shown("{0.0, 1},\n{0.1, -2},\n"), "0.0, 1\n0.1, -2\n");
        assert_eq!(shown("[0.0 1]\n[0.1 2]\n"), "0.0 1\n0.1 2\n");
        assert_eq!(shown("double a[][2] = {\n{0, 1},\n{2, 3},\n{4, 5}\n};\n"), "\n0, 1\n2, 3\n4, 5\n\n");
        assert_eq!(shown("{{0, 1}, {2, 3}, {4, 5}}"), "0, 1\n2, 3\n4, 5\n");
    }

    #[test]
    fn other_text_is_unchanged() {
        for text in ["t,x\n0,1\n", "t [s],x [m]\n0,1\n1,2\n", "(s),(m)\n0,1\n0,2\n", ""] {
            assert_eq!(shown(text), text);
        }
    }
}
