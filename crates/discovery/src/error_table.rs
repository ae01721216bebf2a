//! Tables of prediction errors with intervals.

use crate::fit::{ChosenRecords, Fit};
use crate::forecast::{self, Errors, ForecastSpan};
use crate::hypothesis::Hypothesis;
use crate::result::{ErrorTable, FreeRun, Horizon, HorizonErrors, Rmse};
use augsim_system::{ErrorFigure, Schema, Simulate};
use std::collections::BTreeMap;

/// Minimum number of predictions for which the errors after a horizon are reported.
const MIN_PREDICTIONS: usize = 3;

/// Errors of the same predictions by the declared, the calibrated and the augmented model.
#[derive(Clone, Debug, Default)]
struct Forecasts {
    /// Index in the data of the record of each prediction.
    records: Vec<usize>,
    models: [Errors; 3],
}

impl Forecasts {
    fn extend(&mut self, other: Self) {
        self.records.extend(other.records);
        self.models.iter_mut().zip(other.models).for_each(|(a, b)| append(a, b));
    }

    fn row(&self, model: usize, measure: usize, scale: f64, seed: u64) -> Rmse {
        row(&self.records, &self.models[model], measure, scale, seed)
    }

    /// Calibrated minus augmented root mean square error of a measure, with its 95 % interval.
    fn reduction(&self, measure: usize, scale: f64, seed: u64) -> Rmse {
        let [_, calibrated, augmented] = self.models.each_ref().map(|errors| &errors[measure][..]);
        let ci95 = forecast::bootstrap(&self.records, &[calibrated, augmented], seed, |r| r[0] - r[1]);
        let rmse = forecast::rmse(calibrated) - forecast::rmse(augmented);
        Rmse { rmse: scale * rmse, ci95: ci95.map(|v| scale * v) }
    }
}

/// Root mean square error of one measure over predictions, multiplied by `scale`, with its 95 % interval.
fn row(records: &[usize], errors: &Errors, measure: usize, scale: f64, seed: u64) -> Rmse {
    let list = &errors[measure][..];
    let ci95 = forecast::bootstrap(records, &[list], seed, |r| r[0]);
    Rmse { rmse: scale * forecast::rmse(list), ci95: ci95.map(|v| scale * v) }
}

/// Appends the errors of the predictions in `more` to those in `errors`, measure by measure.
fn append(errors: &mut Errors, more: Errors) {
    errors.resize(more.len(), Vec::new());
    errors.iter_mut().zip(more).for_each(|(a, b)| a.extend(b));
}

/// Prediction errors of the declared, the calibrated and the augmented model on held-out records.
#[derive(Clone, Debug, Default)]
pub(crate) struct ForecastErrors {
    heldout: usize,
    /// Predicted spans of records that `whole` covers; those of appended cross-validation folds are not
    /// included.
    pieces: Vec<ForecastSpan>,
    whole: Forecasts,
    /// Errors that measurement noise and random effects alone would cause, for each measure.
    floor: Errors,
    /// Errors at the last sample of predictions over each horizon of the schema.
    ends: Vec<Forecasts>,
}

impl ForecastErrors {
    /// Predicts the records `test`, which the fits (calibrated, augmented) have not used. `held` is the fit
    /// of the second model's initial states and event offsets to `test`. Windows marked in `out` are
    /// excluded.
    pub fn measure(
        test: &ChosenRecords<'_>,
        [base, best]: [&Fit; 2],
        held: &Fit,
        out: &[bool],
        seed: u64,
    ) -> Self {
        let nominal = Hypothesis::new(test.data, &[]).initial_theta(0.0);
        let ranges = test.windows_by_record();
        let all_windows = test.windows();
        let is_included = |piece: &ForecastSpan| {
            let windows = ranges[piece.chosen].clone();
            !windows.filter(|&w| out.get(w) == Some(&true)).any(|w| {
                let excluded = &all_windows[w].window.samples;
                excluded.start < piece.samples.end && piece.samples.start < excluded.end
            })
        };
        let predict = |pieces: &[ForecastSpan]| Forecasts {
            records: pieces.iter().map(|piece| test.chosen[piece.chosen]).collect(),
            models: [(base, &nominal), (base, &base.theta), (best, &best.theta)]
                .map(|(fit, theta)| forecast::errors(test, pieces, fit, theta)),
        };
        let pieces: Vec<ForecastSpan> = forecast::whole_spans(test).into_iter().filter(is_included).collect();
        let horizons = test.data.system.schema().horizons_s.iter();
        let ends = horizons.map(|&horizon_s| {
            let pieces: Vec<ForecastSpan> =
                forecast::horizon(test, horizon_s).into_iter().filter(is_included).collect();
            predict(&pieces)
        });
        Self {
            heldout: test.chosen.len(),
            whole: predict(&pieces),
            floor: forecast::noise_floor(test, &pieces, best, held, seed),
            ends: ends.collect(),
            pieces,
        }
    }

