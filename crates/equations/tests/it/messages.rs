//! Contract: every error in a model file gives file, line, table and key, marks the place in the expression,
//! and says what to do.
//!
//! Each case is the file of an example with one line changed. The texts are compared exactly, so that no
//! change of a message goes unnoticed.

use augsim_equations::{System, example, model};

/// Error message of the pendulum's model file with `old` replaced by `new`.
fn with(old: &str, new: &str) -> String {
    changed("pendulum", &[(old, new)])
}

/// Error message of an example's model file after these replacements.
fn changed(name: &str, changes: &[(&str, &str)]) -> String {
    let mut text = example(name).expect("an example of that name").to_owned();
    for (old, new) in changes {
        assert!(text.contains(old), "the example no longer has `{old}`");
        text = text.replacen(old, new, 1);
    }
    let file = format!("{name}.toml");
    match model::parse(&text, &file) {
        Err(error) => error.to_string(),
        Ok(model) => System::compile(&model, &[]).expect_err("an error is expected").to_string(),
    }
}

const RATE: &str = "\"-gravity_m_s2 / length_m * sin(theta_rad) - damping_per_s * omega_rad_s\"";

fn rate(text: &str) -> String {
    with(RATE, &format!("\"{text}\""))
}

#[test]
fn an_unknown_name_is_marked_and_the_nearest_is_proposed() {
    assert_eq!(
        rate("-gravity_m_s2 / lenght_m * sin(theta_rad)"),
        "pendulum.toml:22: rates.omega_rad_s: unknown name `lenght_m`; did you mean `length_m`?\n\
         \x20   -gravity_m_s2 / lenght_m * sin(theta_rad)\n\
         \x20                   ^^^^^^^^"
    );
    assert!(rate("zebra_m * theta_rad").contains("unknown name `zebra_m`\n"));
    assert!(rate("sen(theta_rad)").contains("unknown function `sen`; did you mean `sin`?"));
    // Functions are proposed by their meaning, and by their letters only where these are close.
    for (text, proposed) in [
        ("log(length_m)", "unknown function `log`; write `ln(x)`"),
        ("log10(length_m)", "unknown function `log10`; write `ln(x) / ln(10)`"),
        ("pow(length_m, 2)", "unknown function `pow`; write `x^y`"),
        ("arctan(length_m)", "unknown function `arctan`; write `atan(x)`"),
        ("fabs(length_m)", "unknown function `fabs`; write `abs(x)`"),
        ("e^length_m", "`e` cannot be used here: write exp(1)"),
        ("erf(length_m)", "unknown function `erf`\n"),
        ("gamma(length_m)", "unknown function `gamma`\n"),
    ] {
        assert!(rate(text).contains(proposed), "{}", rate(text));
    }
    assert!(
        rate("angle_rad / t").contains("`angle_rad` cannot be used here: an output is a measured quantity")
    );
}

#[test]
fn a_missing_bracket_is_reported_where_it_opens() {
    assert_eq!(
        rate("-gravity_m_s2 / length_m * sin(theta_rad"),
        "pendulum.toml:22: rates.omega_rad_s: the `(` at column 31 is never closed; add the missing `)`\n\
         \x20   -gravity_m_s2 / length_m * sin(theta_rad\n\
         \x20                                 ^"
    );
    assert!(rate("theta_rad)").contains("this `)` has no matching `(`"));
}

#[test]
fn units_that_do_not_match_are_named() {
    assert!(rate("gravity_m_s2 + omega_rad_s").starts_with(
        "pendulum.toml:22: rates.omega_rad_s: cannot add quantities with the units m/s^2 and rad/s: \
         `gravity_m_s2` + `omega_rad_s`; make the units agree"
    ));
    let message = rate("omega_rad_s");
    assert!(
        message.contains(
            "the expression has the unit 1/s, but the rate of `omega_rad_s` must have the unit 1/s^2"
        ),
        "{message}"
    );
    let message = with("damping_per_s = {", "damping_per_s = { unit = \"furlong\",");
    assert!(message.contains("parameters.damping_per_s.unit: \"furlong\" is not a known unit"), "{message}");
}

#[test]
fn a_state_without_a_rate_and_a_rate_without_a_state_are_refused() {
    assert_eq!(
        with("omega_rad_s = \"-gravity", "omega_rad = \"-gravity"),
        "pendulum.toml:22: rates.omega_rad: no state is called `omega_rad`; did you mean \
         `omega_rad_s`? (states are declared under [states])"
    );
    let text = example("pendulum").expect("the example").replace(&format!("omega_rad_s = {RATE}"), "");
    let error = model::parse(&text, "pendulum.toml").expect_err("a state without rate").to_string();
    assert_eq!(
        error,
        "pendulum.toml:13: states: the state `omega_rad_s` has no rate; add its rate under [rates]"
    );
}

#[test]
fn a_value_that_is_defined_later_must_be_moved_up() {
    let message = changed(
        "cart-pole",
        &[
            ("F_N = \"gain", "half_N = \"F_N / 2\"\nF_N = \"gain"),
            ("x_m = \"v_m_s\"", "x_m = \"v_m_s + 0 * half_N\""),
        ],
    );
    assert!(
        message.starts_with(
            "cart-pole.toml:26: let.half_N: uses `F_N`, which is defined later in [let]; move its definition up"
        ),
        "{message}"
    );
}

