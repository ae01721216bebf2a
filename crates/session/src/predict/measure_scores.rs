//! Scores of predictions in each measure, such as the position: error with interval, fit and coverage of the bands.

use augsim_discovery::PredictionSet;
use serde::Serialize;

/// Scores of the predictions of one model in one measure.
#[derive(Debug, Serialize)]
pub struct MeasureScores {
    /// Name of the measure, such as `position`, or of the output.
    pub measure: String,
    /// Root mean square error after the burn-in, in `unit`.
    pub rmse: f64,
    /// 95 % interval of the error over trajectories, in `unit`.
    pub ci95: [f64; 2],
    /// Symbol of the unit of the errors.
    pub unit: String,
    /// Fit of the prediction, %; see [`fit_percent`].
    pub fit_percent: f64,
    /// Coefficient of determination.
    pub r2: f64,
    /// Share, 0 to 1, of the measured values of this measure in the 50 % prediction band.
    pub coverage50: f64,
    /// Share, 0 to 1, of the measured values of this measure in the 90 % prediction band.
    pub coverage90: f64,
}

/// Computes the scores of all measures in which anything was measured after the burn-in.
pub fn measure_scores(predicted: &PredictionSet) -> Vec<MeasureScores> {
    let scores = predicted.errors.iter().filter(|e| e.rmse.is_finite()).map(|e| {
        let [coverage50, coverage90] = [0.5, 0.9].map(|level| predicted.coverage(level, &e.channels).0);
        let r2 = predicted.r2(&e.channels);
        MeasureScores {
            measure: e.measure.clone(),
            rmse: e.rmse,
            ci95: e.ci95,
            unit: e.unit.clone(),
            fit_percent: fit_percent(r2),
            r2,
            coverage50,
            coverage90,
        }
    });
    scores.collect()
}

/// Fit of a model, %: 100 (1 - |y - y_model| / |y - mean|), from the coefficient of determination `r2`.
///
/// It is 100 for a perfect model and 0 for one that predicts as well as the mean.
pub fn fit_percent(r2: f64) -> f64 {
    100.0 * (1.0 - (1.0 - r2).max(0.0).sqrt())
}
