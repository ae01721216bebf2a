//! Report page of an experiment.

use super::data::Data;
use super::layout::Layout;
use super::plan::Experiment;
use super::repeat::Clouds;
use super::result::ResultFile;
use super::rows::results;
use augsim_report::benchmark::{
    self, BenchmarkReport, Cloud, Curve, ErrorCurve, Forecast, LearningCurve, LossPart, TrainingRun,
};
use augsim_report::page::{Method, Provenance};
use augsim_session::training_run::Trained;
use augsim_trainer::push::{GpPush, StartFrame};
use augsim_trainer::score::{Score, quantile};
use augsim_trainer::{Forecaster, Losses, Protocol, Recipe, SAMPLES, Sequence, Task};

/// Maximum number of test trajectories whose forecasts are on the page.
const MAX_SHOWN_TRAJECTORIES: usize = 3;
/// Maximum number of points of a learning curve and of a point cloud.
const CURVE_POINTS: usize = 200;
const CLOUD_POINTS: usize = 700;

/// Score of a model on the first test set, for figures.
pub struct Scored {
    /// Name of the scored model.
    pub name: String,
    /// Protocol under which the model was scored.
    pub protocol: Protocol,
    /// Errors, CRPS and coverage of the model.
    pub score: Score,
}

/// Data and models that the page shows in addition to the result file.
pub struct PageInputs<'a> {
    /// Training and test data.
    pub data: &'a Data,
    /// Networks that were trained on the whole training set.
    pub nets: &'a [Trained],
    /// The Gaussian processes of pushing; `None` for balls or if not planned.
    pub gp: Option<&'a GpPush>,
    /// Training losses of each network, by recipe.
    pub losses: Vec<(Recipe, Vec<Losses>)>,
    /// Scores on the first test set.
    pub scored: Vec<Scored>,
    /// Samples of each model on the repeated push; `None` if not planned.
    pub clouds: Option<&'a Clouds>,
}

/// Makes the input of the report page of an experiment.
pub fn report(
    experiment: &Experiment,
    result: &ResultFile,
    drawn: &PageInputs<'_>,
) -> anyhow::Result<BenchmarkReport> {
    let (words, data) = (&experiment.words, drawn.data);
    let set = &data.tests[0];
    let layout = Layout::for_engine(&data.engine);
    let mut forecasts = Vec::new();
    let nets = drawn.nets.iter().map(|t| &t.model as &dyn Forecaster);
    let all = nets.chain(drawn.gp.iter().map(|gp| *gp as &dyn Forecaster));
    for model in all.filter(|m| (words.draws)(m.name())) {
        for (index, q) in set.items.items.iter().enumerate().take(MAX_SHOWN_TRAJECTORIES) {
            fans(model, q, index, data, layout, &mut forecasts)?;
        }
    }
    let caption = result.test_set.as_ref().map_or(String::new(), |name| {
        let trajectories = set.items.items.len();
        format!("Error on {name}: {trajectories} trajectories of 400 samples at 60 Hz")
    });
    let acted = !data.engine.action_columns().is_empty();
    let estimates = result.calibration.iter().flatten();
    let mut notes: Vec<String> = words.notes.iter().map(|note| (*note).to_owned()).collect();
    if !result.test_runs.is_empty() {
        notes.push(format!("Measured runs that were tested on: {}.", result.test_runs.join(", ")));
    }
    notes.extend(result.notes.iter().cloned());
    Ok(BenchmarkReport {
        kind: words.kind.to_owned(),
        title: words.title.clone(),
        summary: (words.summary)(result),
        subject: Recipe::HybridPlus.label().to_owned(),
        words: layout.words.map(str::to_owned),
        key_figures: (words.key_figures)(result),
        results: results(&result.rows, &caption),
        sizes: sizes(result),
        clouds: clouds(drawn),
        clouds_caption: "Displacement of the object one second into the push, in the frame of its first pose: the truth of \
                         the virtual laboratory below, the samples above."
            .to_owned(),
        forecasts,
        errors: if acted { Vec::new() } else { errors(drawn, layout) },
        parts: if acted { parts(drawn) } else { Vec::new() },
        parts_caption: "the rod rests during the last quarter of a second.".to_owned(),
        parameters: estimates.map(|e| (e.name.clone(), e.nominal, e.value, e.ci95)).collect(),
        learning: drawn.losses.iter().map(|(recipe, losses)| learning(*recipe, losses, layout)).collect(),
        training: drawn
            .nets
            .iter()
            .map(|t| {
                let settings = &t.model.state().settings;
                TrainingRun {
                    model: settings.recipe.label().to_owned(),
                    recipe: (words.describe)(settings.recipe).to_owned(),
                    parameters: Some(t.parameters as u64),
                    iterations: Some(settings.iterations),
                }
            })
            .collect(),
        notes,
        reproduce: vec![experiment.command.clone()],
        methods: words
            .methods
            .iter()
            .map(|(name, purpose, reference)| Method {
                name: (*name).to_owned(),
                purpose: (*purpose).to_owned(),
                reference: (*reference).to_owned(),
            })
            .collect(),
        provenance: Provenance {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: Some(experiment.seed),
            data: data.origin.clone(),
            ..Provenance::default()
        },
    })
}

