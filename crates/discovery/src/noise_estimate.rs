//! Measurement noise of a data set, as estimated before any fit.

use augsim_data::FrameClock;

/// Name of the finding that the time stamps jitter.
pub(crate) const JITTER: &str = "timing-jitter";

/// Measurement noise of a data set, as estimated before any fit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Noise {
    /// Standard deviation of the noise used in fits, by channel, in the unit of each.
    pub sd: Vec<f64>,
    /// Standard deviation of the noise between neighbouring samples, by channel; at most `sd`. It is smaller
    /// than `sd` where the declared accuracy of the instrument is far larger than that noise.
    pub white: Vec<f64>,
    /// Correlation of the noise of neighbouring samples.
    pub correlation: f64,
    /// Standard deviation of the jitter of the time stamps, s.
    pub jitter_s: f64,
    /// Frame period, s, if samples were moved to the frame times about which their time stamps jitter; else
    /// `None`.
    pub frame_s: Option<f64>,
    /// Names of the findings about the noise, such as `noise-autocorrelated`.
    pub findings: Vec<&'static str>,
    /// Number of samples masked as outliers.
    pub outliers: usize,
}

impl Noise {
    /// Stores the frame clock to whose times the samples were moved.
    pub fn set_frame_clock(&mut self, FrameClock { period_s, jitter_s }: FrameClock) {
        (self.frame_s, self.jitter_s) = (Some(period_s), jitter_s);
        if !self.findings.contains(&JITTER) {
            self.findings.push(JITTER);
        }
    }

    /// Share of the noise variance used in fits that differences of neighbouring samples show, at most 1. It
    /// is a lower bound of the ratio of residual variance to that noise variance.
    pub fn white_share(&self) -> f64 {
        let shares = self.white.iter().zip(&self.sd).map(|(white, sd)| (white / sd).powi(2));
        (shares.sum::<f64>() / self.sd.len().max(1) as f64).min(1.0)
    }
}
