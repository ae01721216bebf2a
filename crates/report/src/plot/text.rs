//! Text in figures: estimated widths, wrapping, and formatting of numbers.

/// Upper estimate of the width of `text` at font size `size`, px.
///
/// The font is not known when a figure is drawn, so the widths are those of the widest common system font
/// (DejaVu Sans), by class of character.
pub(crate) fn width(text: &str, size: f64) -> f64 {
    let em: f64 = text
        .chars()
        .map(|c| match c {
            'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | ';' | '\'' | '|' | ' ' | '·' => 0.33,
            'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '-' | '/' => 0.42,
            'm' | 'w' | 'M' | 'W' | '−' | '+' | '=' | '%' => 0.92,
            '\u{202f}' => 0.2,
            '⁰' | '¹' | '²' | '³' | '⁴' | '⁵' | '⁶' | '⁷' | '⁸' | '⁹' | '⁻' => 0.42,
            c if c.is_ascii_uppercase() => 0.7,
            c if c.is_ascii() => 0.615,
            c if c.is_alphabetic() && (c as u32) < 0x2e80 => 0.66,
            _ => 1.0,
        })
        .sum();
    em * size
}

/// Breaks `text` into at most `max_lines` lines of `max_width` px; the last line is cut with "…" if needed.
pub(crate) fn wrap(text: &str, size: f64, max_width: f64, max_lines: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        let candidate = if line.is_empty() { word.to_owned() } else { format!("{line} {word}") };
        if width(&candidate, size) <= max_width || line.is_empty() {
            line = candidate;
        } else {
            lines.push(std::mem::replace(&mut line, word.to_owned()));
        }
    }
    if !line.is_empty() {
        lines.push(line);
    }
    if lines.len() > max_lines {
        let last = lines.split_off(max_lines.max(1) - 1).join(" ");
        lines.push(last);
    }
    for line in &mut lines {
        *line = shorten(line, size, max_width);
    }
    lines
}

/// Cuts `text` with "…" if it is wider than `max_width` px.
pub(crate) fn shorten(text: &str, size: f64, max_width: f64) -> String {
    if width(text, size) <= max_width {
        return text.to_owned();
    }
    let mut cut = String::new();
    for c in text.chars() {
        cut.push(c);
        if width(&cut, size) + size > max_width {
            cut.pop();
            break;
        }
    }
    format!("{}…", cut.trim_end())
}

/// Text of a pixel coordinate with at most one decimal; a tenth of a pixel is not visible.
pub(crate) fn coordinate(value: f64) -> String {
    let rounded = (value * 10.0).round() / 10.0;
    if rounded == 0.0 || !rounded.is_finite() {
        return "0".to_owned();
    }
    format!("{rounded}")
}

/// Text of a number with fixed decimals, a true minus sign, and thin spaces from 10 000.
pub(crate) fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let digits = format!("{:.decimals$}", value.abs());
    let negative = value < 0.0 && digits.bytes().any(|b| (b'1'..=b'9').contains(&b));
    let (whole, fraction) = digits.split_once('.').unwrap_or((&digits, ""));
    let mut out = String::new();
    if negative {
        out.push('−');
    }
    for (i, c) in whole.chars().enumerate() {
        if i > 0 && whole.len() > 4 && (whole.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(c);
    }
    if !fraction.is_empty() {
        out.push('.');
        out.push_str(fraction);
    }
    out
}

/// Converts the text of a number, such as `-1.5e-7`, to a true minus sign, thin spaces, a power of ten.
pub(crate) fn typographic(number: &str) -> String {
    let (mantissa, exponent) = number.split_once('e').map_or((number, None), |(m, e)| (m, Some(e)));
    let decimals = mantissa.split_once('.').map_or(0, |(_, fraction)| fraction.len());
    let head = mantissa.parse().map_or_else(|_| number.to_owned(), |value| fixed(value, decimals));
    match exponent.and_then(|e| e.parse().ok()) {
        Some(exponent) => format!("{head}·10{}", superscript(exponent)),
        None => head,
    }
}

/// Text of a number with `digits` significant digits; as a power of ten outside 10⁻³ to 10⁶.
#[must_use]
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = exponent_of(value, digits);
    if !(-3..6).contains(&exponent) {
        let mantissa = value / 10f64.powi(exponent);
        let mantissa = if mantissa.is_finite() { mantissa } else { value.signum() };
        let head = fixed(mantissa, digits.saturating_sub(1));
        return format!("{head}·10{}", superscript(exponent));
    }
    fixed(value, decimals_for(value, digits))
}

/// Number of decimals that show `value` with `digits` significant digits.
pub(crate) fn decimals_for(value: f64, digits: usize) -> usize {
    if value == 0.0 || !value.is_finite() {
        return digits.saturating_sub(1);
    }
    let exponent = exponent_of(value, digits);
    usize::try_from(i32::try_from(digits).unwrap_or(3) - 1 - exponent).unwrap_or(0)
}

/// Decimal exponent of a value rounded to `digits` digits, e.g. 1 for 9.996 and three digits.
fn exponent_of(value: f64, digits: usize) -> i32 {
    let printed = format!("{:.*e}", digits.saturating_sub(1), value.abs());
    printed.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0)
}

/// Copy of `word` with a capital first letter.
#[must_use]
pub fn capitalised(word: &str) -> String {
    let mut chars = word.chars();
    chars.next().map_or_else(String::new, |first| first.to_uppercase().chain(chars).collect())
}

/// Text of an integer in superscript digits.
pub(crate) fn superscript(value: i32) -> String {
    value
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '4' => '⁴',
            '5' => '⁵',
            '6' => '⁶',
            '7' => '⁷',
            '8' => '⁸',
            '9' => '⁹',
            _ => '⁰',
        })
        .collect()
}

#[cfg(test)]
mod tests {
    //! Contract: numbers have typographic signs and spaces, and are never printed as NaN, "-0" or "1e3".
    use super::*;

    #[test]
    fn numbers_print_with_true_minus_and_thin_spaces() {
        assert_eq!(fixed(-1234.5, 1), "−1234.5");
        assert_eq!(fixed(12345.0, 0), "12\u{202f}345");
        assert_eq!(fixed(-0.0001, 2), "0.00");
        assert_eq!(fixed(f64::NAN, 2), "–");
    }

    #[test]
    fn significant_digits_are_right_after_rounding_up() {
        assert_eq!(significant(9.996, 3), "10.0");
        assert_eq!(significant(0.016_04, 3), "0.0160");
        assert_eq!(significant(1.5e-7, 2), "1.5·10⁻⁷");
        assert_eq!(significant(0.0, 3), "0");
        assert_eq!(significant(f64::INFINITY, 3), "–");
    }

    #[test]
    fn coordinates_have_one_decimal_and_no_negative_zero() {
        assert_eq!(coordinate(-0.01), "0");
        assert_eq!(coordinate(12.349), "12.3");
        assert_eq!(coordinate(f64::NAN), "0");
    }

    #[test]
    fn long_text_wraps_and_then_ends_in_an_ellipsis() {
        let lines = wrap("one two three four five six seven eight", 12.0, 80.0, 2);
        assert_eq!(lines.len(), 2);
        assert!(lines[1].ends_with('…'));
        assert!(lines.iter().all(|line| width(line, 12.0) <= 80.0));
    }
}
