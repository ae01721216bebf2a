//! Check for a value far outside the range of all others that stands for "not measured".

use super::{ExpectedData, Finding};
use crate::dataset::Dataset;

/// Minimum distance of a sentinel (a code for "not measured") from all other values, relative to their range.
///
/// In the measured sets the most distant single value is 0.28 ranges away, the most distant repeated one
/// 0.0004.
const MIN_DISTANCE: f64 = 5.0;
/// Maximum share of a column's samples that may hold a sentinel.
const MAX_SHARE: f64 = 0.5;

/// Finds codes for "not measured" among the extreme values of every column that changes within trajectories.
pub(super) fn run(data: &Dataset, _: &ExpectedData) -> Vec<Finding> {
    let covariates: Vec<&str> = data.covariates().map(|c| c.name()).collect();
    let is_changing = |name: &str| !covariates.contains(&name);
    let columns = data.columns().iter().enumerate().filter(|(_, c)| is_changing(c.name()));
    columns.filter_map(|(i, column)| sentinel(data, i, column.name())).collect()
}

fn sentinel(data: &Dataset, i: usize, column: &str) -> Option<Finding> {
    let values = || data.trajectories().iter().flat_map(|t| t.column(i)).copied().filter(|v| v.is_finite());
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [v.min(low), v.max(high)])
    };
    let total = values().count();
    range(&mut values()).into_iter().find_map(|value| {
        let others = range(&mut values().filter(|v| *v != value));
        let width = others[1] - others[0];
        let distance = (others[0] - value).max(value - others[1]);
        let count = values().filter(|v| *v == value).count();
        // A known code may occur once; any other value must occur several times with all its digits.
        let may_be_sentinel = count > 1 || is_code(value);
        let is_far = width > 0.0 && distance > MIN_DISTANCE * width;
        if !(may_be_sentinel && is_far && (count as f64) < MAX_SHARE * total as f64) {
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

/// Whether programs use `value` for missing data: only nines, or a limit of 16-bit or 32-bit integers.
fn is_code(value: f64) -> bool {
    let all_nines = |n: i32| 10f64.powi(n) - 1.0;
    let integer_limits = [32_767.0, 32_768.0, 65_535.0, 2_147_483_647.0, 2_147_483_648.0, 4_294_967_295.0];
    (3..9).any(|n| value.abs() == all_nines(n)) || integer_limits.contains(&value.abs())
}
