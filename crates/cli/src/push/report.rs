//! The experiment as a page.

use super::experiment::{Drawn, Experiment, ResultFile};
use super::rows::Row;
use augsim_report::page::{DataSource, KeyFigure, Method, Provenance};
use augsim_report::pushing::{OverPush, PushCloud, PushCurve, PushReport, PushRow};
use augsim_report::training::{Forecast, LearningCurve, LossPart, TrainingRun};
use augsim_trainer::push::StartFrame;
use augsim_trainer::score::quantile;
use augsim_trainer::{Forecaster, Losses, Recipe, SAMPLES, Sequence, Task};

/// Test pushes that the page shows.
const SHOWN: usize = 3;
/// Points of a learning curve, and of a cloud: enough for a page.
const CURVE_POINTS: usize = 200;
const CLOUD_POINTS: usize = 700;
/// Columns of a forecast: name, unit, factor from the data's unit.
const CHANNELS: [(&str, &str, f64); 3] =
    [("displacement x", "mm", 1e3), ("displacement y", "mm", 1e3), ("rotation", "°", 57.295_779_513_082_32)];

/// Fills the page's input.
pub fn report(experiment: &Experiment, result: &ResultFile, drawn: &Drawn<'_>) -> anyhow::Result<PushReport> {
    let mut forecasts = Vec::new();
    let nets = drawn.nets.iter().map(|t| &t.model as &dyn Forecaster);
    let shown = ["Hybrid+", "Neural+"];
    for model in
        nets.chain(drawn.others.iter().copied()).filter(|m| shown.contains(&m.name()) || m.name() == "GP")
    {
        for (index, q) in drawn.test.items.iter().enumerate().take(SHOWN) {
            fans(model, q, index, &mut forecasts)?;
        }
    }
    let mut curve: Vec<PushCurve> = Vec::new();
    for p in &result.curve {
        if curve.last().is_none_or(|c| c.model != p.model) {
            curve.push(PushCurve { model: p.model.clone(), ..PushCurve::default() });
        }
        if let Some(c) = curve.last_mut() {
            c.train_pushes.push(p.train_pushes as f64);
            c.pos_mm.push(p.pos_mm);
            c.rot_deg.push(p.rot_deg);
        }
    }
    let estimates = result.calibration.iter().flatten();
    Ok(PushReport {
        title: format!("Planar pushing: forecasts from the first pose ({})", result.data),
        summary: summary(&result.rows),
        key_figures: key_figures(result),
        subject: Recipe::HybridPlus.label().to_owned(),
        rows: result.rows.iter().map(page_row).collect(),
        curve,
        over_push: (drawn.over_push.iter())
            .map(|(model, pos_mm)| OverPush { model: model.clone(), pos_mm: pos_mm.clone() })
            .collect(),
        forecasts,
        learning: drawn.losses.iter().map(|(recipe, losses)| learning(*recipe, losses)).collect(),
        training: drawn.nets.iter().map(training).collect(),
        clouds: clouds(drawn),
        clouds_caption: "Displacement of the object one second into the push, in the frame of its first pose: the truth of \
                         the virtual laboratory below, the samples above."
            .to_owned(),
        parameters: estimates.map(|e| (e.name.clone(), e.nominal, e.value, e.ci95)).collect(),
        notes: notes(result),
        reproduce: vec![experiment.command.clone()],
        methods: methods(),
        provenance: Provenance {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: Some(experiment.seed),
            data: vec![DataSource { path: result.data.to_owned(), hash: String::new() }],
            ..Provenance::default()
        },
    })
}