/// Returns the times of the samples of a trajectory in s, from its clock or the step of the engine.
fn times(data: &Data, q: &Sequence) -> Vec<f64> {
    let clock = |t: usize| q.action(t).last().copied().unwrap_or_default();
    let by_clock = || (0..q.time).map(|t| clock(t) - clock(0)).collect();
    data.engine.step_s().map_or_else(by_clock, |step_s| by_rate(q.time, step_s))
}

/// Computes times in s from the sampling rate, which is a round number more often than the step: 60 Hz.
fn by_rate(samples: usize, step_s: f64) -> Vec<f64> {
    (0..samples).map(|t| t as f64 / step_s.recip()).collect()
}

/// Adds the forecasts of one trajectory by one model to `out`, one per measured quantity.
///
/// They are relative to the first pose for systems with actions.
fn fans(
    model: &dyn Forecaster,
    q: &Sequence,
    index: usize,
    data: &Data,
    layout: &Layout,
    out: &mut Vec<Forecast>,
) -> anyhow::Result<()> {
    let task = Task { start: q.state(0), actions: &q.actions, time: q.time, index: index as u64 };
    let samples = model.forecast(task, SAMPLES)?;
    let (count, s) = (samples.count, q.state(0).len());
    let frame = (!q.actions.is_empty()).then(|| StartFrame::new(q.state(0), 0.0));
    let in_frame = |state: &[f64], j: usize| frame.map_or(state[j], |frame| frame.pose(state)[j]);
    let [one, _] = layout.words;
    for (j, (channel, unit, factor)) in layout.channels.iter().enumerate() {
        let sorted: Vec<Vec<f32>> = (0..q.time)
            .map(|t| {
                let at = |j: usize, i: usize| f64::from(samples.values[(t * s + j) * count + i]);
                let state = |i: usize| (0..s).map(|j| at(j, i)).collect::<Vec<_>>();
                let mut row: Vec<f32> =
                    (0..count).map(|i| (factor * in_frame(&state(i), j)) as f32).collect();
                row.sort_unstable_by(f32::total_cmp);
                row
            })
            .collect();
        let band = |level: f64| sorted.iter().map(|row| quantile(row, level)).collect::<Vec<f64>>();
        out.push(Forecast {
            model: model.name().to_owned(),
            trajectory: format!("{one} {}", q.id),
            channel: (*channel).to_owned(),
            unit: (*unit).to_owned(),
            t_s: times(data, q),
            truth: (0..q.time).map(|t| factor * in_frame(q.state(t), j)).collect(),
            median: band(0.5),
            lower50: band(0.25),
            upper50: band(0.75),
            lower90: band(0.05),
            upper90: band(0.95),
        });
    }
    Ok(())
}

