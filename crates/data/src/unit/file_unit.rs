//! Units that a data file may use, with their conversion to SI: `km/h`, `degC`, `kN m`, `L/min`, `mA h`.
//!
//! A value v in such a unit is `factor * v + offset` in its SI unit. The table of symbols is in
//! [`file_symbol`](super::file_symbol); prefixes and products follow from it. [`FileUnit::from_suffix`] reads
//! the same units at the end of a column name, such as `speed_km_h`.

use super::Unit;
use super::dimensions::{Dimensions, TWELFTHS};
use super::file_symbol::{FileSymbol, symbol};
use super::text::MAX_EXPONENT;

/// Unit of a column of a data file, with its conversion to SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FileUnit {
    unit: Unit,
    factor: f64,
    offset: f64,
}

/// Last words of a name that are more often a word or an index than a unit (`T_in`, `x_min`, `wheel_L`).
///
/// In a column name they are a unit only in brackets, after a slash or in a row of units; times (`t_h`) and
/// coordinates (`x_in`) are exceptions, which the reader of headings makes.
const AMBIGUOUS_ENDINGS: [&str; 28] = [
    "in", "h", "d", "g", "l", "L", "t", "w", "y", "a", "F", "min", "max", "hr", "day", "days", "week",
    "weeks", "year", "years", "rev", "turn", "mi", "kn", "kt", "bar", "lb", "month",
];

/// Number of steps per kelvin to which a converted temperature is rounded; no thermometer is as fine.
const TEMPERATURE_STEPS_PER_KELVIN: f64 = 1e9;

/// Number of significant digits of a decimal number that survive its conversion to a binary number and back.
const SAFE_DIGITS: usize = 15;

/// Computes `factor * value + offset` without the digits that binary rounding adds to decimal numbers.
///
/// 245.53 mm times the binary number next to 0.001 is 0.24553000000000003 m, and 1.1 h times 3600 is 3960.0000000000005 s. If the
/// factor or its inverse is a whole number, the result is rounded to the digits that a binary number has for sure. A
/// temperature is rounded because 273.15 is no binary number either.
pub(crate) fn to_si(value: f64, factor: f64, offset: f64) -> f64 {
    let divisor = (1.0 / factor).round();
    let is_divided = divisor > 1.0 && 1.0 / divisor == factor;
    let is_whole = factor != 1.0 && factor.fract() == 0.0;
    let scaled = if is_divided { value / divisor } else { value * factor };
    let scaled = if is_divided || is_whole { to_safe_digits(scaled) } else { scaled };
    if offset == 0.0 {
        return scaled;
    }
    ((scaled + offset) * TEMPERATURE_STEPS_PER_KELVIN).round() / TEMPERATURE_STEPS_PER_KELVIN
}

/// The binary number next to `value` rounded to [`SAFE_DIGITS`] decimal digits.
fn to_safe_digits(value: f64) -> f64 {
    let digits = SAFE_DIGITS - 1;
    format!("{value:.digits$e}").parse().unwrap_or(value)
}

impl FileUnit {
    /// SI unit of the converted values.
    pub fn unit(&self) -> Unit {
        self.unit
    }

    /// Factor of the conversion, in SI units per unit of the file.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Offset of the conversion, SI units: the value of 0 in the file's unit; not 0 only for degC and degF.
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// Converts `value` from the unit of the file to SI units.
    pub fn to_si(&self, value: f64) -> f64 {
        to_si(value, self.factor, self.offset)
    }

    /// Whether the unit of the file is the SI unit, so that values need no conversion.
    pub fn is_si(&self) -> bool {
        self.factor == 1.0 && self.offset == 0.0
    }

    /// Creates a unit of a file whose values times `factor` are in `unit`.
    pub(crate) fn scaled(unit: Unit, factor: f64) -> FileUnit {
        FileUnit { unit, factor, offset: 0.0 }
    }

