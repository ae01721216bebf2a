//! Drafts a model file of equations for a recording: inputs, outputs, and linear equations to be replaced.

use super::Drafted;
use augsim_data::{Dataset, Dimensions, Unit, digits};
use std::fmt::Write;

/// Words in column names that mark an input of the system: a command or a disturbance.
const INPUT_WORDS: [&str; 34] = [
    "u",
    "cmd",
    "command",
    "commanded",
    "input",
    "voltage",
    "current",
    "force",
    "torque",
    "tau",
    "heater",
    "pwm",
    "duty",
    "setpoint",
    "reference",
    "ref",
    "throttle",
    "valve",
    "pump",
    "power",
    "drive",
    "excitation",
    "ambient",
    "room",
    "outside",
    "load",
    "wind",
    "disturbance",
    "motor",
    "fan",
    "supply",
    "spannung",
    "strom",
    "kraft",
];
/// Units of columns that are taken as inputs, because actuators are commanded in them.
const INPUT_UNITS: [&str; 5] = ["V", "A", "N", "N m", "W"];
/// Words in column names that mark a counter of rows, which the draft does not use.
const COUNTER_WORDS: [&str; 6] = ["frame", "index", "idx", "sample", "count", "row"];
/// Maximum length of a column name that the drafted model uses, so that prefixed names remain valid.
const MAX_NAME: usize = 48;
/// Ratio of the bound of a drafted parameter to its scale, wide enough for any recording.
const BOUND: f64 = 1000.0;

/// Role of a column of the recording in the drafted model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Input,
    Output,
    Constant,
    Unused,
}

/// Column of the recording with its role and its statistics.
struct Quantity {
    name: String,
    unit: Option<Unit>,
    role: Role,
    mean: f64,
    range: f64,
    /// Angular frequency of the column's swings about its mean, rad/s; 0 without swings.
    frequency: f64,
}

/// Drafts a model file of linear equations for `data`: its text and its columns; `None` where no column varies.
///
/// `name` and `source` appear in the text.
pub(super) fn draft(data: &Dataset, name: &str, source: &str) -> Option<(String, Drafted)> {
    let mut quantities: Vec<Quantity> = (0..data.columns().len()).map(|i| quantity(data, i)).collect();
    // Where every column looks like an input, the last one is taken as the response.
    if !quantities.iter().any(|q| q.role == Role::Output) {
        quantities.iter_mut().rfind(|q| q.role == Role::Input)?.role = Role::Output;
    }
    let names = |role: Role| -> Vec<String> {
        quantities.iter().filter(|q| q.role == role).map(|q| q.name.clone()).collect()
    };
    let (inputs, outputs) = (names(Role::Input), names(Role::Output));
    let text = text(&quantities, name, source, duration(data));
    Some((text, Drafted { inputs, outputs }))
}

/// Median duration of the trajectories, s.
fn duration(data: &Dataset) -> f64 {
    let span = |t: &augsim_data::Trajectory| t.time_s().last().zip(t.time_s().first()).map(|(b, a)| b - a);
    let mut spans: Vec<f64> = data.trajectories().iter().filter_map(span).filter(|s| *s > 0.0).collect();
    spans.sort_by(f64::total_cmp);
    spans.get(spans.len() / 2).copied().unwrap_or(1.0)
}

