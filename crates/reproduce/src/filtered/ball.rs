//! Forecasts of ball drops from measured prefixes, with the same prefixes for every model.

use super::Plan;
use super::page;
use crate::experiment::data::Data;
use crate::reproduction::{claim, drop_sources, finish, iterations, record_sources, repeat};
use anyhow::Context;
use augsim_physics::ball::bullet::BulletBall;
use augsim_physics::ball::drop_distribution::{self, DropDistribution};
use augsim_report::page::Block;
use augsim_session::run_data::published_predictor;
use augsim_session::run_dir::Config;
use augsim_terminal::Outcome;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use augsim_terminal::training::{self, Times};
use augsim_trainer::filter::{
    FilterSettings, FilteredScore, FittedDrop, FreeParameters, InitialStatePrior, Prefix, PrefixForecaster,
    RandomRestitution, Sensor, evaluate_filtered, measured_rows, same_prefix_lengths,
};
use augsim_trainer::{NetModel, Recipe, Sequences, Settings};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;

/// Numbers of measured rows after which the rest of a drop is forecast.
const PREFIX_LENGTHS: [usize; 9] = [1, 30, 55, 60, 65, 70, 90, 120, 200];
/// Number of particles of each filter.
const PARTICLES: usize = 256;
/// Number of test drops with `--quick`.
const QUICK_DROPS: usize = 100;

/// Sensors: name, and noise standard deviation of height (m) and velocity (m/s); `None` if not measured.
const SENSORS: [(&str, [Option<f64>; 2]); 3] =
    [("exact", [Some(0.0), Some(0.0)]), ("2 mm", [Some(0.002), None]), ("10 mm", [Some(0.010), None])];

#[derive(Debug, Serialize)]
struct ResultFile {
    schema: &'static str,
    scenario: &'static str,
    /// Number of test drops that were scored.
    trajectories: usize,
    /// Number of particles of each filter.
    particles: usize,
    rows: Vec<Row>,
    iterations: u64,
    seed: u64,
    command: String,
}

/// Scores of one model with one sensor and one prefix length.
#[derive(Debug, Serialize)]
struct Row {
    /// Name of the protocol, always `filtered`.
    protocol: &'static str,
    /// Name of the model.
    model: &'static str,
    /// Name of the sensor that measured the prefix.
    sensor: &'static str,
    /// Number of measured rows (prefix length).
    seen: usize,
    /// Errors over all rows, where measured rows count as zero: % of the height, m, m/s.
    whole: Errors,
    /// Standard errors over the drops of the position (m) and velocity (m/s) errors in `whole`.
    whole_se: [f64; 2],
    /// Errors over the forecast rows only: % (ratio of sums), m, m/s.
    rest: Errors,
    /// `[position, velocity]` errors over the last 70 % of the rows for every prefix length: m, m/s.
    common: [f64; 2],
    /// `[position, velocity]` continuous ranked probability scores over the forecast rows: m, m/s.
    crps: [f64; 2],
    /// Coverage of the 50 % band as a fraction, over rows where the 90 % band is wider than 1 mm.
    coverage50: Option<f64>,
    /// Coverage of the 90 % band as a fraction, over rows where it is wider than 1 mm.
    coverage90: Option<f64>,
}

/// Errors of the median of the forecast samples.
#[derive(Debug, Serialize)]
struct Errors {
    trans_percent: f64,
    pos_m: f64,
    vel_m_s: f64,
}

