//! Contract (issue 17, item 5): where time stamps jitter about the frames of a clock, the loop puts the samples on the frames, says
//! so, and finds the noise of the sensor beside them. Samples that were taken at uneven times, and stamps that are even, stay.

use augsim_data::{Dataset, Trajectory, random_stream};
use augsim_discovery::{Discovery, Options, Verdict, discover};
use augsim_physics::model::Model;
use augsim_tests::sealed::{Scene, Truth, seal};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

const NOISE_M: f64 = 0.001;
const JITTER_S: f64 = 0.001;

/// Drops with nothing to find, taken at 100 Hz.
fn drops() -> (Dataset, Model) {
    let scene = Scene {
        plane: false,
        at_rest: true,
        trajectories: 24,
        rate_hz: 100.0,
        noise_m: NOISE_M,
        restitution: 0.75,
        irregular: false,
    };
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
    assert!(augsim_data::FrameClock::of(&data).is_some(), "the stamps would tell frames");
    assert_eq!(answer(&model, &data).noise.frame_s, None);
}
