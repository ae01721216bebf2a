//! Preparation of joint logs for inverse dynamics.
//!
//! The result has filtered positions, their derivatives and filtered torques on one clock.
//!
//! The steps, for each segment of the log without long gaps:
//! 1. positions and torques are interpolated to a uniform clock;
//! 2. all of them pass a zero-phase low-pass filter of one cutoff frequency, and the torques then a second one of half of it;
//! 3. speeds and accelerations are central differences of the filtered positions;
//! 4. the ends, where the filters have their transients, are dropped, and every n-th sample is kept: many of the motion, few of
//!    the torques.
//!
//! A model computes torques from the filtered motion, and then passes them through the second filter, whose weights are
//! [`LowPassResponse`]. One filter for both sides of an equation keeps the equation (Gautier, "Dynamic identification of
//! robots with power model", ICRA 1997: parallel filtering and decimation). It keeps nonlinear equations too, such as Coulomb
//! friction, because the motion is known in a wider band than the one in which torques are compared.

mod choose;
mod clock;
mod filter;
mod fourier;
mod low_pass;
mod noise_floor;
mod prepare;
mod spectra;

pub use choose::choose;
pub use low_pass::LowPassResponse;
pub use prepare::prepare;

/// A log of a robot's joints.
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    /// Names of the joints, for messages.
    pub joints: Vec<String>,
    /// Sample times, s, `[n]`; strictly increasing, with jitter and gaps.
    pub time_s: Vec<f64>,
    /// Positions, rad or m, `[n][joints]`.
    pub position: Vec<Vec<f64>>,
    /// Torques or forces, N m or N, or currents in A, `[n][joints]`.
    pub torque: Vec<Vec<f64>>,
}

/// Noise of one joint's channels, and what it means for the acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointNoise {
    /// Standard deviation of the position's noise, rad or m, before the filter.
    pub position: f64,
    /// Standard deviation of the torque's noise, N m or N, or A, before the filter.
    pub torque: f64,
    /// Estimated relative error of the filtered acceleration (root mean squares).
    ///
    /// Infinite, or at least 1, for a joint whose motion is hidden by its noise.
    pub acceleration_error: f64,
    /// Estimated error of the filtered torque, relative to the torque without its mean, in the same way.
    pub torque_error: f64,
}

/// How a log is prepared; the same preparation can be repeated on another log.
#[derive(Debug, Clone, PartialEq)]
pub struct Preparation {
    /// Interval of the uniform clock before decimation, s.
    pub interval_s: f64,
    /// Cutoff frequency of the second filter, of measured and modelled torques, Hz.
    pub cutoff_hz: f64,
    /// Cutoff frequency of the first filter, of positions and measured torques, Hz.
    pub motion_cutoff_hz: f64,
    /// One of this many samples of the motion is kept.
    pub motion_decimation: usize,
    /// One of this many samples of the torques is kept, a multiple of the decimation of the motion.
    pub decimation: usize,
    /// Sample rate of the torques after decimation, Hz.
    pub rate_hz: f64,
    /// Time that is dropped at each end of a segment, s, where the first filter has transients.
    pub motion_trim_s: f64,
    /// Time by which the torques begin after the motion and end before it, s: the reach of the second filter.
    pub trim_s: f64,
    /// Longest gap between two samples that is interpolated, s; longer gaps end a segment.
    pub max_gap_s: f64,
    /// Noise of each joint in the log on which the preparation was chosen, `[joints]`.
    pub noise: Vec<JointNoise>,
}

/// A prepared part of a log, without gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Times of the motion, s, `[n]`: uniform, on the clock of the log.
    pub time_s: Vec<f64>,
    /// Filtered positions, rad or m, `[n][joints]`.
    pub position: Vec<Vec<f64>>,
    /// Speeds, rad/s or m/s, `[n][joints]`: derivative of the filtered positions.
    pub speed: Vec<Vec<f64>>,
    /// Accelerations, rad/s2 or m/s2, `[n][joints]`: second derivative of the filtered positions.
    pub acceleration: Vec<Vec<f64>>,
    /// Samples of the motion at which there are torques, `[k]`.
    pub torque_rows: Vec<usize>,
    /// Torques or forces after both filters, `[k][joints]`, in the unit of the log.
    pub torque: Vec<Vec<f64>>,
}

