//! Quantities that are tuned on training trajectories: noise factor, spread of bands, and a network on
//! the residual.

use augsim_session::filtered::{PARTICLES, SystemOnPrefix, TimedSequences};
use augsim_terminal::output::Output;
use augsim_trainer::SAMPLES;
use augsim_trainer::filter::{
    CachedForecasts, CorrectedForecaster, FilterSettings, FilteredScore, ForecastCorrection,
    InitialStatePrior, LearnedPriors, PrefixForecaster, RescaledSpread, Sensor, evaluate_filtered,
};

/// Candidate factors of the standard deviation of the measurement noise.
///
/// Residuals of a flight are autocorrelated, so the nominal noise overstates the information. With larger
const NOISE_FACTORS: [f64; 5] = [1.0, 1.4, 2.0, 2.8, 4.0];
/// Candidate spread factors: factors of the distances of the samples from their median.
const SPREAD_FACTORS: [f64; 10] = [1.0, 1.2, 1.4, 1.7, 2.0, 2.4, 2.8, 3.4, 4.0, 4.8];
/// Minimum coverage of the 90 % bands on training values (as a fraction).
///
/// One in ten flights ends at the net or an edge, which the bands should not include.
const MIN_COVERAGE90: f64 = 0.8;

/// `(rows, seed)`: numbers of measured rows `[trajectory][prefix]`, and the seed of the forecasts.
pub type Prefixes<'a> = (&'a [Vec<usize>], u64);

/// Chooses the noise factor with the smallest CRPS on training trajectories (geometric mean over prefixes).
///
/// Returns it with the sensor that has this noise.
pub fn noise(
    train: &SystemOnPrefix,
    laws: &LearnedPriors,
    prefixes: Prefixes<'_>,
    output: &Output,
) -> anyhow::Result<(f64, Sensor)> {
    let sensor = |noise: f64| Sensor::new(laws.noise().iter().map(|sd| Some(noise * sd)).collect());
    let mut best = (f64::INFINITY, NOISE_FACTORS[0]);
    for noise in NOISE_FACTORS {
        let scores = score_measured(&train.filter, &train.data, (&sensor(noise)?, &train.start), prefixes)?;
        let crps = scores.iter().map(|s| s.median_crps[0].ln()).sum::<f64>() / scores.len() as f64;
        output.detail(format!("noise times {noise}: CRPS of training flights {:.2} mm", 1e3 * crps.exp()));
        if crps < best.0 {
            best = (crps, noise);
        }
    }
    Ok((best.1, sensor(best.1)?))
}

/// Chooses, for each prefix, the smallest spread factor whose bands have nominal coverage in training.
pub fn choose_spread_factors(
    model: &dyn PrefixForecaster,
    train: &SystemOnPrefix,
    sensor: &Sensor,
    prefixes: Prefixes<'_>,
) -> anyhow::Result<Vec<f64>> {
    let known = (sensor, &train.start);
    let cached = CachedForecasts::compute(model, &train.data.set, known, prefixes.0, settings(prefixes.1))?;
    let many = prefixes.0.first().map_or(0, Vec::len);
    let mut spread: Vec<Option<f64>> = vec![None; many];
    for factor in SPREAD_FACTORS {
        let factors = vec![factor; many];
        let widened = RescaledSpread::new(&cached, &factors);
        let scores = score_measured(&widened, &train.data, known, prefixes)?;
        for (found, score) in spread.iter_mut().zip(&scores) {
            if score.coverage90.is_none_or(|held| held >= MIN_COVERAGE90) {
                found.get_or_insert(factor);
            }
        }
        if spread.iter().all(Option::is_some) {
            break;
        }
    }
    let widest = SPREAD_FACTORS[SPREAD_FACTORS.len() - 1];
    Ok(spread.into_iter().map(|factor| factor.unwrap_or(widest)).collect())
}

/// Trains a network on the residual of forecasts with `learned` prefixes; returns it with spread factors.
///
/// The spread factors are for the `asked` prefixes. Cross-validation: each trajectory is corrected by a
/// network that was not trained on it.
pub fn correction(
    train: &SystemOnPrefix,
    sensor: &Sensor,
    learned: &[Vec<usize>],
    asked: Prefixes<'_>,
) -> anyhow::Result<(ForecastCorrection, Vec<f64>)> {
    let known = (sensor, &train.start);
    let learned =
        ForecastCorrection::learn(&train.filter, &train.data.set, known, learned, settings(asked.1))?;
    let crossed = CorrectedForecaster::out_of_fold(&train.filter, &learned);
    let spread = choose_spread_factors(&crossed, train, sensor, asked)?;
    Ok((learned, spread))
}

/// Scores a model on measured trajectories with several prefix lengths.
pub fn score_measured(
    model: &dyn PrefixForecaster,
    data: &TimedSequences,
    known: (&Sensor, &InitialStatePrior),
    (lengths, seed): Prefixes<'_>,
) -> anyhow::Result<Vec<FilteredScore>> {
    Ok(evaluate_filtered(model, &data.set, known, lengths, settings(seed))?)
}

fn settings(seed: u64) -> FilterSettings {
    FilterSettings { particles: PARTICLES, samples: SAMPLES, seed, is_measured: true }
}
