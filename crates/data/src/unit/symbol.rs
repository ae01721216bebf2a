//! The unit symbols that column names and unit texts may use, with their dimensions.

use super::dimensions::Dimensions;

/// Named SI unit that column names and unit texts may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Symbol {
    Metre,
    Radian,
    Second,
    Hertz,
    Kilogram,
    Newton,
    Pascal,
    Kelvin,
    Volt,
    Ampere,
    Watt,
    Joule,
    Coulomb,
    Ohm,
    Mole,
}

/// SI units by symbol: spelling, and exponents of kg, m, s, A, K and mol.
const TABLE: [(Symbol, &str, [i32; 6]); 15] = [
    (Symbol::Metre, "m", [0, 1, 0, 0, 0, 0]),
    (Symbol::Radian, "rad", [0, 0, 0, 0, 0, 0]),
    (Symbol::Second, "s", [0, 0, 1, 0, 0, 0]),
    (Symbol::Hertz, "Hz", [0, 0, -1, 0, 0, 0]),
    (Symbol::Kilogram, "kg", [1, 0, 0, 0, 0, 0]),
    (Symbol::Newton, "N", [1, 1, -2, 0, 0, 0]),
    (Symbol::Pascal, "Pa", [1, -1, -2, 0, 0, 0]),
    (Symbol::Kelvin, "K", [0, 0, 0, 0, 1, 0]),
    (Symbol::Volt, "V", [1, 2, -3, -1, 0, 0]),
    (Symbol::Ampere, "A", [0, 0, 0, 1, 0, 0]),
    (Symbol::Watt, "W", [1, 2, -3, 0, 0, 0]),
    (Symbol::Joule, "J", [1, 2, -2, 0, 0, 0]),
    (Symbol::Coulomb, "C", [0, 0, 1, 1, 0, 0]),
    (Symbol::Ohm, "Ohm", [1, 2, -3, -2, 0, 0]),
    (Symbol::Mole, "mol", [0, 0, 0, 0, 0, 1]),
];

impl Symbol {
    /// Finds the unit symbol with the spelling `text`.
    pub(super) fn from_text(text: &str) -> Option<Symbol> {
        TABLE.iter().find(|(_, written, _)| *written == text).map(|(symbol, ..)| *symbol)
    }

    /// Spelling of the unit symbol.
    pub(super) fn text(self) -> &'static str {
        TABLE[self as usize].1
    }

    /// Dimensions of the unit: exponents of the SI base units.
    pub(super) fn dimensions(self) -> Dimensions {
        Dimensions::from_exponents(TABLE[self as usize].2)
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the table has the order of the enumeration, which indexes it, and no symbol occurs twice.
    use super::*;

    #[test]
    fn the_table_is_in_the_order_of_the_enumeration() {
        for (k, (symbol, text, _)) in TABLE.iter().enumerate() {
            assert_eq!(*symbol as usize, k, "{text}");
            assert_eq!(Symbol::from_text(text), Some(*symbol), "{text}");
        }
    }
}
