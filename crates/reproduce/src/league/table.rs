//! Text tables of the league, and run times.

use super::measures::{Key, keys};
use super::result::{League, ResultFile};
use super::rows::Row;
use crate::args::LeagueScenario;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Run times by scenario and model, as written to `timing.json`.
#[derive(Debug, Serialize)]
pub struct Costs {
    costs: BTreeMap<String, Cost>,
}

#[derive(Debug, Serialize)]
struct Cost {
    /// Processor time of one training in s, median over seeds; `None` without training.
    cpu_s: Option<f64>,
    /// Processor time in µs to simulate one sample (draw) for one second; `None` without a model.
    microseconds_per_simulated_s: Option<f64>,
}

impl Costs {
    /// Collects the run times of all models on the first test set of each scenario.
    pub fn from_result(result: &ResultFile) -> Self {
        let each = |league: &League| -> Vec<(String, Cost)> {
            let first = league.rows.iter().filter(|r| league.sets.first() == Some(&r.set));
            let cost = |r: &Row| Cost { cpu_s: r.cpu_s, microseconds_per_simulated_s: r.microseconds };
            first.map(|r| (format!("{}: {}", league.scenario, r.model), cost(r))).collect()
        };
        Costs { costs: result.leagues.iter().flat_map(each).collect() }
    }
}

/// Returns the scenario that a result names.
pub fn scenario_of(league: &League) -> LeagueScenario {
    if league.scenario == "ball" { LeagueScenario::Ball } else { LeagueScenario::Push }
}

/// Formats the learning curves as text: a line per model class and a column per size.
fn sizes(league: &League) -> String {
    let mut counts: Vec<usize> = league.sizes.iter().filter_map(|r| r.trained_on).collect();
    counts.sort_unstable();
    counts.dedup();
    if counts.is_empty() {
        return String::new();
    }
    let Some(key) = keys(scenario_of(league)).iter().find(|key| Key::decides(key)) else {
        return String::new();
    };
    let mut out = format!("\n{} {} by training trajectories\n  {:<15}", key.title, key.unit, "model");
    counts.iter().for_each(|count| out.push_str(&format!("{count:>10}")));
    for model in league.sized_models() {
        out.push_str(&format!("\n  {model:<15}"));
        for count in &counts {
            let row = league.sizes.iter().find(|r| r.model == model && r.trained_on == Some(*count));
            let figure = row.and_then(|r| r.figures.get(key.name));
            let shown = figure.map_or("-".to_owned(), |f| format!("{:.*}", key.decimals, f.median));
            out.push_str(&format!("{shown:>10}"));
        }
    }
    out.push('\n');
    out
}

/// Formats all tables and verdicts of the league as text.
pub fn table(result: &ResultFile) -> String {
    let mut out = String::new();
    for league in &result.leagues {
        let keys = keys(scenario_of(league));
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "{}: {} training trajectories, {} iterations, {} settings tried on a validation part, median of {} seeds",
            league.scenario, league.training, league.iterations, league.settings_tried, league.seeds
        );
        for set in &league.sets {
            let _ = write!(out, "\n{set}\n  {:<15}", "model");
            for key in keys {
                let _ = write!(out, "{:>14}", format!("{} {}", key.title, key.unit));
            }
            let _ = writeln!(out, "{:>12}{:>8}{:>8}{:>10}", "parameters", "train", "CPU s", "us/s");
            for row in league.rows.iter().filter(|r| r.set == *set) {
                let _ = write!(out, "  {:<15}", row.model);
                for key in keys {
                    let shown = row.figures.get(key.name).map(|f| format!("{:.*}", key.decimals, f.median));
                    let _ = write!(out, "{:>14}", shown.unwrap_or_else(|| "-".to_owned()));
                }
                let count = |n: Option<usize>| n.map_or("-".to_owned(), |n| n.to_string());
                let time = |s: Option<f64>| s.map_or("-".to_owned(), |s| format!("{s:.0}"));
                let _ = writeln!(
                    out,
                    "{:>12}{:>8}{:>8}{:>10}",
                    count(row.parameters),
                    count(row.trained_on),
                    time(row.cpu_s),
                    time(row.microseconds)
                );
            }
        }
        out.push_str(&sizes(league));
        out.push('\n');
        for verdict in &league.verdicts {
            let _ = writeln!(out, "{}", verdict.sentence);
        }
        out.push('\n');
    }
    out
}
