//! Reads a unit in the usual notation, such as `N s/m`, `V^0.5/s` or `rad/(V s^2)`.

use super::Unit;
use super::dimensions::whole_twelfths;
use super::symbol::Symbol;

/// Largest absolute exponent of a symbol in a unit text.
pub(super) const MAX_EXPONENT: f64 = 9.0;

impl Unit {
    /// Parses a unit in the notation of [`Unit::symbol`]; `None` where the text is not a unit.
    ///
    /// Adjacent symbols are multiplied, `^` gives an exponent (whole or fractional, such as 0.5), there is at
    /// most one `/`, and a divisor of several symbols is in parentheses. Products may also be written `N*m`
    /// or `N·m`, powers `m²`. `1` and the empty text are a pure number.
    ///
    /// ```
    /// use augsim_data::Unit;
    /// let unit = Unit::parse("kg m^2").unwrap();
    /// assert_eq!(unit.symbol(), "kg m^2");
    /// assert_eq!(Unit::parse("N s/m").unwrap().dimensions(), Unit::parse("kg/s").unwrap().dimensions());
    /// assert!(Unit::parse("furlong").is_none());
    /// ```
    pub fn parse(text: &str) -> Option<Unit> {
        let text = text.replace(['*', '·', '⋅'], " ").replace('²', "^2").replace('³', "^3");
        let (numerator, divisor) = match text.trim().split_once('/') {
            Some((numerator, divisor)) => (numerator.trim(), Some(divisor.trim())),
            None => (text.trim(), None),
        };
        let mut factors = match numerator {
            "1" => Vec::new(),
            "" if divisor.is_none() => Vec::new(),
            _ => product(numerator)?,
        };
        if let Some(divisor) = divisor {
            let inner = divisor.strip_prefix('(').and_then(|text| text.strip_suffix(')'));
            let divisors = product(inner.unwrap_or(divisor))?;
            // `N/m s` is ambiguous: a divisor of several symbols needs parentheses.
            if inner.is_none() && divisors.len() > 1 {
                return None;
            }
            factors.extend(divisors.into_iter().map(|(symbol, twelfths)| (symbol, -twelfths)));
        }
        Unit::of_factors(&factors)
    }
}

/// Parses a product such as `N s` or `kg m^2` into factors; `None` for an empty text or an unknown symbol.
fn product(text: &str) -> Option<Vec<(Symbol, i32)>> {
    let factors: Option<Vec<_>> = text.split_whitespace().map(factor).collect();
    factors.filter(|factors| !factors.is_empty())
}

fn factor(text: &str) -> Option<(Symbol, i32)> {
    let (symbol, exponent) = match text.split_once('^') {
        Some((symbol, exponent)) => (symbol, exponent.parse::<f64>().ok()?),
        None => (text, 1.0),
    };
    let twelfths = whole_twelfths(exponent).filter(|t| *t != 0 && exponent.abs() <= MAX_EXPONENT)?;
    Some((Symbol::from_text(symbol)?, twelfths))
}

#[cfg(test)]
mod tests {
    //! Contract: a printed unit reads back as the same unit, and an ambiguous text is refused.
    use super::*;

    #[test]
    fn a_printed_unit_reads_back() {
        for text in ["", "m", "m/s^2", "N m", "N s/m", "1/s", "rad/(V s^2)", "kg m^2", "V^0.5/s", "Ohm"] {
            assert_eq!(Unit::parse(text).map(Unit::symbol).as_deref(), Some(text), "{text}");
        }
        for (text, same) in
            [("N*m", "N m"), ("kg·m²", "kg m^2"), ("rad/(V*s²)", "rad/(V s^2)"), ("m³/s", "m^3/s")]
        {
            assert_eq!(Unit::parse(text), Unit::parse(same), "{text}");
            assert!(Unit::parse(text).is_some(), "{text}");
        }
        assert_eq!(Unit::parse("1"), Some(Unit::DIMENSIONLESS));
        assert_eq!(Unit::parse("m^0.5").unwrap().dimensions().power(2.0), Some(Unit::METRE.dimensions()));
    }

    #[test]
    fn a_text_that_is_not_a_unit_is_none() {
        for text in [
            "mm",
            "N/m s",
            "N/m*s",
            "m**2",
            "m/",
            "/s",
            "m/s/s",
            "m^",
            "m^x",
            "m^0",
            "m^0.3",
            "m^10",
            "(m)",
            "m/(s",
            "m m m m m m m",
            "2",
        ] {
            assert_eq!(Unit::parse(text), None, "{text}");
        }
    }
}
