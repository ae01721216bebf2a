//! Forecasts of pushes from a measured prefix: one repeated push, and different pushes.

use super::layout::{self, PARTICLES};
use super::push_physics::{fitted, way};
use super::push_row::Row;
use super::{Plan, page};
use crate::reproduction::{claim, finish, repeat, test_seed};
use anyhow::Context;
use augsim_data::{Dataset, Trajectory};
use augsim_physics::push::laboratory::{PushDesign, PushRecipe};
use augsim_session::run_data::recipe;
use augsim_system::Record as SystemRecord;
use augsim_terminal::Outcome;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use augsim_trainer::Sequences;
use augsim_trainer::filter::{
    FilterSettings, InitialStatePrior, PrefixForecaster, Sensor, TrajectoryRegression, evaluate_filtered,
    same_prefix_lengths,
};
use serde::Serialize;
use std::fmt::Write as _;

/// Lengths of the measured prefixes, s. The pusher starts to move at 0.05 s, with 20 mm/s.
const PREFIXES_S: [f64; 4] = [0.5, 1.0, 2.0, 3.0];
/// Sampling rate of the pushes, Hz.
const RATE_HZ: f64 = 20.0;
/// `[training, test]` numbers of pushes, first in full and then with `--quick`.
const PUSHES: [[usize; 2]; 2] = [[4000, 1000], [600, 100]];
/// Number of test pushes for models that simulate every sample separately, in full and with `--quick`.
const SIMULATED_PUSHES: [usize; 2] = [200, 20];
/// Columns of the object's pose.
const POSE: [&str; 3] = ["x_m", "y_m", "theta_rad"];

#[derive(Debug, Serialize)]
struct ResultFile {
    schema: &'static str,
    scenario: &'static str,
    /// Number of training pushes of the repeated push.
    train: usize,
    rows: Vec<Row>,
    seed: u64,
    command: String,
}

/// Runs the comparison of forecasts of pushes from measured prefixes.
pub fn run(plan: Plan<'_>, output: &Output) -> anyhow::Result<Outcome> {
    let Plan { args, seed, .. } = plan;
    let [train, test] = PUSHES[usize::from(args.quick)];
    let record = Record::new("reproduce filtered push").setting("seed", seed).setting("quick", args.quick);
    let claim = claim(plan.out, record, &[], args.resume, plan.force)?;
    claim.begin()?;
    output.note(format!("generating {train} training and {test} test pushes"));
    let measured = PushRecipe { rate_hz: RATE_HZ, ..recipe(PushDesign::Repeat, "rect1", "abs", train)? };
    let sd = [measured.position_sd_m, measured.position_sd_m, measured.angle_sd_rad];
    let exact = PushRecipe { pushes: test, position_sd_m: 0.0, angle_sd_rad: 0.0, ..measured.clone() };
    let (measured, truth) = (measured.generate(seed)?, exact.generate(test_seed(seed))?);
    let (learned, scored) = (Sequences::new(&measured.data, &POSE)?, Sequences::new(&truth.data, &POSE)?);
    let times = measured.data.trajectories().first().context("a push was made")?.time_s();
    let lengths: Vec<usize> =
        PREFIXES_S.iter().map(|s| times.iter().take_while(|t| **t <= times[0] + s + 1e-9).count()).collect();
    output.note("training on prefixes");
    let remembered = TrajectoryRegression::fit(&learned, &sd, &lengths)?;
    let sensor = Sensor::new(sd.map(Some).to_vec())?;
    let mut rows = Vec::new();
    let mut score =
        |name: &'static str, model: &dyn PrefixForecaster, test: &Sequences| -> anyhow::Result<()> {
            output.note(name);
            let start = InitialStatePrior::from_training_set(&learned);
            let settings = FilterSettings::new(PARTICLES, seed);
            let behind = same_prefix_lengths(&lengths, test.items.len());
            let scores = evaluate_filtered(model, test, (&sensor, &start), &behind, settings)?;
            let each = scores.into_iter().zip(PREFIXES_S).zip(&lengths).map(|((s, seconds), seen)| Row {
                seen_s: Some(seconds),
                seen: Some(*seen),
                ..Row::new("repeat", name, &s)
            });
            rows.extend(each);
            Ok(())
        };
    let mut few = scored.clone();
    few.items.truncate(SIMULATED_PUSHES[usize::from(args.quick)]);
    for (name, physics) in fitted(&truth.declared, &pusher_paths(&truth.data, few.items.len())?) {
        score(name, &physics, &few)?;
    }
    score("Memory of other pushes", &remembered, &scored)?;
    match layout::rows(plan, &sensor, &claim, output)? {
        Some(more) => rows.extend(more),
        None => return Ok(Outcome::Interrupted),
    }
    let mut words = vec![
        "filtered".to_owned(),
        "--scenario".to_owned(),
        "push".to_owned(),
        "--seed".to_owned(),
        seed.to_string(),
    ];
    words.extend(args.quick.then(|| "--quick".to_owned()));
    let result = ResultFile {
        schema: "augsim.filtered-push/2",
        scenario: "push",
        train,
        rows,
        seed,
        command: repeat(words),
    };
    finish(&claim, &result, |result| Ok(page_of(result).render()), None::<()>, table, output)
}

