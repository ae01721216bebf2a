//! The outcome of a score test.

use crate::addition::Addition;
use crate::dispersion::Dispersion;
use crate::statistics::chi2_tail;

/// The score test of one candidate at a fit.
#[derive(Clone, Debug)]
pub(crate) struct Score {
    pub addition: Addition,
    /// Chi-squared statistic.
    pub statistic: f64,
    /// Chi-squared statistic whatever the sign of an amount that has one.
    pub unsigned: f64,
    /// The point at which the test was made.
    pub point: Vec<f64>,
    /// Its degrees of freedom; 0 when the candidate cannot be seen in these data.
    pub rank: f64,
    /// One-step estimate of each parameter, from the null point at which the test was made.
    pub estimate: Vec<f64>,
    /// Standard deviations of the estimates.
    pub sd: Vec<f64>,
    /// Dispersion in the direction of the candidate, where gains are measured in units of it.
    pub dispersion: Option<Dispersion>,
}

impl Score {
    /// Probability of a gain as large by chance; `resolution` is the gain of an effect too small to matter.
    pub fn tail(&self, resolution: f64) -> f64 {
        match self.dispersion {
            None => chi2_tail(self.statistic, self.rank),
            Some(d) => {
                let gain = (self.statistic - resolution).max(0.0);
                chi2_tail(d.narrowed(gain / d.factor, self.rank), self.rank)
            }
        }
    }
}
