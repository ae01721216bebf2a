//! The clock of a time column: one rule for every command that reads a table.
//!
//! 1. A unit that the user, the header or a row of units states is taken.
//! 2. ISO 8601 dates and clock times are points in time; times count from the first sample.
//! 3. Numbers of the size of a time since 1970 in s, ms, us or ns are such times ([`EPOCH_S`]).
//! 4. Other numbers without a unit are seconds, unless all are whole and their step is not one of a logger that
//!    counts seconds; then they are ms, us or ns by the size of the step.

use super::calendar::{Instant, Written, instant};
use super::dialect::{Sheet, number};
use super::heading::ColumnUnit;
use super::unrecognised::Unrecognised;
use crate::error::DataError;
use crate::escape_control_characters::escaped_short;
use crate::statistics::{digits, median};

/// Range of seconds since 1970 in which the time of a recording of 2001 to 2099 lies.
///
/// As times since the start of a recording such numbers would be 31 years or more.
const EPOCH_S: std::ops::Range<f64> = 1e9..4.1e9;
/// Median step below which whole-numbered times are taken as milliseconds.
///
/// A recording has at least 2 samples per second. With larger steps the times are microseconds, from 1000 times as much
/// on nanoseconds.
const MAX_STEP_MS: f64 = 500.0;
/// Units of time that a column of numbers may have: name and size, s.
const CLOCK_UNITS: [(&str, f64); 4] =
    [("seconds", 1.0), ("milliseconds", 1e-3), ("microseconds", 1e-6), ("nanoseconds", 1e-9)];
const HALF_DAY_S: i64 = 43_200;
const DAY_S: i64 = 86_400;

/// Parsed cells of a time column.
pub(super) struct TimeCells {
    /// Times in the order of the rows; `None` for a gap.
    ///
    /// They are the numbers of the file, or for dates and clock times the seconds since the first cell.
    pub values: Vec<Option<f64>>,
    /// Form of the cells: numbers, dates or clock times.
    pub written: Written,
}

/// Reads the cells of the time column `column`, whose name is `name`.
///
/// Clock times that fall back by more than half a day continue on the next day.
///
/// # Errors
/// A cell is neither a number nor a date nor a clock time, or not in the form of the first one.
pub(super) fn read_times(sheet: &Sheet, column: usize, name: &str) -> Result<TimeCells, DataError> {
    let decimal = sheet.dialect.decimal;
    let cell = |row: usize| sheet.row(row)[column].as_str();
    let written = (0..sheet.rows())
        .find_map(|row| match number(cell(row), decimal) {
            Ok(None) => None,
            Ok(Some(_)) => Some(Written::Number),
            Err(()) => Some(instant(cell(row)).map_or(Written::Number, |(written, _)| written)),
        })
        .unwrap_or(Written::Number);
    let (mut origin, mut days, mut last): (Option<Instant>, i64, i64) = (None, 0, i64::MIN);
    let mut values = Vec::with_capacity(sheet.rows());
    for row in 0..sheet.rows() {
        let wrong = || {
            let (line, column, cell) = (sheet.lines[row], name.to_owned(), cell(row).to_owned());
            let reason = Unrecognised::NotATime { line, column, cell };
            DataError::NotRecognised { path: sheet.path.clone(), reason }
        };
        let value = match number(cell(row), decimal) {
            Ok(Some(_)) if written != Written::Number => return Err(wrong()),
            Ok(value) => value,
            Err(()) => {
                let (found, (mut whole, fraction)) = instant(cell(row)).ok_or_else(wrong)?;
                if found != written {
                    return Err(wrong());
                }
                if written == Written::ClockTime {
                    if whole < last.saturating_sub(HALF_DAY_S) {
                        days += 1;
                    }
                    last = whole;
                    whole += days * DAY_S;
                }
                let origin = *origin.get_or_insert((whole, fraction));
                Some((whole - origin.0) as f64 + (fraction - origin.1))
            }
        };
        values.push(value);
    }
    Ok(TimeCells { values, written })
}

