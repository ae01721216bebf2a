//! The noise estimate of a data set.

use augsim_data::FrameClock;

/// Kind of the finding that the time stamps jitter.
pub(crate) const JITTER: &str = "timing-jitter";

/// Noise estimate of a data set.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Noise {
    /// Standard deviation by channel, in the unit of each.
    pub sd: Vec<f64>,
    /// The same from differences of neighbouring samples, where the declared accuracy of the instrument is
    /// far larger.
    pub white: Vec<f64>,
    /// Correlation of neighbouring samples.
    pub correlation: f64,
    /// Standard deviation of the time stamps, s.
    pub jitter_s: f64,
    /// Frame period, s, where samples were moved to the frames about which their time stamps jitter.
    pub frame_s: Option<f64>,
    /// Findings by kind.
    pub findings: Vec<&'static str>,
    /// Number of masked samples.
    pub outliers: usize,
}

impl Noise {
    /// Stores the frame clock to which the samples were moved.
    pub fn set_frame_clock(&mut self, FrameClock { period_s, jitter_s }: FrameClock) {
        (self.frame_s, self.jitter_s) = (Some(period_s), jitter_s);
        if !self.findings.contains(&JITTER) {
            self.findings.push(JITTER);
        }
    }

    /// White share of the variance used in fits, at most 1: a lower bound of the residual variance.
    pub fn white_share(&self) -> f64 {
        let shares = self.white.iter().zip(&self.sd).map(|(white, sd)| (white / sd).powi(2));
        (shares.sum::<f64>() / self.sd.len().max(1) as f64).min(1.0)
    }
}