/// Returns the pusher paths of the first `pushes` pushes, as records without poses.
fn pusher_paths(data: &Dataset, pushes: usize) -> anyhow::Result<Vec<SystemRecord>> {
    let [x, y] = ["pusher_x_m", "pusher_y_m"].map(|c| data.column_index(c));
    let (x, y) = (x?, y?);
    let of = |t: &Trajectory| way(t.id(), t.time_s().to_vec(), [x, y].map(|c| t.column(c).to_vec()));
    Ok(data.trajectories().iter().take(pushes).map(of).collect())
}

fn page_of(result: &ResultFile) -> augsim_report::page::Page {
    let numbers = [
        ("pushes", "", 0),
        ("position", "mm", 3),
        ("rotation", "degrees", 3),
        ("CRPS", "mm", 3),
        ("CRPS", "degrees", 3),
        ("in 50 %", "%", 1),
        ("in 90 %", "%", 1),
    ];
    let row = |r: &Row| {
        let errors = [r.pushes as f64, r.position_mm, r.rotation_deg, r.crps_mm, r.crps_deg].map(Some);
        let bands = [r.coverage50, r.coverage90].map(page::percent);
        (format!("{}, {} measured", r.model, r.prefix()), errors.into_iter().chain(bands).collect())
    };
    let caption = "Errors of the median of 100 samples over the rest, mean over pushes.".to_owned();
    let summary = format!(
        "A push is repeated over tables that differ; a prefix is measured with 0.3 mm and 0.1 degrees. {} other pushes to learn \
         from.",
        result.train
    );
    let of = |layout: &'static str| result.rows.iter().filter(move |r| r.layout == layout).map(row);
    let different = "Pushes of the MIT layout, each at another place, angle and speed; errors as above, with the sensor's noise in what \
                     is scored."
        .to_owned();
    let tables =
        vec![page::table(caption, &numbers, of("repeat")), page::table(different, &numbers, of("mit"))];
    page::page(("Pushes with a measured prefix", summary), Vec::new(), tables, (&result.command, result.seed))
}

fn table(result: &ResultFile) -> String {
    let mut out = format!(
        "filtered forecasts of pushes (repeat: one push over and over, rect1 on abs, 20 mm/s; mit: each at another place, angle and \
         speed): a prefix is measured with 0.3 mm and 0.1 degrees, the rest is forecast; median of 100 samples over the rest; {} \
         other pushes to learn from\n  {:<8}{:<38}{:>7}{:>8}{:>9}{:>9}{:>10}{:>10}{:>8}{:>8}\n",
        result.train,
        "layout",
        "model",
        "seen",
        "pushes",
        "pos mm",
        "rot deg",
        "CRPS mm",
        "CRPS deg",
        "in 50%",
        "in 90%"
    );
    for r in &result.rows {
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "  {:<8}{:<38}{:>7}{:>8}{:>9.3}{:>9.3}{:>10.3}{:>10.3}{:>8}{:>8}",
            r.layout,
            r.model,
            r.prefix(),
            r.pushes,
            r.position_mm,
            r.rotation_deg,
            r.crps_mm,
            r.crps_deg,
            page::percent_text(r.coverage50),
            page::percent_text(r.coverage90)
        );
    }
    out
}
