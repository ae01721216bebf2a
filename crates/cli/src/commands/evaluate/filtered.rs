//! `augsim evaluate --protocol filtered`: measures the first rows of each trajectory, forecasts and
//! scores the others.

use super::net::physics;
use crate::args::Evaluate;
use crate::commands::own_data::{OwnData, ScoredPart};
use augsim_data::{Column, digits};
use augsim_session::filtered::{
    PARTICLES, PrefixLength, SystemOnPrefix, TimedSequences, net_on_prefix, system_on_prefix,
};
use augsim_session::run_dir::RunDir;
use augsim_session::usage::Inapplicable;
use augsim_session::{ModelOrRun, Subject, discovery_in, equations};
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};
use augsim_trainer::filter::{
    EngineTransition, FilterSettings, FilteredScore, InitialStatePrior, PrefixForecaster, Sensor,
    evaluate_filtered,
};
use augsim_trainer::{Forecaster, SAMPLES};
use serde::Serialize;
use std::fmt::Write;

/// Scores of one model whose forecasts start after a measured prefix of one length.
#[derive(Debug, Serialize)]
struct Row {
    model: String,
    /// Name of the protocol, always `filtered`.
    protocol: &'static str,
    /// Length of the measured prefix, as given on the command line.
    seen: String,
    /// Number of trajectories that are longer than the prefix.
    trajectories: usize,
    /// Error of the first measure over all rows, %: sum of errors divided by the sum of absolute values.
    ///
    /// It is the mean over trajectories; measured rows count as zero error.
    whole_percent: f64,
    /// Error of the first measure over the forecast rows, %: sum of errors divided by the sum of absolute values.
    rest_percent: f64,
    /// Errors in each measure (such as the position).
    measures: Vec<MeasureErrors>,
    /// Share, 0 to 1, of the measured values in the 50 % prediction band; absent for a point forecast.
    coverage50: Option<f64>,
    /// Share, 0 to 1, of the measured values in the 90 % prediction band; absent for a point forecast.
    coverage90: Option<f64>,
}

/// Errors of the median forecast in one measure, in the unit of the measure.
#[derive(Debug, Serialize)]
struct MeasureErrors {
    /// Names of the columns that form the measure.
    columns: Vec<String>,
    /// Symbol of the unit of the errors.
    unit: String,
    /// Mean error of the measure over all rows; measured rows count as zero error.
    whole: f64,
    /// Mean error of the measure over the forecast rows.
    rest: f64,
    /// Median over trajectories of the mean error over the forecast rows.
    #[serde(rename = "rest_of_most")]
    median_rest: f64,
    /// Mean error over the last 70 % of the rows, which makes different prefix lengths comparable.
    common: f64,
    /// Continuous ranked probability score (CRPS) over the forecast rows.
    crps: f64,
}

#[derive(Debug, Serialize)]
struct Scored {
    rows: Vec<Row>,
}

/// Scores a network with its physics model, or all models of a discovery, on filtered forecasts.
pub(super) fn run(args: &Evaluate, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    let prefixes = args.seen.iter().map(|word| word.parse()).collect::<Result<Vec<PrefixLength>, Usage>>()?;
    let (from, view) = (args.measured(), args.view.view());
    let mut rows = Vec::new();
    match ModelOrRun::from_path(args.model())? {
        ModelOrRun::Net => {
            let run = RunDir::open(args.model());
            let net = net_on_prefix(&run, &from, &view)?;
            let known = (&net.sensor, &net.start);
            for (name, engine) in physics(&run.read_config()?, &net.model.state().settings.engine, output)? {
                rows.extend(score_model(
                    &name,
                    &EngineTransition::new(&engine),
                    &net.data,
                    known,
                    &prefixes,
                    seed,
                )?);
            }
            rows.extend(score_model(net.model.name(), &net.model, &net.data, known, &prefixes, seed)?);
        }
        ModelOrRun::Model { file, folder } => {
            // Discoveries hold out segments of long recordings of equations, but forecasts cover whole
            // recordings.
            let whole = !equations::is_model(&file);
            let only = folder
                .as_deref()
                .filter(|_| whole)
                .and_then(|folder| ScoredPart::of([OwnData::find(folder, &args.data)]).only);
            let mut models = Vec::new();
            if let Some(found) = folder.as_deref().and_then(discovery_in) {
                let texts =
                    [("declared", found.models.declared_toml), ("calibrated", found.models.calibrated_toml)];
                for (name, text) in texts {
                    let place = file.with_file_name(name).display().to_string();
                    models.push((name, Subject::parse(&text, &place)?));
                }
            }
            let name = if models.is_empty() { "model" } else { "augmented" };
            models.push((name, Subject::read(&file)?));
            for (name, model) in models {
                let SystemOnPrefix { filter, data, sensor, start } =
                    system_on_prefix(&model, &from, &view, only.as_ref())?;
                rows.extend(score_model(name, &filter, &data, (&sensor, &start), &prefixes, seed)?);
            }
        }
    }
    let all = Scored { rows };
    output.result(&all, || table_of_scores(&all))?;
    check_criterion(args, all.rows.last())
}

