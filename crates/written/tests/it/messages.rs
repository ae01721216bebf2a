//! Contract: every mistake in a model file is answered by one sentence with file, line, table and key, the
//! text with a caret below the mistake, and the remedy. The scene is the pendulum's file with one line
//! changed, since that is what people do; the texts are exact, because a message that drifts is a message
//! that nobody has read.

use augsim_written::{System, example, model};

/// The error of the pendulum's file with `old` replaced by `new`.
fn with(old: &str, new: &str) -> String {
    changed("pendulum", &[(old, new)])
}

fn changed(name: &str, changes: &[(&str, &str)]) -> String {
    let mut text = example(name).expect("an example of that name").to_owned();
    for (old, new) in changes {
        assert!(text.contains(old), "the example no longer has `{old}`");
        text = text.replacen(old, new, 1);
    }
    let file = format!("{name}.toml");
    match model::parse(&text, &file) {
        Err(error) => error.to_string(),
        Ok(model) => System::compile(&model, &[]).expect_err("a mistake was expected").to_string(),
    }
}

const RATE: &str = "\"-gravity_m_s2 / length_m * sin(theta_rad) - damping_per_s * omega_rad_s\"";

fn rate(text: &str) -> String {
    with(RATE, &format!("\"{text}\""))
}

#[test]
fn an_unknown_name_is_marked_and_the_nearest_is_offered() {
    assert_eq!(
        rate("-gravity_m_s2 / lenght_m * sin(theta_rad)"),
        "pendulum.toml:22: rates.omega_rad_s: unknown name `lenght_m`; did you mean `length_m`?\n\
         \x20   -gravity_m_s2 / lenght_m * sin(theta_rad)\n\
         \x20                   ^^^^^^^^"
    );
    assert!(rate("zebra_m * theta_rad").contains("unknown name `zebra_m`\n"));
    assert!(rate("sen(theta_rad)").contains("unknown function `sen`; did you mean `sin`?"));
    assert!(rate("angle_rad / t").contains("`angle_rad` cannot be used here: an output is what is measured"));
}

#[test]
fn a_missing_bracket_is_reported_where_it_opens() {
    assert_eq!(
        rate("-gravity_m_s2 / length_m * sin(theta_rad"),
        "pendulum.toml:22: rates.omega_rad_s: `)` missing for the `(` at column 31\n\
         \x20   -gravity_m_s2 / length_m * sin(theta_rad\n\
         \x20                                 ^"
    );
    assert!(rate("theta_rad)").contains("`)` without a `(` before it"));
}

#[test]
fn units_that_do_not_match_are_named() {
    assert!(rate("gravity_m_s2 + omega_rad_s").starts_with(
        "pendulum.toml:22: rates.omega_rad_s: adds m/s^2 and rad/s: `gravity_m_s2` + `omega_rad_s`"
    ));
    let message = rate("omega_rad_s");
    assert!(message.contains("is in 1/s, but the rate of `omega_rad_s` must be in 1/s^2"), "{message}");
    let message = with("damping_per_s = {", "damping_per_s = { unit = \"furlong\",");
    assert!(
        message.contains("parameters.damping_per_s.unit: \"furlong\" is no unit that is known"),
        "{message}"
    );
}

#[test]
fn a_state_without_a_rate_and_a_rate_without_a_state_are_refused() {
    assert_eq!(
        with("omega_rad_s = \"-gravity", "omega_rad = \"-gravity"),
        "pendulum.toml:22: rates.omega_rad: no state is called `omega_rad`; declare it under [states]; did you mean \
         `omega_rad_s`?"
    );
    let text = example("pendulum").expect("the example").replace(&format!("omega_rad_s = {RATE}"), "");
    let error = model::parse(&text, "pendulum.toml").expect_err("a state without rate").to_string();
    assert_eq!(error, "pendulum.toml:13: states: `omega_rad_s` has no rate; add it under [rates]");
}

#[test]
fn a_value_that_is_defined_later_must_move_up() {
    let message = changed(
        "cart-pole",
        &[
            ("F_N = \"gain", "half_N = \"F_N / 2\"\nF_N = \"gain"),
            ("x_m = \"v_m_s\"", "x_m = \"v_m_s + 0 * half_N\""),
        ],
    );
    assert!(
        message.starts_with(
            "cart-pole.toml:26: let.half_N: names `F_N`, which is defined later in [let]; move it up"
        ),
        "{message}"
    );
}