/// Returns the forecast errors over time: one curve per model and measured quantity.
fn errors(drawn: &PageInputs<'_>, layout: &Layout) -> Vec<ErrorCurve> {
    let step_s = drawn.data.engine.step_s().unwrap_or(f64::NAN);
    let curve = |s: &Scored, measure: usize| ErrorCurve {
        model: s.name.clone(),
        protocol: match s.protocol {
            Protocol::Floor => benchmark::Protocol::Floor,
            _ => benchmark::Protocol::Forecast,
        },
        channel: layout.channels[measure].0.to_owned(),
        unit: layout.channels[measure].1.to_owned(),
        t_s: by_rate(s.score.error_by_sample.len(), step_s),
        error: s.score.error_by_sample.iter().map(|row| row[measure]).collect(),
    };
    drawn.scored.iter().flat_map(|s| (0..s.score.crps.len()).map(|m| curve(s, m))).collect()
}

/// Returns position errors over parts (fractions) of the duration, for all models that predict motion.
fn parts(drawn: &PageInputs<'_>) -> Vec<Curve> {
    let moving = drawn.scored.iter().filter(|s| !matches!(s.name.as_str(), "Zero" | "Still"));
    let curve = |s: &Scored| {
        let n = s.score.error_by_part.len();
        Curve {
            model: s.name.clone(),
            measure: "Position".to_owned(),
            unit: "mm".to_owned(),
            x: (0..n).map(|i| (i as f64 + 0.5) / n as f64).collect(),
            y: s.score.error_by_part.iter().map(|v| 1e3 * v).collect(),
        }
    };
    moving.map(curve).collect()
}

/// Returns the learning curves over the training-set size.
fn sizes(result: &ResultFile) -> Vec<Curve> {
    let mut out: Vec<Curve> = Vec::new();
    for (measure, unit) in [("Position", "mm"), ("Rotation", "°")] {
        for p in &result.curve {
            if out.last().is_none_or(|c| c.model != p.model || c.measure != measure) {
                let (model, measure, unit) = (p.model.clone(), measure.to_owned(), unit.to_owned());
                out.push(Curve { model, measure, unit, ..Curve::default() });
            }
            if let Some(c) = out.last_mut() {
                c.x.push(p.train_pushes as f64);
                c.y.push(if unit == "mm" { p.pos_mm } else { p.rot_deg });
            }
        }
    }
    out
}

fn clouds(drawn: &PageInputs<'_>) -> Vec<Cloud> {
    let Some(all) = drawn.clouds else { return Vec::new() };
    let cloud = |(name, points): &(String, Vec<[f64; 2]>)| {
        let kept = || points.iter().take(CLOUD_POINTS);
        let distance = all.result.distances.iter().find(|d| d.model == *name);
        Cloud {
            name: name.clone(),
            x_mm: kept().map(|p| p[0]).collect(),
            y_mm: kept().map(|p| p[1]).collect(),
            chamfer_mm: distance.map(|d| d.chamfer_mm),
            over_floor: distance.map(|d| d.over_floor),
            energy_mm: distance.map(|d| d.energy_mm),
        }
    };
    all.clouds.iter().map(cloud).collect()
}

fn learning(recipe: Recipe, losses: &[Losses], layout: &Layout) -> LearningCurve {
    let every = losses.len().div_ceil(CURVE_POINTS).max(1);
    let kept: Vec<&Losses> = losses.iter().step_by(every).collect();
    let part = |name: &str, f: &dyn Fn(&Losses) -> f64| LossPart {
        name: name.to_owned(),
        unit: format!("nats per {}", layout.words[0]),
        values: kept.iter().map(|l| f(l)).collect(),
    };
    LearningCurve {
        model: recipe.label().to_owned(),
        iteration: kept.iter().map(|l| l.iteration as f64).collect(),
        parts: vec![part("KL", &|l| l.kl), part("misfit", &|l| l.negative_ln_likelihood)],
    }
}