fn fans(model: &dyn Forecaster, q: &Sequence, index: usize, out: &mut Vec<Forecast>) -> anyhow::Result<()> {
    let task = Task { start: q.state(0), actions: &q.actions, time: q.time, index: index as u64 };
    let samples = model.forecast(task, SAMPLES)?;
    let frame = StartFrame::new(q.state(0), 0.0);
    let count = samples.count;
    let moved: Vec<Vec<[f64; 3]>> = (0..q.time)
        .map(|t| {
            let at = |j: usize, i: usize| f64::from(samples.values[(t * 3 + j) * count + i]);
            (0..count).map(|i| frame.pose(&[at(0, i), at(1, i), at(2, i)])).collect()
        })
        .collect();
    for (j, (channel, unit, factor)) in CHANNELS.into_iter().enumerate() {
        let sorted: Vec<Vec<f32>> = moved
            .iter()
            .map(|row| {
                let mut row: Vec<f32> = row.iter().map(|pose| (factor * pose[j]) as f32).collect();
                row.sort_unstable_by(f32::total_cmp);
                row
            })
            .collect();
        let band = |level: f64| sorted.iter().map(|row| quantile(row, level)).collect::<Vec<f64>>();
        out.push(Forecast {
            model: model.name().to_owned(),
            trajectory: format!("push {}", q.id),
            channel: channel.to_owned(),
            unit: unit.to_owned(),
            t_s: (0..q.time).map(|t| q.action(t)[2] - q.action(0)[2]).collect(),
            truth: (0..q.time).map(|t| factor * frame.pose(q.state(t))[j]).collect(),
            median: band(0.5),
            lower50: band(0.25),
            upper50: band(0.75),
            lower90: band(0.05),
            upper90: band(0.95),
        });
    }
    Ok(())
}

fn page_row(r: &Row) -> PushRow {
    PushRow {
        set: r.set(),
        model: r.model.clone(),
        train_pushes: r.train_pushes,
        trans_percent: r.errors.trans_percent,
        moved_percent: r.errors.moved_percent,
        pos_mm: r.errors.pos_mm,
        rot_deg: r.errors.rot_deg,
        crps_mm: r.crps_mm,
        crps_deg: r.crps_deg,
        coverage50: r.coverage50,
        coverage90: r.coverage90,
    }
}

fn test_row<'a>(rows: &'a [Row], model: &str) -> Option<&'a Row> {
    rows.iter().find(|r| r.model == model && r.split == "test")
}

/// The outcome in two sentences.
fn summary(rows: &[Row]) -> String {
    let (Some(best), Some(physics), Some(gp)) =
        (test_row(rows, "Hybrid+"), test_row(rows, "Physics"), test_row(rows, "GP"))
    else {
        return String::new();
    };
    format!(
        "From the first pose and the rod's path, Hybrid+ forecasts the position of the pushed object to {:.2} mm and its \
         angle to {:.2}°; physics alone to {:.2} mm and {:.2}°, a Gaussian process to {:.2} mm and {:.2}°.",
        best.errors.pos_mm,
        best.errors.rot_deg,
        physics.errors.pos_mm,
        physics.errors.rot_deg,
        gp.errors.pos_mm,
        gp.errors.rot_deg
    )
}

fn key_figures(result: &ResultFile) -> Vec<KeyFigure> {
    let figure = |value: String, unit: &str, label: &str, note: String| KeyFigure {
        value,
        unit: unit.to_owned(),
        label: label.to_owned(),
        note,
    };
    let (best, physics) = (test_row(&result.rows, "Hybrid+"), test_row(&result.rows, "Physics"));
    let mut out = Vec::new();
    if let (Some(b), Some(p)) = (best, physics) {
        let note = |v: f64, unit: &str| format!("physics {v:.2}\u{202f}{unit}");
        let e = (&b.errors, &p.errors);
        out.push(figure(
            format!("{:.2}", e.0.pos_mm),
            "mm",
            "Hybrid+, position error",
            note(e.1.pos_mm, "mm"),
        ));
        out.push(figure(format!("{:.2}", e.0.rot_deg), "°", "rotation error", note(e.1.rot_deg, "°")));
        if let Some(c) = b.coverage90 {
            out.push(figure(
                format!("{:.0}", 100.0 * c),
                "%",
                "90 % band holds",
                "of true values inside".to_owned(),
            ));
        }
    }
    let distances = result.repeated.iter().flat_map(|r| &r.distances);
    if let Some(d) = distances.clone().find(|d| d.model == "Hybrid+") {
        let gp = distances
            .clone()
            .find(|d| d.model == "GP-SUM")
            .map_or(String::new(), |g| format!("GP-SUM {:.2}", g.over_floor));
        out.push(figure(format!("{:.2}", d.over_floor), "× floor", "Chamfer distance, repeated push", gp));
    }
    out
}