#[test]
fn a_let_below_the_rate_that_uses_it_must_be_moved_up() {
    let changes = [
        ("theta_rad = \"omega_rad_s\"", "theta_rad = \"F_N\""),
        ("[outputs] #", "[let]\nF_N = \"omega_rad_s\"\n[outputs] #"),
    ];
    assert!(changed("pendulum", &changes).starts_with(
        "pendulum.toml:21: rates.theta_rad: uses `F_N`, which is defined later in [let]; move its definition up"
    ));
    assert!(changed("cart-pole", &[("F_N = \"gain", "F_N = \"F_N + gain")]).contains("uses itself"));
}

#[test]
fn wrong_arguments_of_functions_are_explained() {
    assert!(rate("sqrt(theta_rad, 2)").contains("`sqrt` takes 1 argument, but 2 are given"));
    assert!(rate("atan2(theta_rad)").contains("`atan2` takes 2 arguments, but 1 is given"));
    assert!(rate("if(theta_rad < 0, 1)").contains("`if` takes 3 arguments, but 2 are given"));
    assert!(
        rate("if(theta_rad, 1, 2)")
            .contains("a condition must be a comparison such as a < b, as in if(a < b, x, y)")
    );
    assert!(
        rate("sin(theta_rad < 1)").contains("a comparison is allowed only as the first argument of `if`")
    );
    assert!(rate("theta_rad < 1").contains("a comparison is allowed only as the first argument of `if`"));
    assert!(rate("sin * 2").contains("`sin` is a function and needs its arguments; write `sin(…)`"));
    assert!(rate("theta_rad(2)").contains("`theta_rad` is not a function; write `*` for a product"));
    assert!(
        rate("table(curve, theta_rad)").contains("unknown table `curve` (declare tables as [tables.NAME]")
    );
    assert!(
        rate("table(3, theta_rad)").contains("the first argument of `table` must be the name of a table")
    );
    assert!(rate("slope(angle_rad)").contains("`slope` is allowed only in `start`"));
}

#[test]
fn malformed_expressions_are_explained() {
    assert!(rate("").contains("the expression is empty; write an expression"));
    assert!(
        rate("2 theta_rad").contains("an operator is missing before `theta_rad`; write `*` for a product")
    );
    assert!(
        rate("2 * ")
            .contains("a number, a name or `(` is expected here, but the end of the expression was found")
    );
    assert!(rate("2 * * 3").contains("a number, a name or `(` is expected here, but `*` was found"));
    assert!(rate("2 $ 3").contains("the character `$` is not allowed in an expression"));
    assert!(rate("1.2.3").contains("`1.2.3` is not a number"));
    assert!(rate("3m").contains("`3m` is not a number"));
    assert!(rate("1e999").contains("`1e999` is not a number"));
    assert!(
        rate(&"(".repeat(100)).contains(
            "the expression is nested more than 64 levels deep; move parts of it into named values"
        )
    );
    assert!(rate(&"1+".repeat(2100)).contains("the expression has 4200 bytes, but at most 4096 are allowed"));
}

#[test]
fn an_output_that_depends_on_no_state_is_refused() {
    assert_eq!(
        with("value = \"theta_rad\"", "value = \"length_m\""),
        "pendulum.toml:25: outputs.angle_rad: the output does not depend on any state, so nothing can be fitted to it; \
         use a state in its value"
    );
}

#[test]
fn parameters_must_lie_within_their_bounds_and_be_used() {
    assert_eq!(
        with("nominal = 0.153", "nominal = 3.0"),
        "pendulum.toml:17: parameters.length_m: the value 3.0 is outside its bounds [0.05, 1.0]; change it, or widen `min` and `max`"
    );
    assert!(with("min = 0.05", "min = 1.0").contains("min 1.0 must be below max 1.0; correct the bounds"));
    assert_eq!(
        with("length_m = {", "mass_kg = { nominal = 1.0 }\nlength_m = {"),
        "pendulum.toml:17: parameters.mass_kg: the parameter is not used anywhere; remove it or set frozen = true"
    );
    assert_eq!(
        changed(
            "pendulum",
            &[
                ("start = \"angle_rad\"", "start = \"angle_rad + off_rad\""),
                ("length_m = {", "off_rad = { nominal = 0.1 }\nlength_m = {")
            ]
        ),
        "pendulum.toml:17: parameters.off_rad: the parameter is used only in the start of `theta_rad`, and a fit estimates the initial \
         state itself; set frozen = true, or write the number there"
    );
    assert!(
        with("nominal = 0.153, ", "")
            .contains("parameters.length_m: the key `nominal` is missing; add nominal = 1.0")
    );
    assert!(
        with("nominal = 0.153", "nominal = nan")
            .contains("parameters.length_m.nominal: the value must be a finite number")
    );
}

