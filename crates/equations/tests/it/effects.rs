//! Contract: an effect of a model file changes the equations as it says, with exact derivatives, and nothing
//! at its null.
//!
//! This holds for effects of the library, for candidates of the file, and for formulas. A file that is
//! written back reads as the same model, and keeps the user's comments. The examples serve as models, because
//! together they have a pair of position and speed, flows, inputs, events and bounds. Derivatives are
//! compared with central differences of the same engine.

use augsim_equations::engine::{Method, Options, Point, Record, Seed, Signal, Window};
use augsim_equations::library::{Scales, candidates, generic};
use augsim_equations::model::{self, Hold, Model};
use augsim_equations::{EXAMPLES, System, example};

fn parsed(text: &str) -> Model {
    model::parse(text, "test.toml").unwrap_or_else(|e| panic!("{e}"))
}

fn compiled(model: &Model) -> System {
    let all: Vec<usize> = (0..model.parameters.len()).collect();
    System::compile(model, &all).unwrap_or_else(|e| panic!("{e}"))
}

fn rates(model: &Model, state: &[f64], inputs: &[f64]) -> Vec<f64> {
    let parameters = model.nominals();
    compiled(model).linearise(&Point { state, inputs, parameters: &parameters, time: 0.5 }).rates
}

fn with(name: &str, blocks: &str) -> Model {
    parsed(&format!("{}\n{blocks}", example(name).expect("an example")))
}

const OPTIONS: Options = Options { method: Method::RungeKutta, substeps: 4 };

/// Builds a record with sinusoidal inputs, and an initial state in which no state is 0.
fn scene(model: &Model) -> (Record, Vec<f64>) {
    let times: Vec<f64> = (0..60).map(|k| 0.02 * f64::from(k)).collect();
    let sine = |k: usize| -> Vec<f64> { times.iter().map(|t| 1.0 + ((3 + k) as f64 * t).sin()).collect() };
    let signal = |k: usize| Signal::new(&times, &sine(k), model.inputs[k].hold.unwrap_or(Hold::Linear));
    let inputs = (0..model.inputs.len()).map(signal).collect();
    let start = (0..model.states.len()).map(|i| 0.3 + 0.1 * i as f64).collect();
    (Record::new("scene", times, inputs).expect("rising times"), start)
}

#[test]
fn a_formula_changes_the_rate_it_is_on() {
    let formula = |how: &str| {
        let block = format!(
            "[[effect]]\nkind = \"formula\"\non = \"omega_rad_s\"\n{how} = \"c * sin(theta_rad) + s\"\n\
             c = {{ nominal = 0.5, unit = \"1/s^2\" }}\ns_per_s2 = 0.25\n"
        );
        rates(&with("pendulum", &block), &[0.3, -0.2], &[])[1]
    };
    let plain = rates(&with("pendulum", ""), &[0.3, -0.2], &[])[1];
    let term = 0.5 * 0.3_f64.sin() + 0.25;
    for (how, expected) in [("add", plain + term), ("factor", plain * term), ("replace", term)] {
        assert!((formula(how) - expected).abs() < 1e-12 * expected.abs(), "{how}");
    }
}

#[test]
fn an_effect_of_the_library_uses_the_position_and_speed_of_its_equation() {
    let block = "[[effect]]\nkind = \"coulomb\"\non = \"v_m_s\"\nf = 2.0\nw = 0.1\n";
    let state = [0.1, 0.2, 0.3, 0.4];
    let [plain, changed] = ["", block].map(|b| rates(&with("cart-pole", b), &state, &[0.5]));
    assert!((changed[1] - plain[1] + 2.0 * (0.2_f64 / 0.1).tanh()).abs() < 1e-12);
    assert_eq!([plain[0], plain[2], plain[3]], [changed[0], changed[2], changed[3]]);
}

