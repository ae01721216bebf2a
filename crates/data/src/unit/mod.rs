//! Units of measure, read from the suffix of a column name or from a text.
//!
//! Everything is SI and nothing is converted: a column in millimetres or degrees is refused, so that
//! a number in the code always means the unit its name says. How a suffix is read stands in [`suffix`], how a
//! text such as `V^0.5/s` is read in [`text`].

mod dimensions;
mod suffix;
mod symbol;
mod text;

pub use dimensions::Dimensions;

use dimensions::{TWELFTHS, quotient};
use std::fmt;
use symbol::Symbol;

/// Most factors a unit may have; `kg m^2/(s^3 A^2)` has four.
const MOST_FACTORS: usize = 6;

/// Unit of a quantity: named SI units with exponents, kept as they were written, so that a torque stays `N m`.
///
/// Two units are equal if they are written with the same symbols in the same order; whether two quantities may be
/// added is a question to their [`Dimensions`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Unit {
    /// Symbols and exponents in twelfths, `None` after the last one.
    factors: [Option<(Symbol, i32)>; MOST_FACTORS],
}

impl Unit {
    /// A pure number: flags, counts, indices, ratios, coefficients.
    pub const DIMENSIONLESS: Unit = Unit { factors: [None; MOST_FACTORS] };
    /// Length.
    pub const METRE: Unit = Unit::named(Symbol::Metre);
    /// Angle.
    pub const RADIAN: Unit = Unit::named(Symbol::Radian);
    /// Time.
    pub const SECOND: Unit = Unit::named(Symbol::Second);

    const fn named(symbol: Symbol) -> Unit {
        let mut factors = [None; MOST_FACTORS];
        factors[0] = Some((symbol, TWELFTHS));
        Unit { factors }
    }

    /// Unit of these factors, exponents in twelfths; `None` where there are too many.
    fn of_factors(factors: &[(Symbol, i32)]) -> Option<Unit> {
        let mut unit = Unit::DIMENSIONLESS;
        for (k, factor) in factors.iter().enumerate() {
            *unit.factors.get_mut(k)? = Some(*factor);
        }
        Some(unit)
    }

    /// Exponents of the base units.
    pub fn dimensions(self) -> Dimensions {
        self.factors.into_iter().flatten().fold(Dimensions::NONE, |product, (symbol, twelfths)| {
            let exponent = f64::from(twelfths) / f64::from(TWELFTHS);
            // A unit has exponents up to 9 in twelfths, so that the power is never beyond what dimensions hold.
            product * symbol.dimensions().power(exponent).unwrap_or_default()
        })
    }

    /// SI symbol such as `m/s^2`, `N m` or `N s/m`; empty for a pure number.
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
