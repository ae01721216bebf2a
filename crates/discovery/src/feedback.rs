//! Test whether an input follows the readings of an output: a controller that uses them (closed loop).
//!
//! The controller passes the noise of a reading on to the input. The input of that sample then correlates with the noise,
//! as if it disturbed the reading (Söderström and Stoica 1989, System Identification, chapter 10). The sensitivities of a
//! state to the input are not affected, because they contain earlier inputs only.

use crate::fit::ChosenRecords;
use crate::linear::{Square, dot};
use crate::prepare::Prepared;
use crate::records::View;
use crate::residuals::record_residuals;
use crate::score::{BLOCKS, Scored};
use crate::search::ALPHA;
use crate::statistics::{hotelling_tail, t_of_mean};
use augsim_system::{Effect, Record};
use std::sync::Arc;

/// Number of earlier samples of input and residual from which a sample of the input is predicted.
const LAGS: usize = 4;

/// Excludes the effects of an input on readings that the input follows, which its controller imitates, by the residuals of the
/// fitted set `set`. Returns whether there are any.
pub(crate) fn exclude_feedback(prepared: &mut Prepared, view: &View, set: &Scored) -> bool {
    if prepared.data.effects.is_closed() {
        return false;
    }
    let system = prepared.data.system.clone();
    let schema = system.schema();
    let mut is_changed = false;
    for [channel, input] in closed_loops(&view.sample(), set) {
        let [output, input] = [&schema.channels[channel].column, &schema.inputs[input].columns[0]];
        let imitated =
            |effect: &&Effect| effect.location == *output && effect.added_to_reading.as_ref() == Some(input);
        let kinds: Vec<String> = system.library().iter().filter(imitated).map(|e| e.kind.clone()).collect();
        if !kinds.is_empty() {
            prepared.notes.push(format!(
                "the next value of {input} follows each reading of {output}: a controller uses the readings and passes their noise on, or the \
                 clock of {input} is late; effects of {input} on these readings are not tried"
            ));
            Arc::make_mut(&mut prepared.data.effects).exclude.extend(kinds);
            is_changed = true;
        }
    }
    is_changed
}

/// Pairs of output (channel) and input whose input follows the residuals of the output.
///
/// The next sample of an input is regressed on a residual, beside [`LAGS`] samples of the input up to that of the residual and
/// as many earlier residuals. The noise of a reading does not change the next input without a controller. A model error may
/// predict it, so autocorrelated residuals are not tested. A merely proportional controller of a smooth motion is not found: the earlier samples
/// predict its next input as well.
fn closed_loops(sample: &ChosenRecords<'_>, set: &Scored) -> Vec<[usize; 2]> {
    if !set.has_white_residuals() {
        return Vec::new();
    }
    let residuals = record_residuals(sample, &set.fit);
    let schema = sample.data.system.schema();
    let pairs: Vec<[usize; 2]> = (0..schema.channels.len())
        .flat_map(|channel| (0..schema.inputs.len()).map(move |input| [channel, input]))
        .collect();
    let follows = |[channel, input]: &[usize; 2]| {
        let rows = residuals.iter().zip(sample.chosen).flat_map(|(residuals, &j)| {
            let record = &sample.data.records[j].data;
            regression_rows(record, *input, &residuals.residuals[*channel])
        });
        p_value(&rows.collect::<Vec<_>>()) < 0.1 * ALPHA / pairs.len() as f64
    };
    pairs.iter().copied().filter(follows).collect()
}

/// Rows of the regression for one record: 1, inputs and earlier residuals, then the residual, then the next input.
fn regression_rows(record: &Record, input: usize, residuals: &[f64]) -> Vec<Vec<f64>> {
    let Some(stream) = record.inputs.get(input) else { return Vec::new() };
    let value = |time: f64| {
        let k = stream.times.partition_point(|t| *t < time - 1e-9);
        let is_there = stream.times.get(k).is_some_and(|t| (t - time).abs() <= 1e-9);
        stream.values.first().filter(|_| is_there).map_or(f64::NAN, |values| values[k])
    };
    let inputs: Vec<f64> = record.times.iter().map(|time| value(*time)).collect();
    let row = |k: usize| {
        let mut row = vec![1.0];
        row.extend(&inputs[k + 1 - LAGS..=k]);
        row.extend(&residuals[k - LAGS..k]);
        row.extend([residuals[k], inputs[k + 1]]);
        row
    };
    let all = (LAGS..record.times.len().saturating_sub(1)).map(row);
    all.filter(|row| row.iter().all(|x| x.is_finite())).collect()
}

/// p-value of the second last column of the rows in a regression of the last one, by the scatter of its score over blocks.
fn p_value(rows: &[Vec<f64>]) -> f64 {
    let width = 2 * LAGS + 3;
    if rows.len() < BLOCKS * width {
        return 1.0;
    }
    let known = width - 2;
    let mut products = Square::zero(width);
    for row in rows {
        (0..width).for_each(|i| (0..width).for_each(|j| *products.at_mut(i, j) += row[i] * row[j]));
    }
    let factor = products.sub(&(0..known).collect::<Vec<_>>()).cholesky();
    let coefficients = |column: usize| {
        let mut x: Vec<f64> = (0..known).map(|i| products.at(i, column)).collect();
        factor.solve(&mut x);
        x
    };
    let [of_residual, of_input] = [known, known + 1].map(coefficients);
    let score = |row: &Vec<f64>| {
        let remains = |column: usize, x: &[f64]| row[column] - dot(&row[..known], x);
        remains(known, &of_residual) * remains(known + 1, &of_input)
    };
    let scores: Vec<f64> =
        rows.chunks(rows.len().div_ceil(BLOCKS)).map(|block| block.iter().map(score).sum()).collect();
    let t = t_of_mean(&scores);
    if t.is_finite() { hotelling_tail(t * t, 1, scores.len() as f64 - 1.0) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    //! Contract: an input computed from noisy readings is found; an input given beforehand is not.
    use super::*;
    use augsim_data::random_stream;
    use augsim_system::Stream;
    use rand_distr::{Distribution, StandardNormal};

    /// p-value for a first-order plant whose residuals are noise. The input is a sum of sines minus `gain` times the reading and its change since the last sample.
    fn tested(gain: f64, seed: u64) -> f64 {
        let mut random = random_stream(seed, "feedback", 0);
        let (mut state, mut before) = (0.0, 0.0);
        let (mut times, mut inputs, mut residuals) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..1500 {
            let t = 0.02 * f64::from(k);
            let noise = 0.01 * Distribution::<f64>::sample(&StandardNormal, &mut random);
            let reference: f64 = [1.0, 2.3, 4.1, 6.7, 9.2, 13.0].iter().map(|w| (w * t + w * w).sin()).sum();
            let reading = state + noise;
            let input = reference - gain * (2.0 * reading - before);
            before = reading;
            times.push(t);
            inputs.push(input);
            residuals.push(noise);
            state += 0.02 * (input - state);
        }
        let stream = Stream { times: times.clone(), values: vec![inputs] };
        let record = Record { times, inputs: vec![stream].into(), ..Record::default() };
        p_value(&regression_rows(&record, 0, &residuals))
    }

    #[test]
    fn a_controller_is_found() {
        let level = 0.1 * ALPHA;
        for seed in 0..20 {
            assert!(tested(20.0, seed) < level, "{seed}");
        }
        let false_alarms = (0..200).filter(|seed| tested(0.0, *seed) < ALPHA);
        assert!(false_alarms.count() <= 6);
    }
}
