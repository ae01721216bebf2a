//! Median and quantiles of values.

/// Median of the values in a slice, 0 if it is empty; sorts the slice.
///
/// ```
/// use augsim_system::statistics::median;
/// assert_eq!(median(&mut [4.0, 1.0, 2.0, 3.0]), 2.5);
/// ```
pub fn median(x: &mut [f64]) -> f64 {
    if x.is_empty() {
        return 0.0;
    }
    x.sort_by(f64::total_cmp);
    let n = x.len();
    if n % 2 == 1 { x[n / 2] } else { 0.5 * (x[n / 2 - 1] + x[n / 2]) }
}

/// Quantile `p` (0 to 1) of sorted values by linear interpolation; NaN if there are none.
///
/// ```
/// use augsim_system::statistics::quantile;
/// assert_eq!(quantile(&[0.0, 1.0, 2.0], 0.25), 0.5);
/// assert!(quantile(&[], 0.5).is_nan());
/// ```
pub fn quantile(sorted: &[f64], p: f64) -> f64 {
    let Some(top) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let u = p.clamp(0.0, 1.0) * top as f64;
    let i = (u as usize).min(top.saturating_sub(1));
    let next = sorted[(i + 1).min(top)];
    sorted[i] + (next - sorted[i]) * (u - i as f64)
}

#[cfg(test)]
mod tests {
    //! Median and quantile agree with the usual definition, for even and odd numbers of values.
    use super::*;

    #[test]
    fn median_and_quantile_of_small_slices() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!(quantile(&[0.0, 1.0, 2.0], 0.25), 0.5);
        assert!(quantile(&[], 0.5).is_nan());
    }
}
