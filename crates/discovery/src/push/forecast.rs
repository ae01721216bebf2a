//! Open-loop forecasts from measured poses, with bootstrap intervals.

use super::evaluate::plain;
use super::hypothesis::Hypothesis;
use super::measured::{Measured, Window};
use crate::result::Rmse;
use crate::statistics::quantile;
use augsim_data::random_stream;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

const RESAMPLES: usize = 400;
/// Fewest held-out pushes that the bootstrap draws as wholes; with fewer it draws windows.
const FEWEST_CLUSTERS: usize = 10;

/// Squared errors of one forecast, summed over its samples: position, m², rotation, rad², and their number.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Squares {
    pub position: f64,
    pub rotation: f64,
    pub count: f64,
}

/// Which samples of a forecast count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Counted {
    All,
    Last,
}

/// Squared errors of one forecast.
pub(crate) fn squares(predicted: &[[f64; 3]], measured: &[[f64; 3]], counted: Counted) -> Squares {
    let first = match counted {
        Counted::All => 1,
        Counted::Last => predicted.len().saturating_sub(1),
    };
    let mut s = Squares::default();
    for (p, y) in predicted.iter().zip(measured).skip(first) {
        s.position += (p[0] - y[0]).powi(2) + (p[1] - y[1]).powi(2);
        s.rotation += (p[2] - y[2]).powi(2);
        s.count += 1.0;
    }
    s
}

/// Forecasts of `windows` from their first measured pose.
pub(crate) fn errors(
    data: &Measured,
    windows: &[Window],
    h: &Hypothesis,
    theta: &[f64],
    counted: Counted,
) -> Vec<Squares> {
    windows
        .par_iter()
        .map(|w| {
            let r = &data.records[w.record];
            squares(&plain(h, theta, r.pose[w.first], r, w), &r.pose[w.first..=w.last], counted)
        })
        .collect()
}

/// What noise leaves to the model itself: forecasts of its own motion, with the sensor's noise, from a noisy first pose.
pub(crate) fn floor(
    data: &Measured,
    windows: &[Window],
    h: &Hypothesis,
    theta: &[f64],
    seed: u64,
) -> Vec<Squares> {
    let indexed: Vec<(usize, &Window)> = windows.iter().enumerate().collect();
    indexed
        .into_par_iter()
        .map(|(i, w)| {
            let r = &data.records[w.record];
            let mut rng = random_stream(seed, "push floor", i as u64);
            let mut noisy = |pose: &[f64; 3]| {
                [0, 1, 2].map(|c| {
                    let z: f64 = StandardNormal.sample(&mut rng);
                    pose[c] + data.noise.sd[c] * z
                })
            };
            let truth = plain(h, theta, r.pose[w.first], r, w);
            let seen: Vec<[f64; 3]> = truth.iter().map(&mut noisy).collect();
            squares(&plain(h, theta, seen[0], r, w), &seen, Counted::All)
        })
        .collect()
}

/// Root mean square of a quantity of all forecasts.
pub(crate) fn rmse(all: &[Squares], of: impl Fn(&Squares) -> f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for s in all {
        sum += of(s);
        count += s.count;
    }
    (sum / f64::max(count, 1.0)).sqrt()
}

/// 95 % interval of a statistic of root mean squares, one for each list of errors of the same windows, by the bootstrap over
/// pushes (over windows, where the pushes are few).
pub(crate) fn bootstrap(
    windows: &[Window],
    lists: &[&[Squares]],
    of: impl Fn(&Squares) -> f64 + Copy,
    seed: u64,
    statistic: impl Fn(&[f64]) -> f64,
) -> [f64; 2] {
    let mut clusters: Vec<Vec<usize>> = Vec::new();
    for (i, w) in windows.iter().enumerate() {
        match clusters.last_mut() {
            Some(c) if windows[c[0]].record == w.record => c.push(i),
            _ => clusters.push(vec![i]),
        }
    }
    if clusters.len() < FEWEST_CLUSTERS {
        clusters = (0..windows.len()).map(|i| vec![i]).collect();
    }
    if clusters.is_empty() {
        return [f64::NAN; 2];
    }
    let mut rng = random_stream(seed, "push bootstrap", 0);
    let mut values: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let drawn: Vec<usize> = (0..clusters.len())
                .flat_map(|_| clusters[rng.random_range(0..clusters.len())].clone())
                .collect();
            let each: Vec<f64> =
                lists.iter().map(|l| rmse(&drawn.iter().map(|&i| l[i]).collect::<Vec<_>>(), of)).collect();
            statistic(&each)
        })
        .collect();
    values.sort_by(f64::total_cmp);
    [quantile(&values, 0.025), quantile(&values, 0.975)]
}

/// A root mean square with its interval.
pub(crate) fn row(
    windows: &[Window],
    list: &[Squares],
    of: impl Fn(&Squares) -> f64 + Copy,
    scale: f64,
    seed: u64,
) -> Rmse {
    let ci95 = bootstrap(windows, &[list], of, seed, |r| r[0]).map(|v| scale * v);
    Rmse { rmse: scale * rmse(list, of), ci95 }
}