    /// Parses a unit such as `km/h`, `N mm`, `°C`, `m s^-1` or `seconds`; brackets around it are ignored.
    ///
    /// Symbols are case-sensitive (`mN`, `MN`), but the usual units of length, time and angle may be written
    /// in upper case as well.
    ///
    /// ```
    /// use augsim_data::FileUnit;
    /// let unit = FileUnit::parse("km/h").unwrap();
    /// assert_eq!((unit.to_si(36.0), unit.unit().symbol()), (10.0, "m/s".to_owned()));
    /// assert_eq!(FileUnit::parse("degC").unwrap().to_si(20.0), 293.15);
    /// assert_eq!(FileUnit::parse("furlong"), None);
    /// ```
    pub fn parse(text: &str) -> Option<FileUnit> {
        let text = without_brackets(text);
        let plain = text
            .replace(['µ', 'μ'], "u")
            .replace('Ω', "Ohm")
            .replace(['℃'], "°C")
            .replace(['*', '·', '⋅'], " ")
            .replace('²', "^2")
            .replace('³', "^3")
            .replace('−', "-");
        let written = |text: &str| from_symbol(text).or_else(|| quotient(text));
        if plain.is_empty() {
            return None;
        }
        written(&plain).or_else(|| FileUnit::from_words(&plain)).or_else(|| {
            let lower = plain.to_lowercase();
            from_lower_case(&lower)
        })
    }

    /// Parses a unit written with underscores, such as `km_h`, `deg_per_s` or `N_mm`.
    ///
    /// Two words without `per` are a quotient where the second is a time, otherwise a product.
    fn from_words(text: &str) -> Option<FileUnit> {
        if !text.contains('_') {
            return None;
        }
        let words: Vec<&str> = text.split('_').collect();
        if words.contains(&"per") {
            let mut sides = words.split(|word| *word == "per");
            let numerator = sides.next()?;
            let mut out = FileUnit::scaled(Unit::DIMENSIONLESS, 1.0);
            for word in numerator {
                out = out.times(power(word)?, 1)?;
            }
            for side in sides {
                if side.is_empty() {
                    return None;
                }
                for word in side {
                    out = out.times(power(word)?, -1)?;
                }
            }
            return Some(out);
        }
        let [first, second] = words[..] else { return None };
        let (first, second) = (power(first)?, power(second)?);
        let is_time = second.unit.dimensions() == Unit::SECOND.dimensions()
            || second.unit.dimensions().power(0.5) == Some(Unit::SECOND.dimensions());
        first.times(second, if is_time { -1 } else { 1 })
    }

    /// Splits a column name into the name without its unit suffix, and the unit.
    ///
    /// `None` where the name does not end in a unit after an underscore, or where that ending is a word
    /// rather than a unit (`T_in`, `wheel_L`).
    pub(crate) fn from_suffix(name: &str) -> Option<(&str, FileUnit)> {
        let ends = name.char_indices().filter(|(offset, c)| *c == '_' && *offset > 0);
        ends.map(|(offset, _)| (&name[..offset], &name[offset + 1..]))
            .filter(|(_, suffix)| !AMBIGUOUS_ENDINGS.contains(suffix))
            .find_map(|(base, suffix)| Some((base, FileUnit::exact(suffix)?)))
    }

    /// Whether the last word of a column name is more often a word or an index than a unit.
    pub(crate) fn is_ambiguous_ending(text: &str) -> bool {
        AMBIGUOUS_ENDINGS.contains(&text)
    }

    /// Parses a unit in which upper and lower case matter.
    fn exact(text: &str) -> Option<FileUnit> {
        from_symbol(text).or_else(|| quotient(text)).or_else(|| FileUnit::from_words(text))
    }

    /// Name of the converted column: `base` with the suffix of the SI unit.
    pub(crate) fn si_name(&self, base: &str) -> String {
        // A unit without a suffix gives a name that is no column name, and so no column.
        let suffix = self.unit.suffix().unwrap_or_else(|| self.unit.symbol());
        let suffix = if suffix.is_empty() { "ratio" } else { &suffix };
        let name = format!("{base}_{suffix}");
        // A word before the suffix that looks like another unit, as in `level_h_m`, would make the name unreadable.
        if Unit::from_column_name(&name).is_some() { name } else { format!("{base}_value_{suffix}") }
    }

    /// Multiplies two units, the second to the power `sign`; `None` for temperatures with an offset.
    fn times(self, other: FileUnit, sign: i32) -> Option<FileUnit> {
        if self.offset != 0.0 || other.offset != 0.0 {
            return None;
        }
        let mut factors: Vec<_> = self.unit.factors.into_iter().flatten().collect();
        for (symbol, twelfths) in other.unit.factors.into_iter().flatten() {
            factors.push((symbol, sign * twelfths));
        }
        let factor = self.factor * other.factor.powi(sign);
        Some(FileUnit::scaled(Unit::of_factors(&factors)?, factor))
    }
}