/// Conversion of the numbers of a time column to seconds.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Clock {
    /// Size of the time unit of the file, s.
    pub unit_s: f64,
    /// Whether the times are points in time (such as dates), which count from each trajectory's first sample.
    pub is_absolute: bool,
    /// Note for the user on the assumed unit or origin of the times; `None` where the file states the unit.
    pub note: Option<String>,
}

impl Clock {
    /// Infers the clock of the column `name`, whose numbers are `runs`, one list for each trajectory.
    ///
    /// `unit` is the unit that the user or the file states; it is no unit of frames. `unit_text` is the text of
    /// the unit in the header, which may be unknown.
    ///
    /// # Errors
    /// The header states a unit that is not known, and the cells are numbers.
    pub fn of_column(
        (name, unit_text): (&str, &str),
        unit: Option<ColumnUnit>,
        written: Written,
        runs: &[&[f64]],
    ) -> Result<Clock, Unrecognised> {
        let first = runs.iter().find_map(|run| run.first().copied()).unwrap_or(0.0);
        let shown = escaped_short(name);
        let title = if name.starts_with(|c: char| c.is_ascii_digit()) {
            format!("column {shown}")
        } else {
            shown.clone()
        };
        if written != Written::Number {
            let what = if written == Written::Date { "dates" } else { "clock times" };
            let note = Some(format!(
                "{shown} holds {what}, so times count from the first sample of each trajectory"
            ));
            return Ok(Clock { unit_s: 1.0, is_absolute: true, note });
        }
        if let Some(unit) = unit {
            let unit_s = unit.factor();
            return Ok(Clock { unit_s, is_absolute: EPOCH_S.contains(&(first * unit_s)), note: None });
        }
        if !unit_text.is_empty() {
            return Err(Unrecognised::UnknownTimeUnit { text: unit_text.to_owned() });
        }
        let mut steps: Vec<f64> =
            runs.iter().flat_map(|run| run.windows(2).map(|w| w[1] - w[0])).filter(|s| *s > 0.0).collect();
        let is_regular = steps.windows(2).all(|w| w[0] == w[1]);
        let step = median(&mut steps).unwrap_or(0.0);
        let is_whole = runs.iter().all(|run| run.iter().all(|t| t.fract() == 0.0));
        let remedy = format!("--time {shown}:UNIT states another unit");
        let since_1970 = CLOCK_UNITS.iter().find(|(_, size)| {
            EPOCH_S.contains(&(first * size)) && (step * size < MAX_STEP_MS || is_logger_step(step * size))
        });
        if let Some((unit, size)) = since_1970 {
            let note = format!(
                "{title} has no unit; its numbers are read as {unit} since 1970, and times count from the first sample \
                 of each trajectory; {remedy}"
            );
            return Ok(Clock { unit_s: *size, is_absolute: true, note: Some(note) });
        }
        let (unit, unit_s) = match step {
            _ if !is_whole || step <= 1.0 || (is_regular && is_step_of_seconds(step)) => CLOCK_UNITS[0],
            s if s < MAX_STEP_MS => CLOCK_UNITS[1],
            s if s < 1e3 * MAX_STEP_MS => CLOCK_UNITS[2],
            _ => CLOCK_UNITS[3],
        };
        let whole = if unit_s < 1.0 { "whole numbers with " } else { "" };
        let note =
            format!("{title} has no unit; {whole}steps of {} are read as {unit}; {remedy}", digits(step));
        Ok(Clock { unit_s, is_absolute: false, note: Some(note) })
    }

    /// Converts the interval from `zero` to `time`, both as numbers of the file, to seconds.
    pub fn seconds(&self, time: f64, zero: f64) -> f64 {
        // Division by a whole rate gives the double nearest to the decimal number of seconds;
        // multiplication by its rounded reciprocal would not.
        let rate = (1.0 / self.unit_s).round();
        let is_whole_rate = rate > 1.0 && (rate * self.unit_s - 1.0).abs() < 1e-12;
        if is_whole_rate { (time - zero) / rate } else { (time - zero) * self.unit_s }
    }
}

