//! Dimensions of quantities: read from the end of a name or from a unit's text, multiplied, compared and printed.

use std::fmt;

/// Exponents are kept in twelfths, so that square and cube roots of units stay exact.
const PARTS: i32 = 12;

/// Exponents of metre, kilogram, second, ampere, kelvin and mole. The radian is a pure number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dimension([i32; 6]);

/// Symbol and exponents of the units that names and `unit = "…"` may use.
const UNITS: [(&str, [i32; 6]); 19] = [
    ("m", [1, 0, 0, 0, 0, 0]),
    ("kg", [0, 1, 0, 0, 0, 0]),
    ("s", [0, 0, 1, 0, 0, 0]),
    ("A", [0, 0, 0, 1, 0, 0]),
    ("K", [0, 0, 0, 0, 1, 0]),
    ("mol", [0, 0, 0, 0, 0, 1]),
    ("rad", [0, 0, 0, 0, 0, 0]),
    ("N", [1, 1, -2, 0, 0, 0]),
    ("J", [2, 1, -2, 0, 0, 0]),
    ("W", [2, 1, -3, 0, 0, 0]),
    ("V", [2, 1, -3, -1, 0, 0]),
    ("C", [0, 0, 1, 1, 0, 0]),
    ("Pa", [-1, 1, -2, 0, 0, 0]),
    ("Hz", [0, 0, -1, 0, 0, 0]),
    ("Ohm", [2, 1, -3, -2, 0, 0]),
    ("F", [-2, -1, 4, 2, 0, 0]),
    ("H", [2, 1, -2, -2, 0, 0]),
    ("T", [0, 1, -2, -1, 0, 0]),
    ("Wb", [2, 1, -2, -1, 0, 0]),
];

/// Two words at the end of a name that mean a quotient or a product, as in data columns.
const PAIRS: [(&str, &str, &str); 13] = [
    ("m", "s", "m/s"),
    ("m", "s2", "m/s^2"),
    ("m", "s3", "m/s^3"),
    ("rad", "s", "rad/s"),
    ("rad", "s2", "rad/s^2"),
    ("rad", "s3", "rad/s^3"),
    ("m3", "s", "m^3/s"),
    ("kg", "s", "kg/s"),
    ("N", "m", "N m"),
    ("N", "s", "N s"),
    ("V", "s", "V s"),
    ("A", "s", "A s"),
    ("kg", "m2", "kg m^2"),
];

/// Last words of a name that say "pure number".
const PURE: [&str; 12] = [
    "new", "flag", "count", "index", "ratio", "fraction", "restitution", "friction", "efficiency", "duty",
    "exponent", "factor",
];

/// Words that show, standing before a unit, that the whole is another unit: `speed_km_s` is not in seconds.
const FOREIGN: [&str; 17] =
    ["per", "km", "cm", "mm", "um", "in", "ft", "px", "deg", "rev", "g", "mg", "ms", "us", "min", "h", "kN"];

impl Dimension {
    /// A pure number.
    pub const NONE: Dimension = Dimension([0; 6]);
    /// Time.
    pub const SECOND: Dimension = Dimension([0, 0, PARTS, 0, 0, 0]);

    /// Dimension of a product.
    pub fn times(self, other: Dimension) -> Dimension {
        Dimension(std::array::from_fn(|i| self.0[i].saturating_add(other.0[i])))
    }

    /// Dimension of a quotient.
    pub fn over(self, other: Dimension) -> Dimension {
        Dimension(std::array::from_fn(|i| self.0[i].saturating_sub(other.0[i])))
    }

    /// Dimension of a power; nothing where an exponent would be no multiple of a twelfth.
    pub fn power(self, exponent: f64) -> Option<Dimension> {
        let mut out = [0; 6];
        for (to, from) in out.iter_mut().zip(self.0) {
            let exact = f64::from(from) * exponent;
            if (exact - exact.round()).abs() > 1e-6 || exact.abs() > 1e6 {
                return None;
            }
            *to = exact.round() as i32;
        }
        Some(Dimension(out))
    }

    /// Text of the unit at the end of a name (`N s/m` of `damping_N_s_per_m`); empty for a pure number, nothing for a
    /// name that states none.
    pub fn unit_of_name(name: &str) -> Option<String> {
        let words: Vec<&str> = name.split('_').collect();
        if let Some(per) = words.iter().rposition(|w| *w == "per").filter(|p| *p > 0) {
            return quotient(&words[..per], &words[per + 1..]);
        }
        let (last, before) = words.split_last()?;
        let previous = before.last().copied();
        // Something must precede the unit: in `m_s` alone the `m` is the name and the unit is the second.
        if let [.., name, _] = before
            && let Some((.., unit)) = PAIRS.iter().find(|(a, b, _)| Some(*a) == previous && b == last)
        {
            return (!is_foreign(name) && !name.is_empty()).then(|| (*unit).into());
        }
        if PURE.contains(last) {
            return Some(String::new());
        }
        let before = previous?;
        let clash = before.is_empty() || is_foreign(before) || spelt(before).is_some() && words.len() > 2;
        spelt(last).filter(|_| !clash)
    }

