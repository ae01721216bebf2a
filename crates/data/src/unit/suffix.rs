//! Reads the unit at the end of a column name, such as `height_m` or `damping_N_s_per_m`.
//!
//! The name is split at its underscores. `per` begins a divisor; the words of the numerator, and of each
//! divisor, are multiplied. Six compounds are older than this rule and keep their meaning on either side of
//! `per`: `m_s`, `m_s2`, `rad_s` and `rad_s2` are quotients, `N_m` and `kg_m2` products. Without `per`, any
//! other two adjacent units are refused, because `flow_m3_s` could be a product or a quotient.

use super::symbol::Symbol;
use super::{TWELFTHS, Unit};

/// Factors of a unit of two symbols: pairs (symbol, whole exponent).
type Factors = [(Symbol, i32); 2];

const COMPOUNDS: [(&str, Factors); 6] = [
    ("m_s", [(Symbol::Metre, 1), (Symbol::Second, -1)]),
    ("m_s2", [(Symbol::Metre, 1), (Symbol::Second, -2)]),
    ("rad_s", [(Symbol::Radian, 1), (Symbol::Second, -1)]),
    ("rad_s2", [(Symbol::Radian, 1), (Symbol::Second, -2)]),
    ("N_m", [(Symbol::Newton, 1), (Symbol::Metre, 1)]),
    ("kg_m2", [(Symbol::Kilogram, 1), (Symbol::Metre, 2)]),
];

/// Unit suffixes of column names that messages list, without the quotients.
const LISTED_SUFFIXES: &str = "_m _m2 _m3 _m_s _m_s2 _rad _rad_s _rad_s2 _s _Hz _kg _kg_m2 _N _N_m _Pa _K _V _A _W _J _C \
                      _Ohm _mol";

/// Last words of a name that denote a pure number (`pusher_new`, `sheets_count`, `restitution`).
const DIMENSIONLESS_WORDS: [&str; 8] =
    ["new", "flag", "count", "index", "ratio", "fraction", "restitution", "friction"];

/// Non-SI units that must not precede a known unit suffix in a column name.
///
/// Without this list `speed_km_s` would be read as seconds.
const REFUSED_UNITS: [&str; 38] = [
    "km", "cm", "mm", "um", "nm", "in", "ft", "px", "deg", "rev", "rpm", "g", "mg", "ms", "us", "min", "h",
    "kN", "mN", "mV", "uV", "kV", "mA", "uA", "mW", "kW", "MW", "mJ", "kJ", "mC", "kPa", "MPa", "hPa", "bar",
    "kHz", "MHz", "L", "mL",
];

const PER: &str = "per";

impl Unit {
    /// Unit that the suffix of `name` states; `None` where the suffix is not a known unit.
    ///
    /// The suffix follows an underscore and must not be the whole name. A pure number is recognised by its
    /// last word, which may be the whole name.
    pub fn from_column_name(name: &str) -> Option<Unit> {
        let words: Vec<&str> = name.split('_').collect();
        let (last, before) = words.split_last()?;
        if factor(last).is_none() {
            return DIMENSIONLESS_WORDS.contains(last).then_some(Unit::DIMENSIONLESS);
        }
        // The first word is never part of the unit: in `m_kg` it is the symbol of a mass, not a metre.
        let begin = before
            .iter()
            .rposition(|word| factor(word).is_none() && *word != PER)
            .map_or(1, |k| k + 1)
            .max(1);
        let base = words
            .get(begin - 1)
            .filter(|base| !base.is_empty() && **base != PER && !REFUSED_UNITS.contains(base));
        (base.is_some() && begin < words.len()).then(|| unit_of(&words[begin..])).flatten()
    }

    /// Whether `word`, as the last word of a name, denotes a pure number.
    pub(crate) fn is_dimensionless_word(word: &str) -> bool {
        DIMENSIONLESS_WORDS.contains(&word)
    }

    /// The accepted suffixes as one line of text, for error messages.
    pub fn accepted_suffixes() -> String {
        format!(
            "{LISTED_SUFFIXES}, or a quotient of these with _per_, such as _per_s, _N_per_m or _N_s_per_m; pure numbers end in {}",
            DIMENSIONLESS_WORDS.join(", ")
        )
    }
}

/// Unit of words that are unit symbols or `per`; `None` where their combination is not a unit.
fn unit_of(words: &[&str]) -> Option<Unit> {
    let mut sides = words.split(|word| *word == PER);
    let numerator = sides.next()?;
    let is_quotient = numerator.len() < words.len();
    let mut factors = match numerator {
        [] if is_quotient => Vec::new(),
        _ => side(numerator, is_quotient)?,
    };
    for divisor in sides {
        factors.extend(side(divisor, true)?.into_iter().map(|(symbol, twelfths)| (symbol, -twelfths)));
    }
    Unit::of_factors(&factors)
}

/// Factors (symbol, exponent in twelfths) of one side of `per`, or of a suffix without `per`.
fn side(words: &[&str], in_quotient: bool) -> Option<Vec<(Symbol, i32)>> {
    let text = words.join("_");
    if let Some((_, factors)) = COMPOUNDS.iter().find(|(compound, _)| *compound == text) {
        return Some(factors.iter().map(|&(symbol, exponent)| (symbol, exponent * TWELFTHS)).collect());
    }
    match words {
        [] => None,
        // Outside quotients only metres may have a power: `marker_A2` or `tank_V3` is a label.
        [word] if !in_quotient => {
            factor(word).filter(|&(symbol, t)| t == TWELFTHS || symbol == Symbol::Metre).map(|one| vec![one])
        }
        _ if !in_quotient => None,
        several => several.iter().map(|word| factor(word)).collect(),
    }
}

