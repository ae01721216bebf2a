//! Model files are parsed or refused with file, line and remedy; a written file parses to the same model.

use augsim_physics::model::{Model, ModelFile, Release};
use augsim_system::Per;

const GOOD: &str = r#"scenario = "ball"
[parameters]
gravity_m_s2 = { nominal = 9.81, frozen = true }
restitution  = { nominal = 0.65, min = 0.0, max = 1.0 }
[sensor]
position_sd_m = 0.002
clock_reference_s = 612.5
[release]
kind = "rest"
[[effect]]
kind = "quadratic-drag"
k_per_m = { nominal = 0.0132, ci95 = [0.0127, 0.0138], per = "group", groups = { "golf ball" = 0.01 } }
[[effect]]
kind = "restitution-scatter"
per = "trajectory"
sd = 0.1
[[effect]]
kind = "table"
target = "restitution"
against = "impact-speed"
first = 0.5
last = 5.0
values = [0.0, -0.01, -0.03]
"#;

fn refusal(text: &str) -> String {
    Model::parse(text, "ball.toml").expect_err("refused").to_string()
}

#[test]
fn a_written_model_parses_to_the_same_model() {
    let model = Model::parse(GOOD, "ball.toml").expect("good");
    assert_eq!(model.release, Release::Rest);
    assert_eq!(model.effects[0].parameters[0].per, Per::Group);
    assert_eq!(Model::parse(&model.to_toml(), "ball.toml").expect("good"), model);
}

#[test]
fn group_names_with_any_characters_survive_writing() {
    // Non-breaking spaces, quotes, backslashes, dots, non-Latin letters, the empty string.
    for name in ["golf\u{a0}ball", "5\" steel", "a\\b", "a.b", "Kugel \u{fc}", "\u{1f3c0}", ""] {
        let mut model = Model::parse(GOOD, "ball.toml").expect("good");
        model.effects[0].parameters[0].groups = vec![(name.into(), 1.5e-9)];
        assert_eq!(Model::parse(&model.to_toml(), "ball.toml").expect(name), model);
    }
}

#[test]
fn group_values_without_per_group_are_refused() {
    let text =
        refusal("scenario = \"ball\"\n[parameters]\nrestitution = { nominal = 0.6, groups = { a = 0.5 } }\n");
    assert!(
        text.contains("ball.toml:3: `groups` must be removed, or combined with per = \"group\""),
        "{text}"
    );
}

#[test]
fn tables_without_values_or_with_an_empty_range_are_refused() {
    let table = |first: f64, last: f64, values: &str| {
        refusal(&format!(
            "scenario = \"ball\"\n[[effect]]\nkind = \"table\"\ntarget = \"restitution\"\nagainst = \"impact-speed\"\n\
             first = {first:?}\nlast = {last:?}\nvalues = {values}\n"
        ))
    };
    let text = table(0.5, 5.0, "[]");
    assert!(text.contains("ball.toml:8: `values` must be a list of one number or more"), "{text}");
    let text = table(5.0, 0.5, "[0.0, 0.1]");
    assert!(text.contains("ball.toml:7: `last` must be above `first`"), "{text}");
}

#[test]
fn unknown_keys_and_kinds_are_refused_with_line_and_suggestion() {
    assert_eq!(
        refusal("scenario = \"ball\"\n[[effect]]\nkind = \"quadratic-darg\"\n"),
        "ball.toml:3: unknown effect kind `quadratic-darg`; did you mean `quadratic-drag`?"
    );
    let text = refusal("scenario = \"ball\"\n[parameters]\n\nrestitutoin = 0.5\n");
    assert!(
        text.starts_with(
            "ball.toml:4: unknown key `restitutoin` in [parameters]; did you mean `restitution`?"
        ),
        "{text}"
    );
    let text = refusal("scenario = \"ball\"\n[[effect]]\nkind = \"wind\"\nk_per_m = 1.0\n");
    assert!(text.contains("ball.toml:4: unknown key `k_per_m` in [[effect]] `wind`"), "{text}");
}

#[test]
fn values_out_of_bounds_are_refused() {
    assert_eq!(
        refusal("scenario = \"ball\"\n[parameters]\nrestitution = 1.2\n"),
        "ball.toml:3: `restitution` = 1.2 is outside [0, 1]; change the value or widen min and max"
    );
}

#[test]
fn wrong_types_missing_keys_and_conflicts_are_refused() {
    assert_eq!(
        refusal("scenario = \"ball\"\n[parameters]\nrestitution = \"high\"\n"),
        "ball.toml:3: `restitution` must be a number"
    );
    assert!(refusal("[parameters]\n").contains("lacks `scenario`; add `scenario = \"ball\"`"));
    assert!(refusal("scenario = \"ball\"\n[[effect]]\nper = 1\n").contains("[[effect]] lacks `kind`"));
    assert!(refusal("scenario = \n").starts_with("ball.toml:1: not valid TOML"));
    let two = "scenario = \"ball\"\n[[effect]]\nkind = \"restitution-speed-linear\"\n[[effect]]\nkind = \"restitution-speed-power\"\n";
    assert!(refusal(two).contains("describe the same thing"));
}

#[test]
fn a_missing_file_is_named() {
    let text = Model::read(std::path::Path::new("nowhere/ball.toml")).expect_err("refused").to_string();
    assert!(text.starts_with("nowhere/ball.toml: there is no such file or folder; check the path"), "{text}");
}

#[test]
fn of_group_selects_the_value_of_that_group() {
    let model = ModelFile::parse(GOOD, "ball.toml").expect("good");
    let drag = |group: &str| {
        let of_group = model.clone().of_group(group);
        of_group.parameters().find(|p| p.name == "k_per_m").map(|p| (p.nominal, p.per))
    };
    assert_eq!(drag("golf ball"), Some((0.01, Per::All)));
    assert_eq!(drag("baseball"), Some((0.0132, Per::Group)));
}