/// Runs the comparison of forecasts of ball drops from measured prefixes.
pub fn run(plan: Plan<'_>, output: &Output) -> anyhow::Result<Outcome> {
    let Plan { args, seed, .. } = plan;
    let iterations = iterations(args);
    let (train, test) = drop_sources(args, plan.data, seed);
    let record = Record::new("reproduce filtered ball")
        .setting("seed", seed)
        .setting("quick", args.quick)
        .setting("iterations", iterations);
    let record = record_sources(record, &train, &test);
    let inputs: Vec<&Path> = plan.data.into_iter().collect();
    let claim = claim(plan.out, record, &inputs, args.resume, plan.force)?;
    claim.begin()?;
    let (data, _) = Data::drops(&train, &test)?;
    output.note(format!("training Hybrid+ ({iterations} iterations)"));
    let settings = Settings::new(Recipe::HybridPlus, iterations, seed, published_predictor());
    let config =
        Config { checkpoint_every: 500, data: train, accept: Vec::new(), residual_of: None, settings };
    let folder = claim.folder().join("hybrid-plus");
    let Some(net) = training::train_or_resume(&folder, &config, &data.train, args.resume, output)? else {
        return Ok(Outcome::Interrupted);
    };
    let mut items = data.tests[0].items.clone();
    if args.quick {
        items.items.truncate(QUICK_DROPS);
    }
    let start = InitialStatePrior::from_training_set(&data.train);
    let result = ResultFile {
        schema: "augsim.filtered/1",
        scenario: "ball",
        trajectories: items.items.len(),
        particles: PARTICLES,
        rows: score_models(&net.model, &data.train, &start, &items, seed, output)?,
        iterations,
        seed,
        command: repeat(command_words(plan, iterations)),
    };
    let page =
        |result: &ResultFile| Ok(page_of(result, narrowing(&net.model, &start, &items, seed)?).render());
    finish(&claim, &result, page, Some(Times::from_trained([&net])), table, output)
}

/// Words of the command line that repeats the run.
fn command_words(plan: Plan<'_>, iterations: u64) -> Vec<String> {
    let (seed, iterations) = (plan.seed.to_string(), iterations.to_string());
    let words = ["filtered", "--scenario", "ball", "--seed", &seed, "--iterations", &iterations];
    let mut words: Vec<String> = words.map(str::to_owned).into();
    if let Some(folder) = plan.data {
        words.extend(["--data".to_owned(), folder.display().to_string()]);
    }
    words
}

