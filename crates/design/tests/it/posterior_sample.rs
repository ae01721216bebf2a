//! Contract: draws of the parameters have the distribution that the recordings leave, also on a curve, before and after new
//! recordings, and where each recording begins somewhere else; without recordings they are normal.

use super::validity::{GAINS, run};
use super::{explanation, recording, white};
use augsim_data::random_stream;
use augsim_design::{Evidence, PosteriorSample, after_recordings};
use augsim_system::Record;
use rand_distr::{Distribution, StandardNormal};

/// Shares of draws with a first gain below 0.1 and 0.85, and mean and standard deviation of the sum of both gains.
fn summary(draws: &[(f64, [f64; 2])]) -> [f64; 4] {
    let total: f64 = draws.iter().map(|(w, _)| w).sum();
    let mean = |of: &dyn Fn([f64; 2]) -> f64| draws.iter().map(|(w, g)| w * of(*g)).sum::<f64>() / total;
    let below = |limit: f64| mean(&|gains| if gains[0] < limit { 1.0 } else { 0.0 });
    let sum = mean(&|gains| gains[0] + gains[1]);
    [below(0.1), below(0.85), sum, mean(&|gains| (gains[0] + gains[1] - sum).powi(2)).sqrt()]
}

/// The distribution after the recordings on a grid of logarithms: bounds 0.01 to 5 are normal with the standard deviation
/// of a uniform distribution of the logarithm.
fn exact(records: &[Record]) -> Vec<(f64, [f64; 2])> {
    const STEPS: u32 = 1500;
    let (low, high) = (0.01_f64.ln(), 5.0_f64.ln());
    let (middle, sd) = (0.5 * (low + high), (high - low) / 12.0_f64.sqrt());
    let log_gain = |k: u32| low + (high - low) * (f64::from(k) + 0.5) / f64::from(STEPS);
    let log_density = |a: f64, b: f64| {
        let misfit = |r: &Record| {
            let rate = a.exp() * r.inputs[0].values[0][0] + b.exp() * r.inputs[1].values[0][0];
            r.times.iter().zip(&r.values[0]).map(|(t, y)| (y - rate * t).powi(2)).sum::<f64>() / 0.01
        };
        let prior = [a, b].map(|x| ((x - middle) / sd).powi(2)).iter().sum::<f64>();
        -0.5 * (records.iter().map(misfit).sum::<f64>() + prior)
    };
    let pairs = (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (log_gain(i), log_gain(j))));
    let logs: Vec<(f64, [f64; 2])> = pairs.map(|(a, b)| (log_density(a, b), [a.exp(), b.exp()])).collect();
    let most = logs.iter().map(|(log, _)| *log).fold(f64::NEG_INFINITY, f64::max);
    logs.into_iter().map(|(log, gains)| ((log - most).exp(), gains)).collect()
}

#[test]
fn draws_have_the_distribution_that_recordings_leave_on_a_curve() {
    let free = explanation("free", GAINS, &[0.3, 0.3], white(0.1));
    let mut rng = random_stream(12, "posterior sample", 0);
    let earlier: Vec<Record> = (0..4).map(|_| run([1.0, 1.0], &mut rng)).collect();
    let new = run([1.0, 0.8], &mut rng);
    let after = after_recordings(&free, &earlier).expect("recordings of the model");
    let mut evidence = Evidence::after(&after, &earlier).expect("recordings of the model");
    for records in [earlier.clone(), [&earlier[..], std::slice::from_ref(&new)].concat()] {
        if records.len() > earlier.len() {
            evidence.add(&new).expect("a recording of the model");
        }
        let sample = PosteriorSample::new(&evidence, 3, 0).expect("recordings of the model");
        assert!(sample.effective_number() >= 200.0, "{}", sample.effective_number());
        let draws = (0..4000).map(|_| {
            let values = sample.draw(&mut rng);
            (1.0, [values[0], values[1]])
        });
        let drawn = summary(&draws.collect::<Vec<_>>());
        let expected = summary(&exact(&records));
        // Shares of 200 effective draws err by 0.035; draws without weights have a larger standard deviation.
        let tolerances = [0.1, 0.1, 0.01, 0.25 * expected[3]];
        for k in 0..4 {
            assert!((drawn[k] - expected[k]).abs() < tolerances[k], "{drawn:?} {expected:?}");
        }
    }
}

#[test]
fn draws_without_recordings_are_normal_and_draws_do_not_depend_on_threads() {
    let free = explanation("free", GAINS, &[0.3, 0.3], white(0.1));
    let sample = PosteriorSample::new(&Evidence::new(&free), 3, 0).expect("no recording");
    let normal = PosteriorSample::normal(&free);
    let draw = |sample: &PosteriorSample| sample.draw(&mut random_stream(4, "draw", 0));
    assert_eq!(draw(&sample), draw(&normal));

    let mut rng = random_stream(13, "posterior sample", 0);
    let earlier: Vec<Record> = (0..3).map(|_| run([1.0, 1.0], &mut rng)).collect();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let evidence = Evidence::after(&free, &earlier).expect("recordings of the model");
            let sample = PosteriorSample::new(&evidence, 3, 0).expect("recordings of the model");
            (sample.effective_number(), draw(&sample))
        })
    };
    assert_eq!(on(1), on(3));
}

/// A block that cools to its surroundings; each recording begins at a temperature that is estimated.
const BLOCK: &str = "scenario = \"system\"\nname = \"block\"\n[inputs]\nheat_K_per_s = { hold = \"linear\" }\n[states]\nx_K = { start = \"y_K\" }\n\
    [parameters]\nk_per_s = { nominal = 1.0, min = 0.05, max = 20.0 }\n[rates]\nx_K = \"heat_K_per_s - k_per_s * x_K\"\n\
    [outputs]\ny_K = { value = \"x_K\", sd = 2.0 }\n";

#[test]
fn estimated_starts_of_many_recordings_do_not_pull_the_draws_from_the_truth() {
    const DATA_SETS: u64 = 12;
    let block = explanation("block", BLOCK, &[0.3], white(2.0));
    let times: Vec<f64> = (0..20).map(|k| 0.1 * f64::from(k)).collect();
    let share_below_the_truth = |k: u64| -> f64 {
        let mut rng = random_stream(14, "estimated starts", k);
        let mut one = || {
            let mut noise = || -> f64 { StandardNormal.sample(&mut rng) };
            let readings: Vec<f64> = times.iter().map(|t| 1.0 - (-t).exp() + 2.0 * noise()).collect();
            recording(&times, &[1.0; 20], &readings)
        };
        let earlier: Vec<Record> = (0..30).map(|_| one()).collect();
        let evidence = Evidence::after(&block, &earlier).expect("recordings of the model");
        let sample = PosteriorSample::new(&evidence, k, 0).expect("recordings of the model");
        (0..400).filter(|_| sample.draw(&mut rng)[0] < 1.0).count() as f64 / 400.0
    };
    let mean = (0..DATA_SETS).map(share_below_the_truth).sum::<f64>() / DATA_SETS as f64;
    // The mean of 12 uniform shares has a standard error of 0.083.
    assert!((mean - 0.5).abs() < 0.25, "{mean}");
}
