//! Measured samples, span and noise of a column, for the checks.

use crate::dataset::Dataset;
use crate::push::FRESH_SUFFIX;
use crate::statistics::median;
use crate::trajectory::Trajectory;

/// Column names of the coordinates of one body, by body: object or ball, and rod.
pub(super) const FRAMES: [&[&str]; 2] = [&["x_m", "y_m", "z_m"], &["pusher_x_m", "pusher_y_m"]];

/// Variance of a third difference of white noise of variance 1: the sum of the squares of 1, 3, 3, 1.
const THIRD_DIFFERENCE_VARIANCE: f64 = 20.0;
/// Median of the absolute value of a standard normal variable.
const MEDIAN_NORMAL: f64 = 0.674_489_75;
/// Minimum noise, relative to the largest value of a column, that counts as measurement noise.
///
/// Smaller noise is the rounding of a program to six digits. The finest tracker of the measured sets has a noise of
/// 3e-6, single precision one of 1e-8.
const MIN_RELATIVE_NOISE: f64 = 1e-6;
/// Minimum number of third differences for an estimate of the noise.
const MIN_DIFFERENCES: usize = 30;

/// A column of a data set, with the column that flags its measured (not interpolated) samples, if any.
#[derive(Clone, Copy)]
pub(super) struct Series<'a> {
    data: &'a Dataset,
    column: usize,
    flag: Option<usize>,
}

impl<'a> Series<'a> {
    /// Selects the column `name` of a data set; `None` where there is no such column.
    pub fn named(data: &'a Dataset, name: &str) -> Option<Self> {
        let column = data.columns().iter().position(|c| c.name() == name)?;
        Some(Self::of_column(data, column))
    }

    /// Selects the column with the index `column` of a data set.
    pub fn of_column(data: &'a Dataset, column: usize) -> Self {
        let name = data.columns()[column].name();
        let stream = match name {
            "x_m" | "y_m" | "theta_rad" => "object",
            _ => name.split('_').next().unwrap_or(name),
        };
        let flag = data.columns().iter().position(|c| c.name().strip_suffix(FRESH_SUFFIX) == Some(stream));
        Series { data, column, flag: flag.filter(|&f| f != column) }
    }

    /// Name of the column.
    pub fn name(&self) -> &'a str {
        self.data.columns()[self.column].name()
    }

    /// Symbol of the column's unit.
    pub fn unit(&self) -> String {
        self.data.columns()[self.column].unit().symbol().to_owned()
    }

    /// Times, s, and values of the column's measured samples in `t`; interpolated samples are left out.
    pub fn samples(&self, t: &Trajectory) -> (Vec<f64>, Vec<f64>) {
        let is_fresh = |k: usize| self.flag.is_none_or(|f| t.column(f)[k] > 0.5);
        let samples = t.time_s().iter().zip(t.column(self.column)).enumerate();
        samples.filter(|(k, (_, v))| v.is_finite() && is_fresh(*k)).map(|(_, (t, v))| (*t, *v)).unzip()
    }

    /// Span of the middle 80 % of the column's values in `t`; `None` for fewer than two values.
    ///
    /// It is robust to outliers.
    pub fn span(&self, t: &Trajectory) -> Option<f64> {
        let (_, mut values) = self.samples(t);
        values.sort_unstable_by(f64::total_cmp);
        let trimmed = values.len() / 10;
        (values.len() > 1).then(|| values[values.len() - 1 - trimmed] - values[trimmed])
    }

    /// Median over the trajectories of the column's span; `None` where no trajectory has two values.
    pub fn typical_span(&self) -> Option<f64> {
        median(&mut self.data.trajectories().iter().filter_map(|t| self.span(t)).collect::<Vec<_>>())
    }

    /// Standard deviation of the column's white measurement noise, estimated from third differences.
    ///
    /// sd = median(|third difference|) / (0.674 sqrt(20)). `None` where there are too few samples, or where
    /// the third differences come from a smooth curve or from rounding instead of noise.
    pub fn noise(&self) -> Option<f64> {
        let (mut sizes, mut sign_changes, mut pairs, mut largest) = (Vec::new(), 0, 0, 0.0_f64);
        for t in self.data.trajectories() {
            let (times, v) = self.samples(t);
            largest = v.iter().fold(largest, |max, v| max.max(v.abs()));
            let third: Vec<f64> = (3..v.len())
                .filter(|&k| {
                    let steps =
                        [times[k - 2] - times[k - 3], times[k - 1] - times[k - 2], times[k] - times[k - 1]];
                    // Only equally spaced samples: a gap would not cancel the curve.
                    steps.iter().all(|s| *s < 1.5 * steps[0] && steps[0] < 1.5 * s)
                })
                .map(|k| v[k] - 3.0 * v[k - 1] + 3.0 * v[k - 2] - v[k - 3])
                .collect();
            sign_changes += third.windows(2).filter(|w| w[0] * w[1] < 0.0).count();
            pairs += third.windows(2).filter(|w| w[0] * w[1] != 0.0).count();
            sizes.extend(third.iter().map(|d| d.abs()));
        }
        // Neighbouring third differences of white noise have a correlation of -0.75 and change sign in 77 %
        // of the cases; those of a smooth curve hardly ever do.
        if sizes.len() < MIN_DIFFERENCES || 5 * sign_changes < 3 * pairs {
            return None;
        }
        let sd = median(&mut sizes)? / (MEDIAN_NORMAL * THIRD_DIFFERENCE_VARIANCE.sqrt());
        (sd > MIN_RELATIVE_NOISE * largest).then_some(sd)
    }
}

/// Length of the path of the rod in `t`, m; `None` without columns of the rod.
pub(super) fn rod_path(data: &Dataset, t: &Trajectory) -> Option<f64> {
    let [x, y] = ["pusher_x_m", "pusher_y_m"].map(|c| Series::named(data, c).map(|s| s.samples(t).1));
    let (x, y) = (x?, y?);
    // Noise in the position of the rod lengthens the path, which only widens the bounds that use it.
    let path_length = |v: &[f64]| v.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>();
    Some(path_length(&x).hypot(path_length(&y)))
}
