//! Parses column names with units, such as `t (s)`, `time [ms]`, `x_cm` or `height/mm`.

/// Accepted units, for messages.
pub(super) const KNOWN_UNITS: &str = "known units are m, cm, mm, um, in, ft, px, s, ms, us, ns, min, frames, rad, deg, \
                                      m/s, cm/s, mm/s, rad/s, deg/s";

/// Quantity that a unit measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    Length,
    /// A length in an image of unknown scale.
    Pixels,
    Time,
    /// A time in frames of unknown rate.
    Frames,
    Angle,
    Speed,
    AngularSpeed,
}

/// A unit that a file may use: the quantity that it measures and its size in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FileUnit {
    pub quantity: Quantity,
    pub factor: f64,
}

/// Accepted units with their spellings in lower case.
const UNITS: [(Quantity, f64, &[&str]); 21] = [
    (Quantity::Length, 1.0, &["m", "meter", "meters", "metre", "metres"]),
    (Quantity::Length, 1e-1, &["dm"]),
    (Quantity::Length, 1e-2, &["cm", "centimeter", "centimeters", "centimetre", "centimetres"]),
    (Quantity::Length, 1e-3, &["mm", "millimeter", "millimeters", "millimetre", "millimetres"]),
    (Quantity::Length, 1e-6, &["um", "µm", "μm", "micron", "microns"]),
    (Quantity::Length, 0.0254, &["in", "inch", "inches"]),
    (Quantity::Length, 0.3048, &["ft", "foot", "feet"]),
    (Quantity::Pixels, 1.0, &["px", "pix", "pixel", "pixels"]),
    (Quantity::Time, 1.0, &["s", "sec", "secs", "second", "seconds"]),
    (Quantity::Time, 1e-3, &["ms", "msec", "millisecond", "milliseconds"]),
    (Quantity::Time, 1e-6, &["us", "µs", "μs", "usec", "microsecond", "microseconds"]),
    (Quantity::Time, 1e-9, &["ns", "nsec", "nanosecond", "nanoseconds"]),
    (Quantity::Time, 60.0, &["min", "minute", "minutes"]),
    (Quantity::Frames, 1.0, &["frame", "frames"]),
    (Quantity::Angle, 1.0, &["rad", "radian", "radians"]),
    (Quantity::Angle, std::f64::consts::PI / 180.0, &["deg", "°", "degree", "degrees", "grad"]),
    (Quantity::Speed, 1.0, &["m/s", "m_s", "m s^-1", "ms-1"]),
    (Quantity::Speed, 1e-2, &["cm/s", "cm_s"]),
    (Quantity::Speed, 1e-3, &["mm/s", "mm_s"]),
    (Quantity::AngularSpeed, 1.0, &["rad/s", "rad_s"]),
    (Quantity::AngularSpeed, std::f64::consts::PI / 180.0, &["deg/s", "deg_s", "°/s"]),
];

impl FileUnit {
    /// The unit that a text names; brackets around it and upper case are ignored.
    pub fn parse(text: &str) -> Option<FileUnit> {
        let text = text.trim().trim_matches(|c| "()[]{}<>".contains(c)).trim().to_lowercase();
        let entry = UNITS.iter().find(|(_, _, spellings)| spellings.contains(&text.as_str()));
        entry.map(|&(quantity, factor, _)| FileUnit { quantity, factor })
    }

    /// The unit that an option gives: a known one, or its size in metres as a number.
    pub fn parse_option(text: &str) -> Option<FileUnit> {
        let metres = || text.trim().parse::<f64>().ok().filter(|f| f.is_finite() && *f != 0.0);
        FileUnit::parse(text)
            .or_else(|| metres().map(|factor| FileUnit { quantity: Quantity::Length, factor }))
    }
}

/// A column name, its words and its unit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Heading {
    /// The name as it is in the file.
    pub raw: String,
    /// Its words in lower case, without the unit.
    pub words: Vec<String>,
    pub unit: Option<FileUnit>,
    /// The text of the unit; empty without one.
    pub unit_text: String,
}

impl Heading {
    /// Parses a name; `unit_row` is its cell in the row of units, or empty.
    pub fn read(raw: &str, unit_row: &str) -> Heading {
        let (name, unit_text) = split_unit(raw.trim());
        let unit_text = if unit_row.is_empty() { unit_text } else { unit_row };
        let unit_text = unit_text.trim().trim_matches(|c| "()[]{}<>".contains(c)).trim();
        let name = split_case(name).to_lowercase();
        let words = name.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
        Heading {
            raw: raw.trim().to_owned(),
            words: words.map(str::to_owned).collect(),
            unit: FileUnit::parse(unit_text),
            unit_text: unit_text.to_owned(),
        }
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
        if FileUnit::parse(unit).is_some() && !name.trim().is_empty() {
            return (name, unit);
        }
    }
    // A slash divides by the unit, as in height/mm. The name ends at the first slash.
    if let Some((name, unit)) = raw.split_once('/')
        && FileUnit::parse(unit).is_some()
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
        for (raw, words, quantity, factor) in [
            ("t (s)", "t", Quantity::Time, 1.0),
            ("time [ms]", "time", Quantity::Time, 1e-3),
            ("x_cm", "x", Quantity::Length, 1e-2),
            ("height/mm", "height", Quantity::Length, 1e-3),
            ("Ball Pos X {mm}", "ball pos x", Quantity::Length, 1e-3),
            ("ballX_mm", "ball x", Quantity::Length, 1e-3),
            ("vx_m_s", "vx", Quantity::Speed, 1.0),
            ("vx_cm/s", "vx", Quantity::Speed, 1e-2),
            ("theta (deg)", "theta", Quantity::Angle, std::f64::consts::PI / 180.0),
            ("y, px", "y", Quantity::Pixels, 1.0),
            ("Höhe in cm", "höhe", Quantity::Length, 1e-2),
        ] {
            let heading = Heading::read(raw, "");
            assert_eq!(heading.words.join(" "), words, "{raw}");
            assert_eq!(heading.unit, Some(FileUnit { quantity, factor }), "{raw}");
        }
        for raw in ["x", "m", "frame", "comment", "a/b"] {
            assert_eq!(Heading::read(raw, "").unit, None, "{raw}");
        }
        assert_eq!(Heading::read("x", "mm").unit.map(|u| u.factor), Some(1e-3));
    }
}
