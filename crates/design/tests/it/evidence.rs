//! Contract: for models that are linear in their parameters the evidence is the joint Gaussian density of the readings, and the
//! maximised likelihood is that of the closed form; recordings one after the other give the density of all; an estimated
//! initial state costs the first readings.

use super::{explanation, recording, white};
use augsim_data::random_stream;
use augsim_design::{Evidence, Experiment, Explanation, after_recordings, draw_recording, factor_of};
use augsim_system::Record;
use std::collections::BTreeMap;

/// Integrator with an unknown gain: y = a times the integral of u.
const GAIN: &str = "scenario = \"system\"\nname = \"gain\"\n[inputs]\nu_V = { hold = \"linear\" }\n[states]\nx_m = { start = 0.0, sd = 1e-9 }\n\
    [parameters]\na_m_per_V_s = { nominal = 2.0, min = -50.0, max = 54.0 }\n[rates]\nx_m = \"a_m_per_V_s * u_V\"\n\
    [outputs]\ny_m = { value = \"x_m\", sd = 0.1 }\n";

fn times() -> Vec<f64> {
    (0..12).map(|k| 0.1 * f64::from(k)).collect()
}

/// Log density of `y` under N(mean, covariance).
fn log_density(y: &[f64], mean: &[f64], covariance: &[Vec<f64>]) -> f64 {
    let factor = factor_of(covariance);
    let mut solved = Vec::new();
    let mut log = 0.0;
    for i in 0..y.len() {
        let known: f64 = (0..i).map(|k| factor[i][k] * solved[k]).sum();
        let z: f64 = (y[i] - mean[i] - known) / factor[i][i];
        log -= 0.5 * z * z + factor[i][i].ln() + 0.5 * std::f64::consts::TAU.ln();
        solved.push(z);
    }
    log
}

/// Log density of the readings under the gain's prior N(2, `prior_sd`²).
fn log_density_of_gain(s: &[f64], y: &[f64], prior_sd: f64) -> f64 {
    let mean: Vec<f64> = s.iter().map(|s| 2.0 * s).collect();
    log_density(y, &mean, &covariance(s, prior_sd, 0.1))
}

fn evidence(e: &Explanation, records: &[Record]) -> Evidence {
    let mut evidence = Evidence::new(e);
    records.iter().for_each(|record| evidence.add(record).expect("a recording of the model"));
    evidence
}

fn covariance(s: &[f64], prior_sd: f64, noise_sd: f64) -> Vec<Vec<f64>> {
    let entry = |i: usize, j: usize| {
        prior_sd * prior_sd * s[i] * s[j] + if i == j { noise_sd * noise_sd } else { 0.0 }
    };
    (0..s.len()).map(|i| (0..s.len()).map(|j| entry(i, j)).collect()).collect()
}

fn readings(t: &[f64], gain: f64) -> Vec<f64> {
    t.iter().enumerate().map(|(k, t)| gain * t + 0.1 * (((5 * k) % 7) as f64 / 3.0 - 1.0)).collect()
}

#[test]
fn the_evidence_is_the_joint_density_of_the_readings() {
    let (t, e) = (times(), explanation("gain", GAIN, &[0.5], white(0.1)));
    let y = readings(&t, 2.3);
    let heard = evidence(&e, &[recording(&t, &vec![1.0; t.len()], &y)]);
    let expected = log_density_of_gain(&t, &y, 0.5);
    assert!((heard.log_density() - expected).abs() < 1e-6, "{} {expected}", heard.log_density());
    assert_eq!(heard.tally().count, 12);
    // Conjugate update of the gain.
    let (tt, ty): (f64, f64) =
        (t.iter().map(|t| t * t).sum(), t.iter().zip(&y).map(|(t, y)| t * (y - 2.0 * t)).sum());
    let variance = 1.0 / (1.0 / 0.25 + tt / 0.01);
    let updated = heard.updated();
    assert!((updated.values[0] - (2.0 + variance * ty / 0.01)).abs() < 1e-6);
    assert!((updated.standard_deviations()[0] - variance.sqrt()).abs() < 1e-9);
}

#[test]
fn recordings_in_turn_have_the_density_of_all_together() {
    let (t, e) = (times(), explanation("gain", GAIN, &[0.5], white(0.1)));
    let (y1, y2) = (readings(&t, 2.3), readings(&t, 2.4));
    let records = [recording(&t, &vec![1.0; t.len()], &y1), recording(&t, &vec![1.0; t.len()], &y2)];
    let both = [&t[..], &t[..]].concat();
    let expected = log_density_of_gain(&both, &[&y1[..], &y2[..]].concat(), 0.5);
    assert!((evidence(&e, &records).log_density() - expected).abs() < 1e-6);
    // From a prior as wide as the bounds (uniform on -50 to 54: mean 2, sd 30.02) all recordings at once.
    let after = after_recordings(&e, &records).unwrap();
    let (tt, ty): (f64, f64) = (
        both.iter().map(|t| t * t).sum(),
        both.iter().zip([y1, y2].concat()).map(|(t, y)| t * (y - 2.0 * t)).sum(),
    );
    let variance = 1.0 / (12.0 / (104.0 * 104.0) + tt / 0.01);
    assert!((after.values[0] - (2.0 + variance * ty / 0.01)).abs() < 1e-6, "{}", after.values[0]);
    assert!((after.standard_deviations()[0] - variance.sqrt()).abs() < 1e-9);
}

