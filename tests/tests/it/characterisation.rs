//! Contract: the discovery's answers to sixteen small data sets do not change without a written reason.
//!
//! `tests/characterisation.json` holds for each set the verdict, the effects, a hash of all numbers that
//! matter (parameters, intervals, errors, noise, p-values) and the amount of work. A refactoring leaves all
//! of them unchanged; a change of the statistics writes them anew, with its reason:
//!
//! ```sh
//! AUGSIM_MINT="why the answers change" cargo test --release -p augsim-tests --test it characterisation
//! ```
//!
//! `AUGSIM_ANSWERS=FOLDER` writes every answer in full, so that two commits can be compared byte for byte.
//! The sets are the smallest that still take each branch of the discovery: no effect; effects of flight,
//! impact, sensor and support; a pair; random effects per impact and per trajectory; values per group;
//! effects outside the library; unusual noise; pushes with a smooth effect, with one that is singular at its
//! null value, with one that contains another, and with a value per session.

use crate::shared_data::{shared_data, workspace};
use augsim_data::convert::CONVERTERS;
use augsim_data::{Dataset, MissingCells, Trajectory, random_stream, read_csv};
use augsim_discovery::{Discovery, Options, discover};
use augsim_physics::model::{Model, PushModel};
use augsim_tests::characterisation::{Answer, Answers};
use augsim_tests::sealed::{Kind, Scene, Truth, Unlisted, seal};
use augsim_tests::sealed_push::{PushKind, PushTruth, seal_pushes};
use std::collections::BTreeMap;
use std::time::Instant;

/// Name of the measured data set, which is left out where its files are missing.
const MEASURED: &str = "measured-drops";

fn ball(name: &str, scene: Scene, truth: Truth) -> Discovery {
    let mut rng = random_stream(1, name, 0);
    let sealed = seal(&scene, Truth { declared_ratio: 1.0, ..truth }, &mut rng).expect("well formed");
    answer(&sealed.model, &sealed.data)
}

fn answer(model: &str, data: &Dataset) -> Discovery {
    let model = Model::parse(model, "model.toml").expect("a model");
    discover(&model, data, &Options::default(), &mut |_| {}).expect("an answer")
}

fn push(effect: Option<PushKind>) -> Discovery {
    let truth = PushTruth { effect, patches: false, c_m: 0.0355, contact_friction: 0.28, pushes: 8 };
    let set = seal_pushes(truth, 11).expect("well formed");
    answer_push(&set.model, &set.data)
}

fn answer_push(model: &str, data: &Dataset) -> Discovery {
    let model = PushModel::parse(model, "model.toml").expect("a model");
    discover(&model, data, &Options::default(), &mut |_| {}).expect("an answer")
}

/// Runs the discovery on pushes of two sessions that differ in `c_m`.
fn sessions() -> Discovery {
    let session = |name: &str, c_m: f64, seed: u64| {
        let truth = PushTruth { effect: None, patches: false, c_m, contact_friction: 0.28, pushes: 4 };
        let set = seal_pushes(truth, seed).expect("well formed");
        let grouped: Vec<Trajectory> = (set.data.trajectories().iter())
            .map(|t| {
                let renamed =
                    Trajectory::new(format!("{name} {}", t.id()), t.time_s().to_vec(), t.values().to_vec());
                renamed.and_then(|t| t.with_group(name)).expect("well formed")
            })
            .collect();
        (grouped, set.model)
    };
    let ((morning, model), (evening, _)) = (session("morning", 0.031, 21), session("evening", 0.038, 22));
    let names = ["pusher_x_m", "pusher_y_m", "x_m", "y_m", "theta_rad"];
    answer_push(&model, &Dataset::from_names(&names, [morning, evening].concat()).expect("well formed"))
}

/// Runs the discovery on the fixture; if `grouped`, two groups of trajectories have own restitutions.
fn fixture(grouped: bool) -> Discovery {
    let folder = workspace().join("fixtures/sealed");
    let data = read_csv(&folder.join("bounces.csv"), MissingCells::default()).expect("the fixture");
    let model = std::fs::read_to_string(folder.join("model.toml")).expect("the fixture");
    if !grouped {
        return answer(&model, &data);
    }
    let halves =
        data.trajectories().iter().enumerate().map(|(j, t)| t.clone().with_group(["even", "odd"][j % 2]));
    let halves = halves.collect::<Result<Vec<_>, _>>().expect("well formed");
    let data = Dataset::new(data.columns().to_vec(), halves).expect("well formed");
    answer(&model.replace("max = 1.0 }", "max = 1.0, per = \"group\" }"), &data)
}

