//! Forecasts of different pushes (layout of the MIT set) from a measured prefix.

use super::Plan;
use super::push_physics::{fitted, way};
use super::push_row::Row;
use crate::experiment::Sizes;
use crate::experiment::data::Laboratory;
use augsim_session::run_dir::Config;
use augsim_terminal::destination::Claim;
use augsim_terminal::output::Output;
use augsim_terminal::training;
use augsim_trainer::filter::{
    ConditionedForecaster, FilterSettings, InitialStatePrior, PrefixForecaster, Sensor, evaluate_filtered,
};
use augsim_trainer::{Recipe, Sequence, Sequences, Settings};

/// Fractions of the samples of a push that are measured before the rest is forecast.
const MEASURED_FRACTIONS: [f64; 4] = [0.1, 0.25, 0.5, 0.75];
/// `[training, test]` numbers of pushes, first in full and then with `--quick`.
const PUSHES: [[usize; 2]; 2] = [[2500, 200], [400, 20]];
/// Number of particles of models that simulate every sample (draw) separately.
pub const PARTICLES: usize = 64;
/// Number of training iterations of Hybrid+, in full and with `--quick`.
const ITERATIONS: [u64; 2] = [3000, 500];

/// Scores all models with measurements of `sensor`; returns `None` if interrupted.
pub fn rows(
    plan: Plan<'_>,
    sensor: &Sensor,
    claim: &Claim,
    output: &Output,
) -> anyhow::Result<Option<Vec<Row>>> {
    let quick = usize::from(plan.args.quick);
    let [train, test] = PUSHES[quick];
    output.note(format!("generating {train} training and {test} test pushes of the MIT layout"));
    let laboratory = Laboratory::new(&Sizes { train, test, ..Sizes::quick() }, plan.seed)?;
    let Laboratory { declared, source, train, test, .. } = laboratory;
    let config = Config {
        checkpoint_every: 500,
        data: source,
        accept: Vec::new(),
        residual_of: None,
        settings: Settings::new(Recipe::HybridPlus, ITERATIONS[quick], plan.seed, test.engine.clone()),
    };
    let folder = claim.folder().join("hybrid-plus");
    let Some(net) = training::train_or_resume(&folder, &config, &train, plan.args.resume, output)? else {
        return Ok(None);
    };
    let items = &test.items;
    let way_of = |q: &Sequence| {
        let [x, y, t] = [0, 1, 2].map(|j| q.actions.iter().skip(j).step_by(3).copied().collect());
        way(&q.id, t, [x, y])
    };
    let ways: Vec<_> = items.items.iter().map(way_of).collect();
    let [pose, own] = &fitted(&declared, &ways);
    let (conditioned, plain) =
        (ConditionedForecaster::new(&net.model), ConditionedForecaster::unconditioned(&net.model));
    let models: [(&'static str, &dyn PrefixForecaster); 4] = [
        (pose.0, &pose.1),
        (own.0, &own.1),
        ("Hybrid+, from the first pose", &plain),
        ("Hybrid+, conditioned on what is seen", &conditioned),
    ];
    let mut out = Vec::new();
    for (name, model) in models {
        output.note(name);
        out.extend(score_fractions(
            (name, model),
            (sensor, &InitialStatePrior::from_training_set(&train)),
            items,
            plan.seed,
        )?);
    }
    Ok(Some(out))
}

/// Scores one model with each measured fraction of the samples.
fn score_fractions(
    (name, model): (&'static str, &dyn PrefixForecaster),
    known: (&Sensor, &InitialStatePrior),
    test: &Sequences,
    seed: u64,
) -> anyhow::Result<Vec<Row>> {
    // The poses are already measured, so no noise is added, and the scores include the noise of the
    // sensor.
    let settings = FilterSettings { is_measured: true, ..FilterSettings::new(PARTICLES, seed) };
    let behind = |time: usize| {
        MEASURED_FRACTIONS.iter().map(|share| ((share * time as f64) as usize).max(1)).collect()
    };
    let lengths: Vec<Vec<usize>> = test.items.iter().map(|q| behind(q.time)).collect();
    let scores = evaluate_filtered(model, test, known, &lengths, settings)?;
    let each = scores.into_iter().zip(MEASURED_FRACTIONS);
    Ok(each.map(|(score, share)| Row::new("mit", name, &score).with_prefix_share(share)).collect())
}
