//! A few trajectories in another unit than the rest.
//!
//! A unit scales everything alike: how far a trajectory goes, how it bends, how it scatters. What goes far alone, as a pendulum that
//! winds round and round, bends and scatters as the others do, or little more.

use super::measured::Series;
use super::{Expected, Finding};
use crate::dataset::Dataset;
use crate::statistics::median;

/// How many times the range of all values of the others a trajectory's own span must be. Centimetres are a factor of 100,
/// of which starts and offsets that differ take up to 5; in the measured sets the largest is 1.1.
const FACTOR: f64 = 10.0;
/// How many times those of the others the second differences of a trajectory in another unit are at least.
const BENDS: f64 = 3.0;
/// How many times less a trajectory in another unit may bend than it goes further, both in those of the others.
const UNEVEN: f64 = 10.0;
/// Largest share of the trajectories that can be the exception.
const EXCEPTION: f64 = 1.0 / 3.0;
/// Fewest trajectories that are a rule.
const RULE: usize = 3;

/// Every column that changes, the trajectories in the order of their spans.
pub(super) fn look(data: &Dataset, _: &Expected) -> Vec<Finding> {
    (0..data.columns().len()).filter_map(|i| exception(data, Series::at(data, i))).collect()
}

fn exception(data: &Dataset, series: Series<'_>) -> Option<Finding> {
    let all = data.trajectories().iter().enumerate();
    let mut spans: Vec<(f64, usize)> = all.filter_map(|(j, t)| Some((series.span(t)?, j))).collect();
    spans.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let least = spans.len() - (EXCEPTION * spans.len() as f64) as usize;
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for (place, &(_, j)) in spans.iter().enumerate() {
        if place >= least.max(RULE) && range[1] > range[0] && spans[place].0 > FACTOR * (range[1] - range[0])
        {
            let others = &spans[..place];
            let wide = that_bend_more(data, series, others, &spans[place..]);
            let first = wide.iter().map(|s| s.1).min()?;
            let typical = |part: &[(f64, usize)]| median(&mut part.iter().map(|s| s.0).collect::<Vec<_>>());
            let span = series.span(&data.trajectories()[first])?;
            return Some(Finding::MixedUnits {
                trajectory: data.trajectories()[first].id().to_owned(),
                column: series.name().to_owned(),
                unit: series.unit(),
                span,
                others_span: range[1] - range[0],
                factor: typical(&wide)? / typical(others)?.max(f64::MIN_POSITIVE),
                others: place,
                alike: wide.len(),
            });
        }
        for v in series.samples(&data.trajectories()[j]).1 {
            range = [range[0].min(v), range[1].max(v)];
        }
    }
    None
}

/// Those of the trajectories `wide` that bend more than the others as well, by their typical second difference: all, where the
/// others' do not bend at all and nothing is said.
fn that_bend_more(
    data: &Dataset,
    series: Series<'_>,
    others: &[(f64, usize)],
    wide: &[(f64, usize)],
) -> Vec<(f64, usize)> {
    let bend = |j: usize| {
        let (_, values) = series.samples(&data.trajectories()[j]);
        median(&mut values.windows(3).map(|v| (v[0] - 2.0 * v[1] + v[2]).abs()).collect::<Vec<_>>())
    };
    let typical = median(&mut others.iter().filter_map(|o| bend(o.1)).collect::<Vec<_>>());
    let typical = typical.filter(|bend| *bend > 0.0);
    let span = median(&mut others.iter().map(|o| o.0).collect::<Vec<_>>()).filter(|span| *span > 0.0);
    let alike = |&(wide, j): &(f64, usize)| {
        let further = span.map_or(0.0, |span| wide / span);
        let least = BENDS.max(further / UNEVEN);
        bend(j).zip(typical).is_some_and(|(bend, typical)| bend < least * typical)
    };
    wide.iter().filter(|w| !alike(w)).copied().collect()
}
