//! Generator and engine reproduce the published PyBullet trajectories to all digits of their files.
//!
//! The inputs are the published drop heights and restitutions. Random draws depend on seed and index only.

use crate::shared_data::{shared_data, workspace};
use augsim_data::{Dataset, read_legacy_ball};
use augsim_physics::ball::bullet::DEFAULT_DAMPING;
use augsim_physics::ball::drop_distribution::{Drop, DropDistribution, published_predictor, rollout};
use flate2::read::MultiGzDecoder;
use std::fs::File;
use std::io::Read;
use std::path::Path;

fn undamped() -> DropDistribution {
    DropDistribution::default()
}

fn damped() -> DropDistribution {
    let mut law = DropDistribution::default();
    law.ball.damping = DEFAULT_DAMPING;
    law
}

/// Drop heights and restitutions of the published test set, in file order.
fn drops(path: &Path) -> Vec<Drop> {
    let file = File::open(path).expect("the file exists");
    let content: Box<dyn Read> = if path.extension().is_some_and(|e| e == "gz") {
        Box::new(MultiGzDecoder::new(file))
    } else {
        Box::new(file)
    };
    let mut rows = csv::Reader::from_reader(content);
    let rows = rows.records().map(|row| row.expect("a complete row"));
    let number = |text: &str| text.parse().expect("a number");
    rows.filter(|row| &row[0] == "test")
        .map(|row| Drop { drop_height_m: number(&row[2]), restitution: number(&row[3]) })
        .collect()
}

/// Largest absolute difference of the height, m, and of the velocity, m/s, of two data sets.
fn largest_difference(a: &Dataset, b: &Dataset) -> [f64; 2] {
    assert_eq!(a.trajectories().len(), b.trajectories().len());
    ["height_m", "velocity_m_s"].map(|column| {
        let (a, b) = (a.series(column).expect("there"), b.series(column).expect("there"));
        a.zip(b)
            .flat_map(|(x, y)| x.iter().zip(y).map(|(x, y)| (x - y).abs()).collect::<Vec<_>>())
            .fold(0.0, f64::max)
    })
}

/// Tolerance for files with six significant digits.
///
/// Half a unit of the sixth digit of a height or speed below 10; the rounding errors of GJK, about 1e-11, are
/// negligible.
const ROUNDING_TOLERANCE: f64 = 0.51e-5;

/// Asserts that simulated drops and engine predictions are the published ones.
fn check_reproduced(truth: &Dataset, engine: Option<&Dataset>, law: DropDistribution, drops: &[Drop]) {
    let simulated = law.simulate(drops).expect("finite drops");
    let [height, velocity] = largest_difference(truth, &simulated);
    assert!(height < ROUNDING_TOLERANCE && velocity < ROUNDING_TOLERANCE, "{height:e} m, {velocity:e} m/s");
    let Some(engine) = engine else { return };
    // Predict from the exact initial state: the rounded one of the file moves an impact by up to a
    // microsecond.
    let predicted = rollout(&published_predictor(), &simulated).expect("the engine's rate");
    let [height, velocity] = largest_difference(engine, &predicted);
    assert!(
        height < ROUNDING_TOLERANCE && velocity < ROUNDING_TOLERANCE,
        "engine: {height:e} m, {velocity:e} m/s"
    );
}

#[test]
fn committed_trajectories_are_reproduced() {
    let folder = workspace().join("fixtures/pybullet-ball");
    let truth = read_legacy_ball(&folder.join("test_first5.csv.gz")).unwrap();
    let engine = read_legacy_ball(&folder.join("physics_test_first5.csv.gz")).unwrap();
    assert_eq!(truth.trajectories()[4].id(), "4");
    assert_eq!(truth.trajectories()[4].len(), 400);
    let drops = drops(&folder.join("params_first5.csv"));
    check_reproduced(&truth, Some(&engine), undamped(), &drops);
}

#[test]
fn complete_sets_are_reproduced() {
    // Test set, predictions of the engine, drop heights and restitutions, distribution.
    let sets = [
        ("test", Some("physics_test"), "params", undamped()),
        ("test_1000", None, "params_1000", undamped()),
        ("test_damped", Some("physics_test_damped"), "params_damped", damped()),
    ];
    for (name, engine, params, law) in sets {
        let file = |name: &str| shared_data(&format!("pybullet-ball/{name}.csv.gz"));
        let (Some(truth), Some(params)) = (file(name), file(params)) else {
            return;
        };
        let truth = read_legacy_ball(&truth).unwrap();
        let engine = engine.and_then(file).map(|path| read_legacy_ball(&path).unwrap());
        check_reproduced(&truth, engine.as_ref(), law, &drops(&params));
    }
}

#[test]
fn draws_depend_on_seed_and_index_only() {
    let generate = |threads, trajectories| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| undamped().generate(trajectories, 7)).unwrap()
    };
    let (one, drops) = generate(1, 40);
    assert_eq!(generate(2, 40), (one.clone(), drops.clone()));
    let (longer, more_drops) = generate(7, 50);
    assert_eq!(longer.trajectories()[..40], *one.trajectories());
    assert_eq!(more_drops[..40], drops);
    assert_ne!(undamped().generate(40, 8).unwrap().1, drops);
}

#[test]
fn draws_have_the_declared_distribution() {
    let (_, drops) = DropDistribution { samples: 1, ..undamped() }.generate(20_000, 3).unwrap();
    let mean = |pick: fn(&Drop) -> f64| drops.iter().map(pick).sum::<f64>() / 20_000.0;
    // Five standard errors: uniform on [4, 5] has sd 0.289, the restitution 0.1.
    assert!((mean(|d| d.drop_height_m) - 4.5).abs() < 0.0102);
    assert!((mean(|d| d.restitution) - 0.5).abs() < 0.0035);
    assert!((mean(|d| (d.restitution - 0.5).powi(2)) - 0.01).abs() < 0.0005);
    assert!(drops.iter().all(|d| (4.0..5.0).contains(&d.drop_height_m)));
}

#[test]
fn rollout_refuses_data_with_another_time_step() {
    let mut law = undamped();
    law.ball.step_s = 1.0 / 50.0;
    let (other_rate, _) = law.generate(1, 0).unwrap();
    assert_eq!(
        rollout(&published_predictor(), &other_rate).unwrap_err().to_string(),
        "trajectory `0`: sample 1 is not 1 steps of 0.016666666666666666 s after the first; this \
         engine has a fixed step: resample the data"
    );
}
