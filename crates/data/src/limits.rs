//! Upper limits on the memory and the time that a file or an option may request.
//!
//! A file of a kilobyte can unpack to gigabytes, and an option can request more samples than fit in memory.
//! Each [`Limit`] is far above what the measured data sets in use need. To allow more, set the environment
//! variable that the message names, such as `AUGSIM_LIMIT_CELLS=2e9`.

use std::ffi::{OsStr, OsString};
use thiserror::Error;

const PREFIX: &str = "AUGSIM_LIMIT_";

/// Quantity of a file or a request that has an upper limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Limit {
    /// Number of bytes of one file, or of one member of an archive, after unpacking.
    Bytes,
    /// Number of bytes of a text file that is read as a whole, such as a model file or a configuration.
    TextBytes,
    /// Number of values of a data set: samples times columns.
    Cells,
    /// Number of columns of a data set.
    Columns,
    /// Number of trajectories of a data set.
    Trajectories,
    /// Number of samples of one generated or resampled trajectory, or of rows of one sensor stream of a push.
    Samples,
    /// Number of bytes of the header of an array in an NPZ file.
    HeaderBytes,
    /// Number of opening brackets in the header of an array in an NPZ file.
    Brackets,
    /// Number of parameters of a neural network.
    Parameters,
}

/// Error: a quantity exceeds its limit; the message says which limit and what to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("{} (the limit is {allowed}; set {}{} to allow more)", limit.message(), PREFIX, limit.name())]
pub struct LimitExceeded {
    /// Quantity whose limit was exceeded.
    pub limit: Limit,
    /// Largest allowed value of the quantity.
    pub allowed: u64,
}

/// Error: an environment variable `AUGSIM_LIMIT_…` cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LimitSettingError {
    /// The name of the variable is that of no limit.
    #[error(
        "{variable} is not a known limit; the limits are {}",
        Limit::ALL.map(|limit| format!("{PREFIX}{}", limit.name())).join(", ")
    )]
    Unknown {
        /// Name of the environment variable.
        variable: String,
    },
    /// The value of the variable is not a whole number of at least 1.
    #[error("{variable}={value}: must be a whole number of at least 1, such as 1000000 or 1e6")]
    Value {
        /// Name of the environment variable.
        variable: String,
        /// Value of the environment variable.
        value: String,
    },
}

impl Limit {
    /// All quantities that have a limit.
    pub const ALL: [Limit; 9] = [
        Limit::Bytes,
        Limit::TextBytes,
        Limit::Cells,
        Limit::Columns,
        Limit::Trajectories,
        Limit::Samples,
        Limit::HeaderBytes,
        Limit::Brackets,
        Limit::Parameters,
    ];

