//! Samples, spans and noise of a column, as several checks use them.

use crate::dataset::Dataset;
use crate::push::FRESH_SUFFIX;
use crate::statistics::median;
use crate::trajectory::Trajectory;

/// Coordinates that share a frame.
pub(super) const FRAMES: [&[&str]; 2] = [&["x_m", "y_m", "z_m"], &["pusher_x_m", "pusher_y_m"]];

/// Sum of the squared weights 1, 3, 3, 1 of a third difference: its variance over that of white noise.
const THIRD: f64 = 20.0;
/// Median of the absolute value of a standard normal number.
const MEDIAN_NORMAL: f64 = 0.674_489_75;
/// Noise, relative to the largest value, beneath which it is the rounding of a program: six digits. The finest tracker of the
/// measured sets scatters by 3e-6, single precision by 1e-8.
const ROUNDING: f64 = 1e-6;
/// Fewest third differences that tell a noise.
const FEWEST: usize = 30;

/// A column of a set with the flag of its stream, where it has one.
#[derive(Clone, Copy)]
pub(super) struct Series<'a> {
    data: &'a Dataset,
    column: usize,
    flag: Option<usize>,
}

impl<'a> Series<'a> {
    /// The column `name`; `None` where the set has none.
    pub fn named(data: &'a Dataset, name: &str) -> Option<Self> {
        let column = data.columns().iter().position(|c| c.name() == name)?;
        Some(Self::at(data, column))
    }

    /// The column with index `column`.
    pub fn at(data: &'a Dataset, column: usize) -> Self {
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

    /// Times, s, and values of the samples of `t` that were measured.
    pub fn samples(&self, t: &Trajectory) -> (Vec<f64>, Vec<f64>) {
        let fresh = |k: usize| self.flag.is_none_or(|f| t.column(f)[k] > 0.5);
        let all = t.time_s().iter().zip(t.column(self.column)).enumerate();
        all.filter(|(k, (_, v))| v.is_finite() && fresh(*k)).map(|(_, (t, v))| (*t, *v)).unzip()
    }

    /// Span of the middle 80 % of the values of `t`: a few wild samples do not widen it. `None` for fewer than two values.
    pub fn span(&self, t: &Trajectory) -> Option<f64> {
        let (_, mut values) = self.samples(t);
        values.sort_unstable_by(f64::total_cmp);
        let cut = values.len() / 10;
        (values.len() > 1).then(|| values[values.len() - 1 - cut] - values[cut])
    }

    /// Median of the spans; `None` where no trajectory has two values.
    pub fn typical_span(&self) -> Option<f64> {
        median(&mut self.data.trajectories().iter().filter_map(|t| self.span(t)).collect::<Vec<_>>())
    }

    /// Standard deviation of the noise between neighbouring samples; `None` where there are too few of them, or where what
    /// is left after three differences is a smooth curve or a rounding and no noise.
    pub fn noise(&self) -> Option<f64> {
        let (mut sizes, mut flips, mut pairs, mut largest) = (Vec::new(), 0, 0, 0.0_f64);
        for t in self.data.trajectories() {
            let (times, v) = self.samples(t);
            largest = v.iter().fold(largest, |most, v| most.max(v.abs()));
            let third: Vec<f64> = (3..v.len())
                .filter(|&k| {
                    let steps =
                        [times[k - 2] - times[k - 3], times[k - 1] - times[k - 2], times[k] - times[k - 1]];
                    // Neighbours only: over a gap the curve is not straight.
                    steps.iter().all(|s| *s < 1.5 * steps[0] && steps[0] < 1.5 * s)
                })
                .map(|k| v[k] - 3.0 * v[k - 1] + 3.0 * v[k - 2] - v[k - 3])
                .collect();
            flips += third.windows(2).filter(|w| w[0] * w[1] < 0.0).count();
            pairs += third.windows(2).filter(|w| w[0] * w[1] != 0.0).count();
            sizes.extend(third.iter().map(|d| d.abs()));
        }
        // Third differences of white noise correlate with -0.75 from one to the next and change their sign in 77 % of the
        // cases, those of a smooth curve hardly ever.
        if sizes.len() < FEWEST || 5 * flips < 3 * pairs {
            return None;
        }
        let sd = median(&mut sizes)? / (MEDIAN_NORMAL * THIRD.sqrt());
        (sd > ROUNDING * largest).then_some(sd)
    }
}

/// Path of the rod in `t`, m; `None` without rod columns.
pub(super) fn rod_path(data: &Dataset, t: &Trajectory) -> Option<f64> {
    let [x, y] = ["pusher_x_m", "pusher_y_m"].map(|c| Series::named(data, c).map(|s| s.samples(t).1));
    let (x, y) = (x?, y?);
    // Noise of the rod's position lengthens the path, which makes the bounds that use it wider, never narrower.
    let way = |v: &[f64]| v.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>();
    Some(way(&x).hypot(way(&y)))
}
