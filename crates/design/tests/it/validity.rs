//! Contract: the e-value against a true explanation has a mean of at most 1, also where earlier data leave its parameters on a curved
//! line, against the strongest rival that there can be: the truth itself with known parameters.

use super::{explanation, white};
use augsim_data::random_stream;
use augsim_design::{Evidence, Explanation, after_recordings};
use augsim_system::{Record, Stream};
use rand_distr::{Distribution, StandardNormal};

/// Two gains, of which equal inputs show the sum alone; positive parameters have logarithms as coordinates.
pub const GAINS: &str = "scenario = \"system\"\nname = \"gains\"\n[inputs]\nu_V = { hold = \"linear\" }\nw_V = { hold = \"linear\" }\n[states]\n\
    x_m = { start = 0.0, sd = 1e-9 }\n[parameters]\na_m_per_V_s = { nominal = 1.0, min = 0.01, max = 5.0 }\n\
    b_m_per_V_s = { nominal = 1.0, min = 0.01, max = 5.0 }\n[rates]\nx_m = \"a_m_per_V_s * u_V + b_m_per_V_s * w_V\"\n\
    [outputs]\ny_m = { value = \"x_m\", sd = 0.1 }\n";
pub const TRUE_GAINS: [f64; 2] = [0.4, 1.3];

/// A recording of 12 samples with constant inputs, simulated with the true gains and noise of 0.1.
pub fn run(inputs: [f64; 2], rng: &mut impl rand::Rng) -> Record {
    let times: Vec<f64> = (0..12).map(|k| 0.1 * f64::from(k)).collect();
    let rate = TRUE_GAINS[0] * inputs[0] + TRUE_GAINS[1] * inputs[1];
    let mut noise = || -> f64 { StandardNormal.sample(&mut *rng) };
    let readings = times.iter().map(|t| rate * t + 0.1 * noise()).collect();
    let stream = |u: f64| Stream { times: times.clone(), values: vec![vec![u; times.len()]] };
    Record {
        id: "1".into(),
        values: vec![readings],
        inputs: inputs.map(stream).to_vec().into(),
        times,
        ..Record::default()
    }
}

#[test]
fn the_e_value_against_the_truth_has_a_mean_of_at_most_one() {
    const DATA_SETS: u64 = 300;
    let free = explanation("free", GAINS, &[0.3, 0.3], white(0.1));
    let known =
        Explanation { values: TRUE_GAINS.to_vec(), ..explanation("known", GAINS, &[1e-6, 1e-6], white(0.1)) };
    let e_value = |k: u64| -> f64 {
        let mut rng = random_stream(11, "validity", k);
        let earlier: Vec<Record> = (0..4).map(|_| run([1.0, 1.0], &mut rng)).collect();
        let new = [run([1.0, 0.2], &mut rng), run([0.1, 1.0], &mut rng)];
        let after = after_recordings(&free, &earlier).expect("recordings of the model");
        let mut tested = Evidence::after(&after, &earlier).expect("recordings of the model");
        let mut rival = Evidence::new(&known);
        for evidence in [&mut tested, &mut rival] {
            evidence.add_all(&new).expect("recordings of the model");
        }
        (rival.log_density() - tested.log_maximum()).exp()
    };
    let values: Vec<f64> = (0..DATA_SETS).map(e_value).collect();
    let mean = values.iter().sum::<f64>() / DATA_SETS as f64;
    // A test that keeps nothing of the truth would have a mean near 0.
    assert!((0.02..1.0).contains(&mean), "{mean}");
    assert!(values.iter().filter(|e| **e >= 20.0).count() <= DATA_SETS as usize / 20);
}
