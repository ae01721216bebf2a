//! Numbers of forecasts that are learned from the training trajectories alone: how far readings are believed, how wide bands have to
//! be, and a net on what is left.

use augsim_session::filtered::{OfSystem, PARTICLES, Timed};
use augsim_terminal::output::Output;
use augsim_trainer::SAMPLES;
use augsim_trainer::filter::{
    Corrected, FilterSettings, FilteredScore, ForecastCorrection, Kept, OwnLaws, PrefixForecaster, Sensor,
    StartLaw, Widened, evaluate_filtered,
};

/// Factors of the noise that are tried: what a model leaves of a flight is not independent from row to row, and would be read as
/// evidence of more than there is. A model that is told to doubt its readings more than that forgets the spin.
const NOISE: [f64; 5] = [1.0, 1.4, 2.0, 2.8, 4.0];
/// Factors of the samples' distances from their median that are tried.
const SPREAD: [f64; 10] = [1.0, 1.2, 1.4, 1.7, 2.0, 2.4, 2.8, 3.4, 4.0, 4.8];
/// Least share of training values that the 90 % bands must hold: one in ten of these flights ends at the net or at an edge, which no
/// band should be made for.
const HELD: f64 = 0.8;

/// Rows seen of each trajectory, `[trajectory][prefix]`, and the seed.
pub type Prefixes<'a> = (&'a [Vec<usize>], u64);

/// The factor of the noise at which training trajectories have the least continuous ranked probability score, geometric mean over the
/// prefixes, and the sensor with it.
pub fn noise(
    train: &OfSystem,
    laws: &OwnLaws,
    prefixes: Prefixes<'_>,
    output: &Output,
) -> anyhow::Result<(f64, Sensor)> {
    let sensor = |noise: f64| Sensor::new(laws.noise().iter().map(|sd| Some(noise * sd)).collect());
    let mut best = (f64::INFINITY, NOISE[0]);
    for noise in NOISE {
        let scores = scored(&train.filter, &train.data, (&sensor(noise)?, &train.start), prefixes)?;
        let crps = scores.iter().map(|s| s.crps_of_most[0].ln()).sum::<f64>() / scores.len() as f64;
        output.detail(format!("noise times {noise}: CRPS of training flights {:.2} mm", 1e3 * crps.exp()));
        if crps < best.0 {
            best = (crps, noise);
        }
    }
    Ok((best.1, sensor(best.1)?))
}

/// The least factors of the spread behind each prefix at which the bands of training trajectories hold what they say.
pub fn spread(
    model: &dyn PrefixForecaster,
    train: &OfSystem,
    sensor: &Sensor,
    prefixes: Prefixes<'_>,
) -> anyhow::Result<Vec<f64>> {
    let known = (sensor, &train.start);
    let kept = Kept::of(model, &train.data.set, known, prefixes.0, settings(prefixes.1))?;
    let many = prefixes.0.first().map_or(0, Vec::len);
    let mut spread: Vec<Option<f64>> = vec![None; many];
    for factor in SPREAD {
        let factors = vec![factor; many];
        let widened = Widened::new(&kept, &factors);
        let scores = scored(&widened, &train.data, known, prefixes)?;
        for (found, score) in spread.iter_mut().zip(&scores) {
            if score.coverage90.is_none_or(|held| held >= HELD) {
                found.get_or_insert(factor);
            }
        }
        if spread.iter().all(Option::is_some) {
            break;
        }
    }
    let widest = SPREAD[SPREAD.len() - 1];
    Ok(spread.into_iter().map(|factor| factor.unwrap_or(widest)).collect())
}

/// A net on what the forecasts behind `learned` prefixes leave of training trajectories, and the factors of its spread behind `asked`
/// ones, each trajectory corrected by the net that has not seen it.
pub fn correction(
    train: &OfSystem,
    sensor: &Sensor,
    learned: &[Vec<usize>],
    asked: Prefixes<'_>,
) -> anyhow::Result<(ForecastCorrection, Vec<f64>)> {
    let known = (sensor, &train.start);
    let learned =
        ForecastCorrection::learn(&train.filter, &train.data.set, known, learned, settings(asked.1))?;
    let crossed = Corrected::crossed(&train.filter, &learned);
    let spread = spread(&crossed, train, sensor, asked)?;
    Ok((learned, spread))
}

/// Scores a model behind prefixes of measured trajectories.
pub fn scored(
    model: &dyn PrefixForecaster,
    data: &Timed,
    known: (&Sensor, &StartLaw),
    (lengths, seed): Prefixes<'_>,
) -> anyhow::Result<Vec<FilteredScore>> {
    Ok(evaluate_filtered(model, &data.set, known, lengths, settings(seed))?)
}

fn settings(seed: u64) -> FilterSettings {
    FilterSettings { particles: PARTICLES, samples: SAMPLES, seed, is_measured: true }
}
