//! Dimensions: exponents of the SI base units, for checking sums, rates and arguments.

use std::fmt;
use std::ops::{Div, Mul};

/// Base units in the order in which [`Dimensions`] holds and prints them. The radian is a pure number, the
/// candela is left out: no sensor that this crate reads measures light.
const BASES: [&str; 6] = ["kg", "m", "s", "A", "K", "mol"];

/// Exponents are held in twelfths, so that square, cube and fourth roots are exact.
pub(super) const TWELFTHS: i32 = 12;

/// Exponents of kg, m, s, A, K and mol. Angles and pure numbers have none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Dimensions {
    twelfths: [i32; 6],
}

impl Dimensions {
    /// The dimensions of a pure number.
    pub const NONE: Dimensions = Dimensions { twelfths: [0; 6] };
    /// The dimensions of a time, for the rate of a state: its own dimensions over these.
    pub const TIME: Dimensions = Dimensions::of([0, 0, 1, 0, 0, 0]);

    /// Whole exponents of kg, m, s, A, K, mol.
    pub(super) const fn of(exponents: [i32; 6]) -> Dimensions {
        let mut twelfths = [0; 6];
        let mut base = 0;
        while base < twelfths.len() {
            twelfths[base] = exponents[base] * TWELFTHS;
            base += 1;
        }
        Dimensions { twelfths }
    }

    /// Whether this is a pure number (an angle is one).
    pub fn is_pure(self) -> bool {
        self == Dimensions::NONE
    }

    /// Exponents of kg, m, s, A, K and mol.
    pub fn exponents(self) -> [f64; 6] {
        self.twelfths.map(|t| f64::from(t) / f64::from(TWELFTHS))
    }

    /// Base units with their exponents in twelfths, without those that it does not have.
    pub(super) fn factors(self) -> impl Iterator<Item = (&'static str, i32)> {
        BASES.into_iter().zip(self.twelfths).filter(|(_, t)| *t != 0)
    }

    /// Dimensions of a quantity raised to `exponent`; `None` where one of the exponents would be no multiple of
    /// a twelfth (or beyond 10,000): there is no such quantity, and sums of it cannot be checked.
    pub fn power(self, exponent: f64) -> Option<Dimensions> {
        let mut twelfths = [0; 6];
        for (raised, own) in twelfths.iter_mut().zip(self.twelfths) {
            *raised = whole_twelfths(f64::from(own) / f64::from(TWELFTHS) * exponent)?;
        }
        Some(Dimensions { twelfths })
    }

    fn zip(self, other: Dimensions, join: fn(i32, i32) -> i32) -> Dimensions {
        Dimensions { twelfths: std::array::from_fn(|base| join(self.twelfths[base], other.twelfths[base])) }
    }
}

/// `exponent` in twelfths, where it is a multiple of one to rounding (1/3 written with 15 digits is).
pub(super) fn whole_twelfths(exponent: f64) -> Option<i32> {
    let twelfths = exponent * f64::from(TWELFTHS);
    let whole = twelfths.round();
    // Written exponents such as 0.333 are no third: the tolerance is rounding alone.
    let exact = (twelfths - whole).abs() <= 1e-9 * whole.abs().max(1.0);
    (exact && whole.abs() <= 1e4 * f64::from(TWELFTHS)).then_some(whole as i32)
}

impl Mul for Dimensions {
    type Output = Dimensions;

    fn mul(self, other: Dimensions) -> Dimensions {
        self.zip(other, i32::saturating_add)
    }
}

impl Div for Dimensions {
    type Output = Dimensions;

    fn div(self, other: Dimensions) -> Dimensions {
        self.zip(other, i32::saturating_sub)
    }
}

impl fmt::Display for Dimensions {
    /// Writes the dimensions in base units: `kg m/s^2`; `1` for a pure number.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let factors: Vec<(&str, i32)> = BASES.into_iter().zip(self.twelfths).collect();
        let text = quotient(&factors);
        f.pad(if text.is_empty() { "1" } else { &text })
    }
}

/// Symbols with exponents in twelfths as a quotient: `m/s^2`, `1/s`, `rad/(V s^2)`, and nothing for no factor.
pub(super) fn quotient(factors: &[(&str, i32)]) -> String {
    let side = |sign: i32| -> Vec<String> {
        let those = factors.iter().filter(|(_, t)| t.signum() == sign);
        those.map(|&(symbol, t)| raised(symbol, t.abs())).collect()
    };
    let (over, under) = (side(1), side(-1));
    let numerator = if over.is_empty() && !under.is_empty() { "1".to_owned() } else { over.join(" ") };
    match &under[..] {
        [] => numerator,
        [one] => format!("{numerator}/{one}"),
        several => format!("{numerator}/({})", several.join(" ")),
    }
}

fn raised(symbol: &str, twelfths: i32) -> String {
    match twelfths {
        TWELFTHS => symbol.to_owned(),
        _ => format!("{symbol}^{}", f64::from(twelfths) / f64::from(TWELFTHS)),
    }
}

#[cfg(test)]
mod tests {
    //! Contract: exponents add, subtract and multiply as those of quantities do; roots are exact; a power that no
    //! quantity has is none.
    use super::*;

    const FORCE: Dimensions = Dimensions::of([1, 1, -2, 0, 0, 0]);
    const LENGTH: Dimensions = Dimensions::of([0, 1, 0, 0, 0, 0]);

    #[test]
    fn products_quotients_and_powers_follow_the_quantities() {
        let energy = FORCE * LENGTH;
        assert_eq!(energy.to_string(), "kg m^2/s^2");
        assert_eq!((energy / LENGTH), FORCE);
        assert!((FORCE / FORCE).is_pure());
        let speed = LENGTH / Dimensions::TIME;
        assert_eq!(speed.power(2.0).unwrap() * Dimensions::of([1, 0, 0, 0, 0, 0]), energy);
        assert_eq!(LENGTH.power(0.5).unwrap().power(2.0), Some(LENGTH));
        assert_eq!(LENGTH.power(1.0 / 3.0).unwrap().power(3.0), Some(LENGTH));
        assert_eq!(speed.power(-0.5).unwrap().to_string(), "s^0.5/m^0.5");
        assert_eq!(Dimensions::NONE.to_string(), "1");
    }

    #[test]
    fn a_power_that_no_quantity_has_is_none() {
        for exponent in [0.3, 1.0 / 7.0, f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(LENGTH.power(exponent), None, "{exponent}");
        }
        assert_eq!(Dimensions::NONE.power(0.3), Some(Dimensions::NONE));
    }
}
