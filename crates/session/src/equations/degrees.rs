//! Detects angles in degrees where a model of equations reads radians.
//!
//! The data alone do not decide it: a rotor turns by any number of radians. A model with sines or cosines of the angle
//! does: in the wrong unit it cannot follow even short windows. It is fitted to short windows in both units.

use super::fit::short_fit;
use augsim_data::checks::{AcceptedChecks, Check, Finding, SuspiciousData};
use augsim_data::{DataError, Dataset, Unit};
use augsim_equations::Model;
use augsim_equations::text::{Function, Kind};
use augsim_system::Record;
use std::f64::consts::TAU;

/// Ratio of the residual in radians to that in degrees above which the values are taken for degrees.
///
/// Two fits to the same noise of `n` samples differ by a share of some `1 / sqrt(2 n)`, 7 % for the smallest sets of
/// 100 samples. In the right unit the residual is the noise; a model with half of the residual in degrees is wrong in
/// radians, or lacks so much that the unit has to be confirmed (`--accept angle-in-degrees`).
const MIN_RESIDUAL_RATIO: f64 = 2.0;

/// Checks that columns of radians do not hold degrees.
///
/// # Errors
/// [`SuspiciousData`]; or the model cannot be compiled.
pub(super) fn check(
    model: &Model,
    data: &Dataset,
    records: &[Record],
    accepted: AcceptedChecks,
) -> anyhow::Result<()> {
    match find(model, records) {
        Some(finding) if !accepted.accepts(Check::AngleInDegrees) => {
            let refused = SuspiciousData { origin: data.origin().clone(), findings: vec![finding] };
            Err(DataError::from(refused).into())
        }
        _ => Ok(()),
    }
}

/// Finds columns of radians that hold degrees; `None` if there are none, or if the model cannot decide it.
pub fn find(model: &Model, records: &[Record]) -> Option<Finding> {
    let largest = |index: usize| {
        let values = records.iter().filter_map(|r| r.values.get(index)).flatten();
        values.filter(|v| v.is_finite()).fold(0.0, |max: f64, v| max.max(v.abs()))
    };
    let with_unit = |symbol: &str| -> Vec<usize> {
        let units = model.outputs.iter().map(|o| o.unit.map_or_else(String::new, Unit::symbol));
        units.enumerate().filter(|(_, unit)| unit == symbol).map(|(index, _)| index).collect()
    };
    // An angle within one turn may be in radians.
    let angles: Vec<usize> = with_unit("rad").into_iter().filter(|index| largest(*index) > TAU).collect();
    if angles.is_empty() || !has_sines(model) {
        return None;
    }
    // The rates of the angles may be in the same unit, or have a sensor of their own.
    let with_rates = [&angles[..], &with_unit("rad/s")].concat();
    let choices = if with_rates == angles { vec![angles] } else { vec![angles, with_rates] };
    let in_radians = relative_residual(model, records, &[])?;
    let in_degrees = choices
        .into_iter()
        .filter_map(|columns| Some((in_radians / relative_residual(model, records, &columns)?, columns)));
    let (ratio, columns) = in_degrees.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (ratio > MIN_RESIDUAL_RATIO).then(|| Finding::AngleOfModelInDegrees {
        largest_rad: columns.first().map_or(0.0, |index| largest(*index)),
        columns: columns.iter().map(|index| model.outputs[*index].name.clone()).collect(),
        ratio,
    })
}

/// Whether a rate, an output or a line of `[let]` has a sine, cosine or tangent.
fn has_sines(model: &Model) -> bool {
    let rates = model.states.iter().map(|s| &s.rate.tree);
    let lets = model.lets.iter().map(|l| &l.value.tree);
    let outputs = model.outputs.iter().map(|o| &o.value.tree);
    let is_sine = |kind: &Kind| matches!(kind, Kind::Call(Function::Sin | Function::Cos | Function::Tan, _));
    rates.chain(lets).chain(outputs).any(|tree| tree.nodes.iter().any(|node| is_sine(&node.kind)))
}

/// Geometric mean of the RMS residuals of all outputs over the shortest windows, in the units of the recorded values.
///
/// The values of `columns` are converted from degrees to radians before the fit. `None` if the model cannot be fitted.
fn relative_residual(model: &Model, records: &[Record], columns: &[usize]) -> Option<f64> {
    let mut records = records.to_vec();
    for record in &mut records {
        for index in columns {
            record.values.get_mut(*index)?.iter_mut().for_each(|v| *v = v.to_radians());
        }
    }
    let rmse = short_fit(model, &records).ok()?;
    let as_recorded = |(index, rmse): (usize, &f64)| match columns.contains(&index) {
        true => rmse.to_degrees().ln(),
        false => rmse.ln(),
    };
    let logarithms: f64 = rmse.iter().enumerate().map(as_recorded).sum();
    Some((logarithms / rmse.len().max(1) as f64).exp()).filter(|r| r.is_finite())
}

#[cfg(test)]
mod tests {
    //! Contract: degrees in a column of radians are found by the model, radians and turns of a rotor are not.
    use super::*;

    const PENDULUM: &str = "scenario = \"system\"\nname = \"pendulum\"\n[states]\ntheta_rad = { start = \"angle_rad\" }\n\
        omega_rad_s = { start = \"slope(angle_rad)\" }\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\n\
        length_m = { nominal = 0.4, min = 0.05, max = 2.0 }\n[rates]\ntheta_rad = \"omega_rad_s\"\n\
        omega_rad_s = \"-gravity_m_s2 / length_m * sin(theta_rad)\"\n[outputs]\nangle_rad = { value = \"theta_rad\", sd = \"estimate\" }\n";

    /// Simulates a pendulum of 0.5 m from `angle_rad` and `rate_rad_s`; noise of 2 mrad by a linear congruence.
    fn pendulum([mut angle_rad, mut rate_rad_s]: [f64; 2], per_radian: f64) -> Record {
        let (mut times, mut values, mut state, step_s) = (Vec::new(), Vec::new(), 1_u32, 1e-4);
        for k in 0..40_000 {
            if k % 200 == 0 {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let noise = 0.004 * (f64::from(state) / f64::from(u32::MAX) - 0.5);
                times.push(f64::from(k) * step_s);
                values.push(per_radian * (angle_rad + noise));
            }
            rate_rad_s -= step_s * 9.81 / 0.5 * angle_rad.sin();
            angle_rad += step_s * rate_rad_s;
        }
        Record { id: "1".into(), times, values: vec![values], ..Record::default() }
    }

    #[test]
    fn degrees_are_found_by_the_model() {
        let model = augsim_equations::model::parse(PENDULUM, "pendulum.toml").expect("a model");
        let degrees = 180.0 / std::f64::consts::PI;
        let Some(Finding::AngleOfModelInDegrees { columns, ratio, .. }) =
            find(&model, &[pendulum([1.0, 0.0], degrees), pendulum([0.3, 1.0], degrees)])
        else {
            panic!("not found")
        };
        assert_eq!(columns, ["angle_rad"]);
        assert!(ratio > 3.0, "{ratio}");
        // A swing in radians, and turns over the top.
        assert_eq!(find(&model, &[pendulum([1.0, 0.0], 1.0)]), None);
        assert_eq!(find(&model, &[pendulum([0.0, 15.0], 1.0)]), None);
    }
}
