//! One stream of a trial with its own clock, and the removal of repeated and wrong samples.

use super::error::PushError;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;

/// Maximum duration over which equal values are repeats of one measurement, s.
///
/// A logger that is faster than the sensor repeats its last value. Equal values over a longer time are
/// measurements of a rod at rest.
const MAX_REPEAT_S: f64 = 0.05;
/// Maximum difference of an angle step from whole quarter turns for a jump by quarter turns, rad.
///
/// Motion capture that confuses the markers of an object turns it by a quarter turn between two samples. The
/// fastest real rotation in the set is 0.04 rad per sample.
const QUARTER_TURN_TOLERANCE: f64 = 0.25;
/// Maximum interval between two samples across which a jump by quarter turns is detected, s.
const MAX_JUMP_S: f64 = 0.1;

/// Sensor stream with its own clock: `x, y, yaw` in m and rad, or `fx, fy, torque` in N and N m.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stream {
    /// Sample times of the stream, s, strictly increasing.
    pub time_s: Vec<f64>,
    /// Three columns of measured values, one value per sample time.
    pub values: [Vec<f64>; 3],
}

impl Stream {
    /// Creates a stream from the rows of a file: time, s, and three values.
    ///
    /// Of rows with equal times, which occur in the published files, the first is kept.
    ///
    /// # Errors
    /// A value is not finite, the time decreases, or there are fewer than two samples.
    pub(crate) fn from_rows(path: &Path, key: &'static str, rows: &[[f64; 4]]) -> Result<Self, PushError> {
        let mut stream = Stream::default();
        for (row, &[time_s, a, b, c]) in rows.iter().enumerate() {
            if ![time_s, a, b, c].iter().all(|v| v.is_finite()) {
                return Err(PushError::NotFinite { path: path.to_owned(), key: key.to_owned(), row });
            }
            match stream.time_s.last() {
                Some(&previous_s) if time_s < previous_s => {
                    return Err(PushError::TimeDecreases {
                        path: path.to_owned(),
                        key,
                        row,
                        previous_s,
                        time_s,
                    });
                }
                Some(&previous_s) if time_s == previous_s => continue,
                _ => stream.push(time_s, [a, b, c]),
            }
        }
        if stream.len() < 2 {
            return Err(PushError::TooShort { path: path.to_owned(), key });
        }
        Ok(stream)
    }

    /// Number of samples of the stream.
    #[expect(clippy::len_without_is_empty, reason = "a stream that was read is never empty")]
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    fn push(&mut self, time_s: f64, sample: [f64; 3]) {
        self.time_s.push(time_s);
        for (column, value) in self.values.iter_mut().zip(sample) {
            column.push(value);
        }
    }

    fn sample(&self, k: usize) -> [f64; 3] {
        [self.values[0][k], self.values[1][k], self.values[2][k]]
    }

    /// Stream of the samples whose index `keep` accepts.
    fn filter(&self, keep: impl Fn(usize) -> bool) -> Stream {
        let mut kept = Stream::default();
        (0..self.len()).filter(|&k| keep(k)).for_each(|k| kept.push(self.time_s[k], self.sample(k)));
        kept
    }

    /// Subtracts `offset_s` (s) from all sample times of the stream.
    pub(crate) fn earlier(mut self, offset_s: f64) -> Stream {
        self.time_s.iter_mut().for_each(|t| *t -= offset_s);
        self
    }

    /// Removes samples with which the logger repeats the last measurement, over at most 50 ms.
    ///
    /// A longer sequence of equal samples is a rest and is kept.
    pub fn without_repeats(&self) -> Stream {
        let mut is_repeat = vec![false; self.len()];
        let mut first = 0;
        for k in 1..=self.len() {
            let is_end = k == self.len();
            if !is_end && self.sample(k) == self.sample(first) {
                continue;
            }
            if self.time_s[k - usize::from(is_end)] - self.time_s[first] <= MAX_REPEAT_S {
                is_repeat[first + 1..k].fill(true);
            }
            first = k;
        }
        self.filter(|k| !is_repeat[k])
    }

