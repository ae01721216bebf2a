//! Contract: the loop names a spring between ball and height where the independent generator has one.

use augsim_data::random_stream;
use augsim_discovery::{Options, discover};
use augsim_physics::model::Model;
use augsim_tests::sealed::{Scene, Truth, Unlisted, seal};

#[test]
fn a_tether_is_named() {
    let scene = Scene {
        plane: true,
        at_rest: false,
        trajectories: 30,
        rate_hz: 100.0,
        noise_m: 0.002,
        restitution: 0.75,
        irregular: false,
    };
    let truth = Truth { unlisted: Some(Unlisted::Tether(1.5)), declared_ratio: 1.0, ..Truth::default() };
    let sealed = seal(&scene, truth, &mut random_stream(1, "tether", 0)).expect("well formed");
    let model = Model::parse(&sealed.model, "sealed.toml").expect("a model");
    let found = discover(&model, &sealed.data, &Options::default(), &mut |_| {}).expect("an answer");
    let kinds: Vec<&str> = found.effects.iter().map(|e| e.kind.as_str()).collect();
    assert_eq!(kinds, ["height-spring"], "{}", found.sentence);
    let k = found.effects[0].parameters["k_per_s2"].value;
    assert!((k - 1.5).abs() < 0.1, "{}", found.sentence);
}
