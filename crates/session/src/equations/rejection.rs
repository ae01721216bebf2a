//! Whether a calibrated model is rejected because it predicts an output worse than the mean of the output does.

use super::fit::{fastest_time_constant_s, shortest_step_s};
use super::unit_text;
use augsim_data::with_significant;
use augsim_equations::Model;
use augsim_equations::model::Output;
use augsim_system::{Record, channel_sd};

/// Ratio of the residual to the standard deviation of an output above which the model is rejected.
///
/// The ratio is 1 for a model whose output is constant and right: the output then has only noise. About the true value
/// `n` independent samples have a mean square that exceeds the one about their mean by the factor `1 + z^2 / n`, with
/// `z` normally distributed. The factor is below `1.1^2` for `n` of 32 or more in 99 % of all cases (`z` of 2.58).
const MAX_RESIDUAL_RATIO: f64 = 1.1;

/// Sentence that rejects a calibrated model which predicts an output worse than the mean of the output does.
///
/// It states the remedy. `None` if no output is predicted so badly. `rmse` are the RMS residuals of the
/// calibrated model in the order of its outputs.
pub(super) fn worse_than_mean(model: &Model, rmse: &[f64], records: &[Record]) -> Option<String> {
    let ratio = |(index, rmse): (usize, &f64)| {
        let values =
            || records.iter().filter_map(|r| r.values.get(index)).flatten().filter(|v| v.is_finite());
        let first = values().next()?;
        // The mean of a constant column has no error, with which nothing can be compared.
        values().any(|v| v != first).then(|| (index, *rmse, channel_sd(records, index)))
    };
    let worst = rmse.iter().enumerate().filter_map(ratio).max_by(|a, b| (a.1 / a.2).total_cmp(&(b.1 / b.2)));
    let (index, rmse, sd) = worst.filter(|(_, rmse, sd)| *rmse > MAX_RESIDUAL_RATIO * sd)?;
    Some(sentence(model, &model.outputs[index], [rmse, sd], records))
}

fn sentence(model: &Model, output: &Output, [rmse, sd]: [f64; 2], records: &[Record]) -> String {
    let unit = unit_text(output.unit);
    let [rmse, sd] = [rmse, sd].map(|v| with_significant(v, 4));
    let step_s = shortest_step_s(records);
    let clock = match fastest_time_constant_s(model, records) {
        Some(constant_s) if constant_s < step_s => format!(
            " (the fastest time constant of the model is {} s, and the samples are {} s apart)",
            with_significant(constant_s, 3),
            with_significant(step_s, 3)
        ),
        _ => String::new(),
    };
    format!(
        "Not this system: the calibrated model predicts `{}` worse than its mean does: its error is {rmse}{unit}, the standard deviation of \
         the data {sd}{unit}; check the unit of time{clock}, which --time COLUMN:UNIT names, the units of the columns, and whether the bounds of \
         the parameters in the model file contain the true values",
        output.name
    )
}

#[cfg(test)]
mod tests {
    //! Contract: a model that misses the motion is rejected with the remedy, one that leaves noise is not.
    use super::*;

    const WHEEL: &str = "scenario = \"system\"\nname = \"wheel\"\n[states]\nspeed_rad_s = { start = \"speed_rad_s\" }\n\
        [parameters]\ntau_s = { nominal = 3.0, min = 0.1, max = 100.0 }\n[rates]\nspeed_rad_s = \"-speed_rad_s / tau_s\"\n\
        [outputs]\nspeed_rad_s = { value = \"speed_rad_s\", sd = \"estimate\" }\n";

    fn record(values: Vec<f64>) -> Record {
        let times = (0..values.len()).map(|k| 360.0 * k as f64).collect();
        Record { id: "1".into(), times, values: vec![values], ..Record::default() }
    }

    #[test]
    fn only_a_residual_above_the_standard_deviation_is_rejected() {
        let model = augsim_equations::model::parse(WHEEL, "wheel.toml").expect("a model");
        let decay = [record((0..80).map(|k| 100.0 * (-0.025 * f64::from(k)).exp()).collect())];
        let sd = channel_sd(&decay, 0);
        let text = worse_than_mean(&model, &[2.0 * sd], &decay).expect("rejected");
        for part in [
            "Not this system: the calibrated model predicts `speed_rad_s` worse than its mean does",
            "time constant of the model is 3.00 s, and the samples are 360 s apart",
            "--time COLUMN:UNIT",
            "bounds",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert_eq!(worse_than_mean(&model, &[1.05 * sd], &decay), None);
        assert_eq!(worse_than_mean(&model, &[1.0], &[record(vec![2.0; 50])]), None);
    }
}
