//! Offsets of the events' parameter at a fit: how widely they scatter, and how much of that the events of a record share.
//!
//! An offset that the data hardly see is drawn to 0 by its prior. With `seen` the share of its information that comes from the
//! data, `offset / seen` is what they say of it, with weight `seen`; sums of products of two offsets of a record over those of
//! `seen` estimate the covariance of its events (one-way analysis of variance by moments, Searle, Casella and McCulloch 1992).

use crate::evaluate::{Lanes, Normal};
use crate::hypothesis::Hypothesis;

/// Least standard deviation of a scatter, in units of its typical size: at 0 it could not grow.
const LEAST_SCATTER: f64 = 5e-4;

/// Spread of the offsets of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Spread {
    /// Standard deviation (MacKay's fixed point, Neural Computation 4:415, 1992).
    pub sd: f64,
    /// How many draws the offsets amount to: those that the data hardly see count less.
    pub draws: f64,
    /// Share of the variance that the events of a record have in common, with its standard error over the records; `None` where
    /// too few records have two events.
    pub shared: Option<[f64; 2]>,
}

/// Fewest records with two events that tell what they share.
const FEWEST: usize = 5;

/// Sums over the offsets of one record and over pairs of them.
#[derive(Clone, Copy)]
struct OfRecord {
    squares: f64,
    /// Sum of how far the offsets are seen.
    seen: f64,
    /// Products of two offsets.
    products: f64,
    /// Products of how far the two are seen.
    pairs: f64,
}

impl OfRecord {
    /// The sums over offsets, each with how far it is seen, by `weight`. A record counts in pairs by its events, not by its
    /// pairs: ten events say little more of what they share than five.
    fn new(offsets: &[(f64, f64)], weight: f64) -> Self {
        let sums = |of: fn(&(f64, f64)) -> f64| {
            offsets.iter().map(of).fold((0.0, 0.0), |(s, q), v| (s + v, q + v * v))
        };
        let ((sum, squares), (seen, seen_squares)) = (sums(|o| o.0), sums(|o| o.1));
        let half = if seen > 0.0 { 0.5 * weight / seen } else { 0.0 };
        Self {
            squares: weight * squares,
            seen: weight * seen,
            products: half * (sum * sum - squares),
            pairs: half * (seen * seen - seen_squares),
        }
    }
}

/// The spread of the offsets in `nuisance` where their prior has the standard deviation `sd`.
pub(crate) fn spread_of(
    h: &Hypothesis,
    lanes: &[Lanes],
    normals: &[Normal],
    nuisance: &[Vec<f64>],
    sd: f64,
) -> Spread {
    let (mut sum, mut freedom, mut draws, mut records) = (0.0, 0.0, 0.0, Vec::new());
    for ((l, normal), n) in lanes.iter().zip(normals).zip(nuisance) {
        let tail: Vec<usize> = (l.common()..normal.h.n).collect();
        let c = normal.h.sub(&tail).cholesky().inverse();
        let first = l.fixed_nuisances();
        // A trajectory that the model does not follow says nothing about its scatter.
        let weight = normal.weight.min(1.0);
        let offsets: Vec<(f64, f64)> = (first..first + l.offsets)
            .filter_map(|i| Some((*n.get(i)?, 1.0 - c.at(i, i) / (sd * sd))))
            .collect();
        for (x, seen) in &offsets {
            sum += weight * x * x;
            freedom += weight * seen;
            draws += weight * seen * seen;
        }
        records.push(OfRecord::new(&offsets, weight));
    }
    let (least, most) = scatter_bounds(h);
    let sd = f64::sqrt(sum / f64::max(freedom, 1e-6)).clamp(least, most);
    Spread { sd, draws, shared: shared(&records) }
}

/// The share of the variance that the events of a record have in common: covariance of its pairs over variance, each a ratio of sums
/// over records, with the standard error that the records' parts in both give (linearised).
fn shared(records: &[OfRecord]) -> Option<[f64; 2]> {
    let several: Vec<&OfRecord> = records.iter().filter(|r| r.pairs > 0.0).collect();
    let sum = |of: fn(&OfRecord) -> f64| several.iter().map(|r| of(r)).sum::<f64>();
    let (pairs, seen) = (sum(|r| r.pairs), sum(|r| r.seen));
    let variance = sum(|r| r.squares) / seen;
    if several.len() < FEWEST || variance.is_nan() || variance <= 0.0 {
        return None;
    }
    let share = sum(|r| r.products) / pairs / variance;
    let parts = several.iter().map(|r| {
        let covariance = (r.products / variance - share * r.pairs) / pairs;
        covariance - share * (r.squares / variance - r.seen) / seen
    });
    let n = several.len() as f64;
    let variance_of_share = parts.map(|p| p * p).sum::<f64>() * n / (n - 1.0);
    Some([share, variance_of_share.sqrt()])
}

/// Bounds of the standard deviation of the scatter, in the unit of the parameter that scatters.
pub(crate) fn scatter_bounds(h: &Hypothesis) -> (f64, f64) {
    let event = h.system.schema().event.as_ref();
    let sd = event.and_then(|e| e.scatter.parameters.first());
    sd.map_or((0.0, f64::INFINITY), |p| (LEAST_SCATTER * p.typical, p.max))
}

#[cfg(test)]
mod tests {
    //! Contract: draws per record are shared to the part that their variance has, draws per event are not, whatever the number
    //! of events; the standard error is that of repetitions.
    use super::*;
    use augsim_data::random_stream;
    use rand_distr::{Distribution, StandardNormal};

    /// Mean of the estimated share over 300 repetitions of 60 records, their scatter, and the mean standard error.
    fn repeated(between: f64, within: f64) -> [f64; 3] {
        let mut rng = random_stream(1, "offsets", 0);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let found: Vec<[f64; 2]> = (0..300)
            .map(|_| {
                let records: Vec<OfRecord> = (0..60)
                    .map(|i| {
                        let own = between * normal();
                        let list: Vec<_> = (0..1 + i % 7).map(|_| (own + within * normal(), 1.0)).collect();
                        OfRecord::new(&list, 1.0)
                    })
                    .collect();
                shared(&records).expect("60 records")
            })
            .collect();
        let n = found.len() as f64;
        let mean = found.iter().map(|f| f[0]).sum::<f64>() / n;
        let sd = (found.iter().map(|f| (f[0] - mean).powi(2)).sum::<f64>() / n).sqrt();
        [mean, sd, found.iter().map(|f| f[1]).sum::<f64>() / n]
    }

    #[test]
    fn draws_per_record_are_shared_and_draws_per_event_are_not() {
        for (between, within, truth) in [(0.1, 0.0, 1.0), (0.0, 0.1, 0.0), (0.1, 0.1, 0.5)] {
            let [mean, sd, told] = repeated(between, within);
            // A ratio of sums over 50 records is biased by less than a fifth of its standard error.
            assert!((mean - truth).abs() < 1e-9 + 0.3 * sd, "{between} {within}: {mean}");
            assert!((told - sd).abs() < 1e-9 + 0.25 * sd, "{between} {within}: {told} for {sd}");
        }
    }

    #[test]
    fn few_records_tell_nothing() {
        let one = OfRecord::new(&[(0.1, 1.0), (0.1, 1.0)], 1.0);
        assert_eq!(shared(&[one; 2]), None);
        assert_eq!(shared(&[OfRecord::new(&[(0.1, 1.0)], 1.0); 50]), None, "one event each");
    }
}