/// Scores all models with all sensors and prefix lengths.
fn score_models(
    net: &NetModel,
    train: &Sequences,
    start: &InitialStatePrior,
    test: &Sequences,
    seed: u64,
    output: &Output,
) -> anyhow::Result<Vec<Row>> {
    let distribution = DropDistribution::default();
    let floor = RandomRestitution {
        ball: distribution.ball,
        mean: distribution.restitution_mean,
        sd: distribution.restitution_sd,
    };
    let fitted = |freedom| FittedDrop { ball: drop_distribution::published_predictor(), freedom };
    let (declared, calibrated) = (fitted(FreeParameters::Height), fitted(FreeParameters::Calibrated));
    output.note("fitting restitution and damping to every training drop");
    let augmented = RandomRestitution::fitted(drop_distribution::published_predictor(), train);
    let models: [(&'static str, &dyn PrefixForecaster); 5] = [
        ("Floor", &floor),
        ("Least squares, declared", &declared),
        ("Least squares, calibrated", &calibrated),
        ("Physics augmented", &augmented),
        ("Hybrid+", net),
    ];
    let mut rows = Vec::new();
    for (sensor, sd) in SENSORS {
        for (name, model) in models {
            output.note(format!("{name}, {sensor}"));
            rows.extend(score_model(name, model, (sensor, Sensor::new(sd.to_vec())?), start, test, seed)?);
        }
    }
    Ok(rows)
}

/// Scores one model with one sensor and all prefix lengths.
fn score_model(
    name: &'static str,
    model: &dyn PrefixForecaster,
    (sensor_name, sensor): (&'static str, Sensor),
    start: &InitialStatePrior,
    test: &Sequences,
    seed: u64,
) -> anyhow::Result<Vec<Row>> {
    let settings = FilterSettings::new(PARTICLES, seed);
    let lengths = same_prefix_lengths(&PREFIX_LENGTHS, test.items.len());
    let scores = evaluate_filtered(model, test, (&sensor, start), &lengths, settings)?;
    let row = |(seen, s): (usize, FilteredScore)| {
        let errors = |percent, e: &[f64]| Errors { trans_percent: percent, pos_m: e[0], vel_m_s: e[1] };
        Row {
            protocol: "filtered",
            model: name,
            sensor: sensor_name,
            seen,
            whole: errors(s.all_rows_percent, &s.all_rows),
            whole_se: [s.all_rows_se[0], s.all_rows_se[1]],
            rest: errors(s.forecast_rows_percent, &s.forecast_rows),
            common: [s.last_70_percent[0], s.last_70_percent[1]],
            crps: [s.crps[0], s.crps[1]],
            coverage50: s.coverage50,
            coverage90: s.coverage90,
        }
    };
    Ok(PREFIX_LENGTHS.into_iter().zip(scores).map(row).collect())
}

/// Prefix lengths (rows) that the page shows for one drop, with heights of 2 mm noise.
const SHOWN: [usize; 4] = [30, 60, 65, 90];

/// Draws forecasts of the first test drop with increasing prefix lengths.
fn narrowing(
    model: &NetModel,
    start: &InitialStatePrior,
    test: &Sequences,
    seed: u64,
) -> anyhow::Result<Block> {
    let (name, sd) = SENSORS[1];
    let sensor = Sensor::new(sd.to_vec())?;
    let q = test.items.first().context("a test drop")?;
    let rows = measured_rows(q, &sensor, Some(seed), 0);
    let (id, columns) = (&q.id, sd.len());
    let last = SHOWN[SHOWN.len() - 1];
    let prefix = Prefix {
        id,
        rows: &rows[..last * columns],
        sensor: &sensor,
        start,
        actions: &q.actions,
        time: q.time,
        index: 0,
    };
    let samples = model.forecasts(prefix, &SHOWN, FilterSettings::new(PARTICLES, seed))?;
    let step_s = BulletBall::default().step_s;
    let times: Vec<f64> = (0..q.time).map(|k| step_s * k as f64).collect();
    let heights: Vec<f64> = q.states.iter().step_by(columns).copied().collect();
    let caption = format!(
        "Hybrid+ forecasts drop `{id}` of the test set from its first heights, measured with {name}. Before the rebound the restitution \
         is that of any drop; a few samples after it the restitution is known."
    );
    let forecasts: Vec<_> = SHOWN.into_iter().zip(samples).collect();
    Ok(page::fans(("height", "m"), (&times, &heights), &forecasts, (0, columns), caption))
}

fn page_of(result: &ResultFile, fan: Block) -> augsim_report::page::Page {
    let numbers = [
        ("n", "", 0),
        ("trans", "%", 3),
        ("position", "m", 4),
        ("velocity", "m/s", 3),
        ("CRPS", "m", 4),
        ("CRPS", "m/s", 3),
        ("in 50 %", "%", 1),
        ("in 90 %", "%", 1),
    ];
    let row = |r: &Row| {
        let e = &r.whole;
        let numbers = [r.seen as f64, e.trans_percent, e.pos_m, e.vel_m_s, r.crps[0], r.crps[1]].map(Some);
        (
            r.model.to_owned(),
            numbers.into_iter().chain([r.coverage50, r.coverage90].map(page::percent)).collect(),
        )
    };
    let table = |(sensor, _): (&str, _)| {
        let rows = result.rows.iter().filter(|r| r.sensor == sensor).map(row);
        page::table(format!("Sensor: {sensor}. Measured rows count as zero error."), &numbers, rows)
    };
    let summary = format!(
        "{} drops: n rows of 400 are measured, the others are forecast; errors of the median of 100 samples.",
        result.trajectories
    );
    let tables = SENSORS.map(|(name, sd)| table((name, sd))).into_iter().collect();
    page::page(("Drops with a measured prefix", summary), vec![fan], tables, (&result.command, result.seed))
}

/// Formats the scores as text, one table per sensor.
fn table(result: &ResultFile) -> String {
    let mut out = format!(
        "filtered forecasts of {} drops: n rows are measured, the others are forecast; median of 100 samples, measured rows count as zero \
         error\n",
        result.trajectories
    );
    for (sensor, _) in SENSORS {
        let what = if sensor == "exact" { "every column" } else { "heights only" };
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "\nsensor: {sensor}, {what}\n  {:<27}{:>4}{:>9}{:>9}{:>9}{:>9}{:>9}{:>8}{:>8}",
            "model", "n", "trans %", "pos m", "vel m/s", "CRPS m", "CRPS m/s", "in 50%", "in 90%"
        );
        for r in result.rows.iter().filter(|r| r.sensor == sensor) {
            let _ = writeln!(
                out,
                "  {:<27}{:>4}{:>9.3}{:>9.4}{:>9.3}{:>9.4}{:>9.3}{:>8}{:>8}",
                r.model,
                r.seen,
                r.whole.trans_percent,
                r.whole.pos_m,
                r.whole.vel_m_s,
                r.crps[0],
                r.crps[1],
                page::percent_text(r.coverage50),
                page::percent_text(r.coverage90)
            );
        }
    }
    out
}
