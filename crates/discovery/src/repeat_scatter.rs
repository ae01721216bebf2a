//! Scatter between repeats: recordings with the same inputs, whose readings no model of these inputs tells apart.
//!
//! At time `t` the readings of the `n` repeats of a set have the variance `s^2(t)`, with `n - 1` degrees of freedom. The
//! scatter of an output is the root of the mean of `s^2(t)` over time and sets, weighted by the degrees of freedom.

use augsim_data::{DataError, Dataset, Trajectory};
use serde::{Deserialize, Serialize};

/// Largest difference between the inputs of repeats (root mean square), as a share of the input's standard deviation.
/// In a linear system it changes the outputs by as small a share of theirs.
const MAX_INPUT_DIFFERENCE: f64 = 0.01;
/// Minimum number of recordings of a set of repeats. The scatter of two has one degree of freedom, and says little.
const MIN_REPEATS: usize = 3;

/// Scatter of an output between recordings with the same inputs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RepeatScatter {
    /// Name of the output.
    pub output: String,
    /// Standard deviation of the readings of repeats at the same time, in the unit of the output.
    pub sd: f64,
    /// Unit of the output; empty for a pure number.
    pub unit: String,
    /// Number of recordings that repeat others.
    pub recordings: usize,
    /// Number of sets of recordings with the same inputs.
    pub sets: usize,
}

impl RepeatScatter {
    /// Measures the scatter of each output between recordings that have the same values of all `inputs`. Empty without
    /// inputs, and where fewer than three recordings have the same ones.
    ///
    /// # Errors
    /// The data lack one of the columns.
    pub fn of_recordings(data: &Dataset, inputs: &[&str], outputs: &[&str]) -> Result<Vec<Self>, DataError> {
        let columns =
            |names: &[&str]| names.iter().map(|name| data.column_index(name)).collect::<Result<Vec<_>, _>>();
        let (inputs, output_columns) = (columns(inputs)?, columns(outputs)?);
        let sets = sets_of_repeats(data, &inputs);
        if inputs.is_empty() || sets.is_empty() {
            return Ok(Vec::new());
        }
        let recordings = sets.iter().map(Vec::len).sum();
        let scatter = |(name, column): (&&str, &usize)| {
            let sd = scatter(&sets, *column)?;
            let unit = data.columns()[*column].unit().symbol();
            Some(Self { output: (*name).to_owned(), sd, unit, recordings, sets: sets.len() })
        };
        Ok(outputs.iter().zip(&output_columns).filter_map(scatter).collect())
    }
}

/// Sets of at least [`MIN_REPEATS`] recordings with the same inputs.
fn sets_of_repeats<'d>(data: &'d Dataset, inputs: &[usize]) -> Vec<Vec<&'d Trajectory>> {
    let tolerances: Vec<f64> =
        inputs.iter().map(|i| MAX_INPUT_DIFFERENCE * standard_deviation(data, *i)).collect();
    let mut sets: Vec<Vec<&Trajectory>> = Vec::new();
    for trajectory in data.trajectories() {
        let repeats =
            |set: &&mut Vec<&Trajectory>| have_equal_inputs(set[0], trajectory, inputs, &tolerances);
        match sets.iter_mut().find(repeats) {
            Some(set) => set.push(trajectory),
            None => sets.push(vec![trajectory]),
        }
    }
    sets.retain(|set| set.len() >= MIN_REPEATS);
    sets
}