#[test]
fn a_rate_above_the_let_that_it_names_is_told_to_move_it() {
    let changes = [
        ("theta_rad = \"omega_rad_s\"", "theta_rad = \"F_N\""),
        ("[outputs] #", "[let]\nF_N = \"omega_rad_s\"\n[outputs] #"),
    ];
    assert!(changed("pendulum", &changes).starts_with(
        "pendulum.toml:21: rates.theta_rad: names `F_N`, which is defined later in [let]; move it up"
    ));
    assert!(changed("cart-pole", &[("F_N = \"gain", "F_N = \"F_N + gain")]).contains("names itself"));
}

#[test]
fn functions_say_what_they_take() {
    assert!(rate("sqrt(theta_rad, 2)").contains("`sqrt` takes 1 argument, 2 given"));
    assert!(rate("atan2(theta_rad)").contains("`atan2` takes 2 arguments, 1 given"));
    assert!(rate("if(theta_rad < 0, 1)").contains("`if` takes 3 arguments, 2 given"));
    assert!(rate("if(theta_rad, 1, 2)").contains("must be a comparison, as in if(a < b, x, y)"));
    assert!(rate("sin(theta_rad < 1)").contains("a comparison may stand only as the first argument of `if`"));
    assert!(rate("theta_rad < 1").contains("a comparison may stand only as the first argument of `if`"));
    assert!(rate("sin * 2").contains("`sin` is a function and needs its arguments; write `sin(…)`"));
    assert!(rate("theta_rad(2)").contains("`theta_rad` is not a function; write `*` for a product"));
    assert!(
        rate("table(curve, theta_rad)")
            .contains("unknown table `curve`; tables are declared as [tables.NAME]")
    );
    assert!(
        rate("table(3, theta_rad)").contains("the first argument of `table` must be the name of a table")
    );
    assert!(rate("slope(angle_rad)").contains("`slope` may be used only in `start`"));
}

#[test]
fn what_is_no_expression_is_marked() {
    assert!(rate("").contains("is empty; write an expression"));
    assert!(
        rate("2 theta_rad").contains("an operator is missing before `theta_rad`; write `*` for a product")
    );
    assert!(rate("2 * ").contains("a number, a name or `(` must stand where the end is"));
    assert!(rate("2 * * 3").contains("a number, a name or `(` must stand where `*` is"));
    assert!(rate("2 $ 3").contains("`$` has no meaning in an expression"));
    assert!(rate("1.2.3").contains("`1.2.3` is not a number"));
    assert!(rate("3m").contains("`3m` is not a number"));
    assert!(rate("1e999").contains("`1e999` is not a number"));
    assert!(rate(&"(".repeat(100)).contains("is nested deeper than 64; name parts of it in [let]"));
    assert!(rate(&"1+".repeat(2100)).contains("has 4200 bytes, 4096 are allowed"));
}

#[test]
fn an_output_that_shows_nothing_is_refused() {
    assert_eq!(
        with("value = \"theta_rad\"", "value = \"length_m\""),
        "pendulum.toml:25: outputs.angle_rad: never changes with the state: nothing can be fitted from it; use a state \
         in its value"
    );
}

#[test]
fn parameters_must_lie_within_their_bounds_and_be_used() {
    assert_eq!(
        with("nominal = 0.153", "nominal = 3.0"),
        "pendulum.toml:17: parameters.length_m: nominal 3.0 is outside [0.05, 1.0]; change it or widen min and max"
    );
    assert!(with("min = 0.05", "min = 1.0").contains("min 1.0 is not below max 1.0; exchange them"));
    assert_eq!(
        with("length_m = {", "mass_kg = { nominal = 1.0 }\nlength_m = {"),
        "pendulum.toml:17: parameters.mass_kg: used nowhere; remove it or set frozen = true"
    );
    assert!(
        with("nominal = 0.153, ", "").contains("parameters.length_m: lacks `nominal`; add nominal = 1.0")
    );
    assert!(
        with("nominal = 0.153", "nominal = nan")
            .contains("parameters.length_m.nominal: must be a finite number")
    );
}

#[test]
fn an_event_that_would_fire_for_ever_is_refused() {
    let message = changed(
        "mass-spring-stop",
        &[
            ("{ v_m_s = \"-restitution * v_m_s\" }", "{ x_m = \"stop_m\" }"),
            ("restitution = {", "restitution = { frozen = true,"),
        ],
    );
    assert_eq!(
        message,
        "mass-spring-stop.toml:33: events.stop: sets `x_m` but `when` still holds there: it would fire for ever; set a \
         state that moves `when` away from 0"
    );
}