    /// Dimension of the unit at the end of a name.
    pub fn of_name(name: &str) -> Option<Dimension> {
        Dimension::unit_of_name(name).and_then(|unit| Dimension::of_unit(&unit))
    }

    /// Dimension of a unit's text: symbols with exponents (`s^2`, `V^0.5`, `s2`), joined by blanks, `*` and `/`, with
    /// brackets; a sign `/` holds for the one factor or bracket behind it. Empty or `1` is a pure number.
    pub fn of_unit(text: &str) -> Option<Dimension> {
        // The longest real unit has some 30 characters; the bound keeps the nesting of brackets small.
        if text.len() > 64 {
            return None;
        }
        let text: Vec<char> = text.chars().collect();
        let mut at = 0;
        let found = factors(&text, &mut at)?;
        (at == text.len()).then_some(found)
    }

    /// Symbols that a unit may be made of, for messages.
    pub fn known_symbols() -> String {
        UNITS.map(|(symbol, _)| symbol).join(" ")
    }
}

fn is_foreign(word: &str) -> bool {
    FOREIGN.contains(&word)
}

/// A word of a name as a unit's text: a symbol with an exponent of one digit (`m3` is `m^3`).
fn spelt(word: &str) -> Option<String> {
    let (symbol, exponent) = match word.char_indices().next_back() {
        Some((cut, digit @ '2'..='9')) => (&word[..cut], Some(digit)),
        _ => (word, None),
    };
    let (symbol, _) = UNITS.iter().find(|(s, _)| *s == symbol)?;
    Some(exponent.map_or_else(|| (*symbol).into(), |e| format!("{symbol}^{e}")))
}

/// The unit of a name around its word `per`.
fn quotient(before: &[&str], after: &[&str]) -> Option<String> {
    let below: Option<Vec<String>> = after.iter().map(|w| spelt(w)).collect();
    let below = below.filter(|b| !b.is_empty())?;
    // The first word is the name itself, even where it reads like a unit.
    let named = before.get(1..).unwrap_or(&[]);
    let mut above: Vec<String> = named.iter().rev().map_while(|w| spelt(w)).collect();
    above.reverse();
    let first = before.len() - above.len();
    if before.get(first.wrapping_sub(1)).is_none_or(|w| w.is_empty() || is_foreign(w)) {
        return None;
    }
    let above = if above.is_empty() { "1".into() } else { above.join(" ") };
    Some(match &below[..] {
        [one] => format!("{above}/{one}"),
        many => format!("{above}/({})", many.join(" ")),
    })
}

fn factors(text: &[char], at: &mut usize) -> Option<Dimension> {
    let mut total = Dimension::NONE;
    let (mut divides, mut pending, mut any) = (false, false, false);
    loop {
        while text.get(*at) == Some(&' ') {
            *at += 1;
        }
        match text.get(*at) {
            None | Some(')') => return (!pending).then_some(total),
            Some(sign @ ('*' | '·' | '/')) => {
                if pending || !any {
                    return None;
                }
                (divides, pending) = (*sign == '/', true);
                *at += 1;
                continue;
            }
            _ => {}
        }
        let one = factor(text, at)?;
        total = if divides { total.over(one) } else { total.times(one) };
        (divides, pending, any) = (false, false, true);
    }
}

fn factor(text: &[char], at: &mut usize) -> Option<Dimension> {
    let base = match text.get(*at)? {
        '(' => {
            *at += 1;
            let inner = factors(text, at)?;
            if text.get(*at) != Some(&')') {
                return None;
            }
            *at += 1;
            inner
        }
        '1' => {
            *at += 1;
            return Some(Dimension::NONE);
        }
        _ => {
            let begin = *at;
            *at += text[begin..].iter().take_while(|c| c.is_ascii_alphabetic()).count();
            let symbol: String = text[begin..*at].iter().collect();
            let (_, exponents) = UNITS.iter().find(|(s, _)| *s == symbol)?;
            Dimension(exponents.map(|e| e * PARTS))
        }
    };
    if text.get(*at) == Some(&'^') {
        *at += 1;
    }
    let begin = *at;
    *at += text[begin..].iter().take_while(|c| c.is_ascii_digit() || matches!(c, '.' | '-')).count();
    let digits: String = text[begin..*at].iter().collect();
    if digits.is_empty() {
        return (text.get(begin.wrapping_sub(1)) != Some(&'^')).then_some(base);
    }
    base.power(digits.parse().ok().filter(|e: &f64| e.abs() <= 9.0)?)
}

