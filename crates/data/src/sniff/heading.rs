//! Parses column names with units, such as `t (s)`, `time [ms]`, `x_cm` or `height/mm`.

use super::time_words::is_time_word;
use crate::unit::{Dimensions, FileUnit, Unit};

/// List of the accepted units of a column, for error messages.
pub(super) const KNOWN_UNITS: &str = "known units are SI units with the usual prefixes (mm, kN, mV, mrad), cm, in, ft, \
                                      px, ms, us, ns, min, h, d, weeks, years, frames, deg, rpm, degC, degF, km/h, %, bar, \
                                      psi, L, Ah, Wh, and their products and quotients such as deg/s and L/min";

/// Kind of quantity that a unit of a column measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    Length,
    /// Length in pixels of an image of unknown scale.
    Pixels,
    Time,
    /// Time in frames of unknown rate.
    Frames,
    Angle,
    /// Any other quantity, such as a speed or a force.
    Other,
}

/// A unit that a column may have: the quantity that it measures and its conversion to SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ColumnUnit {
    pub quantity: Quantity,
    pub conversion: FileUnit,
}

impl ColumnUnit {
    /// Unit of a time that is given in frames.
    pub fn frames() -> ColumnUnit {
        ColumnUnit { quantity: Quantity::Frames, conversion: FileUnit::scaled(Unit::DIMENSIONLESS, 1.0) }
    }

    /// Parses the text of a unit; brackets around it are ignored.
    pub fn parse(text: &str) -> Option<ColumnUnit> {
        let word = text.trim().trim_matches(|c| "()[]{}<>".contains(c)).trim().to_lowercase();
        let pure = FileUnit::scaled(Unit::DIMENSIONLESS, 1.0);
        match word.as_str() {
            "px" | "pix" | "pixel" | "pixels" => {
                return Some(ColumnUnit { quantity: Quantity::Pixels, conversion: pure });
            }
            "frame" | "frames" => return Some(ColumnUnit::frames()),
            _ => {}
        }
        let conversion = FileUnit::parse(text)?;
        let unit = conversion.unit();
        let quantity = match () {
            () if unit.dimensions() == Unit::METRE.dimensions() => Quantity::Length,
            () if unit.dimensions() == Dimensions::TIME => Quantity::Time,
            () if unit == Unit::RADIAN => Quantity::Angle,
            () => Quantity::Other,
        };
        Some(ColumnUnit { quantity, conversion })
    }

    /// Parses the unit in a command-line option: a known unit, or the size of a unit of length, m.
    pub fn parse_option(text: &str) -> Option<ColumnUnit> {
        let metres = || text.trim().parse::<f64>().ok().filter(|f| f.is_finite() && *f != 0.0);
        let of_size = |factor: f64| ColumnUnit {
            quantity: Quantity::Length,
            conversion: FileUnit::scaled(Unit::METRE, factor),
        };
        ColumnUnit::parse(text).or_else(|| metres().map(of_size))
    }

    /// Size of the unit in SI units (the factor of the conversion).
    pub fn factor(&self) -> f64 {
        self.conversion.factor()
    }
}

/// Parsed column name: its words and its unit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Heading {
    /// Column name as it is in the file.
    pub raw: String,
    /// Words of the column name in lower case, without the unit.
    pub words: Vec<String>,
    pub unit: Option<ColumnUnit>,
    /// Text of the unit in the file; empty without one.
    pub unit_text: String,
}

impl Heading {
    /// Parses a column name; `unit_row` is the column's cell in the row of units, or empty.
    pub fn read(raw: &str, unit_row: &str) -> Heading {
        let (name, unit_text) = split_unit(raw.trim());
        let unit_text = if unit_row.is_empty() { unit_text } else { unit_row };
        let unit_text = unit_text.trim().trim_matches(|c| "()[]{}<>".contains(c)).trim();
        let bracketed = unit_text;
        let unit = match bracketed {
            // Where a name says temperature, C is the Celsius scale and not the coulomb.
            "C" | "c" if is_temperature(name) => ColumnUnit::parse("degC"),
            "F" | "f" if is_temperature(name) => ColumnUnit::parse("degF"),
            text => ColumnUnit::parse(text),
        };
        let name = split_case(name).to_lowercase();
        let words = name.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
        Heading {
            raw: raw.trim().to_owned(),
            words: words.map(str::to_owned).collect(),
            unit,
            unit_text: unit_text.to_owned(),
        }
    }
}

impl Heading {
    /// Column name without its unit, with underscores between words; case is kept.
    pub fn base(&self) -> String {
        let name = split_unit(&self.raw).0.trim();
        let words = name.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
        words.collect::<Vec<_>>().join("_")
    }
}

/// Whether a column name denotes a temperature: `T`, `T1`, `temp`, `Temperatur`.
fn is_temperature(name: &str) -> bool {
    let name = name.trim();
    let is_symbol = name.strip_prefix('T').is_some_and(|rest| rest.chars().all(|c| c.is_ascii_digit()));
    is_symbol || name.to_lowercase().contains("temp")
}

