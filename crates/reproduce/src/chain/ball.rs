//! Models of increasing quality on the ball: from the declared model to a network on the augmented one.

use super::nets::{Chain, Runs};
use crate::experiment::data::Data;
use crate::experiment::rows::Row;
use augsim_discovery::Discovery;
use augsim_physics::ball::bullet::BulletBall;
use augsim_physics::ball::drop_distribution;
use augsim_physics::ball::effects::SCATTER_KIND;
use augsim_session::run_data::published_predictor;
use augsim_session::run_dir::DataSource;
use augsim_system::ScatterPer;
use augsim_terminal::output::Output;
use augsim_trainer::Engine;
use augsim_trainer::models::ScatteredBall;
use std::path::Path;

/// Scores physics and networks on `test_1000`, with the discovery `found` from training drops.
///
/// Returns the rows of the table, or `None` if interrupted.
pub fn chain(
    folder: &Path,
    found: &Discovery,
    read: usize,
    runs: Runs<'_>,
    output: &Output,
) -> anyhow::Result<Option<Vec<Row>>> {
    let [train, test] = ["train.csv.gz", "test_1000.csv.gz"].map(|name| DataSource::File(folder.join(name)));
    let (data, _) = Data::drops(&train, &test)?;
    let augmented = augmented(found, runs.seed);
    let chain = Chain {
        name: None,
        declared: published_predictor(),
        calibrated: Engine::PybulletBall(stepped(|name| found.calibrated.get(name).map(|e| e.value))),
        augmented: Engine::PybulletBall(augmented.ball),
        scattered: Some(&augmented),
        read,
        source: &train,
        train: &data.train,
        test: &data.tests[0],
        runs,
    };
    chain.run(output)
}

/// Returns the ball simulator with the discovered parameter values and their random variation (scatter).
fn augmented(found: &Discovery, seed: u64) -> ScatteredBall {
    let ball = stepped(|name| found.parameters.get(name).map(|e| e.value));
    let scatter = found.effects.iter().find(|e| e.kind == SCATTER_KIND);
    let per = match scatter.and_then(|e| e.per.as_deref()) {
        Some("impact") => ScatterPer::Event,
        _ => ScatterPer::Record,
    };
    let sd = scatter.and_then(|e| e.parameters.get("sd")).map_or(0.0, |e| e.value);
    ScatteredBall { ball, sd, per, seed }
}

/// Returns the PyBullet engine with `value(name)` for restitution and damping, else the published values.
///
/// Other discovered effects describe the difference between the stepping scheme and the exact engine, which
/// the stepping engine already has.
fn stepped(value: impl Fn(&str) -> Option<f64>) -> BulletBall {
    let nominal = drop_distribution::published_predictor();
    BulletBall {
        restitution: value("restitution").unwrap_or(nominal.restitution),
        // Bullet has one damping for both drag effects.
        damping: value("linear-drag.c_per_s").unwrap_or(nominal.damping),
        ..nominal
    }
}
