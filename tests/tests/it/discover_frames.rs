//! Contract (issue 17, item 5): if time stamps jitter about the frames of a camera clock, the discovery moves
//! the samples to the frames, reports it, and estimates the sensor's noise as well. Samples at uneven times
//! and even time stamps are not moved.

use augsim_data::{Dataset, Trajectory, random_stream};
use augsim_discovery::{Discovery, Options, Verdict, discover};
use augsim_physics::model::Model;
use augsim_session::{DataFrom, DiscoverRequest, Subject};
use augsim_tests::sealed::{Scene, Truth, seal};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write;

const NOISE_M: f64 = 0.001;
const JITTER_S: f64 = 0.001;

/// Drops without a missing effect, sampled at 100 Hz, and their model.
fn drops() -> (Dataset, Model) {
    let scene = Scene { trajectories: 24, noise_m: NOISE_M, ..Scene::DROPS };
    let truth = Truth { declared_ratio: 1.0, ..Truth::default() };
    let sealed = seal(&scene, truth, &mut random_stream(5, "frames", 0)).expect("well formed");
    (sealed.data, Model::parse(&sealed.model, "sealed.toml").expect("well formed"))
}

fn answer(model: &Model, data: &Dataset) -> Discovery {
    discover(model, data, &Options::default(), &mut |_| {}).expect("an answer")
}

#[test]
fn jittering_stamps_are_put_on_their_frames() {
    let (even, model) = drops();
    let mut rng = random_stream(5, "stamps", 0);
    let stamped = even.trajectories().iter().map(|t| {
        let mut late = || -> f64 { JITTER_S * Distribution::<f64>::sample(&StandardNormal, &mut rng) };
        let stamps = t.time_s().iter().map(|&s| if s > 0.0 { s + late() } else { s }).collect();
        t.with_samples(stamps, t.values().to_vec()).expect("well formed")
    });
    let data = Dataset::new(even.columns().to_vec(), stamped.collect()).expect("well formed");
    let found = answer(&model, &data);
    assert_eq!(found.verdict, Verdict::NothingToAdd, "{}", found.sentence);
    let frame_s = found.noise.frame_s.expect("frames");
    assert!((frame_s - 0.01).abs() < 2e-5, "frames of {frame_s} s");
    let jitter_s = found.noise.jitter_s.expect("jitter");
    assert!((jitter_s / JITTER_S - 1.0).abs() < 0.1, "jitter of {jitter_s} s");
    assert!(found.noise.findings.contains(&"timing-jitter".to_owned()), "{:?}", found.noise.findings);
    assert!((found.noise.sd / NOISE_M - 1.0).abs() < 0.15, "noise of {} m", found.noise.sd);
}

#[test]
fn even_stamps_stay() {
    let (data, model) = drops();
    assert_eq!(answer(&model, &data).noise.frame_s, None);
}

#[test]
fn samples_taken_at_uneven_times_stay() {
    let (_, model) = drops();
    let mut rng = random_stream(5, "uneven", 0);
    let mut drop = |id: usize| {
        let height: f64 = rng.random_range(4.5..5.0);
        let times: Vec<f64> = (0..90)
            .map(|k| 0.01 * f64::from(k) + if k > 0 { rng.random_range(0.0..0.004) } else { 0.0 })
            .collect();
        let heights = times.iter().map(|t| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            height - 0.5 * 9.81 * t * t + 2e-4 * noise
        });
        let heights = heights.collect();
        Trajectory::new(id.to_string(), times, vec![heights]).expect("a drop")
    };
    let drops = (0..12).map(&mut drop).collect();
    let data = Dataset::from_names(&["height_m"], drops).expect("data");
    assert!(augsim_data::FrameClock::estimate(&data).is_some(), "the stamps would tell frames");
    assert_eq!(answer(&model, &data).noise.frame_s, None);
}

const PENDULUM: &str = "scenario = \"system\"\nname = \"pendulum\"\n\
    [states]\ntheta_rad = { start = \"angle_rad\" }\nomega_rad_s = { start = \"slope(angle_rad)\" }\n\
    [parameters]\nlength_m = { nominal = 0.15, min = 0.05, max = 1.0 }\n\
    damping_per_s = { nominal = 0.1, min = 0.0, max = 10.0 }\n\
    [rates]\ntheta_rad = \"omega_rad_s\"\n\
    omega_rad_s = \"-9.81 / length_m * sin(theta_rad) - damping_per_s * omega_rad_s\"\n\
    [outputs]\nangle_rad = { value = \"theta_rad\", sd = \"estimate\" }\n";

/// CSV text of pendulum swings: length 0.153 m, damping 0.05 /s, 120 Hz, stamps in whole ms, 1 mrad of noise.
fn swings() -> String {
    let mut rng = random_stream(5, "swings", 0);
    let mut csv = "trajectory,t_s,angle_rad\n".to_owned();
    let rate = |[theta, omega]: [f64; 2]| [omega, -9.81 / 0.153 * theta.sin() - 0.05 * omega];
    let to = |[a, b]: [f64; 2], [c, d]: [f64; 2], h: f64| [a + h * c, b + h * d];
    for swing in 1..=4 {
        let (mut at, h) = ([0.4 + 0.4 * f64::from(swing), 0.0], 1.0 / 1200.0);
        for sample in 0..480 {
            let noise: f64 = StandardNormal.sample(&mut rng);
            let stamp = f64::from(sample) / 120.0;
            writeln!(csv, "{swing},{stamp:.3},{:.6}", at[0] + 1e-3 * noise).expect("a string");
            for _ in 0..10 {
                let a = rate(at);
                let b = rate(to(at, a, h / 2.0));
                let c = rate(to(at, b, h / 2.0));
                let d = rate(to(at, c, h));
                at = [0, 1].map(|i| at[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
            }
        }
    }
    csv
}

#[test]
fn stamps_in_whole_milliseconds_do_not_blur_a_system_of_equations() {
    let model = augsim_equations::model::parse(PENDULUM, "model.toml").unwrap_or_else(|e| panic!("{e}"));
    let data = DataFrom::Table { name: "swings.csv".into(), csv: swings().into_bytes().into() };
    let subject = Subject::Equations(Box::new(model));
    let found = augsim_session::discover(&subject, &data, &DiscoverRequest::default(), &mut |_| {})
        .expect("an answer");
    assert_eq!(found.verdict, Verdict::NothingToAdd, "{}", found.sentence);
    let frame_s = found.noise.frame_s.expect("frames");
    assert!((frame_s - 1.0 / 120.0).abs() < 1e-6, "frames of {frame_s} s");
    assert!((found.noise.sd / 1e-3 - 1.0).abs() < 0.1, "noise of {} rad", found.noise.sd);
    let length = &found.calibrated["length_m"];
    assert!(length.ci95[0] <= 0.153 && 0.153 <= length.ci95[1], "{length}");
}