/// Checks the last row's position error, m, against the limit that `--require-pos-m` gives.
fn check_criterion(args: &Evaluate, row: Option<&Row>) -> anyhow::Result<Outcome> {
    let Some(limit) = args.require_pos_m else { return Ok(Outcome::Done) };
    let Some(position) = row.and_then(|r| r.measures.first()).filter(|m| m.unit == "m") else {
        return Err(Usage::Inapplicable(Inapplicable::PositionUnmeasured).into());
    };
    Ok(if position.rest < limit { Outcome::Done } else { Outcome::CriterionNotMet })
}

/// Scores the forecasts of one model with each of the prefix lengths `seen`.
fn score_model(
    name: &str,
    model: &dyn PrefixForecaster,
    data: &TimedSequences,
    known: (&Sensor, &InitialStatePrior),
    seen: &[PrefixLength],
    seed: u64,
) -> anyhow::Result<Vec<Row>> {
    let settings = FilterSettings { particles: PARTICLES, samples: SAMPLES, seed, is_measured: true };
    let lengths = data.lengths(seen)?;
    let scores = evaluate_filtered(model, &data.set, known, &lengths, settings)?;
    Ok(seen.iter().zip(scores).map(|(seen, score)| row(name, *seen, &data.set.columns, score)).collect())
}

fn row(name: &str, seen: PrefixLength, columns: &[String], s: FilteredScore) -> Row {
    let measures = s.columns.iter().enumerate().map(|(k, range)| MeasureErrors {
        columns: columns[range.clone()].to_vec(),
        unit: Column::new(&columns[range.start]).map_or_else(|_| String::new(), |c| c.unit().symbol()),
        whole: s.all_rows[k],
        rest: s.forecast_rows[k],
        median_rest: s.median_forecast_rows[k],
        common: s.last_70_percent[k],
        crps: s.crps[k],
    });
    Row {
        model: name.to_owned(),
        protocol: "filtered",
        seen: seen.to_string(),
        trajectories: s.trajectories,
        whole_percent: s.all_rows_percent,
        rest_percent: s.forecast_rows_percent,
        measures: measures.collect(),
        coverage50: s.coverage50,
        coverage90: s.coverage90,
    }
}

fn table_of_scores(all: &Scored) -> String {
    let mut text = format!(
        "filtered forecasts: the first rows of each trajectory are measured, the others are forecast; errors of the median of \
         {SAMPLES} samples (whole: all rows, measured rows count as zero error; rest: forecast rows; median: median of rest \
         over trajectories; late: last 70 % of the rows)"
    );
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "\n  {:<20}{:>7}{:>7}{:>9}  {:<24}{:>13}{:>13}{:>13}{:>13}{:>13}{:>8}{:>8}",
        "model",
        "seen",
        "of",
        "whole %",
        "error of",
        "whole",
        "rest",
        "median",
        "late",
        "CRPS",
        "in 50%",
        "in 90%"
    );
    for r in &all.rows {
        for (k, m) in r.measures.iter().enumerate() {
            let figure =
                |v: f64| if m.unit.is_empty() { digits(v) } else { format!("{} {}", digits(v), m.unit) };
            let share = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{:.1}", 100.0 * v));
            let once = |text: String| if k == 0 { text } else { String::new() };
            let _ = write!(
                text,
                "\n  {:<20}{:>7}{:>7}{:>9}  {:<24}{:>13}{:>13}{:>13}{:>13}{:>13}{:>8}{:>8}",
                once(r.model.clone()),
                once(r.seen.clone()),
                once(r.trajectories.to_string()),
                once(format!("{:.2}", r.whole_percent)),
                m.columns.join(", "),
                figure(m.whole),
                figure(m.rest),
                figure(m.median_rest),
                figure(m.common),
                figure(m.crps),
                once(share(r.coverage50)),
                once(share(r.coverage90)),
            );
        }
    }
    text
}
