//! Checks that recorded throws can be calibrated at all, and the messages for those that cannot.

use super::{GRAVITY, RESTITUTION};
use augsim_system::statistics::median;
use augsim_system::{Objection, Parameter, Record};
use thiserror::Error;

/// Largest accepted residual norm of a free fall in the first flight, relative to the heights' spread.
///
/// Twice the ratio of a ball at half its terminal speed, and below the ratio of 0.25 that wrong units give.
const MAX_RESIDUAL_RATIO: f64 = 0.2;

/// Reason why recorded throws cannot be calibrated.
#[derive(Debug, Error)]
enum Reason {
    #[error(
        "no impacts found, so `restitution` cannot be calibrated; freeze it or remove it from the model, or use data with bounces"
    )]
    NoImpacts,
    #[error(
        "the model cannot be calibrated: the first flights differ from a free fall with the declared gravity by {rmse_m:.3} m (RMSE), {:.0} times the measurement noise of {sd_m:.2e} m; check units, the sign of the height (up is positive), the contact height (0) and `t_s` (0 at the release)",
        rmse_m / sd_m
    )]
    NotCalibrated { rmse_m: f64, sd_m: f64 },
    #[error("a trajectory has too few measured heights; remove it or record it at a higher rate")]
    TooFewHeights,
}

/// Error for a record with too few measured heights.
pub(super) fn too_few_heights() -> Objection {
    Objection::new(Reason::TooFewHeights)
}

/// Reason why these records cannot be calibrated; `sd_m` is the noise of the height (last channel), m.
pub(super) fn objection(parameters: &[Parameter], records: &[Record], sd_m: f64) -> Option<Objection> {
    if !parameters[RESTITUTION].frozen && records.iter().all(|r| r.events.is_empty()) {
        return Some(Objection::new(Reason::NoImpacts));
    }
    unlike_free_fall(parameters[GRAVITY].nominal, records, sd_m).map(Objection::new)
}

/// Reason if the first flights differ from a free fall, as with wrong units or an inverted height.
fn unlike_free_fall(g: f64, records: &[Record], sd_m: f64) -> Option<Reason> {
    let mut ratios = Vec::new();
    let mut rmses = Vec::new();
    for r in records {
        let Some(vertical) = r.values.len().checked_sub(1) else { continue };
        let (Some(arc), Some(window)) = (r.smooth_segments.first(), r.windows.first()) else { continue };
        let (p, v) = (window.start[vertical], window.start[r.values.len() + vertical]);
        let (mut n, mut sum, mut square_sum, mut residual_sum) = (0.0, 0.0, 0.0, 0.0);
        for k in arc.clone().filter(|&k| r.values[vertical][k].is_finite()) {
            let (y, t) = (r.values[vertical][k], r.times[k] - r.times[0]);
            n += 1.0;
            sum += y;
            square_sum += y * y;
            residual_sum += (y - p - v * t + 0.5 * g * t * t).powi(2);
        }
        let spread = (square_sum - sum * sum / n).max(0.0);
        // Residuals below ten standard deviations of the noise are no sign of wrong units.
        let is_visible = residual_sum > 100.0 * n * sd_m * sd_m;
        ratios.push(if is_visible { (residual_sum / spread.max(1e-300)).sqrt() } else { 0.0 });
        rmses.push((residual_sum / f64::max(n, 1.0)).sqrt());
    }
    if median(&mut ratios) < MAX_RESIDUAL_RATIO {
        return None;
    }
    Some(Reason::NotCalibrated { rmse_m: median(&mut rmses), sd_m })
}
