//! Contract: on measured sets the loop finds a known effect and the error on held-out trajectories falls. The sets
//! came from others and are not part of this repository: where they are missing the test says so.

use augsim_data::convert::CONVERTERS;
use augsim_discovery::{Discovery, Options, Verdict, discover};
use augsim_physics::model::Model;
use std::path::PathBuf;

fn answer(name: &str) -> Option<Discovery> {
    let root = std::env::var_os("AUGSIM_DATA").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data")),
        PathBuf::from,
    );
    let folder = root.join(name);
    if !folder.exists() {
        let required = std::env::var_os("AUGSIM_REQUIRE_DATA").is_some_and(|v| v == "1");
        assert!(!required, "{} is missing", folder.display());
        let notice = format!("SKIPPED: {} is missing\n", folder.display());
        let _ = std::io::Write::write_all(&mut std::io::stderr(), notice.as_bytes());
        return None;
    }
    let (_, convert) = CONVERTERS.iter().find(|(set, _)| *set == name).expect("a converter");
    let converted = convert(&folder).expect("convertible");
    let model = Model::parse(converted.model_toml.as_deref().expect("a model file"), "model.toml")
        .expect("well formed");
    Some(discover(&model, &converted.data, &Options::default(), &mut |_| {}).expect("an answer"))
}

fn error_falls(d: &Discovery) {
    assert_ne!(d.verdict, Verdict::NothingToAdd, "{}", d.sentence);
    let (before, after) = (d.error.calibrated.rmse, d.error.augmented.rmse);
    assert!(after < 0.95 * before, "{}\n{:?}", d.sentence, d.error);
}

#[test]
fn drops_from_a_bridge_show_drag() {
    if let Some(d) = answer("desilva-ball-drops") {
        error_falls(&d);
        assert!(d.effects.iter().any(|e| e.kind.ends_with("-drag")), "{}", d.sentence);
    }
}

#[test]
fn marbles_on_paper_show_restitution_that_falls_with_speed() {
    if let Some(d) = answer("paper-stack-bounces") {
        error_falls(&d);
        assert!(d.effects.iter().any(|e| e.kind.starts_with("restitution-speed")), "{}", d.sentence);
    }
}
