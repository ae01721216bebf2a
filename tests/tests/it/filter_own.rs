//! Contract: prior distributions of parameters that differ between trajectories are learned from other
//! trajectories. With them the filter estimates the spin of a flight from its beginning, and its prediction
//! bands have their nominal coverage. Flights come from a separate Runge-Kutta integration.
use augsim_data::random_stream;
use augsim_physics::ball::Axes;
use augsim_physics::model::Model;
use augsim_system::{Record, Seed, Simulate};
use augsim_trainer::filter::{
    FilterSettings, FilteredScore, InitialStatePrior, LearnedPriors, Sensor, SystemFilter, evaluate_filtered,
    same_prefix_lengths,
};
use augsim_trainer::{Sequence, Sequences};
use rand_distr::{Distribution, StandardNormal};
use std::sync::Arc;

const STEP_S: f64 = 0.01;
const ROWS: usize = 40;
const SD_M: f64 = 0.001;
/// Lift coefficient of a = LIFT (spin x v); next constant: standard deviation of the spin about x, rad/s.
const LIFT: f64 = 0.002;
const SPIN_SD: f64 = 150.0;
const MODEL: &str = "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\n\
    restitution = { nominal = 0.9, frozen = true }\nradius_m = { nominal = 0.02, frozen = true }\n\
    [release]\nkind = \"free\"\n[[effect]]\nkind = \"magnus\"\ns = { nominal = 0.002, frozen = true }\n\
    [[effect]]\nkind = \"spin-offset\"\n\
    x_rad_s = { nominal = 0.0, min = -700.0, max = 700.0, per = \"trajectory\" }\n\
    y_rad_s = { nominal = 0.0, frozen = true }\nz_rad_s = { nominal = 0.0, frozen = true }\n";

/// Measured rows of a flight along y at 5 m/s with `spin` about x (rad/s): the lift acts in the y-z plane.
fn flight(spin: f64, noise: &mut dyn FnMut() -> f64) -> Vec<f64> {
    let rate = |v: [f64; 2]| [-LIFT * spin * v[1], -9.81 + LIFT * spin * v[0]];
    let (mut at, mut v) = ([0.0, 1.0], [5.0, 1.0]);
    let mut rows = Vec::new();
    for _ in 0..ROWS {
        rows.extend([noise(), at[0] + noise(), at[1] + noise()]);
        for _ in 0..10 {
            let h = STEP_S / 10.0;
            let middle = [0, 1].map(|i| v[i] + 0.5 * h * rate(v)[i]);
            at = [0, 1].map(|i| at[i] + h * middle[i]);
            v = [0, 1].map(|i| v[i] + h * rate(middle)[i]);
        }
    }
    rows
}

fn flights(count: usize, seed: u64) -> Sequences {
    let mut rng = random_stream(seed, "flights", 0);
    let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
    let items = (0..count).map(|i| {
        let spin = SPIN_SD * draw();
        let states = flight(spin, &mut || SD_M * draw());
        Sequence { id: i.to_string(), time: ROWS, states, actions: Vec::new() }
    });
    let columns = ["x_m", "y_m", "z_m"].map(String::from).to_vec();
    Sequences { columns, action_columns: Vec::new(), items: items.collect() }
}

fn filter(count: usize) -> SystemFilter {
    let system = Arc::new(Model::parse(MODEL, "model.toml").expect("a model").open(Axes::Space));
    let covariates = vec![f64::NAN; system.schema().covariates.len()];
    let times: Vec<f64> = (0..ROWS).map(|k| STEP_S * k as f64).collect();
    let values = vec![vec![0.0; ROWS]; 3];
    let record = Record { times, values, covariates, ..Record::default() };
    SystemFilter::new(system, &vec![record; count], &vec![None; count])
}

fn score(filter: &SystemFilter, test: &Sequences) -> FilteredScore {
    let (sensor, start) = (Sensor::exact(3), InitialStatePrior { mean: vec![0.0; 3], sd: vec![0.0; 3] });
    let settings = FilterSettings { is_measured: true, ..FilterSettings::new(200, 1) };
    let lengths = same_prefix_lengths(&[8], test.items.len());
    evaluate_filtered(filter, test, (&sensor, &start), &lengths, settings).expect("scores").remove(0)
}

#[test]
fn laws_of_other_flights_are_those_that_made_them_and_bands_behind_them_hold() {
    let (train, test) = (flights(60, 1), flights(60, 2));
    let laws = LearnedPriors::learn(&filter(60), &train).unwrap();
    let [(Seed::Parameter(_), mean, sd)] = laws.normal_priors() else { panic!("{laws:?}") };
    // The deviation of 60 draws is known to 9 %, their median to 16 % of it.
    assert!((sd / SPIN_SD - 1.0).abs() < 0.3 && mean.abs() < 0.5 * SPIN_SD, "{mean} {sd}");
    assert!(laws.noise().iter().all(|noise| (noise / SD_M - 1.0).abs() < 0.2), "{:?}", laws.noise());
    let (taught, plain) = (filter(60).with_normal_priors(laws.normal_priors(), laws.noise()), filter(60));
    let (taught, plain) = (score(&taught, &test), score(&plain, &test));
    assert!(taught.crps[0] <= plain.crps[0], "{} {}", taught.crps[0], plain.crps[0]);
    let inside = taught.coverage90.unwrap();
    assert!((0.82..=0.96).contains(&inside), "{inside}");
}