fn quantity(data: &Dataset, index: usize) -> Quantity {
    let column = &data.columns()[index];
    let values = || {
        data.trajectories()
            .iter()
            .flat_map(move |t| t.column(index).iter().copied().filter(|v| v.is_finite()))
    };
    let count = values().count().max(1) as f64;
    let mean = values().sum::<f64>() / count;
    let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let range = (high - low).max(0.0);
    let words: Vec<String> = column
        .name()
        .to_lowercase()
        .split('_')
        .map(|w| w.trim_end_matches(|c: char| c.is_ascii_digit()).to_owned())
        .collect();
    let has = |list: &[&str]| words.iter().any(|w| list.contains(&w.as_str()));
    let symbol = column.unit().symbol();
    let is_counter = has(&COUNTER_WORDS) && values().all(|v| v.fract() == 0.0);
    let role = match () {
        () if column.name().len() > MAX_NAME || is_counter => Role::Unused,
        () if range == 0.0 => Role::Constant,
        () if has(&INPUT_WORDS) || INPUT_UNITS.contains(&symbol.as_str()) => Role::Input,
        () => Role::Output,
    };
    let unit = Unit::from_column_name(column.name());
    Quantity {
        name: column.name().to_owned(),
        unit,
        role,
        mean,
        range,
        frequency: frequency(data, index, mean, range),
    }
}

/// Angular frequency of a column's swings about its mean, rad/s; 0 without swings.
///
/// A swing counts where the value goes from a quarter of its range below the mean to a quarter above it.
fn frequency(data: &Dataset, index: usize, mean: f64, range: f64) -> f64 {
    let (mut swings, mut seconds) = (0_u32, 0.0);
    for t in data.trajectories() {
        let mut was_low = false;
        for value in t.column(index) {
            if *value > mean + 0.25 * range && was_low {
                (swings, was_low) = (swings + 1, false);
            } else if *value < mean - 0.25 * range {
                was_low = true;
            }
        }
        seconds += t.time_s().last().zip(t.time_s().first()).map_or(0.0, |(b, a)| b - a);
    }
    if seconds > 0.0 { std::f64::consts::TAU * f64::from(swings) / seconds } else { 0.0 }
}

/// Entry `unit = "…"` of a parameter in `numerator / (divisor s^per_seconds)`; empty where a unit is unknown.
fn unit_entry(numerator: Option<Unit>, divisor: Option<Unit>, per_seconds: i32) -> String {
    let (Some(numerator), Some(divisor)) = (numerator, divisor) else { return String::new() };
    let mut dimensions = numerator.dimensions() / divisor.dimensions();
    for _ in 0..per_seconds {
        dimensions = dimensions / Dimensions::TIME;
    }
    Unit::from_dimensions(dimensions).map_or(String::new(), |unit| match unit.symbol() {
        symbol if symbol.is_empty() => ", unit = \"1\"".to_owned(),
        symbol => format!(", unit = \"{symbol}\""),
    })
}

fn text(quantities: &[Quantity], name: &str, source: &str, duration_s: f64) -> String {
    let of = |role: Role| quantities.iter().filter(move |q| q.role == role);
    let inputs: Vec<&Quantity> = of(Role::Input).collect();
    let mut out = format!(
        "# Made by augsim start from {source}.\n\
         # This draft runs: each output follows a linear equation of its own. Replace [rates] by the equations of your\n\
         # system, with a name, a nominal value and bounds for each constant under [parameters]. A column that is under\n\
         # the wrong heading, [inputs] or [outputs], can be moved. docs/model-file.md explains every key, and\n\
         # `augsim model new pendulum` writes a complete example.\n\
         scenario = \"system\"\nname = \"{name}\"\n"
    );
    let (mut states, mut parameters, mut rates) = (String::new(), String::new(), String::new());
    let mut outputs = String::new();
    // Writing to a string cannot fail.
    for q in of(Role::Output) {
        let _ = equation(q, &inputs, duration_s, &mut states, &mut parameters, &mut rates);
        let _ = writeln!(
            outputs,
            "{} = {{ value = \"state_{}\", sd = \"estimate\"{} }}",
            q.name,
            q.name,
            dimensionless(q)
        );
    }
    if !inputs.is_empty() {
        out += "\n[inputs] # what acts on the system: commands, loads, surroundings\n";
        inputs
            .iter()
            .for_each(|q| out += &format!("{} = {{ hold = \"linear\"{} }}\n", q.name, dimensionless(q)));
    }
    out += &format!("\n[states] # start values are those of the recording\n{states}");
    out += &format!("\n[parameters]\n{parameters}");
    out += &format!("\n[rates] # the equations: replace them\n{rates}");
    out += &format!("\n[outputs] # what was measured; value is an expression of the states\n{outputs}");
    for q in of(Role::Constant) {
        out += &format!("\n# Constant in these data: {} = {}.\n", q.name, digits(q.mean));
    }
    let unused: Vec<&str> = of(Role::Unused).map(|q| q.name.as_str()).collect();
    if !unused.is_empty() {
        out += &format!("\n# Columns that this draft does not use: {}.\n", unused.join(", "));
    }
    out
}