fn measured_drops() -> Option<Discovery> {
    let folder = shared_data("desilva-ball-drops")?;
    let (_, convert) = CONVERTERS.iter().find(|(set, _)| *set == "desilva-ball-drops").expect("a converter");
    let converted = convert(&folder).expect("convertible");
    Some(answer(&converted.model_toml.expect("a model file"), &converted.data))
}

/// Name of a data set, and the function that runs the discovery on it; `None` if its files are missing.
type Set = (&'static str, fn(&str) -> Option<Discovery>);

const DROPS: Scene = Scene::DROPS;
const THROWS: Scene = Scene { plane: true, at_rest: false, ..DROPS };

fn truth(effects: &[Kind]) -> Truth {
    Truth { effects: effects.to_vec(), ..Truth::default() }
}

const SETS: [Set; 16] = [
    ("null-drops", |n| Some(ball(n, DROPS, truth(&[])))),
    ("null-throws-irregular", |n| Some(ball(n, Scene { irregular: true, ..THROWS }, truth(&[])))),
    ("magnus", |n| Some(ball(n, THROWS, truth(&[Kind::Magnus(0.004)])))),
    ("latency", |n| Some(ball(n, DROPS, truth(&[Kind::Latency(0.006)])))),
    ("scatter-by-impact", |n| Some(ball(n, DROPS, truth(&[Kind::ScatterImpact(0.02)])))),
    ("pair", |n| Some(ball(n, THROWS, truth(&[Kind::Grip(0.1), Kind::Drift(5e-5)])))),
    ("unlisted-lens", |n| Some(ball(n, DROPS, Truth { unlisted: Some(Unlisted::Lens(0.02)), ..truth(&[]) }))),
    ("coloured-noise", |n| Some(ball(n, THROWS, Truth { correlation: 0.5, ..truth(&[]) }))),
    ("outliers-scatter-by-trajectory", |n| {
        Some(ball(n, DROPS, Truth { outliers: 0.01, ..truth(&[Kind::ScatterTrajectory(0.03)]) }))
    }),
    ("fixture", |_| Some(fixture(false))),
    ("fixture-groups", |_| Some(fixture(true))),
    (MEASURED, |_| measured_drops()),
    ("push-null", |_| Some(push(None))),
    ("push-anisotropy", |_| Some(push(Some(PushKind::TableAnisotropy(1.25, 0.6))))),
    ("push-frames", |_| Some(push(Some(PushKind::FrameRegistration(0.006, -0.01))))),
    ("push-sessions", |_| Some(sessions())),
];

#[test]
fn answers_stay_as_they_are() {
    let file = workspace().join("tests/characterisation.json");
    let (mint, full) = (std::env::var("AUGSIM_MINT").ok(), std::env::var_os("AUGSIM_ANSWERS"));
    let mut found = BTreeMap::new();
    for (name, set) in SETS {
        let begun = Instant::now();
        let Some(d) = set(name) else { continue };
        eprintln!("{name}: {:.2} s, {:?}, {}", begun.elapsed().as_secs_f64(), d.work, d.sentence);
        found.insert(name.to_string(), Answer::from_discovery(&d));
        if let Some(folder) = &full {
            let text = serde_json::to_string_pretty(&d).expect("JSON");
            let folder = std::path::Path::new(folder);
            std::fs::create_dir_all(folder).expect("a folder");
            std::fs::write(folder.join(format!("{name}.json")), text).expect("a file");
        }
    }
    if let Some(reason) = mint {
        let text = serde_json::to_string_pretty(&Answers::keep(reason, found)).expect("JSON");
        return std::fs::write(&file, text + "\n").expect("a file");
    }
    let text = std::fs::read_to_string(&file).expect("the answers that were kept");
    let mut kept: Answers = serde_json::from_str(&text).expect("answers");
    if !found.contains_key(MEASURED) {
        kept.sets.remove(MEASURED);
    }
    let changed = kept.differences(&found);
    assert!(changed.is_empty(), "answers changed (AUGSIM_MINT=\"why\" keeps them)\n{}", changed.join("\n"));
}