impl fmt::Display for Dimension {
    /// In derived units where one fits (`N`, `N/m`, `V`), else in base units, such as `kg m^2/s`; a pure number is `1`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let simple = |d: &Dimension| d.0.iter().filter(|e| **e != 0).count();
        for (symbol, exponents) in UNITS.iter().skip(7).filter(|(s, _)| *s != "Hz" && *s != "T") {
            let unit = Dimension(exponents.map(|e| e * PARTS));
            let rest = self.over(unit);
            if rest == Dimension::NONE {
                return f.write_str(symbol);
            }
            // One base unit beside a derived one reads better than three base units.
            if simple(&rest) == 1 && simple(self) > 2 {
                let (above, below) = rest.written();
                return match below.is_empty() {
                    true => write!(f, "{symbol} {above}"),
                    false => write!(f, "{symbol}/{below}"),
                };
            }
        }
        let (above, below) = self.written();
        let above = if above.is_empty() { "1" } else { &above };
        match below.split(' ').count() {
            _ if below.is_empty() => f.write_str(above),
            1 => write!(f, "{above}/{below}"),
            _ => write!(f, "{above}/({below})"),
        }
    }
}

impl Dimension {
    /// Base units with positive and with negative exponents.
    fn written(self) -> (String, String) {
        let side = |sign: i32| {
            let parts = self.0.iter().zip(UNITS).filter(|(e, _)| **e * sign > 0).map(|(e, (symbol, _))| {
                let exponent = f64::from(e.abs()) / f64::from(PARTS);
                if exponent == 1.0 { symbol.to_owned() } else { format!("{symbol}^{exponent}") }
            });
            parts.collect::<Vec<_>>().join(" ")
        };
        (side(1), side(-1))
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the end of a name states one unit or none; a unit's text and its name give the same dimension; what
    //! is printed can be read back.
    use super::*;

    #[test]
    fn names_state_their_unit() {
        for (name, unit) in [
            ("theta_rad", "rad"),
            ("omega_rad_s", "rad/s"),
            ("v_m_s", "m/s"),
            ("gravity_m_s2", "m/s^2"),
            ("damping_per_s", "1/s"),
            ("k4_per_s", "1/s"),
            ("cart_damping_N_s_per_m", "N s/m"),
            ("stiffness_N_per_m", "N/m"),
            ("gain_rad_per_V_s2", "rad/(V s^2)"),
            ("volume_m3", "m^3"),
            ("flow_m3_s", "m^3/s"),
            ("pump_V", "V"),
            ("torque_N_m", "N m"),
            ("inertia_kg_m2", "kg m^2"),
            ("restitution", ""),
        ] {
            assert_eq!(Dimension::unit_of_name(name).as_deref(), Some(unit), "{name}");
            assert!(Dimension::of_name(name).is_some(), "{name}");
        }
        for name in ["k1", "m", "speed_km_s", "angle_deg", "x__m", "flow_per_", "gain_V_m", "k_per_furlong"] {
            assert_eq!(Dimension::unit_of_name(name), None, "{name}");
        }
    }

    #[test]
    fn unit_texts_multiply_out() {
        let same = |a: &str, b: &str| assert_eq!(Dimension::of_unit(a), Dimension::of_unit(b), "{a} {b}");
        same("V A", "W");
        same("N m", "J");
        same("kg m^2/s^3/A", "V");
        same("rad/(V s^2)", "1/V/s2");
        same("V^0.5/s * V^0.5", "V/s");
        same("", "1");
        same("C/s", "A");
        for wrong in ["furlong", "m/", "m^", "(m", "m)", "*m", "m//s", "m^99", "m^1.2.3"] {
            assert_eq!(Dimension::of_unit(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn printed_dimensions_can_be_read_back() {
        for unit in ["N/m", "N s/m", "m/s^2", "1/s", "V^0.5/s", "1", "V", "kg m^2", "K/s", "rad/(V s^2)"] {
            let dimension = Dimension::of_unit(unit).expect("a known unit");
            assert_eq!(Dimension::of_unit(&dimension.to_string()), Some(dimension), "{unit} {dimension}");
        }
        assert_eq!(Dimension::of_unit("m s^-2").map(|d| d.to_string()).as_deref(), Some("m/s^2"));
    }
}