#[test]
fn every_candidate_of_every_example_has_no_effect_at_its_null() {
    for (name, text) in EXAMPLES {
        let model = parsed(text);
        let (record, start) = scene(&model);
        let system = compiled(&model);
        let parameters = model.nominals();
        let window = Window { record: &record, first: 0, last: 59, start: &start, parameters: &parameters };
        let plain =
            system.simulate(std::slice::from_ref(&window), &[], &OPTIONS).remove(0).expect("a simulation");
        let scales = Scales::sample(&system, &[window], &OPTIONS);
        let all = candidates(&model).unwrap_or_else(|e| panic!("{e}"));
        assert!(all.len() > 15, "{name} has {} candidates", all.len());
        for mut candidate in all {
            scales.resolve(&mut candidate, &model);
            for values in candidate.null_points() {
                let mut augmented = model.clone();
                augmented.add(&candidate.draft(&values)).unwrap_or_else(|e| panic!("{e}"));
                let system = compiled(&augmented);
                let parameters = augmented.nominals();
                let mut start = start.clone();
                start.resize(augmented.states.len(), 0.0);
                let window =
                    Window { record: &record, first: 0, last: 59, start: &start, parameters: &parameters };
                let found = system.simulate(&[window], &[], &OPTIONS).remove(0);
                let found = found.unwrap_or_else(|e| panic!("{name}, {}: {e}", candidate.name)).values;
                let worst = found.iter().zip(&plain.values).fold(0.0_f64, |w, (a, b)| w.max((a - b).abs()));
                assert!(worst < 1e-9, "{name}, {}: moves by {worst} at {values:?}", candidate.name);
            }
        }
    }
}

#[test]
fn derivatives_with_every_kind_agree_with_central_differences() {
    let mut kinds: Vec<String> = Vec::new();
    for name in ["cart-pole", "tanks", "servo"] {
        let model = parsed(example(name).expect("an example"));
        let (record, start) = scene(&model);
        let parameters = model.nominals();
        let window = Window { record: &record, first: 0, last: 59, start: &start, parameters: &parameters };
        let scales = Scales::sample(&compiled(&model), &[window], &OPTIONS);
        for mut candidate in candidates(&model).expect("candidates") {
            // One place per kind is enough, because places differ only in their names.
            if kinds.contains(&candidate.kind) {
                continue;
            }
            kinds.push(candidate.kind.clone());
            scales.resolve(&mut candidate, &model);
            let usual: Vec<f64> = candidate
                .parameters
                .iter()
                .map(|p| if p.is_inner { p.grid[p.grid.len() - 1] } else { p.typical.unwrap_or(1.0) })
                .collect();
            let mut augmented = model.clone();
            augmented.add(&candidate.draft(&usual)).expect("an effect");
            let system = compiled(&augmented);
            let parameters = augmented.nominals();
            let mut start = start.clone();
            start.resize(augmented.states.len(), 0.05);
            let first = model.parameters.len();
            let seeds: Vec<Seed> = (first..parameters.len()).map(Seed::Parameter).collect();
            let run = |parameters: &[f64], seeds: &[Seed]| {
                let window = Window { record: &record, first: 0, last: 59, start: &start, parameters };
                let mut all = system.simulate(&[window], seeds, &OPTIONS);
                all.remove(0).unwrap_or_else(|e| panic!("{}: {e}", candidate.name))
            };
            let exact = run(&parameters, &seeds);
            for (k, _) in seeds.iter().enumerate() {
                let value = parameters[first + k].abs();
                let h = if value > 0.0 { 1e-4 * value } else { 1e-3 };
                let moved = |by: f64| {
                    let mut parameters = parameters.clone();
                    parameters[first + k] += by;
                    run(&parameters, &[]).values
                };
                // Two central differences combined have an error of order h^4, which narrow widths need.
                let [up, down, near_up, near_down] = [h, -h, 0.5 * h, -0.5 * h].map(moved);
                let difference = |i: usize| {
                    let (wide, near) = ((up[i] - down[i]) / (2.0 * h), (near_up[i] - near_down[i]) / h);
                    (4.0 * near - wide) / 3.0
                };
                let slope = |i: usize| exact.slopes[i * seeds.len() + k];
                let scale = (0..up.len()).map(|i| slope(i).abs()).fold(1e-5, f64::max);
                let error = |i: usize| (slope(i) - difference(i)).abs() / scale;
                let worst = (0..up.len()).map(error).fold(0.0, f64::max);
                assert!(worst < 2e-5, "{name}, {}, parameter {k}: {worst}", candidate.name);
            }
        }
    }
    let all = generic().expect("the library");
    // Effects on the joints of a robot are in robot.rs and robot_effects.rs.
    let is_of_robot = |place: &String| {
        place.starts_with("joint-") || ["armature", "payload", "tilt"].contains(&place.as_str())
    };
    let others = all.iter().filter(|row| !row.on.iter().any(is_of_robot));
    let missing: Vec<&str> =
        others.map(|r| r.kind.as_str()).filter(|k| !kinds.iter().any(|kind| kind == k)).collect();
    assert_eq!(missing, ["reset-law"], "only effects on events are not covered here");
}