/// Non-SI unit at the end of the name of a model quantity, with the name that has the SI unit instead.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NonSiEnding {
    /// Text of the unit at the end of the name, such as `degC`.
    pub ending: String,
    /// Name with the SI unit instead, such as `room_K`.
    pub si_name: String,
    /// Dimensions of the non-SI unit: exponents of the SI base units.
    pub dimensions: Dimensions,
}

/// Finds the non-SI unit at the end of `name`; `None` for an SI unit and for a name without a unit.
///
/// ```
/// use augsim_data::non_si_ending;
/// assert_eq!(non_si_ending("room_degC").unwrap().si_name, "room_K");
/// assert_eq!(non_si_ending("speed_km_h").unwrap().si_name, "speed_m_s");
/// assert!(non_si_ending("room_K").is_none() && non_si_ending("gain").is_none());
/// ```
pub fn non_si_ending(name: &str) -> Option<NonSiEnding> {
    if Unit::from_column_name(name).is_some() {
        return None;
    }
    let (base, unit) = FileUnit::from_suffix(name)?;
    let si_name = unit.si_name(base);
    // A name such as `x_s_m`, whose words are SI units, is none that this crate can read: it has no unit.
    (!unit.is_si()).then(|| NonSiEnding {
        ending: name[base.len() + 1..].to_owned(),
        si_name,
        dimensions: unit.unit.dimensions(),
    })
}

/// Removes the brackets around a unit; brackets around a part of it, as in `W/(m^2 K)`, stay.
fn without_brackets(text: &str) -> &str {
    let text = text.trim();
    let inner = ["()", "[]", "{}", "<>"].iter().find_map(|pair| {
        let (open, close) = pair.split_at(1);
        text.strip_prefix(open)?.strip_suffix(close)
    });
    inner.map_or(text, without_brackets)
}

/// Parses a unit symbol with an optional exponent at its end, such as `s2` or `mm^2`.
fn power(word: &str) -> Option<FileUnit> {
    if let Some(unit) = from_symbol(word) {
        return Some(unit);
    }
    let begin = word.rfind(|c: char| !(c.is_ascii_digit() || c == '-' || c == '.'))? + 1;
    let (symbol, exponent) = word.split_at_checked(begin)?;
    let exponent: i32 = exponent.parse().ok().filter(|e| *e != 0)?;
    let base = from_symbol(symbol.strip_suffix('^').unwrap_or(symbol))?;
    let [Some((symbol, twelfths)), ..] = base.unit.factors else { return None };
    let is_single = base.unit.factors.iter().flatten().count() == 1 && base.offset == 0.0;
    (is_single && f64::from(exponent.abs()) <= MAX_EXPONENT).then_some(())?;
    let unit = Unit::of_factors(&[(symbol, twelfths * exponent)])?;
    // A division by a whole number is exact where its reciprocal is not.
    Some(FileUnit::scaled(unit, base.factor.powi(exponent)))
}

/// Parses products and quotients of units: `kN m`, `km/h`, `m/s^2`, `W/(m^2 K)`, `1/min`, `m s^-1`.
fn quotient(text: &str) -> Option<FileUnit> {
    let (numerator, divisor) = match text.split_once('/') {
        Some((numerator, divisor)) => (numerator.trim(), Some(divisor.trim())),
        None => (text.trim(), None),
    };
    let mut out = FileUnit::scaled(Unit::DIMENSIONLESS, 1.0);
    if numerator != "1" {
        for word in numerator.split_whitespace() {
            out = out.times(power(word)?, 1)?;
        }
    }
    let Some(divisor) = divisor else {
        return (numerator.split_whitespace().count() > 0 && numerator != "1").then_some(out);
    };
    let inner = divisor.strip_prefix('(').and_then(|text| text.strip_suffix(')'));
    let words: Vec<&str> = inner.unwrap_or(divisor).split(['/', ' ']).filter(|w| !w.is_empty()).collect();
    if words.is_empty() || numerator.is_empty() {
        return None;
    }
    for word in words {
        out = out.times(power(word)?, -1)?;
    }
    Some(out)
}