/// Parses a word such as `m`, `s2` or `kg` into symbol and exponent in twelfths; powers are 2 to 4.
fn factor(word: &str) -> Option<(Symbol, i32)> {
    let (text, exponent) = match word.as_bytes().last()? {
        digit @ b'2'..=b'4' => (&word[..word.len() - 1], i32::from(digit - b'0')),
        _ => (word, 1),
    };
    Symbol::from_text(text).map(|symbol| (symbol, exponent * TWELFTHS))
}

#[cfg(test)]
mod tests {
    //! Contract: a name states one unit or none.
    //!
    //! A unit that is not accepted is never read as a shorter suffix, and two adjacent units are one of the six
    //! compounds or are refused.
    use super::*;

    #[test]
    fn a_suffix_states_its_unit() {
        for (name, symbol) in [
            ("height_m", "m"),
            ("area_m2", "m^2"),
            ("velocity_m_s", "m/s"),
            ("pusher_velocity_x_m_s", "m/s"),
            ("acceleration_m_s2", "m/s^2"),
            ("theta_rad", "rad"),
            ("spin_x_rad_s", "rad/s"),
            ("spin_up_rad_s2", "rad/s^2"),
            ("delay_s", "s"),
            ("drag_per_m", "1/m"),
            ("damping_per_s", "1/s"),
            ("clock_Hz", "Hz"),
            ("mass_kg", "kg"),
            ("m_kg", "kg"),
            ("force_x_N", "N"),
            ("torque_z_N_m", "N m"),
            ("pressure_Pa", "Pa"),
            ("room_K", "K"),
            ("pusher_new", ""),
            ("restitution", ""),
            ("sheets_count", ""),
        ] {
            assert_eq!(Unit::from_column_name(name).map(Unit::symbol).as_deref(), Some(symbol), "{name}");
        }
    }

    #[test]
    fn electrical_thermal_and_quotient_units_are_accepted() {
        for (name, symbol, dimensions) in [
            ("motor_V", "V", "kg m^2/(s^3 A)"),
            ("current_A", "A", "A"),
            ("power_W", "W", "kg m^2/s^3"),
            ("heat_J", "J", "kg m^2/s^2"),
            ("charge_C", "C", "s A"),
            ("winding_Ohm", "Ohm", "kg m^2/(s^3 A^2)"),
            ("volume_m3", "m^3", "m^3"),
            ("inertia_kg_m2", "kg m^2", "kg m^2"),
            ("stiffness_N_per_m", "N/m", "kg/s^2"),
            ("cart_damping_N_s_per_m", "N s/m", "kg/s"),
            ("burn_kg_per_s", "kg/s", "kg/s"),
            ("flow_m3_per_s", "m^3/s", "m^3/s"),
            ("gain_N_per_V", "N/V", "s A/m"),
            ("gain_rad_per_V_s2", "rad/(V s^2)", "s A/(kg m^2)"),
            ("k_per_kg", "1/kg", "1/kg"),
            ("drag_per_m2", "1/m^2", "1/m^2"),
            ("k_per_rad", "1/rad", "1"),
            ("loss_W_per_m2_per_K", "W/(m^2 K)", "kg/(s^3 K)"),
            ("capacity_J_per_kg_K", "J/(kg K)", "m^2/(s^2 K)"),
            ("c_m_per_N", "m/N", "s^2/kg"),
        ] {
            let unit = Unit::from_column_name(name).unwrap_or_else(|| panic!("{name} is refused"));
            assert_eq!(
                (unit.symbol(), unit.dimensions().to_string()),
                (symbol.into(), dimensions.into()),
                "{name}"
            );
        }
    }

    #[test]
    fn older_compounds_keep_their_meaning_beside_per() {
        for (name, same) in [
            ("k_N_per_m_s", "k_N_s_per_m"),
            ("emf_V_per_rad_s", "emf_V_s_per_rad"),
            ("k_N_m_per_rad", "k_J_per_rad"),
            ("gain_m_s_per_V", "gain_m_per_s_V"),
        ] {
            let dimensions = |name| Unit::from_column_name(name).map(Unit::dimensions);
            assert!(dimensions(name).is_some(), "{name}");
            assert_eq!(dimensions(name), dimensions(same), "{name}");
        }
    }

    #[test]
    fn an_unknown_missing_or_ambiguous_unit_is_none() {
        for name in [
            "height",
            "m",
            "_m",
            "x_mm",
            "x_mm_s",
            "speed_km_s",
            "angle_deg",
            "spin_deg_s",
            "turn_deg_per_s",
            "y_px",
            "force_n",
            "x__m",
            "height_M",
            "supply_mV",
            "supply_mV_s",
            "x_per",
            "x_per_per_m",
            "k_N_per",
            "per_m",
            "flow_m3_s",
            "x_N_s",
            "marker_A_m",
            "marker_A2",
            "x_m5",
            "k_N_per_mm",
            "",
            "_",
            "é_m2é",
        ] {
            assert_eq!(Unit::from_column_name(name), None, "{name}");
        }
    }
}