    /// Predicted spans with the root mean square errors of each in the first measure: declared, augmented
    /// model. Errors are in the unit of the measure's channels; spans of appended folds are not included.
    pub fn errors_by_span(&self) -> (&[ForecastSpan], Vec<[f64; 2]>) {
        let error = |errors: &Errors, i: usize| forecast::rmse(&errors[0][i..=i]);
        let [declared, _, augmented] = &self.whole.models;
        let errors = (0..self.pieces.len()).map(|i| [error(declared, i), error(augmented, i)]);
        (&self.pieces, errors.collect())
    }

    /// Appends the errors on another cross-validation fold.
    pub fn extend(&mut self, other: Self) {
        self.heldout += other.heldout;
        self.whole.extend(other.whole);
        append(&mut self.floor, other.floor);
        self.ends.resize(other.ends.len(), Forecasts::default());
        self.ends.iter_mut().zip(other.ends).for_each(|(a, b)| a.extend(b));
    }

    /// Error table of the first measure of the schema, which decides, in the unit of its channels.
    pub fn first(&self, schema: &Schema, seed: u64, heldout_gain: f64) -> ErrorTable {
        let table = self.table(0, 1.0, &deciding_measure(schema).0, seed, heldout_gain);
        let names = &schema.error_figures;
        let measure = if names.len() > 1 { names[0].name.clone() } else { String::new() };
        ErrorTable { measure, ..table }
    }

    /// Error tables of all measures but the first, by name, in their display units.
    pub fn other_figures(
        &self,
        schema: &Schema,
        seed: u64,
        heldout_gain: f64,
    ) -> BTreeMap<String, ErrorTable> {
        let table = |(i, measure): (usize, &ErrorFigure)| {
            let (unit, scale) = &measure.unit;
            let table = self.table(i, *scale, unit, seed, heldout_gain);
            (measure.name.clone(), ErrorTable { measure: measure.name.clone(), ..table })
        };
        schema.error_figures.iter().enumerate().skip(1).map(table).collect()
    }

    fn table(&self, measure: usize, scale: f64, unit: &str, seed: u64, heldout_gain: f64) -> ErrorTable {
        let [declared, calibrated, augmented] = [0, 1, 2].map(|i| self.whole.row(i, measure, scale, seed));
        let noise_floor = row(&self.whole.records, &self.floor, measure, scale, seed);
        ErrorTable {
            measure: String::new(),
            unit: unit.into(),
            heldout_trajectories: self.heldout,
            folds: None,
            declared,
            calibrated,
            augmented,
            noise_floor,
            reduction: self.whole.reduction(measure, scale, seed),
            explained_share: ErrorTable::explained(calibrated.rmse, augmented.rmse, noise_floor.rmse),
            heldout_gain,
            free_run: None,
        }
    }

    /// Errors after each prediction horizon for which there are enough predictions.
    pub fn horizons(&self, schema: &Schema, seed: u64) -> Vec<Horizon> {
        let horizons =
            schema.horizons_s.iter().zip(&self.ends).filter(|(_, f)| f.records.len() >= MIN_PREDICTIONS);
        let errors = |f: &Forecasts, i: usize, measure: &ErrorFigure| {
            let (unit, scale) = &measure.unit;
            let [declared, calibrated, augmented] = [0, 1, 2].map(|model| f.row(model, i, *scale, seed));
            let reduction = f.reduction(i, *scale, seed);
            HorizonErrors { unit: unit.clone(), declared, calibrated, augmented, reduction }
        };
        horizons
            .map(|(&horizon_s, f)| Horizon {
                horizon_s,
                forecasts: f.records.len(),
                errors: schema
                    .error_figures
                    .iter()
                    .enumerate()
                    .map(|(i, measure)| (measure.name.clone(), errors(f, i, measure)))
                    .collect(),
            })
            .collect()
    }
}

impl FreeRun {
    /// Errors of simulations of whole recordings by both models; `None` if there are none of the augmented
    /// model.
    pub(crate) fn from_errors(
        system: &dyn Simulate,
        calibrated: Option<f64>,
        augmented: Option<f64>,
    ) -> Option<Self> {
        let unit = match &system.schema().channels[..] {
            [one] => one.unit.clone(),
            _ => String::new(),
        };
        let finite = |error: Option<f64>| error.filter(|e| e.is_finite());
        augmented.map(|_| Self { unit, calibrated: finite(calibrated), augmented: finite(augmented) })
    }
}

/// Unit and channel indices of the deciding measure, the first of the schema.
pub(crate) fn deciding_measure(schema: &Schema) -> (String, Vec<usize>) {
    let channels = schema.error_figures.first().map_or(Vec::new(), |m| m.channels.clone());
    let first = channels.first().and_then(|&c| schema.channels.get(c));
    (first.map_or(String::new(), |c| c.unit.clone()), channels)
}
