//! Words that name a time column, and times that are written as dates or clock times.

use super::heading::{ColumnUnit, Heading};

/// Unit of a column whose name is a calendar unit, such as `Year` or `day`; `None` for other names.
pub(super) fn calendar_unit(h: &Heading) -> Option<ColumnUnit> {
    let [word] = &h.words[..] else { return None };
    let is_calendar = matches!(
        word.as_str(),
        "year" | "years" | "day" | "days" | "week" | "weeks" | "hour" | "hours" | "minute" | "minutes"
    );
    (is_calendar && h.unit.is_none()).then(|| ColumnUnit::parse(word)).flatten()
}

/// Whether a column name is that of dates, which are the time only in a file without a time of day.
pub(super) fn is_date(h: &Heading) -> bool {
    matches!(&h.words[..], [word] if matches!(word.as_str(), "date" | "datum"))
}

/// Form of the cells of a time column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Written {
    /// The cells are numbers.
    Number,
    /// The cells are ISO 8601 dates, with or without a time of day.
    Date,
    /// The cells are clock times `hh:mm:ss`.
    ClockTime,
}

/// Point in time: whole seconds and the fraction of a second.
pub(super) type Instant = (i64, f64);

/// Point in time of a cell that is a date or a clock time, with its form; `None` for any other text.
///
/// Dates count from 1970-01-01 UTC; without a zone they are taken as UTC. Clock times count from midnight.
pub(super) fn instant(cell: &str) -> Option<(Written, Instant)> {
    let cell = cell.trim();
    if let Some(time) = clock_time(cell) {
        return Some((Written::ClockTime, time));
    }
    let (date, time) = match cell.find(['T', 't', ' ']) {
        Some(at) => (&cell[..at], cell[at + 1..].trim()),
        None => (cell, ""),
    };
    let days = days_since_1970(date)?;
    if time.is_empty() {
        return Some((Written::Date, (days * 86_400, 0.0)));
    }
    let (time, shift_s) = split_zone(time)?;
    let (seconds, fraction) = clock_time(time)?;
    Some((Written::Date, (days * 86_400 + seconds - shift_s, fraction)))
}

/// Days from 1970-01-01 to a date `2024-05-31` or `2024/05/31` of the Gregorian calendar.
fn days_since_1970(date: &str) -> Option<i64> {
    let parts: Vec<&str> = date.split(['-', '/']).collect();
    let [year, month, day] = parts[..] else { return None };
    let is_digits = |s: &str, count: usize| s.len() == count && s.bytes().all(|b| b.is_ascii_digit());
    if !(is_digits(year, 4) && is_digits(month, 2) && is_digits(day, 2)) {
        return None;
    }
    let (year, month, day): (i64, i64, i64) = (year.parse().ok()?, month.parse().ok()?, day.parse().ok()?);
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    // Days of the civil calendar, with years that begin in March, so that the leap day is the last.
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let year_of_era = year - era * 400;
    let day_of_year = (153 * (month + if month > 2 { -3 } else { 9 }) + 2) / 5 + day - 1;
    let day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
    Some(era * 146_097 + day_of_era - 719_468)
}

/// Splits a time of day from its zone (`Z`, `+02:00`, `-0530`); returns its text and the zone's shift, s.
fn split_zone(time: &str) -> Option<(&str, i64)> {
    if let Some(time) = time.strip_suffix(['Z', 'z']).or_else(|| time.strip_suffix(" UTC")) {
        return Some((time, 0));
    }
    let Some(at) = time.find(['+', '-']) else { return Some((time, 0)) };
    let sign = if time[at..].starts_with('-') { -1 } else { 1 };
    let digits: String = time[at + 1..].chars().filter(|c| *c != ':').collect();
    if !matches!(digits.len(), 2 | 4) || !digits.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let hours: i64 = digits[..2].parse().ok()?;
    let minutes: i64 = if digits.len() == 4 { digits[2..].parse().ok()? } else { 0 };
    Some((time[..at].trim(), sign * (hours * 3600 + minutes * 60)))
}

/// Parses a clock time `hh:mm:ss`, `hh:mm:ss.fff`, `hh:mm` or `mm:ss.fff` as seconds from midnight.
fn clock_time(text: &str) -> Option<Instant> {
    let parts: Vec<&str> = text.split(':').collect();
    let is_whole = |s: &&str| !s.is_empty() && s.len() <= 4 && s.bytes().all(|b| b.is_ascii_digit());
    let last = parts.last()?.replace(',', ".");
    let (whole, fraction) = match last.split_once('.') {
        Some((whole, digits)) => (whole.to_owned(), format!("0.{digits}").parse::<f64>().ok()?),
        None => (last.clone(), 0.0),
    };
    let has_fraction = last.contains('.');
    let head = &parts[..parts.len() - 1];
    if !head.iter().all(is_whole) || !is_whole(&whole.as_str()) || !(0.0..1.0).contains(&fraction) {
        return None;
    }
    let number = |s: &str| s.parse::<i64>().ok();
    let last = number(&whole)?;
    let (hours, minutes, seconds) = match head {
        [hours, minutes] => (number(hours)?, number(minutes)?, last),
        // Only a fraction shows that the last of two numbers are seconds.
        [minutes] if has_fraction => (0, number(minutes)?, last),
        [hours] => (number(hours)?, last, 0),
        _ => return None,
    };
    let is_minutes = minutes < 60 || hours == 0 && has_fraction;
    (is_minutes && seconds < 60).then_some((hours * 3600 + minutes * 60 + seconds, fraction))
}

#[cfg(test)]
mod tests {
    //! Contract: ISO 8601 dates and clock times are points in time, and nothing else is.
    use super::*;

    #[test]
    fn dates_and_clock_times_are_points_in_time() {
        for (cell, written, seconds) in [
            ("1970-01-01", Written::Date, 0.0),
            ("1970-01-02T00:00:01Z", Written::Date, 86_401.0),
            ("2000-03-01T00:00:00", Written::Date, 951_868_800.0),
            ("2024-02-29 12:00:00.25", Written::Date, 1_709_208_000.25),
            ("2024-02-29T14:00:00.25+02:00", Written::Date, 1_709_208_000.25),
            ("2024/02/29 12:00", Written::Date, 1_709_208_000.0),
            ("10:11:12", Written::ClockTime, 36_672.0),
            ("10:11:12.5", Written::ClockTime, 36_672.5),
            ("10:11", Written::ClockTime, 36_660.0),
            ("01:02.5", Written::ClockTime, 62.5),
        ] {
            let (found, (whole, fraction)) = instant(cell).unwrap_or_else(|| panic!("{cell} is refused"));
            assert_eq!((found, whole as f64 + fraction), (written, seconds), "{cell}");
        }
        for cell in
            ["", "5", "1.5", "31.05.2024", "05/31/2024", "2024-13-01", "10:61:00", "a:b", "10:11:12:13", "-"]
        {
            assert_eq!(instant(cell), None, "{cell}");
        }
    }
}
