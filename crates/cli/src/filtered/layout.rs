//! Pushes laid out as the MIT set, each at another place, angle and speed: the beginning is seen, the rest is forecast.

use super::Plan;
use super::push_row::Row;
use crate::destination::Claim;
use crate::experiment::Sizes;
use crate::experiment::data::Laboratory;
use crate::output::Output;
use crate::session;
use augsim_physics::push::{C, CONTACT_FRICTION};
use augsim_physics::system::{self, Stream, System};
use augsim_session::run_dir::Config;
use augsim_trainer::filter::{
    Conditioned, FilterSettings, PrefixForecaster, Sensor, StartLaw, SystemFilter, evaluate_filtered,
};
use augsim_trainer::{Recipe, Sequences, Settings};
use std::sync::Arc;

/// Shares of a push's samples that are seen.
const SHARES: [f64; 4] = [0.1, 0.25, 0.5, 0.75];
/// Pushes to train on and to score, and the same with `--quick`.
const PUSHES: [[usize; 2]; 2] = [[2500, 200], [400, 20]];
/// Particles of models that simulate every draw.
pub const PARTICLES: usize = 64;
/// Standard deviations from push to push of the ellipsoid's c (m) and of the contact's friction, where both are fitted to the
/// prefix: those of the reference's baseline.
pub const OWN: [(usize, f64); 2] = [(C, 1.8e-3), (CONTACT_FRICTION, 0.02)];
/// Iterations of Hybrid+, and with `--quick`.
const ITERATIONS: [u64; 2] = [3000, 500];

/// Scores every model behind readings of `sensor`, that of the laboratory; `None` if the user stopped it.
pub fn rows(
    plan: Plan<'_>,
    sensor: &Sensor,
    claim: &Claim,
    output: &Output,
) -> anyhow::Result<Option<Vec<Row>>> {
    let quick = usize::from(plan.args.quick);
    let [train, test] = PUSHES[quick];
    output.note(format!("making {train} pushes of the MIT layout to learn from and {test} others"));
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
    let Some(net) = session::train_again(&folder, &config, &train, plan.args.resume, output)? else {
        return Ok(None);
    };
    let items = &test.items;
    let system: Arc<dyn System> = Arc::new(declared.open());
    let records: Vec<system::Record> = items.items.iter().map(|q| record(&q.id, &q.actions)).collect();
    let physics = SystemFilter::new(system, &records, &vec![None; records.len()]);
    let fitted =
        OWN.into_iter().fold(physics.clone(), |filter, (parameter, sd)| filter.with_own(parameter, sd));
    let (conditioned, plain) = (Conditioned::new(&net.model), Conditioned::not_at_all(&net.model));
    let models: [(&'static str, &dyn PrefixForecaster); 4] = [
        ("Physics, pose fitted", &physics),
        ("Physics, pose, c and friction fitted", &fitted),
        ("Hybrid+, from the first pose", &plain),
        ("Hybrid+, conditioned on what is seen", &conditioned),
    ];
    let mut out = Vec::new();
    for (name, model) in models {
        output.note(name);
        out.extend(scored((name, model), (sensor, &StartLaw::of(&train)), items, plan.seed)?);
    }
    Ok(Some(out))
}

/// The rows of a model, one a share seen.
fn scored(
    (name, model): (&'static str, &dyn PrefixForecaster),
    known: (&Sensor, &StartLaw),
    test: &Sequences,
    seed: u64,
) -> anyhow::Result<Vec<Row>> {
    // Poses are measured: nothing is added to what is seen, and the sensor's noise is in what is scored.
    let settings = FilterSettings { is_measured: true, ..FilterSettings::new(PARTICLES, seed) };
    let behind = |time: usize| SHARES.iter().map(|share| ((share * time as f64) as usize).max(1)).collect();
    let lengths: Vec<Vec<usize>> = test.items.iter().map(|q| behind(q.time)).collect();
    let scores = evaluate_filtered(model, test, known, &lengths, settings)?;
    let each = scores.into_iter().zip(SHARES);
    Ok(each.map(|(score, share)| Row::new("mit", name, &score).behind_share(share)).collect())
}

/// The rod's path of a push, as the simulated system reads it.
fn record(id: &str, actions: &[f64]) -> system::Record {
    let column = |j: usize| actions.iter().skip(j).step_by(3).copied().collect::<Vec<f64>>();
    let times = column(2);
    system::Record {
        id: id.to_owned(),
        values: vec![vec![f64::NAN; times.len()]; 3],
        inputs: [Stream { times: times.clone(), values: vec![column(0), column(1)] }].into(),
        times,
        ..system::Record::default()
    }
}