#[test]
fn an_event_that_would_fire_forever_is_refused() {
    let message = changed(
        "mass-spring-stop",
        &[
            ("{ v_m_s = \"-restitution * v_m_s\" }", "{ x_m = \"stop_m\" }"),
            ("restitution = {", "restitution = { frozen = true,"),
        ],
    );
    assert_eq!(
        message,
        "mass-spring-stop.toml:33: events.stop: the event sets `x_m`, but its condition `when` still holds afterwards, \
         so it would fire forever; set a state that moves `when` away from 0"
    );
}

#[test]
fn unknown_keys_names_and_values_are_refused() {
    assert!(
        with("frozen = true", "frosen = true")
            .contains("parameters.gravity_m_s2: unknown key `frosen`; did you mean `frozen`?")
    );
    assert!(
        with("[rates]", "[rate]").contains("pendulum.toml:20: unknown key `rate`; did you mean `rates`?")
    );
    assert!(with("length_m = {", "sin = {").contains("`sin` is a reserved name; choose another name"));
    assert!(with("length_m = {", "theta_rad = {").contains("`theta_rad` is already the name of a state"));
    assert!(
        with("length_m = {", "\"le n\" = {")
            .contains("`le n` is not a valid name; use letters, digits and `_`")
    );
    assert!(
        with("scenario = \"system\"", "")
            .contains("the key `scenario` is missing; add scenario = \"system\"")
    );
    assert!(
        with("scenario = \"system\"", "scenario = \"balls\"")
            .contains("scenario: the value must be \"system\"")
    );
    assert!(
        with("sd = \"estimate\"", "sd = -1.0")
            .contains("outputs.angle_rad.sd: the value must be positive, but -1.0 is given")
    );
    let process_noise = |text: &str| {
        with("start = \"slope(angle_rad)\"", &format!("start = \"slope(angle_rad)\", shaken = {text}"))
    };
    assert!(
        process_noise("{ sd = 0.1, memory_s = -1.0 }")
            .contains("states.omega_rad_s.shaken.memory_s: the value must be 0 or more, but -1.0 is given")
    );
    assert!(process_noise("{ sd = 0.1 }").contains(
        "states.omega_rad_s.shaken: the key `memory_s` is missing; add shaken = { sd = 0.1, memory_s = 0.02 }"
    ));
    assert!(process_noise("0.1").contains(
        "states.omega_rad_s.shaken: the value must be a table such as { sd = 0.1, memory_s = 0.02 }"
    ));
    assert!(
        with("sd = \"estimate\"", "sd = \"guess\"")
            .contains("outputs.angle_rad.sd: the value must be \"estimate\" or a positive number")
    );
    assert!(with("[states]", "[states").contains("the file is not valid TOML"));
    assert!(
        with("name = \"pendulum\"", "constraints = \"x = 0\"")
            .contains("constraints: equations with constraints")
    );
    assert!(
        with("start = \"angle_rad\"", "start = \"theta_rad\"").contains("a start value may use only outputs")
    );
    assert!(
        changed("servo", &[("sign_width = { speed_rad_s", "sign_width = { angle_rad")])
            .contains("`angle_rad` is not the argument of any sign, step or if")
    );
    assert!(
        changed("mass-spring-stop", &[("hold = [\"x_m\"]", "hold = [\"y_m\"]")])
            .contains("no state is called `y_m`")
    );
    assert!(
        changed("mass-spring-stop", &[("hold = \"zero\"", "hold = \"cubic\"")])
            .contains("force_N.hold: the value must be \"zero\", \"linear\" or \"spline\"")
    );
    let table = "[tables.curve]\nat = [0.0, 0.0]\nvalues = [1.0, 2.0]\n[outputs] #";
    assert!(
        with("[outputs] #", table)
            .contains("tables.curve: the knots must increase, but 0.0 follows 0.0; sort them")
    );
    let table = "[tables.curve]\nat = [0.0, 1.0]\nvalues = [1.0]\n[outputs] #";
    assert!(with("[outputs] #", table).contains("tables.curve: the table has 2 knots and 1 values"));
}

#[test]
fn control_characters_and_long_texts_are_not_repeated() {
    let message = rate("theta_rad + \\u001b[31m");
    assert!(!message.contains('\u{1b}'), "{message:?}");
    assert!(message.contains("the character `\\u{1b}` is not allowed in an expression"), "{message}");
    let long = rate(&format!("{} + nonsense", "theta_rad + ".repeat(200)));
    assert!(long.len() < 400, "{} characters", long.len());
}

#[test]
fn the_examples_parse_and_compile() {
    for (name, text) in augsim_equations::EXAMPLES {
        let model = model::parse(text, name).unwrap_or_else(|e| panic!("{e}"));
        let active: Vec<usize> =
            (0..model.parameters.len()).filter(|p| !model.parameters[*p].frozen).collect();
        System::compile(&model, &active).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn whole_numbers_follow_toml() {
    assert!(
        with("nominal = 0.153", "nominal = 99999999999999999999")
            .contains("the value must be a finite number")
    );
    let text = example("pendulum").expect("an example").replace("max = 10.0", "max = 0x10");
    assert_eq!(model::parse(&text, "pendulum.toml").expect("a model").parameters[2].max, 16.0);
}