/// Entry `unit = "1"` for a quantity without a known unit; empty for others.
fn dimensionless(q: &Quantity) -> &'static str {
    if q.unit.is_none() { ", unit = \"1\"" } else { "" }
}

/// Adds the state, the parameters and the rate of one output to the texts of the drafted model.
///
/// A position or an angle swings about its rest, `y'' = -k (y - rest) - d y' + gain u`; any other quantity
/// approaches a level, `y' = (level - y) / T + gain u`.
fn equation(
    q: &Quantity,
    inputs: &[&Quantity],
    duration_s: f64,
    states: &mut String,
    parameters: &mut String,
    rates: &mut String,
) -> std::fmt::Result {
    let (name, unit) = (&q.name, Some(q.unit.unwrap_or(Unit::DIMENSIONLESS)));
    let is_position = q.unit.is_some_and(|u| u == Unit::METRE || u == Unit::RADIAN);
    let symbol = dimensionless(q);
    writeln!(states, "state_{name} = {{ start = \"{name}\"{symbol} }}")?;
    let (low, high) = (digits(q.mean - BOUND * q.range), digits(q.mean + BOUND * q.range));
    writeln!(
        parameters,
        "level_{name} = {{ nominal = {}, min = {low}, max = {high}{symbol} }}",
        digits(q.mean)
    )?;
    // Swings, or else a tenth of the recording, give the scale of time.
    let rate = if q.frequency > 0.0 { q.frequency } else { 10.0 / duration_s };
    let bounded =
        |value: f64| format!("nominal = {}, min = 0.0, max = {}", digits(value), digits(BOUND * value));
    let mut terms = String::new();
    for input in inputs {
        let gain = format!("gain_{name}_of_{}", input.name);
        let scale = BOUND * q.range / input.range * rate * if is_position { rate } else { 1.0 };
        let unit = unit_entry(
            unit,
            Some(input.unit.unwrap_or(Unit::DIMENSIONLESS)),
            if is_position { 2 } else { 1 },
        );
        writeln!(
            parameters,
            "{gain} = {{ nominal = 0.0, min = {}, max = {}{unit} }}",
            digits(-scale),
            digits(scale)
        )?;
        terms += &format!(" + {gain} * {}", input.name);
    }
    if is_position {
        let speed = if q.unit == Some(Unit::METRE) { "m_s" } else { "rad_s" };
        writeln!(states, "rate_{name}_{speed} = {{ start = \"slope({name})\" }}")?;
        writeln!(parameters, "stiffness_{name}_per_s2 = {{ {}, unit = \"1/s^2\" }}", bounded(rate * rate))?;
        writeln!(parameters, "damping_{name}_per_s = {{ {}, unit = \"1/s\" }}", bounded(0.2 * rate))?;
        writeln!(rates, "state_{name} = \"rate_{name}_{speed}\"")?;
        writeln!(
            rates,
            "rate_{name}_{speed} = \"stiffness_{name}_per_s2 * (level_{name} - state_{name}) - damping_{name}_per_s * rate_{name}_{speed}{terms}\""
        )
    } else {
        writeln!(parameters, "rate_{name}_per_s = {{ {}, unit = \"1/s\" }}", bounded(rate))?;
        writeln!(rates, "state_{name} = \"rate_{name}_per_s * (level_{name} - state_{name}){terms}\"")
    }
}
