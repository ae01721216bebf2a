//! Units of measure, read from the suffix of a column name.
//!
//! Everything is SI and nothing is converted: a column in millimetres or degrees is refused, so that
//! a number in the code always means the unit its name says.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Unit of a column. Closed: a suffix outside this list is an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Unit {
    /// Length, `_m`.
    Metre,
    /// Area, `_m2`.
    SquareMetre,
    /// Velocity, `_m_s`.
    MetrePerSecond,
    /// Acceleration, `_m_s2`.
    MetrePerSecondSquared,
    /// Angle, `_rad`.
    Radian,
    /// Angular velocity, `_rad_s`.
    RadianPerSecond,
    /// Angular acceleration, `_rad_s2`.
    RadianPerSecondSquared,
    /// Time, `_s`.
    Second,
    /// Rate of decay, `_per_s`.
    PerSecond,
    /// Reciprocal length (such as drag over mass), `_per_m`.
    PerMetre,
    /// Frequency, `_Hz`.
    Hertz,
    /// Mass, `_kg`.
    Kilogram,
    /// Force, `_N`.
    Newton,
    /// Torque, `_N_m`.
    NewtonMetre,
    /// Pressure, `_Pa`.
    Pascal,
    /// Temperature, `_K`.
    Kelvin,
    /// A pure number: flags, counts, indices, ratios, coefficients.
    Dimensionless,
}

/// Suffix (without its leading underscore) and unit; a longer match wins over a shorter one.
const SUFFIXES: [(&str, Unit); 16] = [
    ("m", Unit::Metre),
    ("m2", Unit::SquareMetre),
    ("m_s", Unit::MetrePerSecond),
    ("m_s2", Unit::MetrePerSecondSquared),
    ("rad", Unit::Radian),
    ("rad_s", Unit::RadianPerSecond),
    ("rad_s2", Unit::RadianPerSecondSquared),
    ("s", Unit::Second),
    ("per_s", Unit::PerSecond),
    ("per_m", Unit::PerMetre),
    ("Hz", Unit::Hertz),
    ("kg", Unit::Kilogram),
    ("N", Unit::Newton),
    ("N_m", Unit::NewtonMetre),
    ("Pa", Unit::Pascal),
    ("K", Unit::Kelvin),
];

/// Last words of a name that say "pure number" (`pusher_new`, `sheets_count`, `restitution`).
const DIMENSIONLESS_WORDS: [&str; 8] =
    ["new", "flag", "count", "index", "ratio", "fraction", "restitution", "friction"];

/// Words that, standing just before a known suffix, show that the unit is a different one: without
/// them `speed_km_s` would pass for seconds.
const FOREIGN_WORDS: [&str; 17] =
    ["per", "km", "cm", "mm", "um", "in", "ft", "px", "deg", "rev", "g", "mg", "ms", "us", "min", "h", "kN"];

impl Unit {
    /// Unit that the suffix of `name` states, or `None` where it states none of the known ones.
    ///
    /// The suffix follows an underscore and something must precede it; a pure number is recognised
    /// by its last word, which may be the whole name.
    pub fn of_column_name(name: &str) -> Option<Unit> {
        let words: Vec<&str> = name.split('_').collect();
        let matched = SUFFIXES
            .iter()
            .filter_map(|(suffix, unit)| {
                let base = name.strip_suffix(suffix)?.strip_suffix('_')?;
                Some((suffix.len(), base, *unit))
            })
            .max_by_key(|(length, _, _)| *length);
        match matched {
            Some((_, base, unit)) => {
                let before = base.rsplit('_').next()?;
                (!before.is_empty() && !FOREIGN_WORDS.contains(&before)).then_some(unit)
            }
            None => {
                words.last().filter(|word| DIMENSIONLESS_WORDS.contains(word)).map(|_| Unit::Dimensionless)
            }
        }
    }

    /// SI symbol; empty for a pure number.
    pub fn symbol(self) -> &'static str {
        match self {
            Unit::Metre => "m",
            Unit::SquareMetre => "m^2",
            Unit::MetrePerSecond => "m/s",
            Unit::MetrePerSecondSquared => "m/s^2",
            Unit::Radian => "rad",
            Unit::RadianPerSecond => "rad/s",
            Unit::RadianPerSecondSquared => "rad/s^2",
            Unit::Second => "s",
            Unit::PerSecond => "1/s",
            Unit::PerMetre => "1/m",
            Unit::Hertz => "Hz",
            Unit::Kilogram => "kg",
            Unit::Newton => "N",
            Unit::NewtonMetre => "N m",
            Unit::Pascal => "Pa",
            Unit::Kelvin => "K",
            Unit::Dimensionless => "",
        }
    }

    /// The accepted suffixes in one line, for error messages.
    pub fn accepted_suffixes() -> String {
        let units: Vec<String> = SUFFIXES.iter().map(|(s, _)| format!("_{s}")).collect();
        format!("{}; pure numbers end in {}", units.join(" "), DIMENSIONLESS_WORDS.join(", "))
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.symbol())
    }
}

#[cfg(test)]
mod tests {
    //! Contract: a name states exactly one unit or none; nothing foreign slips through a shorter
    //! suffix.
    use super::*;

    #[test]
    fn the_longest_suffix_decides() {
        for (name, unit) in [
            ("height_m", Unit::Metre),
            ("velocity_m_s", Unit::MetrePerSecond),
            ("pusher_velocity_x_m_s", Unit::MetrePerSecond),
            ("acceleration_m_s2", Unit::MetrePerSecondSquared),
            ("theta_rad", Unit::Radian),
            ("spin_x_rad_s", Unit::RadianPerSecond),
            ("delay_s", Unit::Second),
            ("drag_per_m", Unit::PerMetre),
            ("damping_per_s", Unit::PerSecond),
            ("mass_kg", Unit::Kilogram),
            ("force_x_N", Unit::Newton),
            ("torque_z_N_m", Unit::NewtonMetre),
            ("pressure_Pa", Unit::Pascal),
            ("pusher_new", Unit::Dimensionless),
            ("restitution", Unit::Dimensionless),
            ("sheets_count", Unit::Dimensionless),
        ] {
            assert_eq!(Unit::of_column_name(name), Some(unit), "{name}");
        }
    }

    #[test]
    fn a_foreign_or_absent_unit_is_none() {
        for name in [
            "height",
            "m",
            "_m",
            "x_mm",
            "x_mm_s",
            "speed_km_s",
            "angle_deg",
            "spin_deg_s",
            "k_per_kg",
            "y_px",
            "force_n",
            "x__m",
            "height_M",
            "k_per_rad",
            "drag_per_m2",
        ] {
            assert_eq!(Unit::of_column_name(name), None, "{name}");
        }
    }
}