#[test]
fn a_file_that_is_written_back_keeps_model_and_comments() {
    let blocks = r#"
[[effect]]
kind = "quadratic-damping"
on = "omega_rad_s"
c = { nominal = 0.02, ci95 = [0.01, 0.03] } # to be kept in words, not in place
[[effect]]
kind = "formula"
on = "omega_rad_s"
add = "a * tanh(theta_rad / w)"
a_per_s2 = { nominal = 0.3 }
w_rad = { nominal = 0.1, min = 0.01, max = 1.0 }
also_fits = ["a * theta_rad"]
[[effect]]
kind = "table"
on = "angle_rad"
against = "theta_rad"
first = -1.0
last = 1.0
values = [0.0, 0.1, 0.0]
"#;
    let mut model = with("pendulum", blocks);
    model.parameters[1].nominal = 0.16;
    model.parameters[1].ci95 = Some([0.15, 0.17]);
    let text = model.to_toml().expect("a text");
    let again = parsed(&text);
    let plain = |model: &Model| {
        let mut parameters = model.parameters.clone();
        parameters.iter_mut().for_each(|p| p.line = 0);
        parameters
    };
    assert_eq!(plain(&model), plain(&again));
    let changes = |model: &Model| -> Vec<_> {
        let of = |a: &model::Addition| {
            (a.kind.clone(), a.on.clone(), a.with.clone(), a.equivalent_expressions.clone(), a.table)
        };
        model.additions.iter().map(of).collect()
    };
    assert_eq!(changes(&model), changes(&again));
    let line = "length_m = { nominal = 0.16, min = 0.05, max = 1.0, ci95 = [0.15, 0.17] }\n";
    assert!(text.contains(line), "{text}");
    for kept in ["# A pendulum: the smallest system", "# the change of each state per second"] {
        assert!(text.contains(kept), "{kept} is gone:\n{text}");
    }
    assert_eq!(again.to_toml().expect("a text"), text, "written twice");
    let state = [0.4, -0.3];
    assert_eq!(rates(&model, &state, &[]), rates(&again, &state, &[]));
}

#[test]
fn a_kind_that_contains_a_simpler_one_names_that_of_the_same_place() {
    let simpler = |example: &str, name: &str| {
        let all = candidates(&with(example, "")).expect("candidates");
        let found = all.into_iter().find(|c| c.name == name);
        found.unwrap_or_else(|| panic!("{example} has no {name}")).reduces_to
    };
    assert_eq!(simpler("servo", "stribeck").as_deref(), Some("coulomb"));
    assert_eq!(simpler("cart-pole", "stribeck on v_m_s").as_deref(), Some("coulomb on v_m_s"));
    assert_eq!(
        simpler("cart-pole", "hidden-mode on omega_rad_s").as_deref(),
        Some("linear-damping on omega_rad_s")
    );
    assert_eq!(simpler("servo", "quadratic-damping"), None);
}

#[test]
fn candidates_of_the_file_are_listed_before_the_library() {
    let block = "[[candidate]]\nkind = \"soft-spring\"\non = \"omega_rad_s\"\nadd = \"-a * theta_rad * exp(-(theta_rad / w)^2)\"\n\
                 a = { min = 0.0, typical = 2.0 }\nw_rad = { grid = [0.1, 0.3] }\nstands_for = \"gravity\"\n";
    let model = with("pendulum", block);
    let all = candidates(&model).expect("candidates");
    assert_eq!((all[0].name.as_str(), all[0].on.as_str()), ("soft-spring", "omega_rad_s"));
    assert_eq!(all[0].null_points(), [[0.0, 0.1], [0.0, 0.3]]);
    assert_eq!(all[0].parameters[0].unit.map(|u| u.to_string()).as_deref(), Some("1/s^2"));
    assert!(all[0].formula.starts_with("d(omega_rad_s)/dt -= a * theta_rad"));
    assert!(all.iter().any(|c| c.name == "coulomb"), "the library follows");
}

