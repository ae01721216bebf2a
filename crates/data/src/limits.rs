//! Limits on what a file or an option may ask of the machine, all in one place.
//!
//! A file of a kilobyte can unpack to gigabytes, and an option can ask for more samples than there is memory. Each
//! [`Limit`] is far above what any measured set in use needs; who needs more sets the environment variable that the
//! message names, such as `AUGSIM_LIMIT_CELLS=2e9`.

use std::ffi::{OsStr, OsString};
use thiserror::Error;

const PREFIX: &str = "AUGSIM_LIMIT_";

/// A quantity that is bounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Limit {
    /// Bytes of one file, or of one member of an archive, once it is unpacked.
    Bytes,
    /// Bytes of a text that is read whole: a model file, a configuration.
    TextBytes,
    /// Values of a data set: samples times columns.
    Cells,
    /// Columns of a data set.
    Columns,
    /// Trajectories of a data set.
    Trajectories,
    /// Samples of one trajectory that is generated or resampled, rows of one stream of a push.
    Samples,
    /// Bytes of the header of an array in an NPZ file.
    HeaderBytes,
    /// Opening brackets in such a header.
    Brackets,
    /// Parameters of a net.
    Parameters,
}

/// A limit that was reached: the sentence says which, and what to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("{} (the limit is {allowed}; set {}{} to allow more)", limit.sentence(), PREFIX, limit.name())]
pub struct LimitExceeded {
    /// The limit that was reached.
    pub limit: Limit,
    /// Largest value that is allowed.
    pub allowed: u64,
}

/// An environment variable `AUGSIM_LIMIT_…` that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LimitSetting {
    /// No limit has this name.
    #[error(
        "{variable} names no limit; the limits are {}",
        Limit::ALL.map(|limit| format!("{PREFIX}{}", limit.name())).join(", ")
    )]
    Unknown {
        /// The variable.
        variable: String,
    },
    /// Its value is no whole number of at least 1.
    #[error("{variable}={value}: must be a whole number of at least 1, such as 1000000 or 1e6")]
    Value {
        /// The variable.
        variable: String,
        /// Its value.
        value: String,
    },
}

impl Limit {
    /// All limits.
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

    /// Name after `AUGSIM_LIMIT_`.
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

    /// Value without an environment variable.
    pub fn default_value(self) -> u64 {
        match self {
            // The largest file at hand unpacks to 14 MB; a reader needs a small multiple of the file in memory.
            Limit::Bytes => 1 << 30,
            // A model file has a few kilobytes.
            Limit::TextBytes => 16 << 20,
            // 0.8 GB of doubles.
            Limit::Cells => 100_000_000,
            Limit::Columns => 10_000,
            Limit::Trajectories => 1_000_000,
            // The longest measured record at hand has 131,072 samples.
            Limit::Samples => 1_000_000,
            // numpy writes 118 bytes for a one-dimensional array.
            Limit::HeaderBytes => 4096,
            // numpy writes two. The parser takes a time that grows exponentially with brackets within brackets.
            Limit::Brackets => 6,
            // The nets here have some thousand.
            Limit::Parameters => 10_000_000,
        }
    }

    /// Value that counts: of the environment variable where it is set to a number, otherwise the default.
    pub fn value(self) -> u64 {
        let set = std::env::var_os(format!("{PREFIX}{}", self.name()));
        set.as_deref().and_then(number).unwrap_or_else(|| self.default_value())
    }

    /// Checks that `found` is within the limit.
    ///
    /// # Errors
    /// [`LimitExceeded`].
    pub fn check(self, found: u64) -> Result<(), LimitExceeded> {
        let allowed = self.value();
        if found <= allowed { Ok(()) } else { Err(self.exceeded()) }
    }

    /// The error for a quantity that was cut off at the limit.
    pub fn exceeded(self) -> LimitExceeded {
        LimitExceeded { limit: self, allowed: self.value() }
    }

    /// Checks that every variable `AUGSIM_LIMIT_…` of the environment names a limit and holds a number.
    ///
    /// # Errors
    /// [`LimitSetting`] for the first one that does not.
    pub fn check_environment() -> Result<(), LimitSetting> {
        // Sorted, so that the same environment gives the same message.
        let mut variables: Vec<(OsString, OsString)> =
            std::env::vars_os().filter(|(name, _)| name.to_string_lossy().starts_with(PREFIX)).collect();
        variables.sort();
        for (name, value) in variables {
            let variable = name.to_string_lossy().into_owned();
            let known = Limit::ALL.iter().any(|limit| variable.strip_prefix(PREFIX) == Some(limit.name()));
            if !known {
                return Err(LimitSetting::Unknown { variable });
            }
            if number(&value).is_none() {
                return Err(LimitSetting::Value { variable, value: value.to_string_lossy().into_owned() });
            }
        }
        Ok(())
    }

    fn sentence(self) -> &'static str {
        match self {
            Limit::Bytes => {
                "holds too many bytes once it is unpacked; split it, or convert it to fewer columns"
            }
            Limit::TextBytes => "is too long for a text file of settings; check that it is the right file",
            Limit::Cells => "has too many values (samples times columns); take fewer of either",
            Limit::Columns => "has too many columns; leave out those that no model names",
            Limit::Trajectories => "has too many trajectories; take fewer",
            Limit::Samples => "has too many samples in one trajectory; take fewer, or a lower rate",
            Limit::HeaderBytes => {
                "has a header that is too long for an array of numbers; save the array again"
            }
            Limit::Brackets => {
                "has too many brackets in its header for an array of numbers; save each column as an array of its own"
            }
            Limit::Parameters => "has too many parameters for a net of this kind; lower the sizes of the net",
        }
    }
}

/// A whole number of at least 1, also as `1e6`.
fn number(text: &OsStr) -> Option<u64> {
    let text = text.to_str()?;
    let value = text.parse::<u64>().ok().or_else(|| {
        let value = text.parse::<f64>().ok()?;
        (value.fract() == 0.0 && (1.0..1e18).contains(&value)).then_some(value as u64)
    });
    value.filter(|value| *value >= 1)
}

#[cfg(test)]
mod tests {
    //! Contract: every limit has a name, a default and a sentence of its own, and the sentence names the way out.
    //! The environment is tested with the whole binary (`crates/cli/tests/it/limits.rs`), which can set it.
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_limit_has_its_own_sentence_and_names_its_override() {
        let mut sentences = BTreeSet::new();
        for limit in Limit::ALL {
            let allowed = limit.default_value();
            let text = limit.check(allowed + 1).unwrap_err().to_string();
            assert!(text.ends_with(&format!(
                "(the limit is {allowed}; set AUGSIM_LIMIT_{} to allow more)",
                limit.name()
            )));
            assert!(sentences.insert(text), "{limit:?}");
            assert_eq!(limit.check(allowed), Ok(()));
        }
    }

    #[test]
    fn a_value_is_a_whole_number_of_at_least_one() {
        let read = |text: &str| number(OsStr::new(text));
        assert_eq!((read("7"), read("1e6"), read("2.5e3")), (Some(7), Some(1_000_000), Some(2500)));
        for text in ["", "0", "-1", "1.5", "many", "inf", "nan", "1e300"] {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
