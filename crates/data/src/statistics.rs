//! Median of values, and numbers as text for messages.

/// Median (the lower one of an even number), which sorts the values; `None` without values.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len().checked_sub(1)? / 2).copied()
}

/// Formats a number with five significant digits, with an exponent only below 1e-4 and from 1e6.
pub fn digits(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return value.to_string();
    }
    let exponent = value.abs().log10().floor();
    if !(-4.0..6.0).contains(&exponent) {
        let text = format!("{value:.4e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}e{exponent}", mantissa.trim_end_matches('0').trim_end_matches('.'));
    }
    let text = format!("{value:.*}", (4.0 - exponent).max(0.0) as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// Minimum and maximum number of significant digits of the largest of an estimate and its interval limits.
const ESTIMATE_DIGITS: [i32; 2] = [3, 12];
/// Mantissa of an interval's half-width from which one digit of it is printed instead of two.
///
/// A half-width of 0.0048 gives two digits, one of 0.005 one.
const ONE_DIGIT_MANTISSA: f64 = 4.95;

/// Formats an estimate and its interval limits with the digits that the interval supports.
///
/// The last printed digit is the second one of the interval's half-width where that begins with 1 to 4, and the first
/// one otherwise. No number that is not zero is printed as zero. Without a finite interval each number has five
/// significant digits.
pub fn estimate_digits(value: f64, [low, high]: [f64; 2]) -> [String; 3] {
    let half = 0.5 * (high - low).abs();
    let size = value.abs().max(low.abs()).max(high.abs());
    if !(half > 0.0 && half.is_finite() && value.is_finite()) {
        return [value, low, high].map(digits);
    }
    let exponent = |x: f64| x.log10().floor() as i32;
    let mantissa = half / 10f64.powi(exponent(half));
    let half_digits = if mantissa < ONE_DIGIT_MANTISSA { 1 } else { 0 };
    let [least, most] = ESTIMATE_DIGITS.map(|n| exponent(size) - (n - 1));
    let last = (exponent(half) - half_digits).min(least).max(most);
    [value, low, high].map(|x| {
        // A limit that is zero to these digits is printed as such; a value has at least three digits.
        if x == value && x != 0.0 && exponent(x.abs()) - 2 < last {
            with_significant(x, 3)
        } else {
            rounded(x, last, exponent(size))
        }
    })
}

/// Formats a number rounded at the decimal place 10^`last`.
///
/// It has an exponent where the decimal exponent `largest` of the largest number is below -4 or above 5.
fn rounded(value: f64, last: i32, largest: i32) -> String {
    if value == 0.0 || value.abs() < 0.5 * 10f64.powi(last) {
        return "0".to_owned();
    }
    if (-4..6).contains(&largest) {
        return format!("{value:.*}", usize::try_from(-last).unwrap_or(0));
    }
    let own = value.abs().log10().floor() as i32;
    format!("{value:.*e}", usize::try_from(own - last).unwrap_or(0))
}

/// Formats a number with `count` significant digits, with an exponent only below 1e-4 and from 1e6.
pub fn with_significant(value: f64, count: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { value.to_string() };
    }
    let exponent = value.abs().log10().floor() as i32;
    rounded(value, exponent - (count - 1), exponent)
}

#[cfg(test)]
mod tests {
    //! Contract: an estimate has the digits that its interval supports, and is never printed as zero.
    use super::*;

    fn text(value: f64, ends: [f64; 2]) -> String {
        let [value, low, high] = estimate_digits(value, ends);
        format!("{value} [{low}, {high}]")
    }

    #[test]
    fn digits_follow_the_interval_at_every_size() {
        assert_eq!(text(7.651e-12, [7.643e-12, 7.659e-12]), "7.651e-12 [7.643e-12, 7.659e-12]");
        assert_eq!(text(3.203e-7, [3.198e-7, 3.208e-7]), "3.203e-7 [3.198e-7, 3.208e-7]");
        assert_eq!(text(1.114e-4, [1.107e-4, 1.121e-4]), "0.0001114 [0.0001107, 0.0001121]");
        assert_eq!(text(60.08, [59.62, 60.53]), "60.08 [59.62, 60.53]");
        assert_eq!(text(2.0e11, [1.98e11, 2.02e11]), "2.000e11 [1.980e11, 2.020e11]");
        assert_eq!(text(-4.0, [-5.5, -2.5]), "-4.0 [-5.5, -2.5]".replace(".0", ".00").replace(".5", ".50"));
    }

    #[test]
    fn the_half_width_has_one_digit_from_five_on() {
        assert_eq!(text(1.0, [0.9955, 1.0045]), "1.0000 [0.9955, 1.0045]");
        assert_eq!(text(1.0, [0.991, 1.009]), "1.000 [0.991, 1.009]");
    }

    #[test]
    fn no_value_is_printed_as_zero() {
        assert_eq!(text(1.5e-9, [-5000.0, 5000.0]), "1.50e-9 [-5000, 5000]");
        assert_eq!(text(45.98, [-2399.6, 2491.6]), "46.0 [-2400, 2492]");
        assert_eq!(text(1.3e-12, [1.3e-12, 1.3e-12]), "1.3e-12 [1.3e-12, 1.3e-12]");
        assert_eq!(text(0.0, [-1e-6, 1e-6]), "0 [-1.00e-6, 1.00e-6]");
    }
}
