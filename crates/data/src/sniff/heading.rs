//! Names of columns with the units that people write into them: `t (s)`, `time [ms]`, `x_cm`, `height/mm`.

/// Units that messages list.
pub(super) const KNOWN_UNITS: &str = "known are m, cm, mm, um, in, ft, px, s, ms, us, ns, min, frames, rad, deg, \
                                      m/s, cm/s, mm/s, rad/s, deg/s";

/// Quantity that a unit measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Measures {
    Length,
    /// A length on an image, whose scale nobody wrote down.
    Pixels,
    Time,
    /// A number of frames.
    Frames,
    Angle,
    Speed,
    Turning,
}

/// A unit in SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    pub measures: Measures,
    pub factor: f64,
}

/// Spellings of units, in small letters.
const UNITS: [(Measures, f64, &[&str]); 21] = [
    (Measures::Length, 1.0, &["m", "meter", "meters", "metre", "metres"]),
    (Measures::Length, 1e-1, &["dm"]),
    (Measures::Length, 1e-2, &["cm", "centimeter", "centimeters", "centimetre", "centimetres"]),
    (Measures::Length, 1e-3, &["mm", "millimeter", "millimeters", "millimetre", "millimetres"]),
    (Measures::Length, 1e-6, &["um", "µm", "μm", "micron", "microns"]),
    (Measures::Length, 0.0254, &["in", "inch", "inches"]),
    (Measures::Length, 0.3048, &["ft", "foot", "feet"]),
    (Measures::Pixels, 1.0, &["px", "pix", "pixel", "pixels"]),
    (Measures::Time, 1.0, &["s", "sec", "secs", "second", "seconds"]),
    (Measures::Time, 1e-3, &["ms", "msec", "millisecond", "milliseconds"]),
    (Measures::Time, 1e-6, &["us", "µs", "μs", "usec", "microsecond", "microseconds"]),
    (Measures::Time, 1e-9, &["ns", "nsec", "nanosecond", "nanoseconds"]),
    (Measures::Time, 60.0, &["min", "minute", "minutes"]),
    (Measures::Frames, 1.0, &["frame", "frames"]),
    (Measures::Angle, 1.0, &["rad", "radian", "radians"]),
    (Measures::Angle, std::f64::consts::PI / 180.0, &["deg", "°", "degree", "degrees", "grad"]),
    (Measures::Speed, 1.0, &["m/s", "m_s", "m s^-1", "ms-1"]),
    (Measures::Speed, 1e-2, &["cm/s", "cm_s"]),
    (Measures::Speed, 1e-3, &["mm/s", "mm_s"]),
    (Measures::Turning, 1.0, &["rad/s", "rad_s"]),
    (Measures::Turning, std::f64::consts::PI / 180.0, &["deg/s", "deg_s", "°/s"]),
];

impl Scale {
    /// The unit that a text names.
    pub fn of(text: &str) -> Option<Scale> {
        let text = text.trim().trim_matches(|c| "()[]{}<>".contains(c)).trim().to_lowercase();
        let found = UNITS.iter().find(|(_, _, spellings)| spellings.contains(&text.as_str()));
        found.map(|&(measures, factor, _)| Scale { measures, factor })
    }
}

impl Scale {
    /// The unit that a user gives: one of the known ones, or how many metres it has.
    pub fn given(text: &str) -> Option<Scale> {
        let metres = || text.trim().parse::<f64>().ok().filter(|f| f.is_finite() && *f != 0.0);
        Scale::of(text).or_else(|| metres().map(|factor| Scale { measures: Measures::Length, factor }))
    }
}

/// A name with what it says.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Heading {
    /// The heading as it stands in the file.
    pub raw: String,
    /// Its words in small letters, without the unit.
    pub words: Vec<String>,
    pub unit: Option<Scale>,
    /// The unit as it is written; empty without one.
    pub unit_text: String,
}

impl Heading {
    /// Reads a name; `unit_row` is what stands in a row of units below it.
    pub fn read(raw: &str, unit_row: &str) -> Heading {
        let (name, unit_text) = split(raw.trim());
        let unit_text = if unit_row.is_empty() { unit_text } else { unit_row };
        let unit_text = unit_text.trim().trim_matches(|c| "()[]{}<>".contains(c)).trim();
        let name = split_case(name).to_lowercase();
        let words = name.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
        Heading {
            raw: raw.trim().to_owned(),
            words: words.map(str::to_owned).collect(),
            unit: Scale::of(unit_text),
            unit_text: unit_text.to_owned(),
        }
    }
}

/// `ballX` and `posY` as two words each.
fn split_case(name: &str) -> String {
    let mut out = String::with_capacity(name.len() + 4);
    let mut before_is_small = false;
    for c in name.chars() {
        if c.is_uppercase() && before_is_small {
            out.push('_');
        }
        before_is_small = c.is_lowercase();
        out.push(c);
    }
    out
}

/// Name and unit of a heading; the unit is empty where none is written.
fn split(raw: &str) -> (&str, &str) {
    for (open, close) in [('(', ')'), ('[', ']'), ('{', '}'), ('<', '>')] {
        if let Some((name, rest)) = raw.split_once(open)
            && let Some((unit, _)) = rest.split_once(close)
            && !name.trim().is_empty()
        {
            return (name, unit);
        }
    }
    // At the end, after an underscore, a blank, a comma or a hyphen: the longest unit that leaves a name.
    let breaks = raw.char_indices().filter(|(_, c)| matches!(c, '_' | ' ' | ',' | '-' | '.'));
    for (at, c) in breaks {
        let (name, unit) = (&raw[..at], &raw[at + c.len_utf8()..]);
        let unit = unit.trim().trim_start_matches("in ");
        if Scale::of(unit).is_some() && !name.trim().is_empty() {
            return (name, unit);
        }
    }
    // A slash divides by the unit, as in physics: height/mm. The name comes before the first one.
    if let Some((name, unit)) = raw.split_once('/')
        && Scale::of(unit).is_some()
        && !name.trim().is_empty()
    {
        return (name, unit);
    }
    (raw, "")
}

#[cfg(test)]
mod tests {
    //! Contract: the unit is found wherever people write it, and a name without one has none.
    use super::*;

    #[test]
    fn units_are_read_from_names() {
        for (raw, words, measures, factor) in [
            ("t (s)", "t", Measures::Time, 1.0),
            ("time [ms]", "time", Measures::Time, 1e-3),
            ("x_cm", "x", Measures::Length, 1e-2),
            ("height/mm", "height", Measures::Length, 1e-3),
            ("Ball Pos X {mm}", "ball pos x", Measures::Length, 1e-3),
            ("ballX_mm", "ball x", Measures::Length, 1e-3),
            ("vx_m_s", "vx", Measures::Speed, 1.0),
            ("vx_cm/s", "vx", Measures::Speed, 1e-2),
            ("theta (deg)", "theta", Measures::Angle, std::f64::consts::PI / 180.0),
            ("y, px", "y", Measures::Pixels, 1.0),
            ("Höhe in cm", "höhe", Measures::Length, 1e-2),
        ] {
            let heading = Heading::read(raw, "");
            assert_eq!(heading.words.join(" "), words, "{raw}");
            assert_eq!(heading.unit, Some(Scale { measures, factor }), "{raw}");
        }
        for raw in ["x", "m", "frame", "comment", "a/b"] {
            assert_eq!(Heading::read(raw, "").unit, None, "{raw}");
        }
        assert_eq!(Heading::read("x", "mm").unit.map(|u| u.factor), Some(1e-3));
    }
}
