//! Segments within which the motion is smooth, for systems that do not name them.

use crate::noise::polynomial_variance;
use crate::record::Measured;

/// Segment lengths that are tried, in measured values of each channel.
const LENGTHS: [usize; 5] = [12, 24, 48, 96, 192];
/// Ratio of the residual variance about polynomials to that over the shortest segments above which motion is
/// not smooth.
const MAX_SMOOTH_RATIO: f64 = 1.3;

/// Divides records into the longest segments over which polynomials fit every channel as well as over the
/// shortest. Returns whether polynomials follow the motion at all: if samples are too sparse, their residuals
/// are not measurement noise.
pub(crate) fn split_smooth_segments(data: &mut Measured) -> bool {
    if data.records.iter().any(|r| !r.data.smooth_segments.is_empty()) {
        return true;
    }
    let rows_per_value = rows_per_value(data);
    let lengths = LENGTHS.map(|length| length * rows_per_value);
    let mut chosen_length = lengths[0];
    let mut shortest: Option<Vec<f64>> = None;
    for length in lengths {
        let variance = polynomial_variance(data, length);
        match &shortest {
            None => shortest = Some(variance),
            Some(first) => {
                let is_rough =
                    variance.iter().zip(first).any(|(m, f)| *m > MAX_SMOOTH_RATIO * f || !m.is_finite());
                if is_rough {
                    break;
                }
                chosen_length = length;
            }
        }
    }
    let is_smooth = chosen_length > lengths[0];
    // Segments must not be longer than half the records, or short records would have none.
    let longest = data.records.iter().map(|r| r.data.times.len()).max().unwrap_or(chosen_length);
    chosen_length = chosen_length.min(longest);
    for record in &mut data.records {
        let samples = record.data.times.len();
        let cuts = (0..samples).step_by(chosen_length).map(|a| a..(a + chosen_length).min(samples));
        record.data.smooth_segments = cuts.filter(|piece| piece.len() * 2 >= chosen_length).collect();
    }
    is_smooth
}

/// Number of rows per measured value of the channel with the fewest values. It is 2 where two sensors are
/// read in alternate rows. Channels without any value do not count.
fn rows_per_value(data: &Measured) -> usize {
    let rows: usize = data.records.iter().map(|r| r.data.times.len()).sum();
    let count = |channel: usize| -> usize {
        let values = data.records.iter().flat_map(|r| &r.data.values[channel]);
        values.filter(|v| v.is_finite()).count()
    };
    let counts = (0..data.system.schema().channels.len()).map(count).filter(|n| *n > 0);
    counts.min().map_or(1, |fewest| rows_per_value_of(rows, fewest))
}

/// Number of rows per measured value, rounded so that a channel with a few gaps gives 1.
fn rows_per_value_of(rows: usize, values: usize) -> usize {
    ((rows as f64 / values as f64).round() as usize).max(1)
}

#[cfg(test)]
mod tests {
    //! Contract: segments of sensors in alternate rows are twice as long; a few gaps change nothing.
    use super::rows_per_value_of;

    #[test]
    fn alternating_rows_double_the_segments() {
        assert_eq!([800, 790, 400, 267].map(|values| rows_per_value_of(800, values)), [1, 1, 2, 3]);
    }
}
