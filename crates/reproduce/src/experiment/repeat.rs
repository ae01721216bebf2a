//! Distribution of one repeated push (paper, section IV-B): samples of the models compared with the
//! virtual laboratory.

use super::data::LABORATORY;
use augsim_physics::push::laboratory::PushDesign;
use augsim_session::run_data::recipe;
use augsim_trainer::push::{point_sets, pushes};
use augsim_trainer::{Forecaster, Sequence, Sequences, Task, collect_in_order};
use rayon::prelude::*;
use serde::Serialize;

/// Time after the start at which displacements are compared, s: 20 mm of pusher travel, as published.
const HORIZON_S: f64 = 1.0;
/// Offset of the seed of the first true set of pushes; the second set uses the next seed.
const SEED_OFFSET: u64 = 50_000_000;

/// Displacements of repeated pushes, `[x, y]` in mm, in the frame of the first pose.
pub type Points = Vec<[f64; 2]>;

/// Distances between the displacements that a model samples and the true ones.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Distance {
    /// Name of the model. A second set of true pushes is included; its distance is the lowest possible one.
    pub model: String,
    /// Chamfer distance to the first set of true displacements, mm.
    pub chamfer_mm: f64,
    /// Chamfer distance divided by that of the second set of true displacements.
    pub over_floor: f64,
    /// Energy distance to the first set of true displacements, mm.
    pub energy_mm: f64,
    /// Mean displacement `[x, y]`, mm.
    pub mean_mm: [f64; 2],
    /// Standard deviation of the displacement `[x, y]`, mm.
    pub sd_mm: [f64; 2],
}

/// Comparison of models on one repeated push, as written to `result.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Repeated {
    /// Name of the source of the true pushes.
    pub data: &'static str,
    /// Number of pushes or samples in each set of displacements.
    pub points: usize,
    /// Time after the start of a push at which displacements are compared, s.
    pub horizon_s: f64,
    /// Distances of all models; the second set of true pushes is first.
    pub distances: Vec<Distance>,
}

/// Displacements of true pushes and models, and their distances.
#[derive(Debug)]
pub struct Clouds {
    /// Name and displacements of each set; the first set of true pushes is first.
    pub clouds: Vec<(String, Points)>,
    /// Distances of each set from the first set of true pushes.
    pub result: Repeated,
}

/// Compares samples of the models, and a second set of true pushes, with a first set of true pushes.
///
/// Each model is sampled once per push of the second set, from the push's first pose.
pub fn compare(repeats: usize, seed: u64, models: &[(String, &dyn Forecaster)]) -> anyhow::Result<Clouds> {
    let make = |k: u64| -> anyhow::Result<Sequences> {
        let recipe = recipe(PushDesign::Repeat, "rect1", "abs", repeats)?;
        let data = recipe.generate(seed.wrapping_add(SEED_OFFSET + k))?.data;
        let mut all =
            pushes(&data, augsim_trainer::push::Subsampling { samples: usize::MAX, rate_hz: 20.0 })?;
        for q in &mut all.items {
            cut(q);
        }
        Ok(all)
    };
    let (first, second) = (make(0)?, make(1)?);
    let truth = |set: &Sequences| -> Points {
        set.items.iter().map(|q| displacement(q.state(0), q.state(q.time - 1))).collect()
    };
    let mut clouds = vec![("truth".to_owned(), truth(&first)), ("truth, again".to_owned(), truth(&second))];
    for (name, model) in models {
        let points = (second.items.par_iter().enumerate()).map(|(i, q)| -> anyhow::Result<_> {
            let task = Task { start: q.state(0), actions: &q.actions, time: q.time, index: i as u64 };
            let samples = model.forecast(task, 1)?;
            let end: Vec<f64> = samples.values[3 * (q.time - 1)..].iter().map(|v| f64::from(*v)).collect();
            Ok(displacement(q.state(0), &end))
        });
        clouds.push((name.clone(), collect_in_order(points)?));
    }
    let reference = clouds[0].1.clone();
    let floor = point_sets::chamfer(&reference, &clouds[1].1);
    let distances = clouds[1..]
        .iter()
        .map(|(name, points)| {
            let chamfer_mm = point_sets::chamfer(&reference, points);
            let (mean_mm, sd_mm) = moments(points);
            Distance {
                model: name.clone(),
                chamfer_mm,
                over_floor: chamfer_mm / floor,
                energy_mm: point_sets::energy(&reference, points),
                mean_mm,
                sd_mm,
            }
        })
        .collect();
    let result = Repeated { data: LABORATORY, points: repeats, horizon_s: HORIZON_S, distances };
    Ok(Clouds { clouds, result })
}

/// Removes the samples after the horizon from a push.
fn cut(q: &mut Sequence) {
    let begin = q.action(0)[2];
    let kept = (0..q.time).filter(|&t| q.action(t)[2] - begin <= HORIZON_S + 1e-9).count();
    q.time = kept.max(2);
    q.states.truncate(3 * q.time);
    q.actions.truncate(3 * q.time);
}

fn displacement(start: &[f64], end: &[f64]) -> [f64; 2] {
    let (sin, cos) = start[2].sin_cos();
    let (dx, dy) = (1e3 * (end[0] - start[0]), 1e3 * (end[1] - start[1]));
    [cos * dx + sin * dy, cos * dy - sin * dx]
}

fn moments(points: &[[f64; 2]]) -> ([f64; 2], [f64; 2]) {
    let n = points.len() as f64;
    let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    let sd = [0, 1].map(|k| (points.iter().map(|p| (p[k] - mean[k]).powi(2)).sum::<f64>() / n).sqrt());
    (mean, sd)
}
