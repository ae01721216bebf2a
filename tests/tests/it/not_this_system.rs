//! Contract (issue 16): data of another system than the declared one are answered without a named effect,
//! whichever parameters are free. The height of the floor changes nothing in the answer but the estimated
//! floor height.

use augsim_data::{Dataset, random_stream};
use augsim_discovery::{Discovery, Options, Verdict, discover};
use augsim_physics::model::Model;
use augsim_tests::sealed::{Kind, Scene, Truth, seal};
use augsim_tests::unmodelled_systems::{changed, pendulum, spring, tossed_cubes, tumbling_squares};

fn model(gravity: &str) -> Model {
    let text = format!(
        "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = {{ nominal = 9.81{gravity} }}\n\
         restitution = {{ nominal = 0.65, min = 0.0, max = 1.0 }}\n[release]\nkind = \"free\"\n"
    );
    Model::parse(&text, "ball.toml").expect("a model")
}

/// Runs the discovery; returns its answer, or the message with which it rejects the data.
fn answer(model: &Model, data: &Dataset) -> Result<Discovery, String> {
    discover(model, data, &Options::default(), &mut |_| {}).map_err(|e| e.to_string())
}

fn throws() -> Dataset {
    let scene = Scene { plane: true, at_rest: false, trajectories: 16, rate_hz: 60.0, ..Scene::DROPS };
    let truth = Truth { effects: vec![Kind::QuadraticDrag(0.06)], declared_ratio: 1.0, ..Truth::default() };
    seal(&scene, truth, &mut random_stream(16, "own recordings", 0)).expect("well formed").data
}

/// Asserts that the discovery names no effect, and that its sentence or message contains `says`.
fn refused(model: &Model, data: &Dataset, says: &str) {
    match answer(model, data) {
        Ok(d) => {
            assert!(d.effects.is_empty(), "{}", d.sentence);
            assert_eq!(d.verdict, Verdict::NotThisSystem, "{}", d.sentence);
            assert!(d.sentence.contains(says), "{}", d.sentence);
        }
        Err(e) => assert!(e.contains(says), "{e}"),
    }
}

#[test]
fn tumbling_squares_are_no_balls() {
    for seed in (1..5).chain(201..207) {
        refused(
            &model(", frozen = true"),
            &tumbling_squares(seed).expect("data"),
            "does not bounce as a ball",
        );
    }
}

#[test]
fn tossed_cubes_are_no_balls() {
    for seed in (1..5).chain(201..207) {
        refused(&model(", frozen = true"), &tossed_cubes(seed).expect("data"), "does not bounce as a ball");
    }
}

#[test]
fn a_pendulum_is_no_ball() {
    for gravity in ["", ", frozen = true"] {
        refused(&model(gravity), &pendulum(1).expect("data"), "");
    }
}

#[test]
fn a_spring_is_no_ball() {
    for gravity in ["", ", frozen = true"] {
        refused(&model(gravity), &spring(1).expect("data"), "");
    }
}

#[test]
fn centimetres_called_metres_are_told_from_an_effect() {
    let centimetres = changed(&throws(), |column, v| if column.ends_with("_m") { 100.0 * v } else { v });
    refused(&model(""), &centimetres.expect("data"), "");
    // Beyond what the checks of the data refuse: a scale that is wrong by a factor of two.
    let doubled = changed(&throws(), |column, v| if column.ends_with("_m") { 2.0 * v } else { v });
    refused(&model(""), &doubled.expect("data"), "gravity fits");
}

#[test]
fn the_answer_does_not_depend_on_the_height_of_the_floor() {
    let data = throws();
    let clean = answer(&model(", frozen = true"), &data).expect("an answer");
    let drag = |d: &Discovery| {
        d.effects.iter().find(|e| e.kind == "quadratic-drag").map(|e| e.parameters["k_per_m"].clone())
    };
    let k = drag(&clean).expect(&clean.sentence);
    assert_eq!(clean.effects.len(), 1, "{}", clean.sentence);
    assert!(k.ci95[0] <= 0.06 && 0.06 <= k.ci95[1], "{k}");
    for floor_m in [0.3, 0.6, 1.0, 5.0] {
        let raised = changed(&data, |column, v| if column == "z_m" { v + floor_m } else { v });
        let d = answer(&model(", frozen = true"), &raised.expect("data")).expect("an answer");
        let found = drag(&d).unwrap_or_else(|| panic!("{floor_m}: {}", d.sentence));
        assert_eq!(d.effects.len(), 1, "{floor_m}: {}", d.sentence);
        assert!((found.value - k.value).abs() < 0.5 * (k.ci95[1] - k.ci95[0]), "{floor_m}: {found} and {k}");
        let floor = &d.parameters["floor_height_m"];
        assert!((floor.value - floor_m).abs() < 0.003, "{floor_m}: {floor}");
        assert!((d.error.augmented.rmse / clean.error.augmented.rmse - 1.0).abs() < 0.1, "{floor_m}");
        // The model that was found reads back with its floor, and lacks nothing.
        let again = Model::parse(&d.model_toml, "found.toml").expect("a model");
        assert!(again.declared.iter().any(|p| p == "floor_height_m"), "{}", d.model_toml);
    }
}

#[test]
fn one_throw_alone_is_cut_in_two_and_says_so() {
    let d = answer(&model(", frozen = true"), &throws().select(&[0])).expect("an answer");
    assert!(d.notes.iter().any(|n| n.contains("there is only one trajectory")), "{:?}", d.notes);
}

#[test]
fn heights_that_count_downwards_are_no_findings() {
    let down = changed(&throws(), |column, v| if column == "z_m" { -v } else { v }).expect("data");
    for gravity in ["", ", frozen = true"] {
        refused(&model(gravity), &down, "");
    }
}

#[test]
fn a_parameter_at_its_bound_is_named_and_no_effect_is() {
    // The throws rebound with 0.75 of their speed.
    let text = "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\n\
        restitution = { nominal = 0.5, min = 0.3, max = 0.6 }\n[release]\nkind = \"free\"\n";
    refused(
        &Model::parse(text, "ball.toml").expect("a model"),
        &throws(),
        "the fitted value of `restitution` is at its bound 0.6",
    );
}
