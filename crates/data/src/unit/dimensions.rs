//! Dimensions of quantities: exponents of the SI base units, for checking sums, rates and arguments.

use std::fmt;
use std::ops::{Div, Mul};

/// SI base units in the order in which [`Dimensions`] holds and prints their exponents.
///
/// The radian is a pure number. The candela is left out, because no sensor that this crate reads measures
/// light.
const BASES: [&str; 6] = ["kg", "m", "s", "A", "K", "mol"];

/// Denominator of the stored exponents: with twelfths, square, cube and fourth roots are exact.
pub(super) const TWELFTHS: i32 = 12;

/// Physical dimensions: exponents of kg, m, s, A, K and mol; all are 0 for angles and pure numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Dimensions {
    twelfths: [i32; 6],
}

impl Dimensions {
    /// Dimensions of a pure number: all exponents are 0.
    pub const NONE: Dimensions = Dimensions { twelfths: [0; 6] };
    /// Dimensions of a time: exponent 1 of the second.
    pub const TIME: Dimensions = Dimensions::from_exponents([0, 0, 1, 0, 0, 0]);

    /// Creates dimensions from whole exponents of kg, m, s, A, K and mol.
    pub(super) const fn from_exponents(exponents: [i32; 6]) -> Dimensions {
        let mut twelfths = [0; 6];
        let mut base = 0;
        while base < twelfths.len() {
            twelfths[base] = exponents[base] * TWELFTHS;
            base += 1;
        }
        Dimensions { twelfths }
    }

    /// Whether these are the dimensions of a pure number (an angle is one).
    pub fn is_pure(self) -> bool {
        self == Dimensions::NONE
    }

    /// Exponents of kg, m, s, A, K and mol, in this order.
    pub fn exponents(self) -> [f64; 6] {
        self.twelfths.map(|t| f64::from(t) / f64::from(TWELFTHS))
    }

    /// Base units with non-zero exponents: pairs (symbol, exponent in twelfths).
    pub(super) fn factors(self) -> impl Iterator<Item = (&'static str, i32)> {
        BASES.into_iter().zip(self.twelfths).filter(|(_, t)| *t != 0)
    }

    /// Dimensions of a quantity raised to the power `exponent`.
    ///
    /// `None` where an exponent would not be a multiple of a twelfth or would exceed 10,000: no physical
    /// quantity has such dimensions, and sums of it cannot be checked.
    pub fn power(self, exponent: f64) -> Option<Dimensions> {
        let mut twelfths = [0; 6];
        for (raised, base) in twelfths.iter_mut().zip(self.twelfths) {
            *raised = whole_twelfths(f64::from(base) / f64::from(TWELFTHS) * exponent)?;
        }
        Some(Dimensions { twelfths })
    }

    fn combine(self, other: Dimensions, operation: fn(i32, i32) -> i32) -> Dimensions {
        let exponent = |base: usize| operation(self.twelfths[base], other.twelfths[base]);
        Dimensions { twelfths: std::array::from_fn(exponent) }
    }
}

/// Converts an exponent to twelfths; `None` where it is no multiple of 1/12 up to rounding, or too large.
pub(super) fn whole_twelfths(exponent: f64) -> Option<i32> {
    let twelfths = exponent * f64::from(TWELFTHS);
    let whole = twelfths.round();
    // A written exponent such as 0.333 is not a third: the tolerance allows only for rounding.
    let exact = (twelfths - whole).abs() <= 1e-9 * whole.abs().max(1.0);
    (exact && whole.abs() <= 1e4 * f64::from(TWELFTHS)).then_some(whole as i32)
}

impl Mul for Dimensions {
    type Output = Dimensions;

    fn mul(self, other: Dimensions) -> Dimensions {
        self.combine(other, i32::saturating_add)
    }
}

impl Div for Dimensions {
    type Output = Dimensions;

    fn div(self, other: Dimensions) -> Dimensions {
        self.combine(other, i32::saturating_sub)
    }
}

impl fmt::Display for Dimensions {
    /// Writes the dimensions in base units, such as `kg m/s^2`; `1` for a pure number.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let factors: Vec<(&str, i32)> = BASES.into_iter().zip(self.twelfths).collect();
        let text = quotient(&factors);
        f.pad(if text.is_empty() { "1" } else { &text })
    }
}

/// Text of a unit from (symbol, exponent in twelfths) pairs, such as `rad/(V s^2)`; empty without pairs.
pub(super) fn quotient(factors: &[(&str, i32)]) -> String {
    let side = |sign: i32| -> Vec<String> {
        let with_sign = factors.iter().filter(|(_, t)| t.signum() == sign);
        with_sign.map(|&(symbol, t)| power_text(symbol, t.abs())).collect()
    };
    let (above, below) = (side(1), side(-1));
    let numerator = if above.is_empty() && !below.is_empty() { "1".to_owned() } else { above.join(" ") };
    match &below[..] {
        [] => numerator,
        [one] => format!("{numerator}/{one}"),
        several => format!("{numerator}/({})", several.join(" ")),
    }
}

fn power_text(symbol: &str, twelfths: i32) -> String {
    match twelfths {
        TWELFTHS => symbol.to_owned(),
        _ => format!("{symbol}^{}", f64::from(twelfths) / f64::from(TWELFTHS)),
    }
}

#[cfg(test)]
mod tests {
    //! Contract: exponents add, subtract and multiply as those of quantities do, and roots are exact.
    //!
    //! A power with exponents that are not multiples of 1/12 is `None`.
    use super::*;

    const FORCE: Dimensions = Dimensions::from_exponents([1, 1, -2, 0, 0, 0]);
    const LENGTH: Dimensions = Dimensions::from_exponents([0, 1, 0, 0, 0, 0]);

    #[test]
    fn products_quotients_and_powers_follow_the_quantities() {
        let energy = FORCE * LENGTH;
        assert_eq!(energy.to_string(), "kg m^2/s^2");
        assert_eq!((energy / LENGTH), FORCE);
        assert!((FORCE / FORCE).is_pure());
        let speed = LENGTH / Dimensions::TIME;
        assert_eq!(speed.power(2.0).unwrap() * Dimensions::from_exponents([1, 0, 0, 0, 0, 0]), energy);
        assert_eq!(LENGTH.power(0.5).unwrap().power(2.0), Some(LENGTH));
        assert_eq!(LENGTH.power(1.0 / 3.0).unwrap().power(3.0), Some(LENGTH));
        assert_eq!(speed.power(-0.5).unwrap().to_string(), "s^0.5/m^0.5");
        assert_eq!(Dimensions::NONE.to_string(), "1");
    }

    #[test]
    fn a_power_with_other_fractions_than_twelfths_is_none() {
        for exponent in [0.3, 1.0 / 7.0, f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(LENGTH.power(exponent), None, "{exponent}");
        }
        assert_eq!(Dimensions::NONE.power(0.3), Some(Dimensions::NONE));
    }
}