#[test]
fn keys_and_names_are_known_or_refused() {
    assert!(
        with("frozen = true", "frosen = true")
            .contains("parameters.gravity_m_s2: unknown key `frosen`; did you mean `frozen`?")
    );
    assert!(
        with("[rates]", "[rate]").contains("pendulum.toml:20: unknown key `rate`; did you mean `rates`?")
    );
    assert!(with("length_m = {", "sin = {").contains("`sin` has a meaning of its own; choose another name"));
    assert!(with("length_m = {", "theta_rad = {").contains("`theta_rad` is already the name of a state"));
    assert!(with("length_m = {", "\"le n\" = {").contains("`le n` is no name; use letters, digits and `_`"));
    assert!(with("scenario = \"system\"", "").contains("lacks `scenario`; add scenario = \"system\""));
    assert!(with("scenario = \"system\"", "scenario = \"balls\"").contains("scenario: must be \"system\""));
    assert!(
        with("sd = \"estimate\"", "sd = -1.0").contains("outputs.angle_rad.sd: must be positive, -1.0 given")
    );
    let shaken = |text: &str| {
        with("start = \"slope(angle_rad)\"", &format!("start = \"slope(angle_rad)\", shaken = {text}"))
    };
    assert!(
        shaken("{ sd = 0.1, memory_s = -1.0 }")
            .contains("states.omega_rad_s.shaken.memory_s: must be 0 or more, -1.0 given")
    );
    assert!(
        shaken("{ sd = 0.1 }").contains(
            "states.omega_rad_s.shaken: lacks `memory_s`; add shaken = { sd = 0.1, memory_s = 0.02 }"
        )
    );
    assert!(
        shaken("0.1")
            .contains("states.omega_rad_s.shaken: must be a table such as { sd = 0.1, memory_s = 0.02 }")
    );
    assert!(
        with("sd = \"estimate\"", "sd = \"guess\"")
            .contains("outputs.angle_rad.sd: must be \"estimate\" or a positive number")
    );
    assert!(with("[states]", "[states").contains("not valid TOML"));
    assert!(
        with("name = \"pendulum\"", "constraints = \"x = 0\"")
            .contains("constraints: equations with constraints")
    );
    assert!(
        with("start = \"angle_rad\"", "start = \"theta_rad\"").contains("a start is guessed from outputs")
    );
    assert!(
        changed("servo", &[("sign_width = { speed_rad_s", "sign_width = { angle_rad")])
            .contains("`angle_rad` stands in no sign, step or if")
    );
    assert!(
        changed("mass-spring-stop", &[("hold = [\"x_m\"]", "hold = [\"y_m\"]")])
            .contains("no state is called `y_m`")
    );
    assert!(
        changed("mass-spring-stop", &[("hold = \"zero\"", "hold = \"cubic\"")])
            .contains("force_N.hold: must be \"zero\", \"linear\" or \"spline\"")
    );
    let table = "[tables.curve]\nat = [0.0, 0.0]\nvalues = [1.0, 2.0]\n[outputs] #";
    assert!(with("[outputs] #", table).contains("tables.curve: knots must rise: 0.0 follows 0.0; sort `at`"));
    let table = "[tables.curve]\nat = [0.0, 1.0]\nvalues = [1.0]\n[outputs] #";
    assert!(with("[outputs] #", table).contains("tables.curve: has 2 knots and 1 values"));
}

#[test]
fn nothing_that_disturbs_a_terminal_is_repeated() {
    let message = rate("theta_rad + \\u001b[31m");
    assert!(!message.contains('\u{1b}'), "{message:?}");
    assert!(message.contains("`\\u{1b}` has no meaning in an expression"), "{message}");
    let long = rate(&format!("{} + nonsense", "theta_rad + ".repeat(200)));
    assert!(long.len() < 400, "{} characters", long.len());
}

#[test]
fn the_five_examples_read_and_compile() {
    for (name, text) in augsim_written::EXAMPLES {
        let model = model::parse(text, name).unwrap_or_else(|e| panic!("{e}"));
        let active: Vec<usize> =
            (0..model.parameters.len()).filter(|p| !model.parameters[*p].frozen).collect();
        System::compile(&model, &active).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn whole_numbers_are_those_of_toml() {
    assert!(with("nominal = 0.153", "nominal = 99999999999999999999").contains("must be a finite number"));
    let text = example("pendulum").expect("an example").replace("max = 10.0", "max = 0x10");
    assert_eq!(model::parse(&text, "pendulum.toml").expect("a model").parameters[2].max, 16.0);
}