/// Looks up the unit of one symbol.
fn from_symbol(text: &str) -> Option<FileUnit> {
    let FileSymbol { factor, offset, si } = symbol(text)?;
    Some(FileUnit { unit: Unit::parse(si)?, factor, offset })
}

/// Parses units whose spelling in upper case is common: `MM`, `SEC`, `Deg`, `M/S`.
fn from_lower_case(lower: &str) -> Option<FileUnit> {
    const COMMON: [&str; 14] =
        ["m", "cm", "mm", "um", "s", "ms", "us", "ns", "rad", "deg", "m/s", "cm/s", "mm/s", "rad/s"];
    let is_common = COMMON.contains(&lower) || lower == "deg/s" || lower.chars().count() > 2;
    is_common.then(|| from_symbol(lower).or_else(|| quotient(lower)))?
}

impl Unit {
    /// Suffix of a column name with this unit, such as `m_s`, `N_m` or `kg_per_s`; `None` for a pure number.
    pub(crate) fn suffix(self) -> Option<String> {
        let text = |unit: Unit| {
            let side = |sign: i32| -> Option<Vec<String>> {
                let factors = unit.factors.into_iter().flatten().filter(|(_, t)| t.signum() == sign);
                let word = |(symbol, t): (super::Symbol, i32)| match t.abs() / TWELFTHS {
                    1 if t.abs() == TWELFTHS => Some(symbol.text().to_owned()),
                    n @ 2..=4 if t.abs() == n * TWELFTHS => Some(format!("{}{n}", symbol.text())),
                    _ => None,
                };
                factors.map(word).collect()
            };
            let (above, below) = (side(1)?.join("_"), side(-1)?.join("_"));
            let short = format!("{above}_{below}");
            let candidates = match (above.is_empty(), below.is_empty()) {
                (true, true) => Vec::new(),
                (false, true) => vec![above],
                (true, false) => vec![format!("per_{below}")],
                (false, false) => vec![short, format!("{above}_per_{below}")],
            };
            let reads_back = |suffix: &String| {
                Unit::from_column_name(&format!("q_{suffix}")).map(Unit::dimensions)
                    == Some(unit.dimensions())
            };
            candidates.into_iter().find(reads_back)
        };
        if self == Unit::DIMENSIONLESS {
            return None;
        }
        let coulomb = Unit::parse("C").filter(|coulomb| coulomb.dimensions() == self.dimensions());
        text(self).or_else(|| text(coulomb.or_else(|| Unit::from_dimensions(self.dimensions()))?))
    }
}

#[cfg(test)]
mod tests {
    //! Contract: every usual spelling of a unit converts to SI, and a text that is not a unit has none.
    use super::*;

    #[test]
    fn decimal_numbers_stay_decimal() {
        for (value, factor, offset, expected) in [
            (245.53, 1e-3, 0.0, 0.24553),
            (22.14, 1.0, 273.15, 295.29),
            (0.3, 1e3, 0.0, 300.0),
            (41.0, 1e-6, 0.0, 41e-6),
            (17.1, 1e-2, 0.0, 0.171),
            (24.554, 1e-2, 0.0, 0.24554),
            (1.1, 3600.0, 0.0, 3960.0),
            (-7.3, 60.0, 0.0, -438.0),
        ] {
            assert_eq!(to_si(value, factor, offset), expected, "{value} {factor} {offset}");
        }
        // A factor that is no decimal fraction multiplies.
        assert_eq!(to_si(3.0, std::f64::consts::PI / 180.0, 0.0), 3.0 * (std::f64::consts::PI / 180.0));
    }