#[test]
fn an_estimated_initial_state_costs_the_first_samples_only() {
    // y = x0 + a t: given the first 5 readings, the density of the others under a flat prior of x0.
    let text = GAIN.replace("start = 0.0, sd = 1e-9", "start = \"y_m\"");
    let (t, e) = (times(), explanation("gain", &text, &[0.5], white(0.1)));
    let y: Vec<f64> = readings(&t, 2.3).iter().map(|y| y + 7.0).collect();
    let heard = evidence(&e, &[recording(&t, &vec![1.0; t.len()], &y)]);
    let given_first = |gain: f64| {
        let mean: Vec<f64> = t.iter().map(|t| 7.0 + gain * t).collect();
        let flat = |n: usize| {
            let mut c = covariance(&t[..n], 0.0, 0.1);
            c.iter_mut().flatten().for_each(|c| *c += 1e4);
            log_density(&y[..n], &mean[..n], &c)
        };
        flat(12) - flat(5)
    };
    // Mixture over the prior N(2, 0.5²) of the gain, by the trapezoidal rule.
    let sum: f64 = (-800..=800)
        .map(|k| {
            let z = 0.01 * f64::from(k);
            0.01 * (given_first(2.0 + 0.5 * z) - 0.5 * z * z).exp()
        })
        .sum();
    let expected = sum.ln() - 0.5 * std::f64::consts::TAU.ln();
    assert!((heard.log_density() - expected).abs() < 1e-2, "{} {expected}", heard.log_density());
    assert_eq!(heard.tally().count, 7);
}

#[test]
fn half_of_the_earlier_recordings_counts_in_the_maximised_likelihood() {
    let (t, e) = (times(), explanation("gain", GAIN, &[0.5], white(0.1)));
    let gains = [2.0, 2.4, 2.1, 2.2];
    let earlier: Vec<Vec<f64>> = gains.iter().map(|gain| readings(&t, *gain)).collect();
    let new = readings(&t, 3.0);
    let record = |y: &Vec<f64>| recording(&t, &vec![1.0; t.len()], y);
    let after = after_recordings(&e, &earlier.iter().map(record).collect::<Vec<_>>()).unwrap();
    let mut heard = Evidence::after(&after, &earlier.iter().map(record).collect::<Vec<_>>()).unwrap();
    heard.add(&record(&new)).unwrap();
    // Every second recording is in the first half; the mixture density of a half is a ratio of densities.
    let log_likelihood = |gain: f64, y: &[f64]| {
        let mean: Vec<f64> = t.iter().map(|t| gain * t).collect();
        log_density(y, &mean, &covariance(&t, 0.0, 0.1))
    };
    // The bounds are wider than 100 standard errors of the fit, which then are the standard deviation of the prior.
    let (fit, sd) = (after.values[0], 100.0 * after.standard_deviations()[0]);
    let joint = |parts: &[&Vec<f64>]| {
        let (s, y) = (t.repeat(parts.len()), parts.iter().copied().flatten().copied().collect::<Vec<_>>());
        let mean: Vec<f64> = s.iter().map(|s| fit * s).collect();
        log_density(&y, &mean, &covariance(&s, sd, 0.1))
    };
    // Nine tenths have the distribution that the others leave, one tenth the wide one.
    let mixture = |of: &[&Vec<f64>], given: &[&Vec<f64>]| {
        (0.9 * (joint(&[given, of].concat()) - joint(given)).exp() + 0.1 * joint(of).exp()).ln()
    };
    let ratio = |half: [&Vec<f64>; 2], other: [&Vec<f64>; 2]| {
        let mixture = mixture(&half, &other);
        let likelihood = |k: i32| {
            let gain = 1.5 + 5e-4 * f64::from(k);
            log_likelihood(gain, half[0]) + log_likelihood(gain, half[1]) + log_likelihood(gain, &new)
        };
        (mixture - (0..4000).map(likelihood).fold(f64::NEG_INFINITY, f64::max)).exp()
    };
    let [first, second] = [[&earlier[0], &earlier[2]], [&earlier[1], &earlier[3]]];
    let expected = -(0.5 * (ratio(first, second) + ratio(second, first))).ln();
    // The steps end 0.01 from the largest value of twice the log likelihood.
    assert!((heard.log_maximum() - expected).abs() < 5e-3, "{} {expected}", heard.log_maximum());
    // All four earlier recordings take part in the density.
    let density = mixture(&[&new], &earlier.iter().collect::<Vec<_>>());
    assert!((heard.log_density() - density).abs() < 1e-6, "{} {density}", heard.log_density());
}