/// Whether a step of whole numbers is more likely one of seconds than one of milliseconds.
///
/// Loggers that count seconds divide a minute, an hour or a day evenly; those that count milliseconds divide a
/// second evenly. Steps that do both (2, 4, 5, 10, 20) are milliseconds, because 50 Hz and 100 Hz are the usual
/// rates of a motion and the note names the other reading.
fn is_step_of_seconds(step: f64) -> bool {
    is_logger_step(step) && 1000.0 % step != 0.0
}

/// Whether a step, s, divides a minute, an hour or a day evenly and is whole seconds, minutes or hours.
fn is_logger_step(step: f64) -> bool {
    [(1.0, 60.0), (60.0, 3600.0), (3600.0, 86_400.0)]
        .into_iter()
        .any(|(part, whole)| step >= part && step % part == 0.0 && whole % step == 0.0)
}

#[cfg(test)]
mod tests {
    //! Contract: a clock has the unit that is stated, and without one the unit that its numbers show.
    use super::*;

    fn unit_s(first: f64, step: f64) -> f64 {
        let times: Vec<f64> = (0..50).map(|k| first + step * f64::from(k)).collect();
        Clock::of_column(("time", ""), None, Written::Number, &[&times]).expect("a clock").unit_s
    }

    #[test]
    fn numbers_without_a_unit_show_the_unit_of_their_clock() {
        for (first, step, expected) in [
            (0.0, 0.02, 1.0),
            (0.0, 2.002, 1.0),
            (0.0, 20.013, 1.0),
            (0.0, 1.0, 1.0),
            (0.0, 20.0, 1e-3),
            (0.0, 100.0, 1e-3),
            (0.0, 8.0, 1e-3),
            (0.0, 60.0, 1.0),
            (0.0, 30.0, 1.0),
            (0.0, 900.0, 1.0),
            (0.0, 86_400.0, 1.0),
            (0.0, 20_000.0, 1e-6),
            (4e7, 2e7, 1e-9),
            // Times since 1970.
            (1.7e9, 1.0, 1.0),
            (1.7e9, 0.5, 1.0),
            (1.7e9, 3600.0, 1.0),
            (1.7e12, 20.0, 1e-3),
            (1.7e15, 20_000.0, 1e-6),
            (1.7e18, 2e7, 1e-9),
            // Twenty minutes after the start of a clock of microseconds.
            (1.2e9, 20_000.0, 1e-6),
        ] {
            assert_eq!(unit_s(first, step), expected, "{first} {step}");
        }
        // The threshold between milliseconds and microseconds, halved or doubled, would move one of these.
        assert_eq!((unit_s(0.0, 400.0), unit_s(0.0, 501.0)), (1e-3, 1e-6));
        // A camera with jitter.
        let times = [0.0, 33.0, 67.0, 100.0, 133.0, 167.0];
        let clock = Clock::of_column(("t", ""), None, Written::Number, &[&times]);
        assert_eq!(clock.expect("a clock").unit_s, 1e-3);
    }

    #[test]
    fn a_stated_unit_is_taken() {
        let hours = ColumnUnit::parse("h");
        let clock = Clock::of_column(("t", "h"), hours, Written::Number, &[&[0.0, 0.5]]).expect("a clock");
        assert_eq!((clock.seconds(0.5, 0.0), clock.is_absolute, clock.note), (1800.0, false, None));
        let nanoseconds = ColumnUnit::parse("ns");
        let clock =
            Clock::of_column(("t", "ns"), nanoseconds, Written::Number, &[&[1.7e18, 1.700_000_001e18]])
                .expect("a clock");
        assert!(Clock::of_column(("t", "furlongs"), None, Written::Number, &[&[0.0, 0.5]]).is_err());
        assert!(clock.is_absolute && clock.seconds(1.700_000_001e18, 1.7e18) == 1.0);
    }
}