fn clouds(drawn: &Drawn<'_>) -> Vec<PushCloud> {
    let Some(all) = drawn.clouds else { return Vec::new() };
    let cloud = |(name, points): &(String, Vec<[f64; 2]>)| {
        let kept = || points.iter().take(CLOUD_POINTS);
        let distance = all.result.distances.iter().find(|d| d.model == *name);
        PushCloud {
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

fn learning(recipe: Recipe, losses: &[Losses]) -> LearningCurve {
    let every = losses.len().div_ceil(CURVE_POINTS).max(1);
    let kept: Vec<&Losses> = losses.iter().step_by(every).collect();
    let part = |name: &str, f: &dyn Fn(&Losses) -> f64| LossPart {
        name: name.to_owned(),
        unit: "nats per push".to_owned(),
        values: kept.iter().map(|l| f(l)).collect(),
    };
    LearningCurve {
        model: recipe.label().to_owned(),
        iteration: kept.iter().map(|l| l.iteration as f64).collect(),
        parts: vec![part("KL", &|l| l.kl), part("misfit", &|l| l.misfit)],
    }
}

fn training(t: &crate::session::Trained) -> TrainingRun {
    let settings = &t.model.state().settings;
    let recipe = match settings.recipe {
        Recipe::Neural => "DCVRNN of the paper without physics: the condition is the rod's path",
        Recipe::Hybrid | Recipe::HybridStandardised => {
            "DCVRNN of the paper: the condition is the rod's path and the physics roll-out"
        }
        Recipe::HybridPlus => "GRU over features of the physics roll-out corrects it; one latent per push",
        Recipe::NeuralPlus => "the same net on the rod's path alone",
    };
    TrainingRun {
        model: settings.recipe.label().to_owned(),
        recipe: recipe.to_owned(),
        parameters: Some(t.parameters as u64),
        iterations: Some(settings.iterations),
    }
}

fn notes(result: &ResultFile) -> Vec<String> {
    let mut notes = vec![
        format!(
            "Pushes are thinned to at most {} samples and {} a second; nothing is interpolated.",
            result.thinning[0], result.thinning[1]
        ),
        "The virtual laboratory's truth is Coulomb friction summed over the footprint, with a friction map that is drawn \
         anew for each push, contact friction that differs from the declared one, and inertia above 50 mm/s. The declared \
         physics (ellipsoidal limit surface, quasi-static) has none of it. Measured poses carry noise of 0.3 mm and 0.1°."
            .to_owned(),
        "In the published net the same noise enters encoder, prior and latent, so its divergence does not bound what \
         the latent carries: samples of its prior are nothing that its decoder was trained on, and its forecasts are \
         little better than that nothing moves."
            .to_owned(),
    ];
    if !result.test_runs.is_empty() {
        notes.push(format!("Measured runs that were tested on: {}.", result.test_runs.join(", ")));
    }
    notes.extend(result.notes.iter().cloned());
    notes
}

fn methods() -> Vec<Method> {
    [
        (
            "Decoupled conditional VRNN",
            "Neural and Hybrid",
            "Ajay, Wu, Fazeli, Bauza, Kaelbling, Tenenbaum, Rodriguez: Augmenting Physical Simulators with Stochastic \
             Neural Networks, IROS 2018",
        ),
        (
            "Quasi-static pushing",
            "Physics",
            "Lynch, Maekawa, Tanie: Manipulation and Active Sensing by Pushing Using Tactile Feedback, IROS 1992",
        ),
        (
            "GP-SUM",
            "the repeated push",
            "Bauza, Rodriguez: GP-SUM. Gaussian Process Filtering of non-Gaussian Beliefs, WAFR 2018",
        ),
        (
            "Heteroscedastic Gaussian process",
            "GP and GP-SUM",
            "Kersting, Plagemann, Pfaff, Burgard: Most Likely Heteroscedastic Gaussian Process Regression, ICML 2007",
        ),
        (
            "beta-NLL",
            "Hybrid+: learned deviations",
            "Seitzer et al.: On the Pitfalls of Heteroscedastic Uncertainty Estimation, ICLR 2022",
        ),
        (
            "Energy distance",
            "distance of two clouds",
            "Székely, Rizzo: Energy Statistics, Journal of Statistical Planning and Inference, 2013",
        ),
    ]
    .map(|(name, purpose, reference)| Method {
        name: name.to_owned(),
        purpose: purpose.to_owned(),
        reference: reference.to_owned(),
    })
    .to_vec()
}
