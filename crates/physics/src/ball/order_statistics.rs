//! Median and weighted median by selection in linear time, without sorting.

/// Encodes draws as integer keys and partitions them at their middle; returns the index of the middle.
///
/// A key has the value in its upper 32 bits, encoded so that integers order like the values, and the draw's
/// index in its lower ones. Keys before the middle are not larger than the middle one, those after it not
/// smaller.
pub(crate) fn partition_at_middle(draws: &[f32], keys: &mut Vec<u64>) -> usize {
    keys.clear();
    keys.extend(draws.iter().enumerate().map(|(index, x)| {
        let bits = x.to_bits();
        let ordered = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
        u64::from(ordered) << 32 | index as u64
    }));
    let middle = keys.len() / 2;
    keys.select_nth_unstable(middle);
    middle
}

/// Value of the draw that a key encodes.
fn value(key: u64) -> f64 {
    let ordered = (key >> 32) as u32;
    f64::from(f32::from_bits(if ordered >> 31 == 1 { ordered ^ 1 << 31 } else { !ordered }))
}

/// Median of the encoded draws, partitioned at `middle`; for an even number, the mean of the middle two.
pub(crate) fn median(keys: &[u64], middle: usize) -> f64 {
    let upper = value(keys[middle]);
    match keys[..middle].iter().max() {
        Some(&lower) if keys.len().is_multiple_of(2) => (value(lower) + upper) / 2.0,
        _ => upper,
    }
}

/// Weighted median of the encoded draws: the smallest value at which half of the weight is reached.
///
/// Bisects the index range; the keys are already partitioned at `middle`.
pub(crate) fn weighted_median(keys: &mut [u64], mut middle: usize, weights: &[f64]) -> f64 {
    let weight_of =
        |keys: &[u64]| -> f64 { keys.iter().map(|&key| weights[(key & u64::from(u32::MAX)) as usize]).sum() };
    let half = weights.iter().sum::<f64>() / 2.0;
    let (mut low, mut high, mut below) = (0, keys.len(), 0.0);
    loop {
        let reached = below + weight_of(&keys[low..middle]);
        if reached >= half && middle > low {
            high = middle;
        } else {
            // Rounding errors of the sums cannot move the range beyond the last key.
            low = middle;
            below = reached;
        }
        if high - low <= 1 {
            return value(keys[low]);
        }
        middle = low + (high - low) / 2;
        keys[low..high].select_nth_unstable(middle - low);
    }
}

#[cfg(test)]
mod tests {
    //! Contract: selection agrees with sorting, for even and odd numbers of values, ties and both signs.
    use super::*;
    use rand::Rng;

    #[test]
    fn selection_agrees_with_sorting() {
        let mut rng = augsim_data::random_stream(1, "order-statistics", 0);
        let mut keys = Vec::new();
        for count in (1..60).chain([1000, 1001]) {
            // Few distinct values, so that ties occur, including zeros of both signs.
            let draw = |word: u64| {
                let size = (word % 20) as f32 * 0.25;
                if word >> 63 == 1 { -size } else { size }
            };
            let draws: Vec<f32> = (0..count).map(|_| draw(rng.next_u64())).collect();
            let weights: Vec<f64> = (0..count).map(|_| (1 + rng.next_u64() % 9) as f64).collect();
            let mut sorted: Vec<(f32, f64)> = draws.iter().copied().zip(weights.iter().copied()).collect();
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
            let middle = partition_at_middle(&draws, &mut keys);
            let expected = f64::from(sorted[(count - 1) / 2].0 + sorted[count / 2].0) / 2.0;
            assert_eq!(median(&keys, middle), expected);

            let half = weights.iter().sum::<f64>() / 2.0;
            let mut reached = 0.0;
            let heavy = sorted.iter().find(|(_, weight)| {
                reached += weight;
                reached >= half
            });
            let found = weighted_median(&mut keys, middle, &weights);
            assert_eq!(Some(found), heavy.map(|(x, _)| f64::from(*x)), "{count}");
        }
    }
}