/// Standard deviation of a column over all recordings.
fn standard_deviation(data: &Dataset, column: usize) -> f64 {
    let values =
        || data.trajectories().iter().flat_map(|t| t.column(column)).copied().filter(|v| v.is_finite());
    let count = (values().count() as f64).max(1.0);
    let mean = values().sum::<f64>() / count;
    (values().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt()
}

/// Whether two recordings have the same inputs, sample by sample, within these tolerances.
fn have_equal_inputs(one: &Trajectory, other: &Trajectory, inputs: &[usize], tolerances: &[f64]) -> bool {
    let [first, second] = [one, other].map(|t| t.time_s());
    if first.len() != second.len() || first.len() < 2 {
        return false;
    }
    let step = (first[first.len() - 1] - first[0]) / (first.len() - 1) as f64;
    let is_same_time = |(a, b): (&f64, &f64)| ((a - first[0]) - (b - second[0])).abs() <= 0.5 * step;
    first.iter().zip(second).all(is_same_time)
        && inputs.iter().zip(tolerances).all(|(input, tolerance)| {
            let squares = one.column(*input).iter().zip(other.column(*input)).map(|(a, b)| (a - b).powi(2));
            // A gap in one of them is a difference.
            (squares.sum::<f64>() / first.len() as f64).sqrt() <= *tolerance
        })
}

/// Standard deviation of an output's readings at the same time, over all sets; `None` without such readings.
fn scatter(sets: &[Vec<&Trajectory>], column: usize) -> Option<f64> {
    let (mut squares, mut freedom) = (0.0, 0.0);
    for set in sets {
        for k in 0..set[0].time_s().len() {
            let readings: Vec<f64> =
                set.iter().map(|t| t.column(column)[k]).filter(|v| v.is_finite()).collect();
            if readings.len() >= MIN_REPEATS {
                let mean = readings.iter().sum::<f64>() / readings.len() as f64;
                squares += readings.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
                freedom += (readings.len() - 1) as f64;
            }
        }
    }
    (freedom > 0.0).then(|| (squares / freedom).sqrt())
}

#[cfg(test)]
mod tests {
    //! Contract: the scatter between recordings with equal inputs is measured, whatever their common course; recordings
    //! with other inputs, and two repeats only, have none.
    use super::*;

    /// Recordings with these offsets of the output; the inputs of the last differ by `change`.
    fn recordings(offsets: &[f64], change: f64) -> Dataset {
        let trajectory = |(i, offset): (usize, &f64)| {
            let times: Vec<f64> = (0..50).map(f64::from).collect();
            let own_change = if i + 1 == offsets.len() { change } else { 0.0 };
            let input = times.iter().map(|t| (t / 5.0).sin() * (1.0 + own_change)).collect();
            let output = times.iter().map(|t| t.sqrt() + offset).collect();
            Trajectory::new(format!("run {i}"), times, vec![input, output]).expect("a trajectory")
        };
        let list = offsets.iter().enumerate().map(trajectory).collect();
        Dataset::from_names(&["u_V", "y_m"], list).expect("a data set")
    }

    fn of(data: &Dataset) -> Vec<RepeatScatter> {
        RepeatScatter::of_recordings(data, &["u_V"], &["y_m"]).expect("columns")
    }

    #[test]
    fn repeats_scatter_by_their_differences() {
        let found = of(&recordings(&[0.1, 0.2, 0.3], 0.0));
        assert!((found[0].sd - 0.1).abs() < 1e-12, "{found:?}");
        assert_eq!(
            (&*found[0].output, &*found[0].unit, found[0].recordings, found[0].sets),
            ("y_m", "m", 3, 1)
        );
        assert_eq!(of(&recordings(&[0.1, 0.2], 0.0)), []);
    }

    #[test]
    fn recordings_with_other_inputs_are_no_repeats() {
        assert_eq!(of(&recordings(&[0.1, 0.2, 0.3], 0.0))[0].recordings, 3);
        // Half of the tolerance is the same input, twice the tolerance is another.
        assert_eq!(of(&recordings(&[0.1, 0.2, 0.3, 0.4], 0.005))[0].recordings, 4);
        assert_eq!(of(&recordings(&[0.1, 0.2, 0.3, 0.4], 0.02))[0].recordings, 3);
        assert_eq!(
            RepeatScatter::of_recordings(&recordings(&[0.1; 4], 0.0), &[], &["y_m"]).expect("columns"),
            []
        );
    }
}