    #[test]
    fn units_convert_to_si() {
        for (text, value, in_si, name) in [
            ("degC", 20.0, 293.15, "q_K"),
            ("°C", -40.0, 233.15, "q_K"),
            ("degF", 32.0, 273.15, "q_K"),
            ("km/h", 36.0, 10.0, "q_m_s"),
            ("rpm", 60.0, std::f64::consts::TAU, "q_rad_s"),
            ("1/min", 60.0, 1.0, "q_per_s"),
            ("mrad", 5.0, 0.005, "q_rad"),
            ("deg", 180.0, std::f64::consts::PI, "q_rad"),
            ("deg/s", 180.0, std::f64::consts::PI, "q_rad_s"),
            ("°/s^2", 180.0, std::f64::consts::PI, "q_rad_s2"),
            ("%", 40.0, 0.4, "q_ratio"),
            ("bar", 2.0, 2e5, "q_Pa"),
            ("mbar", 2.0, 200.0, "q_Pa"),
            ("kPa", 2.0, 2e3, "q_Pa"),
            ("Ah", 2.0, 7200.0, "q_C"),
            ("mA h", 2.0, 7.2, "q_C"),
            ("kWh", 1.0, 3.6e6, "q_J"),
            ("kW", 3.0, 3e3, "q_W"),
            ("N mm", 3.0, 3e-3, "q_N_m"),
            ("Nm", 3.0, 3.0, "q_N_m"),
            ("mNm", 3.0, 3e-3, "q_N_m"),
            ("kN", 3.0, 3e3, "q_N"),
            ("g", 3.0, 3e-3, "q_kg"),
            ("kg m^2", 3.0, 3.0, "q_kg_m2"),
            ("g cm^2", 1e7, 1.0, "q_kg_m2"),
            ("L/min", 60.0, 1e-3, "q_m3_per_s"),
            ("m/s²", 3.0, 3.0, "q_m_s2"),
            ("m s^-1", 3.0, 3.0, "q_m_s"),
            ("W/(m^2 K)", 3.0, 3.0, "q_W_per_m2_K"),
            ("µs", 3.0, 3e-6, "q_s"),
            ("hours", 2.0, 7200.0, "q_s"),
            ("d", 1.0, 86400.0, "q_s"),
            ("weeks", 1.0, 604800.0, "q_s"),
            ("MM", 3.0, 3e-3, "q_m"),
            ("Seconds", 3.0, 3.0, "q_s"),
            ("mA", 3.0, 3e-3, "q_A"),
            ("kOhm", 3.0, 3e3, "q_Ohm"),
            ("psi", 1.0, 6894.757293, "q_Pa"),
            ("mph", 1.0, 0.44704, "q_m_s"),
        ] {
            let unit = FileUnit::parse(text).unwrap_or_else(|| panic!("{text} is refused"));
            assert!((unit.to_si(value) / in_si - 1.0).abs() < 1e-9, "{text}: {}", unit.to_si(value));
            assert_eq!(unit.si_name("q"), name, "{text}");
        }
    }

    #[test]
    fn a_suffix_is_a_unit_and_a_word_is_none() {
        for (name, base, factor) in [
            ("speed_km_h", "speed", 1.0 / 3.6),
            ("pos_x_mm", "pos_x", 1e-3),
            ("turn_deg_per_s", "turn", std::f64::consts::PI / 180.0),
            ("torque_N_mm", "torque", 1e-3),
            ("damping_N_s_per_mm", "damping", 1e3),
            ("p_kPa", "p", 1e3),
        ] {
            let (found, unit) = FileUnit::from_suffix(name).unwrap_or_else(|| panic!("{name}"));
            assert_eq!(found, base, "{name}");
            assert!((unit.factor() / factor - 1.0).abs() < 1e-12, "{name}: {}", unit.factor());
        }
        for name in ["T_in", "wheel_L", "x_min", "gain_x", "mm", "_mm", "x_MA", "v_x", "k_p", "x_bar", ""] {
            assert_eq!(FileUnit::from_suffix(name), None, "{name}");
        }
        for text in ["", "furlong", "1", "/s", "m/", "degC/s", "x", "kkg", "k", "mmm", "n"] {
            assert_eq!(FileUnit::parse(text), None, "{text}");
        }
    }

    #[test]
    fn a_converted_name_can_be_read_again() {
        let millimetre = FileUnit::exact("mm").unwrap();
        for (base, name) in [("level", "level_m"), ("level_h", "level_h_value_m")] {
            assert_eq!(millimetre.si_name(base), name);
            assert_eq!(Unit::from_column_name(name), Some(Unit::METRE));
        }
    }

    #[test]
    fn names_of_models_with_other_units_get_their_si_name() {
        for (name, si_name) in [
            ("angle_deg", Some("angle_rad")),
            ("temp_degC", Some("temp_K")),
            ("charge_Ah", Some("charge_C")),
            ("height_m", None),
            ("u_v", None),
            ("T_in", None),
            ("x_min", None),
        ] {
            assert_eq!(non_si_ending(name).map(|e| e.si_name).as_deref(), si_name, "{name}");
        }
    }
}
