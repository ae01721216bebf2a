//! Units other than seconds that a time column may have by mistake.

use serde::Serialize;
use std::fmt;

/// Unit of a time column that is not in seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClockUnit {
    /// Nanoseconds, 1e-9 s.
    Nanoseconds,
    /// Microseconds, 1e-6 s.
    Microseconds,
    /// Milliseconds, 1e-3 s.
    Milliseconds,
    /// Minutes, 60 s.
    Minutes,
    /// Hours, 3600 s.
    Hours,
}

impl ClockUnit {
    pub(super) const ALL: [ClockUnit; 5] = [
        ClockUnit::Nanoseconds,
        ClockUnit::Microseconds,
        ClockUnit::Milliseconds,
        ClockUnit::Minutes,
        ClockUnit::Hours,
    ];

    /// Whether the unit is shorter than a second.
    pub(super) fn is_finer_than_seconds(self) -> bool {
        self.times_per_second() > 1.0
    }

    /// Factor by which times in this unit are too large when they are read as seconds.
    pub(super) fn times_per_second(self) -> f64 {
        match self {
            ClockUnit::Nanoseconds => 1e9,
            ClockUnit::Microseconds => 1e6,
            ClockUnit::Milliseconds => 1e3,
            ClockUnit::Minutes => 1.0 / 60.0,
            ClockUnit::Hours => 1.0 / 3600.0,
        }
    }
}

impl fmt::Display for ClockUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ClockUnit::Nanoseconds => "nanoseconds",
            ClockUnit::Microseconds => "microseconds",
            ClockUnit::Milliseconds => "milliseconds",
            ClockUnit::Minutes => "minutes",
            ClockUnit::Hours => "hours",
        })
    }
}