    /// Removes poses whose angle jumped by quarter turns, and makes the angle continuous over full turns.
    ///
    /// Motion capture that confuses the markers of an object gives such wrong poses. Returns the stream and
    /// the number of removed samples.
    pub fn without_quarter_turns(&self) -> (Stream, usize) {
        let mut turns = vec![0_i64; self.len()];
        let mut angle = self.values[2].clone();
        for k in 1..self.len() {
            let step = self.values[2][k] - self.values[2][k - 1];
            let quarters = (step / FRAC_PI_2).round();
            let is_jump = quarters as i64 % 4 != 0
                && (step - quarters * FRAC_PI_2).abs() < QUARTER_TURN_TOLERANCE
                && self.time_s[k] - self.time_s[k - 1] < MAX_JUMP_S;
            turns[k] = turns[k - 1] + if is_jump { quarters as i64 } else { 0 };
            let whole = (step / TAU).round() * TAU;
            angle[k] = angle[k - 1] + step - whole;
        }
        let unwrapped =
            Stream { values: [self.values[0].clone(), self.values[1].clone(), angle], ..self.clone() };
        let kept = unwrapped.filter(|k| turns[k] % 4 == 0);
        let confused = self.len() - kept.len();
        (kept, confused)
    }
}

#[cfg(test)]
mod tests {
    //! Contract: equal values are one measurement unless they are a rest.
    //!
    //! A pose with confused markers is removed and the angle remains continuous. A wrap of the angle is not a jump.
    use super::*;

    fn stream(rows: &[[f64; 4]]) -> Stream {
        Stream::from_rows(Path::new("F"), "object_pose", rows).expect("well formed")
    }

    #[test]
    fn repeats_of_a_slow_sensor_are_removed_and_rests_are_kept() {
        let rows: Vec<_> = (0..20).map(|k| [f64::from(k) * 0.01, f64::from(k / 2), 0.0, 0.0]).collect();
        assert_eq!(stream(&rows).without_repeats().values[0], (0..10).map(f64::from).collect::<Vec<_>>());
        let rest: Vec<_> = (0..20).map(|k| [f64::from(k) * 0.01, f64::from(k / 10), 0.0, 0.0]).collect();
        assert_eq!(stream(&rest).without_repeats(), stream(&rest));
    }

    #[test]
    fn poses_with_confused_markers_are_removed_and_wraps_are_undone() {
        let yaw = [3.1, 3.12, 3.13 - 1.57, 3.15 - 1.57, 3.16 - TAU, 3.18 - TAU];
        let rows: Vec<_> = yaw.iter().zip(0..).map(|(&a, k)| [f64::from(k) * 0.004, 0.0, 0.0, a]).collect();
        let (kept, confused) = stream(&rows).without_quarter_turns();
        assert_eq!(confused, 2);
        assert_eq!(kept.time_s, [0.0, 0.004, 0.016, 0.020]);
        for (angle, expected) in kept.values[2].iter().zip([3.1, 3.12, 3.16, 3.18]) {
            assert!((angle - expected).abs() < 1e-12, "{angle} {expected}");
        }
    }

    #[test]
    fn of_equal_times_the_first_is_kept_and_decreasing_times_are_errors() {
        let rows = [[0.0, 1.0, 0.0, 0.0], [0.0, 2.0, 0.0, 0.0], [1.0, 3.0, 0.0, 0.0]];
        assert_eq!(stream(&rows).values[0], [1.0, 3.0]);
        let rows = [[0.5, 1.0, 0.0, 0.0], [0.0, 2.0, 0.0, 0.0]];
        let error = Stream::from_rows(Path::new("F"), "tip_pose", &rows).unwrap_err().to_string();
        assert_eq!(
            error,
            "F: stream `tip_pose`, row 1: the time decreases (0 s follows 0.5 s); sort the rows by time, or remove the \
             trial if its clock was reset"
        );
    }
}