#[test]
fn a_presliding_distance_is_at_least_the_one_passed_between_samples_at_a_reversal() {
    let model = parsed(
        "scenario = \"system\"\nname = \"oscillator\"\n[parameters]\nw2_per_s2 = { nominal = 400.0 }\n\
         [states]\nx_m = { start = \"x_m\" }\nv_m_s = { start = 0.0 }\n\
         [rates]\nx_m = \"v_m_s\"\nv_m_s = \"-w2_per_s2 * x_m\"\n[outputs]\nx_m = { value = \"x_m\" }\n",
    );
    let (amplitude, w) = (0.2_f64, 20.0);
    let distances = |step: f64| {
        let times: Vec<f64> = (0..2000).map(|k| step * f64::from(k)).collect();
        let record = Record::new("swing", times, Vec::new()).expect("rising times");
        let (start, parameters) = (vec![amplitude, 0.0], model.nominals());
        let window = Window { record: &record, first: 0, last: 1999, start: &start, parameters: &parameters };
        let options = Options { substeps: 40, ..OPTIONS };
        let scales = Scales::sample(&compiled(&model), &[window], &options);
        let mut all = candidates(&model).expect("candidates");
        let presliding = all.iter_mut().find(|c| c.kind == "presliding").expect("a force");
        scales.resolve(presliding, &model);
        let d = presliding.parameters.iter().find(|p| p.is_inner).expect("a distance");
        (d.min, d.null, d.grid.clone())
    };
    // Twenty samples a period.
    let coarse = amplitude * (w * 0.0157_f64).powi(2) / 2.0;
    let (min, null, grid) = distances(0.0157);
    assert!((min / coarse - 1.0).abs() < 0.01, "{min} and {coarse}");
    assert_eq!((null, grid[0], grid.len()), (min, min, 3));
    let rms = amplitude / 2.0_f64.sqrt();
    let (min, _, grid) = distances(0.00157);
    assert!((min / (0.001 * rms) - 1.0).abs() < 0.01 && (grid[0] / (0.03 * rms) - 1.0).abs() < 0.01);
}

#[test]
fn errors_in_blocks_name_their_line_and_the_alternatives() {
    let error = |blocks: &str| {
        let text = format!("{}\n{blocks}", example("pendulum").expect("an example"));
        model::parse(&text, "pendulum.toml").expect_err("a mistake").to_string()
    };
    assert_eq!(
        error("[[effect]]\nkind = \"colomb\"\non = \"omega_rad_s\"\n"),
        "pendulum.toml:27: effect.colomb: no effect is called `colomb`; did you mean `coulomb`? \
         (`augsim effects --for MODEL.toml` lists all effects; kind \"formula\" takes an expression of your own)"
    );
    assert_eq!(
        error("[[effect]]\nkind = \"coulomb\"\non = \"theta_rad\"\nf = 1.0\nw = 1.0\n"),
        "pendulum.toml:29: effect.coulomb.on: `coulomb` cannot act on `theta_rad`; it can act on `omega_rad_s`"
    );
    assert_eq!(
        error("[[effect]]\nkind = \"coulomb\"\non = \"omega_rad_s\"\nf = 1.0\n"),
        "pendulum.toml:27: effect.coulomb: the parameter `w` of coulomb is missing; add w = { nominal = 1.0 }"
    );
    // The place is right, and only its partner is wrong: the message must not propose the same place again.
    let text = format!(
        "{}\n[[effect]]\nkind = \"parameter-dependence\"\non = \"restitution\"\nwith = \"v_m\"\nc = 0.1\n",
        example("mass-spring-stop").expect("an example")
    );
    let partner = model::parse(&text, "mass.toml").expect_err("a mistake").to_string();
    assert!(
        partner.contains("`parameter-dependence` on `restitution` cannot go with `v_m`; it can go with ")
            && partner.contains("`v_m_s`")
            && !partner.contains("can act on"),
        "{partner}"
    );
    let formula = "[[effect]]\nkind = \"formula\"\non = \"omega_rad_s\"\nadd = \"c * thta_rad\"\nc = 1.0\n";
    let found = error(formula);
    assert!(
        found.contains("unknown name `thta_rad`; did you mean `theta_rad`?") && found.contains("^^^^^^^^"),
        "{found}"
    );
    let unused =
        error("[[effect]]\nkind = \"formula\"\non = \"omega_rad_s\"\nadd = \"c\"\nc = 1.0\nd = 2.0\n");
    assert!(unused.contains("effect.formula.d: the parameter is not used anywhere"), "{unused}");
    let place = error("[[candidate]]\nkind = \"mine\"\non = \"omega\"\nadd = \"c\"\nc = {}\n");
    assert!(place.contains("`omega` is not a rate, an input, an output or a parameter"), "{place}");
}
