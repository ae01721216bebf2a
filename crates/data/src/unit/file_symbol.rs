//! Symbols and words of the units that data files use, beyond those of SI that models use.

use std::f64::consts::{PI, TAU};

/// Conversion of one unit symbol: a value v in it is `factor * v + offset` in the SI unit `si`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FileSymbol {
    pub factor: f64,
    pub offset: f64,
    /// SI unit in the notation of [`Unit::parse`](super::Unit::parse).
    pub si: &'static str,
}

/// Units of data files: spellings, factor of the conversion to SI, and SI unit.
const SYMBOLS: [(&[&str], f64, &str); 47] = [
    (&["m", "meter", "meters", "metre", "metres"], 1.0, "m"),
    (&["centimeter", "centimeters", "centimetre", "centimetres"], 1e-2, "m"),
    (&["millimeter", "millimeters", "millimetre", "millimetres"], 1e-3, "m"),
    (&["micron", "microns"], 1e-6, "m"),
    (&["in", "inch", "inches"], 0.0254, "m"),
    (&["ft", "foot", "feet"], 0.3048, "m"),
    (&["mi", "mile", "miles"], 1609.344, "m"),
    (&["s", "sec", "secs", "second", "seconds"], 1.0, "s"),
    (&["msec", "millis", "millisecond", "milliseconds"], 1e-3, "s"),
    (&["usec", "micros", "microsecond", "microseconds"], 1e-6, "s"),
    (&["nsec", "nanos", "nanosecond", "nanoseconds"], 1e-9, "s"),
    (&["min", "mins", "minute", "minutes"], 60.0, "s"),
    (&["h", "hr", "hrs", "hour", "hours"], 3600.0, "s"),
    (&["d", "day", "days"], 86_400.0, "s"),
    (&["w", "wk", "week", "weeks"], 604_800.0, "s"),
    // The Julian year of astronomy, 365.25 days.
    (&["y", "yr", "yrs", "year", "years"], 31_557_600.0, "s"),
    (&["rad", "radian", "radians"], 1.0, "rad"),
    (&["deg", "°", "degree", "degrees", "grad"], PI / 180.0, "rad"),
    (&["rev", "revs", "turn", "turns", "revolution", "revolutions"], TAU, "rad"),
    (&["rpm", "RPM", "rev/min", "revolutions per minute"], TAU / 60.0, "rad/s"),
    (&["rps", "rev/s"], TAU, "rad/s"),
    (&["dps"], PI / 180.0, "rad/s"),
    (&["ms-1"], 1.0, "m/s"),
    (&["kph", "kmh"], 1.0 / 3.6, "m/s"),
    (&["mph"], 0.447_04, "m/s"),
    (&["kn", "kt", "knot", "knots"], 1852.0 / 3600.0, "m/s"),
    (&["g", "gram", "grams"], 1e-3, "kg"),
    (&["kilogram", "kilograms"], 1.0, "kg"),
    (&["lb", "lbs"], 0.453_592_37, "kg"),
    (&["N", "newton", "newtons"], 1.0, "N"),
    (&["lbf"], 4.448_221_615_260_5, "N"),
    (&["Nm"], 1.0, "N m"),
    (&["Pa", "pascal"], 1.0, "Pa"),
    (&["bar"], 1e5, "Pa"),
    (&["psi"], 6_894.757_293_168, "Pa"),
    (&["atm"], 101_325.0, "Pa"),
    (&["K", "kelvin"], 1.0, "K"),
    (&["V", "volt", "volts"], 1.0, "V"),
    (&["A", "amp", "amps", "ampere", "amperes"], 1.0, "A"),
    (&["W", "watt", "watts"], 1.0, "W"),
    (&["J", "joule", "joules"], 1.0, "J"),
    (&["Wh"], 3600.0, "J"),
    (&["C", "coulomb"], 1.0, "C"),
    (&["Ah"], 3600.0, "C"),
    (&["Ohm", "ohm", "ohms"], 1.0, "Ohm"),
    (&["Hz", "hertz"], 1.0, "Hz"),
    (&["mol"], 1.0, "mol"),
];
/// Volumes and pure numbers: spellings, factor of the conversion to SI, and SI unit.
const OTHERS: [(&[&str], f64, &str); 3] = [
    (&["L", "l", "liter", "liters", "litre", "litres"], 1e-3, "m^3"),
    (&["%", "percent", "pct"], 1e-2, ""),
    (&["ppm"], 1e-6, ""),
];
/// Temperature scales with another zero: spellings, K per degree, and the temperature of 0 degrees, K.
const TEMPERATURES: [(&[&str], f64, f64); 2] = [
    (&["degC", "°C", "celsius", "Celsius", "deg C", "° C", "degc", "centigrade"], 1.0, 273.15),
    (&["degF", "°F", "fahrenheit", "Fahrenheit", "deg F", "° F", "degf"], 5.0 / 9.0, 273.15 - 160.0 / 9.0),
];
/// SI prefixes: symbol, factor, and the unit symbols before which each is accepted.
const PREFIXES: [(&str, f64, &[&str]); 7] = [
    ("n", 1e-9, &["m", "s", "g", "N", "V", "A", "W", "J", "C", "mol", "L"]),
    ("u", 1e-6, &["m", "s", "g", "N", "V", "A", "W", "J", "C", "mol", "L", "rad", "Pa", "Nm", "Ohm"]),
    (
        "m",
        1e-3,
        &[
            "m", "s", "g", "N", "V", "A", "W", "J", "C", "mol", "L", "l", "rad", "Pa", "Nm", "Ohm", "bar",
            "K", "Hz", "Ah", "Wh",
        ],
    ),
    ("c", 1e-2, &["m", "L", "l", "N"]),
    ("d", 1e-1, &["m", "L", "l"]),
    ("k", 1e3, &["m", "g", "N", "V", "A", "W", "J", "Pa", "Nm", "Ohm", "Hz", "mol", "Wh", "Ah"]),
    ("M", 1e6, &["N", "V", "W", "J", "Pa", "Nm", "Ohm", "Hz", "Wh"]),
];

/// Conversion of a unit symbol, with or without a prefix; `None` for an unknown one.
pub(super) fn symbol(text: &str) -> Option<FileSymbol> {
    if let Some((_, factor, offset)) = TEMPERATURES.iter().find(|(spellings, ..)| spellings.contains(&text)) {
        return Some(FileSymbol { factor: *factor, offset: *offset, si: "K" });
    }
    if text == "hPa" {
        return Some(FileSymbol { factor: 100.0, offset: 0.0, si: "Pa" });
    }
    plain(text).or_else(|| {
        PREFIXES.iter().find_map(|(prefix, size, symbols)| {
            let rest = text.strip_prefix(prefix).filter(|rest| symbols.contains(rest))?;
            let unit = plain(rest)?;
            Some(FileSymbol { factor: unit.factor * size, ..unit })
        })
    })
}

/// Conversion of a unit symbol without a prefix; `None` for an unknown one.
fn plain(text: &str) -> Option<FileSymbol> {
    let all = || SYMBOLS.iter().chain(&OTHERS);
    let (_, factor, si) = all().find(|(spellings, ..)| spellings.contains(&text))?;
    Some(FileSymbol { factor: *factor, offset: 0.0, si })
}
