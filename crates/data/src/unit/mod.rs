//! Units of measure, read from the suffix of a column name or from a text.
//!
//! A [`Unit`] is SI, so that every number in the code has the unit that its name states. [`suffix`] reads the
//! suffixes, [`text`] a text such as `V^0.5/s`. A [`FileUnit`] is any unit of a data file, with its conversion to
//! SI.

mod dimensions;
mod file_symbol;
mod file_unit;
mod suffix;
mod symbol;
mod text;

pub use dimensions::Dimensions;
pub(crate) use file_unit::to_si;
pub use file_unit::{FileUnit, NonSiEnding, non_si_ending};

use dimensions::{TWELFTHS, quotient};
use std::fmt;
use symbol::Symbol;

/// Named SI units that [`Unit::from_dimensions`] uses where they are shorter than base units.
const NAMED: [Symbol; 6] =
    [Symbol::Newton, Symbol::Volt, Symbol::Pascal, Symbol::Watt, Symbol::Joule, Symbol::Ohm];

/// Maximum number of factors of a unit; `kg m^2/(s^3 A^2)` has four.
const MAX_FACTORS: usize = 6;

/// Unit of a quantity: named SI units with exponents.
///
/// The symbols remain as they were written, so that a torque stays `N m`. Two units are equal if they are
/// written with the same symbols in the same order. Whether two quantities may be added is decided by their
/// [`Dimensions`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Unit {
    /// Factors of the unit: symbol and exponent in twelfths; `None` after the last one.
    factors: [Option<(Symbol, i32)>; MAX_FACTORS],
}

impl Unit {
    /// Unit of pure numbers: flags, counts, indices, ratios, coefficients.
    pub const DIMENSIONLESS: Unit = Unit { factors: [None; MAX_FACTORS] };
    /// Unit of length, the metre.
    pub const METRE: Unit = Unit::named(Symbol::Metre);
    /// Unit of angle, the radian.
    pub const RADIAN: Unit = Unit::named(Symbol::Radian);
    /// Unit of time, the second.
    pub const SECOND: Unit = Unit::named(Symbol::Second);

    const fn named(symbol: Symbol) -> Unit {
        let mut factors = [None; MAX_FACTORS];
        factors[0] = Some((symbol, TWELFTHS));
        Unit { factors }
    }

    /// Creates a unit from (symbol, exponent in twelfths) pairs; `None` where there are too many.
    fn of_factors(factors: &[(Symbol, i32)]) -> Option<Unit> {
        let mut unit = Unit::DIMENSIONLESS;
        for (k, factor) in factors.iter().enumerate() {
            *unit.factors.get_mut(k)? = Some(*factor);
        }
        Some(unit)
    }

    /// Finds the unit with the given dimensions that has the fewest symbols.
    ///
    /// It consists of base units, or of one named unit and base units where that takes fewer symbols; of
    /// several such units it is the one with the smallest exponents. `None` where it has too many factors.
    pub fn from_dimensions(dimensions: Dimensions) -> Option<Unit> {
        let bases = |d: Dimensions| -> Vec<(Symbol, i32)> {
            d.factors().filter_map(|(base, t)| Some((Symbol::from_text(base)?, t))).collect()
        };
        let length =
            |factors: &[(Symbol, i32)]| (factors.len(), factors.iter().map(|f| f.1.abs()).sum::<i32>());
        let base = bases(dimensions);
        let mut best: Option<Vec<(Symbol, i32)>> = None;
        for symbol in NAMED {
            // Whole powers, and square roots, which occur in flow through an orifice.
            for power in [1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 0.5, -0.5] {
                let Some(part) = symbol.dimensions().power(power) else { continue };
                let mut factors = vec![(symbol, (power * f64::from(TWELFTHS)) as i32)];
                factors.extend(bases(dimensions / part));
                let shorter = best.as_ref().is_none_or(|best| length(&factors) < length(best));
                if factors.len() < base.len() && shorter {
                    best = Some(factors);
                }
            }
        }
        Unit::of_factors(best.as_ref().unwrap_or(&base))
    }

    /// This unit divided by a quantity with the given dimensions, with the symbols of this unit.
    ///
    /// A torque over a speed is `N m s`, where [`Unit::from_dimensions`] would give `J s`. `None` where it has too many
    /// factors.
    pub fn over(self, divisor: Dimensions) -> Option<Unit> {
        let mut factors: Vec<(Symbol, i32)> = self.factors.into_iter().flatten().collect();
        for (base, twelfths) in divisor.factors() {
            let symbol = Symbol::from_text(base)?;
            match factors.iter_mut().find(|(known, _)| *known == symbol) {
                Some((_, exponent)) => *exponent -= twelfths,
                None => factors.push((symbol, -twelfths)),
            }
        }
        factors.retain(|(_, exponent)| *exponent != 0);
        Unit::of_factors(&factors)
    }

    /// Dimensions of the unit: exponents of the SI base units.
    pub fn dimensions(self) -> Dimensions {
        self.factors.into_iter().flatten().fold(Dimensions::NONE, |product, (symbol, twelfths)| {
            let exponent = f64::from(twelfths) / f64::from(TWELFTHS);
            // The exponents of a unit are at most 9, so the power always fits into `Dimensions`.
            product * symbol.dimensions().power(exponent).unwrap_or_default()
        })
    }

    /// Symbol of the unit, such as `m/s^2`, `N m` or `N s/m`; empty for a pure number.
    pub fn symbol(self) -> String {
        let factors: Vec<(&str, i32)> =
            self.factors.into_iter().flatten().map(|(symbol, twelfths)| (symbol.text(), twelfths)).collect();
        quotient(&factors)
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.symbol())
    }
}

#[cfg(test)]
mod tests {
    //! Contract: a unit computed from dimensions has the shortest symbol and these dimensions.
    use super::*;

    #[test]
    fn a_torque_over_a_speed_keeps_its_symbols() {
        let torque = Unit::parse("N m").expect("a unit");
        for (divisor, shown) in [("rad/s", "N m s"), ("m", "N"), ("rad", "N m"), ("rad/s^2", "N m s^2")] {
            let divisor = Unit::parse(divisor).expect("a unit").dimensions();
            let unit = torque.over(divisor).expect("few symbols");
            assert_eq!(unit.symbol(), shown);
            assert_eq!(unit.dimensions(), torque.dimensions() / divisor);
        }
    }

    #[test]
    fn computed_units_have_the_shortest_symbol() {
        for (text, shown) in [
            ("kg m^2/(s^3 A)", "V"),
            ("s^3 A/(kg m^2)", "1/V"),
            ("kg m/s^2", "N"),
            ("kg/s", "kg/s"),
            ("m/s^2", "m/s^2"),
            ("V/(m s)", "V/(m s)"),
            ("1/(V^2 s^2)", "1/(V^2 s^2)"),
            ("V^0.5/s", "V^0.5/s"),
            ("m^0.5/s", "m^0.5/s"),
        ] {
            let unit = Unit::parse(text).expect("a unit");
            let computed = Unit::from_dimensions(unit.dimensions()).expect("few symbols");
            assert_eq!(computed.symbol(), shown, "{text}");
            assert_eq!(computed.dimensions(), unit.dimensions(), "{text}");
        }
    }
}
