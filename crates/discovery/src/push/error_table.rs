//! Errors before and after as tables with intervals.

use super::fit::Fit;
use super::forecast::{self, Counted, Squares};
use super::hypothesis::Hypothesis;
use super::measured::{Measured, Window};
use crate::result::{ErrorTable, PushHorizon, Rmse};
use augsim_physics::model::PushModel;

/// Longest push that is forecast as a whole, m of travel; longer ones are cut by time.
const WHOLE_M: f64 = 0.2;
/// Horizons of forecasts, s; the middle one cuts long runs in the table of errors.
const HORIZONS_S: [f64; 3] = [0.5, 1.0, 2.0];
/// Fewest forecasts of a horizon.
const FEWEST: usize = 3;

/// Squared errors of the same forecasts: as declared, calibrated, augmented.
#[derive(Clone, Debug, Default)]
struct Forecasts {
    windows: Vec<Window>,
    models: [Vec<Squares>; 3],
}

impl Forecasts {
    fn extend(&mut self, other: Self) {
        self.windows.extend(other.windows);
        self.models.iter_mut().zip(other.models).for_each(|(a, b)| a.extend(b));
    }

    fn row(&self, i: usize, of: fn(&Squares) -> f64, scale: f64, seed: u64) -> Rmse {
        forecast::row(&self.windows, &self.models[i], of, scale, seed)
    }

    /// Calibrated minus augmented.
    fn reduction(&self, of: fn(&Squares) -> f64, scale: f64, seed: u64) -> Rmse {
        let [_, calibrated, augmented] = &self.models;
        Rmse {
            rmse: scale * (forecast::rmse(calibrated, of) - forecast::rmse(augmented, of)),
            ci95: forecast::bootstrap(&self.windows, &[calibrated, augmented], of, seed, |r| r[0] - r[1])
                .map(|v| scale * v),
        }
    }
}

/// Errors on pushes that the fits have not seen.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lists {
    records: usize,
    /// All samples of whole pushes, or of pieces of long ones.
    whole: Forecasts,
    floor: Vec<Squares>,
    /// Last samples after each horizon.
    ends: [Forecasts; 3],
}

impl Lists {
    /// On the pushes `records`, of which the windows `kept` were not left out.
    pub fn of(
        model: &PushModel,
        data: &Measured,
        records: &[usize],
        kept: &[Window],
        fits: [&Fit; 2],
        seed: u64,
    ) -> Self {
        let plain = Hypothesis::new(model, &data.groups, &[]);
        let nominal = plain.start();
        let [base, best] = fits;
        let models = [(&plain, &nominal), (&base.hypothesis, &base.theta), (&best.hypothesis, &best.theta)];
        let on = |windows: Vec<Window>, counted: Counted| Forecasts {
            models: models.map(|(h, theta)| forecast::errors(data, &windows, h, theta, counted)),
            windows,
        };
        let whole = on(forecast_windows(data, records, kept), Counted::All);
        let floor = forecast::floor(data, &whole.windows, &best.hypothesis, &best.theta, seed);
        let ends = HORIZONS_S.map(|h| on(cut(data, records, kept, h), Counted::Last));
        Self { records: records.len(), whole, floor, ends }
    }

    /// Windows of the table, and root mean square errors of the position of each, m: declared, augmented.
    pub fn by_window(&self) -> (&[Window], Vec<[f64; 2]>) {
        let [declared, _, augmented] = &self.whole.models;
        let of = |all: &[Squares], i: usize| forecast::rmse(&all[i..=i], |s| s.position);
        let errors = (0..declared.len()).map(|i| [of(declared, i), of(augmented, i)]).collect();
        (&self.whole.windows, errors)
    }

    /// Adds the pushes of another fold.
    pub fn extend(&mut self, other: Self) {
        self.records += other.records;
        self.whole.extend(other.whole);
        self.floor.extend(other.floor);
        self.ends.iter_mut().zip(other.ends).for_each(|(a, b)| a.extend(b));
    }

    /// The table of positions, m.
    pub fn positions(&self, seed: u64, heldout_gain: f64) -> ErrorTable {
        self.table(|s| s.position, 1.0, "m", seed, heldout_gain)
    }

    /// The table of rotations, degrees.
    pub fn rotations(&self, seed: u64, heldout_gain: f64) -> ErrorTable {
        self.table(|s| s.rotation, 1f64.to_degrees(), "deg", seed, heldout_gain)
    }

    fn table(
        &self,
        of: fn(&Squares) -> f64,
        scale: f64,
        unit: &str,
        seed: u64,
        heldout_gain: f64,
    ) -> ErrorTable {
        let [declared, calibrated, augmented] = [0, 1, 2].map(|i| self.whole.row(i, of, scale, seed));
        let noise_floor = forecast::row(&self.whole.windows, &self.floor, of, scale, seed);
        ErrorTable {
            unit: unit.into(),
            heldout_trajectories: self.records,
            folds: None,
            declared,
            calibrated,
            augmented,
            noise_floor,
            reduction: self.whole.reduction(of, scale, seed),
            explained_share: ErrorTable::explained(calibrated.rmse, augmented.rmse, noise_floor.rmse),
            heldout_gain,
            free_run: None,
        }
    }

    /// Errors after each horizon that is shorter than the pushes.
    pub fn horizons(&self, seed: u64) -> Vec<PushHorizon> {
        let all = HORIZONS_S.into_iter().zip(&self.ends).filter(|(_, f)| f.windows.len() >= FEWEST);
        all.map(|(horizon_s, f)| PushHorizon {
            horizon_s,
            windows: f.windows.len(),
            position_m: [0, 1, 2].map(|i| f.row(i, |s| s.position, 1.0, seed)),
            reduction_m: f.reduction(|s| s.position, 1.0, seed),
            rotation_deg: [0, 1, 2].map(|i| f.row(i, |s| s.rotation, 1f64.to_degrees(), seed)),
        })
        .collect()
    }
}

/// Whether no part of a window was left out. Windows of fits leave out nothing else but remainders of a sample or two.
fn used(data: &Measured, w: &Window, kept: &[Window]) -> bool {
    let covered: usize = kept
        .iter()
        .filter(|v| v.record == w.record)
        .map(|v| (v.last.min(w.last) + 1).saturating_sub(v.first.max(w.first)))
        .sum();
    data.records[w.record].time.len() >= 2 && covered + 3 > w.last - w.first
}

/// Pieces of one horizon.
fn cut(data: &Measured, records: &[usize], kept: &[Window], horizon_s: f64) -> Vec<Window> {
    let all = records.iter().flat_map(|&i| data.records[i].horizons(i, horizon_s));
    all.filter(|w| used(data, w, kept)).collect()
}

/// Windows of the table of errors.
fn forecast_windows(data: &Measured, records: &[usize], kept: &[Window]) -> Vec<Window> {
    let mut windows = whole_windows(data, records);
    windows.retain(|w| used(data, w, kept));
    windows
}

/// Whole pushes, and pieces of long ones.
pub(super) fn whole_windows(data: &Measured, records: &[usize]) -> Vec<Window> {
    let mut windows = Vec::new();
    for &i in records {
        let r = &data.records[i];
        if r.length() <= WHOLE_M {
            windows.push(Window { record: i, first: 0, last: r.time.len() - 1 });
        } else {
            windows.extend(r.horizons(i, HORIZONS_S[1]));
        }
    }
    windows
}