/// Why a log cannot be prepared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SignalError {
    /// The log has too few samples.
    #[error("the log has {samples} samples; at least {needed} are needed")]
    TooShort {
        /// Number of samples of the log.
        samples: usize,
        /// Smallest number of samples.
        needed: usize,
    },
    /// No part of the log without gaps is long enough for the filter.
    #[error(
        "the longest part of the log without a gap of more than {max_gap_s:.3} s lasts {longest_s:.3} s, but the low-pass \
         filter of {cutoff_hz:.2} Hz needs more than {needed_s:.3} s; use a longer log or a higher cutoff"
    )]
    SegmentsTooShort {
        /// Duration of the longest segment, s.
        longest_s: f64,
        /// Smallest duration, s.
        needed_s: f64,
        /// Longest gap within a segment, s.
        max_gap_s: f64,
        /// Cutoff frequency, Hz.
        cutoff_hz: f64,
    },
    /// A time is not later than the one before.
    #[error("row {row}: the time {time_s} s is not later than the time before, {previous_s} s")]
    TimeNotIncreasing {
        /// Row, from 1.
        row: usize,
        /// Time of this row, s.
        time_s: f64,
        /// Time of the row before, s.
        previous_s: f64,
    },
    /// A value is not a finite number.
    #[error("row {row}: the {channel} of joint `{joint}` is not a finite number")]
    NotFinite {
        /// `position` or `torque`.
        channel: &'static str,
        /// Name of the joint.
        joint: String,
        /// Row, from 1.
        row: usize,
    },
    /// A time is not a finite number.
    #[error("row {row}: the time is not a finite number")]
    TimeNotFinite {
        /// Row, from 1.
        row: usize,
    },
    /// A channel has another number of rows, or a row another number of joints.
    #[error(
        "the {channel} has {rows} rows, and row {row} has {width} values; expected {expected_rows} rows of {joints} values"
    )]
    Shape {
        /// `position` or `torque`.
        channel: &'static str,
        /// Rows of the channel.
        rows: usize,
        /// First row with a wrong number of values, from 1; the last row if only their number is wrong.
        row: usize,
        /// Values in this row.
        width: usize,
        /// Rows of the time.
        expected_rows: usize,
        /// Number of joints.
        joints: usize,
    },
    /// No joint moves by more than its noise.
    #[error(
        "no joint moves by more than the noise of its position; accelerations cannot be estimated from this log"
    )]
    NoMotion,
}

impl Log {
    /// Checks shapes, finite values and increasing times.
    ///
    /// # Errors
    /// The first problem, with its channel, joint and row.
    pub fn check(&self) -> Result<(), SignalError> {
        for (i, time) in self.time_s.iter().enumerate() {
            if !time.is_finite() {
                return Err(SignalError::TimeNotFinite { row: i + 1 });
            }
            if i > 0 && *time <= self.time_s[i - 1] {
                let previous_s = self.time_s[i - 1];
                return Err(SignalError::TimeNotIncreasing { row: i + 1, time_s: *time, previous_s });
            }
        }
        self.check_channel("position", &self.position)?;
        self.check_channel("torque", &self.torque)
    }

    fn check_channel(&self, channel: &'static str, rows: &[Vec<f64>]) -> Result<(), SignalError> {
        let (expected_rows, joints) = (self.time_s.len(), self.joints.len());
        let wrong = rows.iter().position(|row| row.len() != joints);
        if rows.len() != expected_rows || wrong.is_some() {
            let row = wrong.map_or(rows.len(), |row| row + 1);
            let width = rows.get(row.saturating_sub(1)).map_or(0, Vec::len);
            return Err(SignalError::Shape { channel, rows: rows.len(), row, width, expected_rows, joints });
        }
        for (i, row) in rows.iter().enumerate() {
            if let Some(joint) = row.iter().position(|value| !value.is_finite()) {
                let joint = self.joints[joint].clone();
                return Err(SignalError::NotFinite { channel, joint, row: i + 1 });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
