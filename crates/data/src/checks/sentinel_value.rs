//! One value far outside of all others that stands for "not measured".

use super::{Expected, Finding};
use crate::dataset::Dataset;

/// Distance from all other values, in units of their whole range, from which a value that occurs again and again is none
/// of them. In the measured sets the farthest single value lies 0.28 ranges off, the farthest that comes back 0.0004.
const FAR: f64 = 5.0;
/// Share of the samples below which a value is the exception.
const RARE: f64 = 0.5;

/// The largest and the smallest value of every column that changes within trajectories.
pub(super) fn look(data: &Dataset, _: &Expected) -> Vec<Finding> {
    let covariates: Vec<&str> = data.covariates().map(|c| c.name()).collect();
    let changing = |name: &str| !covariates.contains(&name);
    let columns = data.columns().iter().enumerate().filter(|(_, c)| changing(c.name()));
    columns.filter_map(|(i, column)| sentinel(data, i, column.name())).collect()
}

fn sentinel(data: &Dataset, i: usize, column: &str) -> Option<Finding> {
    let values = || data.trajectories().iter().flat_map(|t| t.column(i)).copied().filter(|v| v.is_finite());
    let range = |of: &mut dyn Iterator<Item = f64>| {
        of.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [v.min(low), v.max(high)])
    };
    let total = values().count();
    range(&mut values()).into_iter().find_map(|value| {
        let others = range(&mut values().filter(|v| *v != value));
        let width = others[1] - others[0];
        let away = (others[0] - value).max(value - others[1]);
        let count = values().filter(|v| *v == value).count();
        // A code is known by itself; other values must come back, digit by digit.
        let repeats = count > 1 || is_code(value);
        let found = repeats && width > 0.0 && away > FAR * width && (count as f64) < RARE * total as f64;
        if !found {
            return None;
        }
        let (t, k) = data
            .trajectories()
            .iter()
            .find_map(|t| Some((t, t.column(i).iter().position(|v| *v == value)?)))?;
        Some(Finding::SentinelValue {
            trajectory: t.id().to_owned(),
            time_s: t.time_s()[k],
            column: column.to_owned(),
            value,
            count,
            others,
        })
    })
}

/// Whether programs write `value` for nothing: a row of nines, or the end of a 16-bit or 32-bit integer.
fn is_code(value: f64) -> bool {
    let nines = |n: i32| 10f64.powi(n) - 1.0;
    let ends = [32_767.0, 32_768.0, 65_535.0, 2_147_483_647.0, 2_147_483_648.0, 4_294_967_295.0];
    (3..9).any(|n| value.abs() == nines(n)) || ends.contains(&value.abs())
}
