//! The time-stepping scheme reproduces trajectories recorded with PyBullet.
//!
//! Each trajectory is regenerated from ground, damping, restitution and drop height alone. `GEOM_PLANE` is
//! bit-identical. For `plane.urdf`, PyBullet computes distances with GJK, whose rounding errors of 1e-16 to
//! 1e-13 grow at each bounce; a reference implementation differs by up to 2e-12 m at 60 Hz and 6.5e-7 m at
//! 240 Hz. A wrong formula, or one comparison with a different outcome, gives differences of millimetres.

use crate::shared_data::{shared_data, workspace};
use augsim_physics::ball::bullet::{BulletBall, DEFAULT_DAMPING, Ground};
use flate2::read::GzDecoder;
use std::fs::File;
use std::path::Path;

/// A recorded trajectory: the scene, and pairs of centre height and velocity from step 0 on.
struct Case {
    ball: BulletBall,
    name: String,
    trajectory: Vec<(f64, f64)>,
}

/// Reads the recorded PyBullet trajectories of a file.
fn cases(path: &Path, step_s: f64) -> Vec<Case> {
    let file = File::open(path).expect("the file exists");
    let mut rows = csv::Reader::from_reader(GzDecoder::new(file));
    let mut cases: Vec<Case> = Vec::new();
    for row in rows.records() {
        let row = row.expect("a complete row");
        let number = |i: usize| row[i].parse::<f64>().expect("a number");
        let name = row.iter().take(4).collect::<Vec<_>>().join(" ");
        if cases.last().is_none_or(|case| case.name != name) {
            let ground = match &row[0] {
                "plane_urdf" => Ground::PlaneUrdf,
                "geom_plane" => Ground::GeomPlane,
                other => panic!("ground {other}"),
            };
            let damping = if number(1) == 0.0 { 0.0 } else { DEFAULT_DAMPING };
            let restitution = number(2);
            let ball = BulletBall { ground, damping, restitution, step_s, ..BulletBall::default() };
            cases.push(Case { ball, name, trajectory: Vec::new() });
        }
        let case = cases.last_mut().expect("just pushed");
        assert_eq!(number(4), case.trajectory.len() as f64, "steps count up from 0");
        case.trajectory.push((number(6), number(7)));
    }
    cases
}

/// Largest difference of height, m, and of velocity, m/s, over the cases with this ground.
///
/// Recorded samples are `every` steps apart.
#[expect(clippy::print_stdout, reason = "the measured differences, for --nocapture")]
fn max_difference(cases: &[Case], ground: Ground, every: usize) -> (f64, f64) {
    let mut max = (0.0_f64, 0.0_f64);
    for case in cases.iter().filter(|case| case.ball.ground == ground) {
        let steps = (case.trajectory.len() - 1) * every;
        let simulated = case.ball.simulate(case.trajectory[0].0, steps);
        for (i, (z, v)) in case.trajectory.iter().enumerate() {
            let (simulated_z, simulated_v) = simulated[i * every];
            max = (max.0.max((simulated_z - z).abs()), max.1.max((simulated_v - v).abs()));
        }
    }
    println!("{ground:?}: {:.1e} m, {:.1e} m/s", max.0, max.1);
    max
}

fn check(path: &Path, step_s: f64, every: usize, expected_cases: usize, urdf_tolerance_m: f64) {
    let cases = cases(path, step_s);
    assert_eq!(cases.len(), expected_cases);
    assert_eq!(max_difference(&cases, Ground::GeomPlane, every), (0.0, 0.0), "bit-identical");
    let (z, v) = max_difference(&cases, Ground::PlaneUrdf, every);
    // Velocities are up to ten times as large as heights.
    assert!(z < urdf_tolerance_m && v < 10.0 * urdf_tolerance_m, "{z:e} m, {v:e} m/s");
}

#[test]
fn committed_cases_are_reproduced() {
    let fixtures = workspace().join("fixtures/pybullet-ball");
    check(&fixtures.join("golden_60hz_subset.csv.gz"), 1.0 / 60.0, 1, 8, 1e-9);
    check(&fixtures.join("golden_240hz_sampled60_subset.csv.gz"), 1.0 / 240.0, 4, 4, 1e-6);
}

#[test]
fn all_cases_at_60_hz_are_reproduced() {
    let Some(path) = shared_data("pybullet-ball/golden_60hz.csv.gz") else {
        return;
    };
    check(&path, 1.0 / 60.0, 1, 60, 1e-9);
}

#[test]
fn all_cases_at_240_hz_are_reproduced() {
    let Some(path) = shared_data("pybullet-ball/golden_240hz_sampled60.csv.gz") else {
        return;
    };
    check(&path, 1.0 / 240.0, 4, 60, 1e-6);
    let Some(path) = shared_data("pybullet-ball/golden_240hz_every.csv.gz") else {
        return;
    };
    check(&path, 1.0 / 240.0, 1, 20, 1e-6);
}
