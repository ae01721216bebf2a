//! Contract: correct data pass every check for suspicious data, with the expectations of their model. The
//! data are generated sets of all kinds (strong effects and unusual noise are not suspicious), pushes of the
//! virtual laboratory and of the independent generator, drops of the paper's distribution, and every measured
//! set. Where measured sets are missing the test says so.

use crate::shared_data::{shared_data, workspace};
use augsim_data::checks::{ExpectedData, run_checks};
use augsim_data::convert::CONVERTERS;
use augsim_data::{Dataset, MissingCells, random_stream, read_dataset};
use augsim_physics::ball::drop_distribution::DropDistribution;
use augsim_physics::model::{Model, ModelFile, PushModel};
use augsim_tests::sealed::{draw, seal};
use augsim_tests::sealed_push::{draw_push, seal_pushes};

fn passes(data: &Dataset, expected: &ExpectedData, name: &str) {
    let found: Vec<String> =
        run_checks(data, expected).into_iter().flat_map(|o| o.findings).map(|f| f.to_string()).collect();
    assert!(found.is_empty(), "{name}: {found:#?}");
}

#[test]
fn sealed_throws_pass() {
    // No effect, one, two, a law outside the library, unusual noise: 40 sets of each.
    for (family, effects, noisy) in [
        ("null", Some(0), false),
        ("single", Some(1), false),
        ("pair", Some(2), false),
        ("unlisted", None, false),
        ("noise", Some(0), true),
    ] {
        for seed in 0..40 {
            let mut rng = random_stream(seed, &format!("suspicious {family}"), 0);
            let (scene, truth) = draw(&mut rng, effects, noisy);
            let sealed = seal(&scene, truth, &mut rng).expect("a set");
            let expected = Model::parse(&sealed.model, "sealed.toml").expect("a model").expected();
            passes(&sealed.data, &expected, &format!("{family} {seed}"));
        }
    }
}

#[test]
fn sealed_pushes_and_drops_of_the_papers_law_pass() {
    for seed in 0..6 {
        let mut rng = random_stream(seed, "suspicious pushes", 0);
        let sealed = seal_pushes(draw_push(&mut rng, Some(seed as usize), 20), seed).expect("a set");
        let expected = PushModel::parse(&sealed.model, "sealed.toml").expect("a model").expected();
        passes(&sealed.data, &expected, &format!("pushes {seed}"));
    }
    let (drops, _) = DropDistribution::default().generate(60, 5).expect("drops");
    passes(&drops, &ExpectedData { gravity_m_s2: Some(9.8), ..ExpectedData::default() }, "drops");
}

#[test]
fn measured_sets_pass() {
    for (set, folder) in [
        ("desilva-ball-drops", "desilva-ball-drops"),
        ("paper-stack-bounces", "paper-stack-bounces"),
        ("spindoe-table-tennis", "spindoe-table-tennis"),
        ("mit-pusher-slider", "mit-pusher-slider-runs"),
        ("mit-push", "mit-pnpush-pushes/preliminary"),
    ] {
        let Some(folder) = shared_data(folder) else { continue };
        let (_, convert) = CONVERTERS.iter().find(|(name, _)| *name == set).expect("a converter");
        let converted = convert(&folder).expect("convertible");
        let model = converted.model_toml.map(|text| ModelFile::parse(&text, "model.toml").expect("a model"));
        passes(&converted.data, &model.map_or_else(ExpectedData::default, |m| m.expected()), set);
    }
    if let Some(folder) = shared_data("pybullet-ball") {
        let test = read_dataset(&folder.join("test.csv.gz"), MissingCells::Refuse).expect("a set");
        passes(&test, &ExpectedData { gravity_m_s2: Some(9.8), ..ExpectedData::default() }, "pybullet-ball");
    }
    let sealed = workspace().join("fixtures/sealed");
    let bounces = read_dataset(&sealed.join("bounces.csv"), MissingCells::Refuse).expect("a fixture");
    passes(
        &bounces,
        &ModelFile::read(&sealed.join("model.toml")).expect("a model").expected(),
        "fixtures/sealed",
    );
}
