//! Why no answer can come of some throws.

use super::{GRAVITY, RESTITUTION};
use crate::model::Parameter;
use crate::statistics::median;
use crate::system::{Objection, Record};
use thiserror::Error;

/// Share of the spread of the first flight that gravity with a free start may leave: twice that of a ball at half its
/// terminal speed, below the quarter that wrong units leave.
const HOPELESS: f64 = 0.2;

#[derive(Debug, Error)]
enum Reason {
    #[error(
        "no impacts found, so `restitution` cannot be calibrated; freeze it or remove it from the model, or give data with bounces"
    )]
    NoImpacts,
    #[error(
        "the model cannot be calibrated: gravity with a free start leaves {rmse_m:.3} m in the first flights, {:.0} times the sensor's noise of {sd_m:.2e} m; check units, the sign of the height (up is positive), the contact height (0) and `t_s` (0 at the release)",
        rmse_m / sd_m
    )]
    NotCalibrated { rmse_m: f64, sd_m: f64 },
    #[error("too few heights of a throw were measured")]
    TooFewHeights,
}

/// The objection to a record of which nothing can be made.
pub(super) fn too_few_heights() -> Objection {
    Objection::new(Reason::TooFewHeights)
}

/// Why no answer can come of these records: the height is the last channel, `sd_m` its noise.
pub(super) fn objection(parameters: &[Parameter], records: &[Record], sd_m: f64) -> Option<Objection> {
    if !parameters[RESTITUTION].frozen && records.iter().all(|r| r.events.is_empty()) {
        return Some(Objection::new(Reason::NoImpacts));
    }
    unlike_gravity(parameters[GRAVITY].nominal, records, sd_m).map(Objection::new)
}

/// A model that does not even follow the first flight is in other units or upside down.
fn unlike_gravity(g: f64, records: &[Record], sd_m: f64) -> Option<Reason> {
    let mut shares = Vec::new();
    let mut misfits = Vec::new();
    for r in records {
        let Some(vertical) = r.values.len().checked_sub(1) else { continue };
        let (Some(arc), Some(window)) = (r.pieces.first(), r.windows.first()) else { continue };
        let (p, v) = (window.start[vertical], window.start[r.values.len() + vertical]);
        let (mut n, mut sum, mut square, mut misfit) = (0.0, 0.0, 0.0, 0.0);
        for k in arc.clone().filter(|&k| r.values[vertical][k].is_finite()) {
            let (y, t) = (r.values[vertical][k], r.times[k] - r.times[0]);
            n += 1.0;
            sum += y;
            square += y * y;
            misfit += (y - p - v * t + 0.5 * g * t * t).powi(2);
        }
        let spread = (square - sum * sum / n).max(0.0);
        let visible = misfit > 100.0 * n * sd_m * sd_m;
        shares.push(if visible { (misfit / spread.max(1e-300)).sqrt() } else { 0.0 });
        misfits.push((misfit / f64::max(n, 1.0)).sqrt());
    }
    if median(&mut shares) < HOPELESS {
        return None;
    }
    Some(Reason::NotCalibrated { rmse_m: median(&mut misfits), sd_m })
}