    /// Name of the limit's environment variable, without the prefix `AUGSIM_LIMIT_`.
    pub fn name(self) -> &'static str {
        match self {
            Limit::Bytes => "BYTES",
            Limit::TextBytes => "TEXT_BYTES",
            Limit::Cells => "CELLS",
            Limit::Columns => "COLUMNS",
            Limit::Trajectories => "TRAJECTORIES",
            Limit::Samples => "SAMPLES",
            Limit::HeaderBytes => "HEADER_BYTES",
            Limit::Brackets => "BRACKETS",
            Limit::Parameters => "PARAMETERS",
        }
    }

    /// Default value of the limit, used where its environment variable is not set.
    pub fn default_value(self) -> u64 {
        match self {
            // The largest measured file in use unpacks to 14 MB; a reader needs a small multiple of it in
            // memory.
            Limit::Bytes => 1 << 30,
            // A model file has a few kilobytes.
            Limit::TextBytes => 16 << 20,
            // 0.8 GB of doubles.
            Limit::Cells => 100_000_000,
            Limit::Columns => 10_000,
            Limit::Trajectories => 1_000_000,
            // The longest measured record in use has 131,072 samples.
            Limit::Samples => 1_000_000,
            // numpy writes 118 bytes for a one-dimensional array.
            Limit::HeaderBytes => 4096,
            // numpy writes two. The time of the parser grows exponentially with the depth of nested brackets.
            Limit::Brackets => 6,
            // The nets of this workspace have a few thousand parameters.
            Limit::Parameters => 10_000_000,
        }
    }

    /// Value of the limit: that of its environment variable where it is valid, otherwise the default.
    pub fn value(self) -> u64 {
        let set = std::env::var_os(format!("{PREFIX}{}", self.name()));
        set.as_deref().and_then(parse_whole_number).unwrap_or_else(|| self.default_value())
    }

    /// Checks that `found` is within the limit.
    ///
    /// # Errors
    /// [`LimitExceeded`].
    pub fn check(self, found: u64) -> Result<(), LimitExceeded> {
        let allowed = self.value();
        if found <= allowed { Ok(()) } else { Err(self.exceeded()) }
    }

    /// Creates the error for a quantity that exceeds this limit.
    pub fn exceeded(self) -> LimitExceeded {
        LimitExceeded { limit: self, allowed: self.value() }
    }

    /// Checks that every environment variable `AUGSIM_LIMIT_…` names a limit and holds a valid number.
    ///
    /// # Errors
    /// [`LimitSettingError`] for the first variable, in alphabetical order, that does not.
    pub fn check_environment() -> Result<(), LimitSettingError> {
        // Sorted, so that the same environment gives the same message.
        let mut variables: Vec<(OsString, OsString)> =
            std::env::vars_os().filter(|(name, _)| name.to_string_lossy().starts_with(PREFIX)).collect();
        variables.sort();
        for (name, value) in variables {
            let variable = name.to_string_lossy().into_owned();
            let known = Limit::ALL.iter().any(|limit| variable.strip_prefix(PREFIX) == Some(limit.name()));
            if !known {
                return Err(LimitSettingError::Unknown { variable });
            }
            if parse_whole_number(&value).is_none() {
                return Err(LimitSettingError::Value {
                    variable,
                    value: value.to_string_lossy().into_owned(),
                });
            }
        }
        Ok(())
    }

    /// Predicate of the error message: what exceeds the limit, and the remedy.
    fn message(self) -> &'static str {
        match self {
            Limit::Bytes => "has too many bytes after unpacking; split it, or keep fewer columns",
            Limit::TextBytes => "is too long for a text file; check that it is the right file",
            Limit::Cells => "has too many values (samples times columns); use fewer samples or columns",
            Limit::Columns => "has too many columns; leave out those that no model uses",
            Limit::Trajectories => "has too many trajectories; use fewer",
            Limit::Samples => "has too many samples in one trajectory; use fewer, or a lower rate",
            Limit::HeaderBytes => {
                "has a header that is too long for an array of numbers; save the array again"
            }
            Limit::Brackets => {
                "has too many brackets in its header for an array of numbers; save each column as a separate array"
            }
            Limit::Parameters => {
                "has too many parameters for a net of this kind; reduce the sizes of the net"
            }
        }
    }
}

/// Parses a whole number of at least 1, also as `1e6`; `None` for other texts.
fn parse_whole_number(text: &OsStr) -> Option<u64> {
    let text = text.to_str()?;
    let value = text.parse::<u64>().ok().or_else(|| {
        let value = text.parse::<f64>().ok()?;
        (value.fract() == 0.0 && (1.0..1e18).contains(&value)).then_some(value as u64)
    });
    value.filter(|value| *value >= 1)
}

#[cfg(test)]
mod tests {
    //! Contract: every limit has its own name, default and message, which names the environment variable.
    //!
    //! Environment variables are tested with the command-line program (`crates/cli/tests/it/limits.rs`).
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_limit_has_its_own_message_that_names_its_environment_variable() {
        let mut messages = BTreeSet::new();
        for limit in Limit::ALL {
            let allowed = limit.default_value();
            let text = limit.check(allowed + 1).unwrap_err().to_string();
            assert!(text.ends_with(&format!(
                "(the limit is {allowed}; set AUGSIM_LIMIT_{} to allow more)",
                limit.name()
            )));
            assert!(messages.insert(text), "{limit:?}");
            assert_eq!(limit.check(allowed), Ok(()));
        }
    }

    #[test]
    fn a_value_is_a_whole_number_of_at_least_one() {
        let read = |text: &str| parse_whole_number(OsStr::new(text));
        assert_eq!((read("7"), read("1e6"), read("2.5e3")), (Some(7), Some(1_000_000), Some(2500)));
        for text in ["", "0", "-1", "1.5", "many", "inf", "nan", "1e300"] {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
