//! Columns of the league tables and the computation of their values.

use super::processor::processor_s;
use crate::args::LeagueScenario;
use crate::experiment::data::Set;
use augsim_report::page::Best;
use augsim_trainer::score::{Score, Scoring, average, score};
use augsim_trainer::{Forecaster, SAMPLES, Samples, Task, Violations, collect_in_order, violations};
use rayon::prelude::*;

/// A column of the league tables.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Name of the column in `result.json`, with its unit.
    pub name: &'static str,
    /// Heading of the column in tables.
    pub title: &'static str,
    pub unit: &'static str,
    pub decimals: usize,
    pub best: Best,
}

const fn key(name: &'static str, title: &'static str, unit: &'static str, decimals: usize) -> Key {
    Key { name, title, unit, decimals, best: Best::Lowest }
}

const fn share(name: &'static str, title: &'static str, nominal: f64) -> Key {
    Key { name, title, unit: "%", decimals: 1, best: Best::Nearest(nominal) }
}

static BALL: [Key; 10] = [
    key("trans_percent", "trans", "%", 2),
    key("pos_m", "pos", "m", 4),
    key("vel_m_s", "vel", "m/s", 3),
    key("crps_m", "CRPS", "m", 4),
    key("crps_m_s", "CRPS vel", "m/s", 3),
    share("inside_50_percent", "in 50", 50.0),
    share("inside_90_percent", "in 90", 90.0),
    key("under_ground_percent", "under", "%", 3),
    key("under_ground_mm", "by", "mm", 1),
    key("gaining_rebounds_percent", "gains", "%", 2),
];

static PUSH: [Key; 10] = [
    key("pos_mm", "pos", "mm", 3),
    key("rot_deg", "rot", "°", 3),
    key("end_pos_mm", "end pos", "mm", 3),
    key("end_rot_deg", "end rot", "°", 3),
    key("crps_mm", "CRPS", "mm", 3),
    key("crps_deg", "CRPS rot", "°", 3),
    share("inside_50_percent", "in 50", 50.0),
    share("inside_90_percent", "in 90", 90.0),
    key("overlap_mm", "overlap", "mm", 2),
    key("untouched_mm", "untouched", "mm", 2),
];

impl Key {
    /// Whether models are ranked by this column: the CRPS of the position.
    pub fn decides(&self) -> bool {
        matches!(self.name, "crps_m" | "crps_mm")
    }
}

/// Returns the columns of the league tables of a scenario.
pub fn keys(scenario: LeagueScenario) -> &'static [Key] {
    match scenario {
        LeagueScenario::Ball => &BALL,
        LeagueScenario::Push => &PUSH,
    }
}

/// Measured values of one model on one test set.
#[derive(Debug, Clone)]
pub struct Measured {
    /// One value for each column in [`keys`]; `None` if it does not apply.
    pub figures: Vec<Option<f64>>,
    /// CRPS of each trajectory, averaged over its samples.
    pub crps: Vec<f64>,
    /// Processor time in µs to simulate one sample (draw) for one second; `None` without a model.
    pub microseconds: Option<f64>,
}

impl Measured {
    /// Returns the CRPS averaged over trajectories.
    pub fn mean_crps(&self) -> f64 {
        mean(&self.crps)
    }
}

/// Returns the mean of scores; 0 if there are none.
pub fn mean(scores: &[f64]) -> f64 {
    scores.iter().sum::<f64>() / scores.len().max(1) as f64
}

/// Value that replaces non-finite forecasts: a diverged model has an error of a million.
const DIVERGED_VALUE: f32 = 1e6;

/// Computes the values of a model on a test set; without a model, the physics violations of the data.
pub fn measure(model: Option<&dyn Forecaster>, set: &Set) -> anyhow::Result<Measured> {
    let scoring = Scoring::for_columns(&set.items);
    let start_s = processor_s();
    let each = |(i, q): (usize, &augsim_trainer::Sequence)| -> anyhow::Result<_> {
        let task = Task { start: q.state(0), actions: &q.actions, time: q.time, index: i as u64 };
        let mut samples = match model {
            Some(model) => model.forecast(task, SAMPLES)?,
            None => Samples { count: 1, values: q.states.iter().map(|v| *v as f32).collect() },
        };
        let far = |v: &&mut f32| v.is_nan() || v.abs() > DIVERGED_VALUE;
        samples.values.iter_mut().filter(far).for_each(|v| *v = DIVERGED_VALUE);
        let duration = match set.engine.step_s() {
            Some(step_s) => step_s * (q.time - 1) as f64,
            None => q.action(q.time - 1)[2] - q.action(0)[2],
        };
        let broken = violations(&set.engine, task, &samples);
        Ok((score(&samples, &q.states, &scoring), broken, duration * samples.count as f64))
    };
    let all = collect_in_order(set.items.items.par_iter().enumerate().map(each))?;
    let spent = processor_s() - start_s;
    let simulated: f64 = all.iter().map(|(.., s)| s).sum();
    let scores: Vec<Score> = all.iter().map(|(s, ..)| s.clone()).collect();
    let broken: Vec<Violations> = all.iter().filter_map(|(_, v, _)| *v).collect();
    let scale = if set.engine.action_columns().is_empty() { 1.0 } else { 1e3 };
    Ok(Measured {
        figures: figures(model.is_some(), &average(&scores), &broken, scale == 1.0),
        crps: scores.iter().map(|s| scale * s.crps[0]).collect(),
        microseconds: model.map(|_| 1e6 * spent / simulated),
    })
}

fn figures(scored: bool, s: &Score, broken: &[Violations], ball: bool) -> Vec<Option<f64>> {
    let percent = |share: Option<f64>| share.map(|v| 100.0 * v);
    let mean = |of: fn(&Violations) -> f64| {
        (!broken.is_empty()).then(|| broken.iter().map(of).sum::<f64>() / broken.len() as f64)
    };
    let m = &s.mean;
    let errors = match ball {
        true => [
            Some(m.trans_percent),
            Some(m.absolute[0]),
            Some(m.absolute[1]),
            Some(s.crps[0]),
            Some(s.crps[1]),
            percent(s.coverage50),
            percent(s.coverage90),
        ],
        false => [
            Some(1e3 * m.absolute[0]),
            Some(m.absolute[1].to_degrees()),
            Some(1e3 * m.end[0]),
            Some(m.end[1].to_degrees()),
            Some(1e3 * s.crps[0]),
            Some(s.crps[1].to_degrees()),
            percent(s.coverage50),
        ],
    };
    let mut out: Vec<Option<f64>> = errors.into_iter().map(|v| v.filter(|_| scored)).collect();
    if ball {
        out.extend([
            mean(|v| if let Violations::Ball { under_share, .. } = v { 100.0 * under_share } else { 0.0 }),
            mean(|v| if let Violations::Ball { under_m, .. } = v { 1e3 * under_m } else { 0.0 }),
            mean(|v| if let Violations::Ball { gain_share, .. } = v { 100.0 * gain_share } else { 0.0 }),
        ]);
    } else {
        out.extend([
            percent(s.coverage90).filter(|_| scored),
            mean(|v| if let Violations::Push { overlap_m, .. } = v { 1e3 * overlap_m } else { 0.0 }),
            mean(|v| if let Violations::Push { untouched_m, .. } = v { 1e3 * untouched_m } else { 0.0 }),
        ]);
    }
    out
}