/// Whether `unit`, the last word of a column name, is a unit of `name` and not a part of it.
///
/// Words such as `in`, `h` and `min` are a unit only of a time or of a coordinate.
fn is_unit_of(name: &str, unit: &str) -> bool {
    let Some(found) = ColumnUnit::parse(unit) else { return false };
    let words: Vec<String> =
        name.to_lowercase().split(|c: char| !c.is_alphanumeric()).map(str::to_owned).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).filter(|w| !w.is_empty()).collect();
    let may_be_word =
        FileUnit::is_ambiguous_ending(unit) || unit.chars().count() == 1 && unit != "m" && unit != "s";
    match found.quantity {
        Quantity::Time if may_be_word => words.iter().all(|w| is_time_word(w)),
        Quantity::Length if may_be_word => {
            let is_coordinate = |w: &str| matches!(w, "x" | "y" | "z" | "height" | "h" | "pos" | "position");
            words.iter().any(|w| is_coordinate(w))
        }
        _ if unit == "C" => true,
        _ if may_be_word => {
            unit.chars().all(|c| c.is_ascii_uppercase()) && !FileUnit::is_ambiguous_ending(unit)
        }
        _ => true,
    }
}

/// Inserts an underscore before an upper-case letter that follows a lower-case one, as in `ballX`.
fn split_case(name: &str) -> String {
    let mut out = String::with_capacity(name.len() + 4);
    let mut follows_lowercase = false;
    for c in name.chars() {
        if c.is_uppercase() && follows_lowercase {
            out.push('_');
        }
        follows_lowercase = c.is_lowercase();
        out.push(c);
    }
    out
}

/// Splits a column name into name and unit; the unit is empty where none is written.
fn split_unit(raw: &str) -> (&str, &str) {
    for (open, close) in [('(', ')'), ('[', ']'), ('{', '}'), ('<', '>')] {
        if let Some((name, inner)) = raw.split_once(open)
            && let Some((unit, _)) = inner.split_once(close)
            && !name.trim().is_empty()
        {
            return (name, unit);
        }
    }
    // A unit at the end, after an underscore, a space, a comma or a hyphen; the longest such unit is taken.
    let separators = raw.char_indices().filter(|(_, c)| matches!(c, '_' | ' ' | ',' | '-' | '.'));
    for (offset, c) in separators {
        let (name, unit) = (&raw[..offset], &raw[offset + c.len_utf8()..]);
        let unit = unit.trim().trim_start_matches("in ");
        if !name.trim().is_empty() && is_unit_of(name, unit) {
            return (name, unit);
        }
    }
    // A slash divides by the unit, as in height/mm. The name ends at the first slash.
    if let Some((name, unit)) = raw.split_once('/')
        && ColumnUnit::parse(unit).is_some()
        && !name.trim().is_empty()
    {
        return (name, unit);
    }
    (raw, "")
}

#[cfg(test)]
mod tests {
    //! Contract: the unit is found in all usual notations, and a name without a unit has none.
    use super::*;

    #[test]
    fn units_are_found_in_names() {
        let deg = std::f64::consts::PI / 180.0;
        for (raw, words, quantity, factor) in [
            ("t (s)", "t", Quantity::Time, 1.0),
            ("time [ms]", "time", Quantity::Time, 1e-3),
            ("time (hours)", "time", Quantity::Time, 3600.0),
            ("t_h", "t", Quantity::Time, 3600.0),
            ("t_d", "t", Quantity::Time, 86_400.0),
            ("t_min", "t", Quantity::Time, 60.0),
            ("x_cm", "x", Quantity::Length, 1e-2),
            ("x_in", "x", Quantity::Length, 0.0254),
            ("height/mm", "height", Quantity::Length, 1e-3),
            ("Ball Pos X {mm}", "ball pos x", Quantity::Length, 1e-3),
            ("ballX_mm", "ball x", Quantity::Length, 1e-3),
            ("vx_m_s", "vx", Quantity::Other, 1.0),
            ("vx_cm/s", "vx", Quantity::Other, 1e-2),
            ("speed_km_h", "speed", Quantity::Other, 1.0 / 3.6),
            ("theta (deg)", "theta", Quantity::Angle, deg),
            ("y, px", "y", Quantity::Pixels, 1.0),
            ("Höhe in cm", "höhe", Quantity::Length, 1e-2),
            ("force_N", "force", Quantity::Other, 1.0),
        ] {
            let heading = Heading::read(raw, "");
            assert_eq!(heading.words.join(" "), words, "{raw}");
            let unit = heading.unit.unwrap_or_else(|| panic!("{raw} has no unit"));
            assert_eq!(unit.quantity, quantity, "{raw}");
            assert!((unit.factor() / factor - 1.0).abs() < 1e-12, "{raw}");
        }
        for raw in ["x", "m", "frame", "comment", "a/b", "T_in", "x_d", "gain_h", "wheel_L", "k_w", "u_v"] {
            assert_eq!(Heading::read(raw, "").unit, None, "{raw}");
        }
        assert_eq!(Heading::read("x", "mm").unit.map(|u| u.factor()), Some(1e-3));
    }

    #[test]
    fn c_is_celsius_where_a_name_says_temperature() {
        for (raw, offset) in [("Temp (C)", 273.15), ("T [C]", 273.15), ("T_C", 273.15), ("charge (C)", 0.0)] {
            assert_eq!(Heading::read(raw, "").unit.map(|u| u.conversion.offset()), Some(offset), "{raw}");
        }
    }
}
