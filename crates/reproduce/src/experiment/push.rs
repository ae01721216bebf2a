//! Experiment with pushes (paper, section IV-B): networks, scores and text of the report.

use super::data::{Data, LABORATORY};
use super::plan::{Experiment, ExperimentTexts, NetPlan};
use super::result::ResultFile;
use super::sizes::Sizes;
use augsim_report::page::KeyFigure;
use augsim_trainer::Recipe;
use std::path::PathBuf;

/// Networks trained on the whole training set.
const NETS: [Recipe; 4] = [Recipe::Neural, Recipe::NeuralPlus, Recipe::Hybrid, Recipe::HybridPlus];

/// Experiment with one network only: a point of the learning curve, with scores on every test set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OneNet {
    /// Recipe (model class) of the network.
    pub recipe: Recipe,
    /// Number of training pushes; all if `None`.
    pub train_size: Option<usize>,
}

/// Makes the plan of the experiment on `data` with measured runs, or, with `one`, of one network only.
pub fn experiment(
    plan: &Sizes,
    data: &Data,
    one: Option<OneNet>,
    runs: Option<PathBuf>,
    quick: bool,
    (command, seed, resume): (String, u64, bool),
) -> Experiment {
    let net = |recipe| NetPlan { recipe, iterations: plan.iterations(recipe) };
    let name = data.name.unwrap_or_default();
    let all = one.is_none();
    Experiment {
        command,
        floor: None,
        baselines: all,
        nets: one.map_or(NETS.map(net).into(), |one| vec![net(one.recipe)]),
        sizes: if all { plan.sizes.clone() } else { vec![data.train.items.len()] },
        gp_steps: all.then_some(plan.gp_steps),
        // Only the laboratory can repeat a push.
        repeats: (all && name == LABORATORY).then_some(plan.repeats),
        runs: runs.filter(|_| all),
        quick,
        words: ExperimentTexts {
            scenario: "push",
            kind: "pushing report",
            title: format!("Planar pushing: forecasts from the first pose ({name})"),
            summary,
            key_figures,
            describe,
            draws: |model| ["Hybrid+", "Neural+", "GP"].contains(&model),
            notes: &NOTES,
            methods: &METHODS,
        },
        seed,
        resume,
    }
}

/// Summarises the outcome of the push experiment in two sentences.
fn summary(result: &ResultFile) -> String {
    let find = |model: &str| result.forecast(model).map(|r| [r.number("pos_mm"), r.number("rot_deg")]);
    let (Some(best), Some(physics), Some(gp)) = (find("Hybrid+"), find("Physics"), find("GP")) else {
        return String::new();
    };
    format!(
        "From the first pose and the rod's path, Hybrid+ forecasts the position of the pushed object to {:.2} mm and its \
         angle to {:.2}°; physics alone to {:.2} mm and {:.2}°, a Gaussian process to {:.2} mm and {:.2}°.",
        best[0], best[1], physics[0], physics[1], gp[0], gp[1]
    )
}

fn key_figures(result: &ResultFile) -> Vec<KeyFigure> {
    let figure = |value: String, unit: &str, label: &str, note: String| KeyFigure {
        value,
        unit: unit.to_owned(),
        label: label.to_owned(),
        note,
    };
    let mut out = Vec::new();
    if let (Some(best), Some(physics)) = (result.forecast("Hybrid+"), result.forecast("Physics")) {
        for (name, unit, label) in
            [("pos_mm", "mm", "Hybrid+, position error"), ("rot_deg", "°", "rotation error")]
        {
            let note = format!("physics {:.2}\u{202f}{unit}", physics.number(name));
            out.push(figure(format!("{:.2}", best.number(name)), unit, label, note));
        }
        if let Some(c) = best.coverage90 {
            let note = "of true values inside".to_owned();
            out.push(figure(format!("{:.0}", 100.0 * c), "%", "90 % band holds", note));
        }
    }
    let over_floor = |model: &str| {
        let mut distances = result.repeated.iter().flat_map(|r| &r.distances);
        distances.find(|d| d.model == model).map(|d| format!("{:.2}", d.over_floor))
    };
    if let Some(best) = over_floor("Hybrid+") {
        let gp = over_floor("GP-SUM").map_or(String::new(), |gp| format!("GP-SUM {gp}"));
        out.push(figure(best, "× floor", "Chamfer distance, repeated push", gp));
    }
    out
}

fn describe(recipe: Recipe) -> &'static str {
    match recipe {
        Recipe::Neural => "DCVRNN of the paper without physics: the condition is the rod's path",
        Recipe::Hybrid | Recipe::HybridStandardised => {
            "DCVRNN of the paper: the condition is the rod's path and the physics roll-out"
        }
        Recipe::HybridPlus => "GRU over features of the physics roll-out corrects it; one latent per push",
        Recipe::NeuralPlus => "the same net on the rod's path alone",
        _ => recipe.about(),
    }
}

const NOTES: [&str; 3] = [
    "Pushes are subsampled to at most 50 samples and 50 a second; nothing is interpolated.",
    "The virtual laboratory's truth is Coulomb friction summed over the footprint, with a friction map that is drawn \
     anew for each push, contact friction that differs from the declared one, and inertia above 50 mm/s. The declared \
     physics (ellipsoidal limit surface, quasi-static) has none of it. Measured poses carry noise of 0.3 mm and 0.1°.",
    "In the published net the same noise enters encoder, prior and latent, so its divergence does not bound what \
     the latent carries: samples of its prior are nothing that its decoder was trained on, and its forecasts are \
     little better than that nothing moves.",
];

const METHODS: [(&str, &str, &str); 6] = [
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
];
