//! Contract: a model file of pushing is read completely or rejected with file, line and remedy; a written
//! file is read back unchanged; the key `scenario` selects the kind of model.

use augsim_physics::model::{ModelFile, PushModel};

const GOOD: &str = r#"scenario = "push"
object = "rect2"
[parameters]
c_m = { nominal = 0.036, min = 0.02, max = 0.06 }
contact_friction = 0.25
rod_radius_m = 0.00475
[sensor]
position_sd_m = 0.0003
angle_sd_rad = 0.0017
[[effect]]
kind = "table-anisotropy"
ratio = { nominal = 1.2, ci95 = [1.1, 1.3] }
angle_rad = 0.4
[[effect]]
kind = "friction-scatter"
sd_m = 0.001
"#;

fn parse_error(text: &str) -> String {
    PushModel::parse(text, "push.toml").expect_err("refused").to_string()
}

#[test]
fn a_written_model_is_read_back_unchanged() {
    let model = PushModel::parse(GOOD, "push.toml").expect("good");
    assert_eq!(PushModel::parse(&model.to_toml(), "push.toml").expect("good"), model);
    let (world, values) = model.world();
    assert_eq!(values.len(), world.parameter_count());
    assert_eq!(values, [0.036, 0.25, 0.00475, 0.15, 1.045, 1.2, 0.4]);
    assert!(!model.parameters[0].frozen && !model.parameters[1].frozen && model.parameters[2].frozen);
    let polygon = "scenario = \"push\"\npolygon_m = [[0.1, 0.1], [0.0, 0.1], [0.0, 0.0], [0.1, 0.0]]\n";
    let model = PushModel::parse(polygon, "push.toml").expect("good");
    // 0.382598 L for a square of side L, and the frame is moved to the centroid.
    assert!((model.parameters[0].nominal - 0.0382598).abs() < 1e-7);
    assert!((model.object.tracked_origin_m[0] + 0.05).abs() < 1e-15);
    assert_eq!(PushModel::parse(&model.to_toml(), "push.toml").expect("good"), model);
}

#[test]
fn unknown_and_invalid_entries_are_errors_with_line_and_remedy() {
    let text = parse_error("scenario = \"push\"\nobject = \"rekt1\"\n");
    assert!(text.starts_with("push.toml:2: `object` must be one of \"rect1\", \"rect2\""), "{text}");
    assert!(text.ends_with("give any other outline as polygon_m = [[x, y], …] in metres"), "{text}");
    assert_eq!(
        parse_error("scenario = \"push\"\n"),
        "push.toml:1: the model file lacks `object`; add `object = \"rect1\"`"
    );
    assert_eq!(
        parse_error("scenario = \"push\"\npolygon_m = [[0.0, 0.0], [0.1, 0.0], [0.2, 0.0]]\n"),
        "push.toml:2: `polygon_m` must be an outline of at least three different vertices, in metres, with a non-zero area"
    );
    assert_eq!(
        parse_error("scenario = \"push\"\npolygon_m = [[0.0, 0.0], 0.1]\n"),
        "push.toml:2: `polygon_m` must be a list of vertices [[x, y], …] in metres"
    );
    let text = parse_error("scenario = \"push\"\nobject = \"hex\"\n[parameters]\ncontact_fricton = 0.2\n");
    assert!(
        text.starts_with(
            "push.toml:4: unknown key `contact_fricton` in [parameters]; did you mean `contact_friction`?"
        ),
        "{text}"
    );
    assert_eq!(
        parse_error("scenario = \"push\"\nobject = \"hex\"\n[parameters]\nc_m = -0.1\n"),
        "push.toml:4: `c_m` = -0.1 is outside [0.001, 1]; change the value or widen min and max"
    );
    assert_eq!(
        parse_error("scenario = \"push\"\nobject = \"hex\"\n[[effect]]\nkind = \"exact-surfase\"\n"),
        "push.toml:4: unknown effect kind `exact-surfase`; did you mean `exact-surface`?"
    );
    let two = "scenario = \"push\"\nobject = \"hex\"\n[[effect]]\nkind = \"exact-surface\"\n[[effect]]\nkind = \"superelliptic-surface\"\n";
    assert!(parse_error(two).contains("describe the same thing"));
    assert_eq!(
        parse_error("scenario = \"push\"\nobject = \"hex\"\n[sensor]\nangle_sd_rad = 0.0\n"),
        "push.toml:4: `angle_sd_rad` must be a positive number"
    );
    assert_eq!(parse_error("scenario = \"ball\"\n"), "push.toml:1: `scenario` must be one of \"push\"");
}

#[test]
fn the_scenario_selects_the_kind_of_model() {
    assert!(matches!(ModelFile::parse(GOOD, "m.toml"), Ok(ModelFile::Push(_))));
    assert!(matches!(ModelFile::parse("scenario = \"ball\"\n", "m.toml"), Ok(ModelFile::Ball(_))));
    let text = ModelFile::parse("scenario = \"pull\"\n", "m.toml").expect_err("refused").to_string();
    assert_eq!(text, "m.toml:1: `scenario` must be one of \"ball\", \"push\"");
}