#[test]
fn a_single_earlier_recording_does_not_count_in_the_maximised_likelihood() {
    let (t, e) = (times(), explanation("gain", GAIN, &[0.001], white(0.1)));
    let [earlier, new] = [2.0, 2.3].map(|gain| readings(&t, gain));
    let input = vec![1.0; t.len()];
    let mut heard = Evidence::after(&e, &[recording(&t, &input, &earlier)]).unwrap();
    heard.add(&recording(&t, &input, &new)).unwrap();
    let log_likelihood = |k: i32| {
        let mean: Vec<f64> = t.iter().map(|t| (1.0 + 5e-4 * f64::from(k)) * t).collect();
        log_density(&new, &mean, &covariance(&t, 0.0, 0.1))
    };
    let expected = (0..4000).map(log_likelihood).fold(f64::NEG_INFINITY, f64::max);
    assert!((heard.log_maximum() - expected).abs() < 1e-3, "{} {expected}", heard.log_maximum());
    assert!(heard.log_maximum() > heard.log_density() + 1.0);
}

#[test]
fn the_maximised_likelihood_keeps_half_of_what_earlier_data_say() {
    let (t, e) = (times(), explanation("gain", GAIN, &[0.5], white(0.1)));
    let y = readings(&t, 2.3);
    let heard = evidence(&e, &[recording(&t, &vec![1.0; t.len()], &y)]);
    // Likelihood of a gain, times the square root of exp(-z²/2) for its deviation z from the prior, times sqrt(2).
    let log_likelihood = |gain: f64| {
        let mean: Vec<f64> = t.iter().map(|t| gain * t).collect();
        let z = (gain - 2.0) / 0.5;
        log_density(&y, &mean, &covariance(&t, 0.0, 0.1)) - 0.25 * z * z + 0.5 * 2.0_f64.ln()
    };
    let expected =
        (0..4000).map(|k| log_likelihood(1.0 + 5e-4 * f64::from(k))).fold(f64::NEG_INFINITY, f64::max);
    assert!((heard.log_maximum() - expected).abs() < 1e-4, "{} {expected}", heard.log_maximum());
}

#[test]
fn a_truth_outside_what_earlier_data_say_keeps_a_tenth_of_the_wide_density() {
    // Earlier data say 2.0 ± 0.01; the recording says 3. The bounds are wider than 100 standard errors: the wide one is 2 ± 1.
    let (t, e) = (times(), explanation("gain", GAIN, &[0.01], white(0.1)));
    let input = vec![1.0; t.len()];
    let earlier = [2.0, 2.0].map(|gain| recording(&t, &input, &readings(&t, gain)));
    let mut heard = Evidence::after(&e, &earlier).unwrap();
    let new = readings(&t, 3.0);
    heard.add(&recording(&t, &input, &new)).unwrap();
    let expected = log_density_of_gain(&t, &new, 1.0) + 0.1_f64.ln();
    assert!((heard.log_density() - expected).abs() < 1e-3, "{} {expected}", heard.log_density());
    assert!((heard.updated().values[0] - 3.0).abs() < 0.1, "{:?}", heard.updated().values);
}

/// A heated body whose loss grows with its temperature.
const HEATED: &str = "scenario = \"system\"\nname = \"heated\"\n[inputs]\np_W = { hold = \"linear\" }\n\
    [states]\nrise_K = { start = 0.0, sd = 0.001 }\n[parameters]\n\
    c_J_per_K = { nominal = 1.0, min = 0.2, max = 5.0 }\nh_W_per_K = { nominal = 0.3, min = 0.06, max = 1.5 }\n\
    b_per_K = { nominal = 0.008, min = 0.0016, max = 0.04 }\n\
    [rates]\nrise_K = \"(p_W - h_W_per_K * rise_K * (1.0 + b_per_K * rise_K)) / c_J_per_K\"\n\
    [outputs]\ny_K = { value = \"rise_K\", sd = 3.0 }\n";

#[test]
fn a_parameter_that_earlier_recordings_leave_at_its_bound_comes_back() {
    // The earlier recordings are short of heat and leave b at a bound; the new one needs another value.
    let e = explanation("heated", HEATED, &[0.05, 0.1, 0.01], white(3.0));
    let t: Vec<f64> = (0..101).map(|k| 0.04 * f64::from(k)).collect();
    for seed in 0..6 {
        let mut rng = random_stream(seed, "heated", 0);
        let mut run = |power: f64| {
            let inputs = vec![vec![power; t.len()]];
            let experiment = Experiment { inputs, starts: BTreeMap::new(), times: t.clone() };
            draw_recording(&e, &e.values, &experiment, "run", &mut rng).unwrap()
        };
        let earlier: Vec<Record> = (0..6).map(|k| run(8.0 + f64::from(k))).collect();
        let mut heard = Evidence::after(&e, &earlier).unwrap();
        heard.add(&run(40.0)).unwrap();
        // The density is a mean over parameters, and the maximum one over all of them.
        let log_e_value = heard.log_density() - heard.log_maximum();
        assert!(log_e_value < 1000_f64.ln(), "seed {seed}: {log_e_value}");
    }
}
