//! Contract: outputs and derivatives of a window are those of the equations, and do not depend on what else
//! is simulated.
//!
//! This holds through events, rests, state bounds, delays and stiff rates. Where closed-form solutions exist
//! (bouncing ball, decay, oscillator) they are the reference; elsewhere derivatives are compared with central
//! differences of the same engine, and values with the adaptive reference integrator.

use augsim_equations::engine::{Method, Options, Record, Seed, Signal, Simulated, SimulationError, Window};
use augsim_equations::model::{self, Hold};
use augsim_equations::{System, example};

fn compiled(text: &str) -> System {
    let model = model::parse(text, "test.toml").unwrap_or_else(|e| panic!("{e}"));
    let all: Vec<usize> = (0..model.parameters.len()).collect();
    System::compile(&model, &all).unwrap_or_else(|e| panic!("{e}"))
}

fn times(count: usize, interval: f64) -> Vec<f64> {
    (0..count).map(|i| i as f64 * interval).collect()
}

fn record(times: Vec<f64>, inputs: Vec<Signal>) -> Record {
    Record::new("trajectory 3", times, inputs).expect("rising times")
}

fn steps(substeps: usize) -> Options {
    Options { method: Method::RungeKutta, substeps }
}

fn all_seeds(system: &System) -> Vec<Seed> {
    let parameters = (0..system.model().parameters.len()).map(Seed::Parameter);
    parameters.chain((0..system.model().states.len()).map(Seed::Start)).collect()
}

/// Simulates one window that covers a whole record.
fn whole(
    system: &System,
    record: &Record,
    (start, parameters): (&[f64], &[f64]),
    seeds: &[Seed],
    options: &Options,
) -> Result<Simulated, SimulationError> {
    let window = Window { record, first: 0, last: record.times().len() - 1, start, parameters };
    system.simulate(&[window], seeds, options).pop().expect("one window, one result")
}

/// Largest difference between the engine's derivatives and central differences of its values.
///
/// Relative to the size of each derivative's column.
fn derivative_error(system: &System, record: &Record, start: &[f64], options: &Options) -> f64 {
    let parameters = system.model().nominals();
    let seeds = all_seeds(system);
    let exact = whole(system, record, (start, &parameters), &seeds, options).expect("a simulation");
    let mut worst: f64 = 0.0;
    for (column, seed) in seeds.iter().enumerate() {
        let moved = |by: f64| {
            let (mut start, mut parameters) = (start.to_vec(), parameters.clone());
            match seed {
                Seed::Parameter(p) => parameters[*p] += by,
                Seed::Start(state) => start[*state] += by,
            }
            whole(system, record, (&start, &parameters), &[], options).expect("a simulation").values
        };
        let size = match seed {
            Seed::Parameter(p) => parameters[*p].abs(),
            Seed::Start(state) => start[*state].abs(),
        };
        let h = 1e-6 * size.max(0.1);
        let (up, down) = (moved(h), moved(-h));
        let slope = |i: usize| exact.slopes[i * seeds.len() + column];
        let scale = (0..up.len()).map(|i| slope(i).abs()).fold(1e-3, f64::max);
        for i in 0..up.len() {
            worst = worst.max((slope(i) - (up[i] - down[i]) / (2.0 * h)).abs() / scale);
        }
    }
    worst
}

const BALL: &str = r#"
scenario = "system"
[states]
height_m = { start = "z_m" }
velocity_m_s = { start = "slope(z_m)" }
[parameters]
gravity_m_s2 = 9.81
restitution = 0.8
[rates]
height_m = "velocity_m_s"
velocity_m_s = "-gravity_m_s2"
[outputs]
z_m = { value = "height_m", sd = 0.001 }
[[events]]
name = "floor"
when = "height_m"
direction = "falling"
set = { velocity_m_s = "-restitution * velocity_m_s" }
rest = { below_m_s = 1e-4, hold = ["height_m"] }
"#;

/// Height of a bouncing ball at time `t` (s) after its drop from height `drop`, with derivatives.
///
/// The derivatives are by gravity, restitution and drop height. Arcs begin at times t1 (1 + 2e + 2e^2 + …),
/// t1 = sqrt(2 drop / g), with speed e^k g t1.
fn bounced(t: f64, [g, e, drop]: [f64; 3]) -> (f64, [f64; 3], usize) {
    let first = (2.0 * drop / g).sqrt();
    let first_by = [-0.5 * first / g, 0.0, 0.5 * first / drop];
    if t < first {
        return (drop - 0.5 * g * t * t, [-0.5 * t * t, 0.0, 1.0], 0);
    }
    let (mut begin, mut begin_by) = (first, first_by);
    let mut k = 1;
    loop {
        let power = e.powi(k);
        let speed = power * g * first;
        let speed_by = [
            power * (first + g * first_by[0]),
            f64::from(k) * e.powi(k - 1) * g * first,
            power * g * first_by[2],
        ];
        let last = 2.0 * speed / g;
        let last_by: [f64; 3] =
            std::array::from_fn(|i| 2.0 * speed_by[i] / g - if i == 0 { 2.0 * speed / (g * g) } else { 0.0 });
        if t < begin + last {
            let s = t - begin;
            let by = std::array::from_fn(|i| {
                speed_by[i] * s - (speed - g * s) * begin_by[i] - if i == 0 { 0.5 * s * s } else { 0.0 }
            });
            return (speed * s - 0.5 * g * s * s, by, k as usize);
        }
        begin += last;
        (0..3).for_each(|i| begin_by[i] += last_by[i]);
        k += 1;
    }
}

#[test]
fn sensitivities_are_exact_through_ten_bounces() {
    let system = compiled(BALL);
    // 3.76 s is behind the tenth bounce and before the eleventh.
    let record = record(times(95, 0.04), vec![]);
    let seeds = [Seed::Parameter(0), Seed::Parameter(1), Seed::Start(0)];
    let found =
        whole(&system, &record, (&[1.0, 0.0], &[9.81, 0.8]), &seeds, &steps(1)).expect("a simulation");
    assert!(found.events.len() >= 10, "{} bounces", found.events.len());
    assert!(found.events.iter().all(|e| !e.is_grazing && !e.begins_rest));
    for (i, t) in record.times().iter().enumerate() {
        let (height, by, bounces) = bounced(*t, [9.81, 0.8, 1.0]);
        if bounces > 10 {
            break;
        }
        assert!((found.values[i] - height).abs() < 1e-9, "{t} s: {} {height}", found.values[i]);
        for (seed, by) in by.iter().enumerate() {
            let slope = found.slopes[3 * i + seed];
            assert!((slope - by).abs() < 1e-9, "{t} s after {bounces}: seed {seed}: {slope} {by}");
        }
    }
}

#[test]
fn a_zeno_sequence_of_bounces_ends_in_rest() {
    let system = compiled(BALL);
    let record = record(times(300, 0.02), vec![]);
    let found =
        whole(&system, &record, (&[1.0, 0.0], &[9.81, 0.8]), &[Seed::Start(0)], &steps(1)).expect("rest");
    assert!(found.events.last().is_some_and(|e| e.begins_rest), "{:?}", found.events.last());
    // The sum of all bounces ends at t1 (1 + e) / (1 - e) = 4.06 s.
    assert!((found.events.last().expect("an event").time - 4.06).abs() < 0.01);
    assert!(found.values[220..].iter().all(|z| z.abs() < 1e-6));
    assert_eq!(found.slopes[299], 0.0);
    let without_rest = BALL.replace("rest = { below_m_s = 1e-4, hold = [\"height_m\"] }", "");
    let error = whole(&compiled(&without_rest), &record, (&[1.0, 0.0], &[9.81, 0.8]), &[], &steps(1)).err();
    let error = error.expect("an unlimited number of bounces").to_string();
    assert!(error.contains("events.floor fires faster and faster without end"), "{error}");
}

#[test]
fn runge_kutta_has_order_four() {
    let system = compiled(example("pendulum").expect("the example"));
    let record = record(times(11, 0.1), vec![]);
    let parameters = system.model().nominals();
    let run = |options: &Options| {
        whole(&system, &record, (&[1.5, 0.0], &parameters), &[], options).expect("a simulation").values
    };
    let exact = run(&Options { method: Method::Reference { tolerance: 1e-13 }, substeps: 1 });
    let error =
        |n: usize| run(&steps(n)).iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max).ln();
    // Least squares of log error against log of the step.
    let points: Vec<(f64, f64)> = [8_usize, 12, 16, 24, 32].map(|n| (-(n as f64).ln(), error(n))).to_vec();
    let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>()
        / points.iter().map(|p| (p.0 - x) * (p.0 - x)).sum::<f64>();
    assert!((slope - 4.0).abs() < 0.15, "order {slope}");
}

/// Builds windows of different initial states and parameters over one record of the mass with a stop.
///
/// In many of the windows the mass strikes the stop.
fn scene() -> (System, Record, Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let system = compiled(example("mass-spring-stop").expect("the example"));
    let t = times(60, 0.02);
    let force: Vec<f64> = t.iter().map(|t| 3.0 * (7.0 * t).sin() + 2.0).collect();
    let record = record(t.clone(), vec![Signal::new(&t, &force, Hold::Linear)]);
    let starts =
        (0..2000).map(|i| vec![0.04 * f64::from(i % 97) / 97.0 - 0.01, 0.3 * f64::from(i % 13) / 13.0]);
    let nominal = system.model().nominals();
    let varied = (0..2000).map(|i| nominal.iter().map(|p| p * (1.0 + 0.001 * f64::from(i % 31))).collect());
    (system, record, starts.collect(), varied.collect())
}

fn bits(results: &[Result<Simulated, SimulationError>]) -> Vec<Vec<u64>> {
    let of = |r: &Result<Simulated, SimulationError>| {
        let s = r.as_ref().expect("a simulation");
        let events = s.events.iter().map(|e| e.time);
        let all = s.values.iter().chain(&s.slopes).chain(&s.end).chain(&s.end_slopes).copied().chain(events);
        all.map(f64::to_bits).collect()
    };
    results.iter().map(of).collect()
}

#[test]
fn a_window_is_independent_of_other_windows_and_threads() {
    let (system, record, starts, parameters) = scene();
    let window = |i: usize| Window {
        record: &record,
        first: i % 5,
        last: 59 - i % 7,
        start: &starts[i],
        parameters: &parameters[i],
    };
    let seeds = all_seeds(&system);
    let all: Vec<Window<'_>> = (0..400).map(window).collect();
    let expected = bits(&system.simulate(&all, &seeds, &steps(2)));
    assert!(
        system
            .simulate(&all, &[], &steps(2))
            .iter()
            .filter_map(|r| r.as_ref().ok())
            .any(|s| s.events.len() > 2)
    );
    let values = |results: &[Result<Simulated, SimulationError>]| -> Vec<Vec<f64>> {
        results.iter().map(|r| r.as_ref().expect("a simulation").values.clone()).collect()
    };
    let expected_values = values(&system.simulate(&all, &seeds, &steps(2)));
    for threads in [1, 2, 7] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        // Blocks without sensitivities have other numbers of lanes.
        assert!(
            pool.install(|| values(&system.simulate(&all, &[], &steps(2)))) == expected_values,
            "values, {threads} threads"
        );
        assert!(
            pool.install(|| bits(&system.simulate(&all, &seeds, &steps(2)))) == expected,
            "{threads} threads"
        );
    }
    let mut reversed = all.clone();
    reversed.reverse();
    let mut back = bits(&system.simulate(&reversed, &seeds, &steps(2)));
    back.reverse();
    assert!(back == expected, "order of the windows");
    for i in [0, 17, 399] {
        let alone = bits(&system.simulate(&all[i..=i], &seeds, &steps(2)));
        assert!(alone[0] == expected[i], "window {i} alone");
    }
    let two = bits(&system.simulate(&all[30..32], &seeds, &steps(2)));
    assert!(two[..] == expected[30..32], "two windows");
}

#[test]
fn values_are_the_same_with_and_without_sensitivities() {
    let (system, record, starts, parameters) = scene();
    for i in 0..50 {
        let start = (&starts[i][..], &parameters[i][..]);
        let with = whole(&system, &record, start, &all_seeds(&system), &steps(2)).expect("a simulation");
        let without = whole(&system, &record, start, &[], &steps(2)).expect("a simulation");
        assert_eq!(with.values, without.values);
    }
}

#[test]
fn sensitivities_through_impacts_agree_with_differences() {
    let (system, record, ..) = scene();
    let error = derivative_error(&system, &record, &[0.01, 0.3], &steps(8));
    assert!(error < 1e-5, "{error}");
}

#[test]
fn sensitivities_at_state_bounds_agree_with_differences() {
    let text = example("tanks").expect("the example").replace("min = 0.0 }", "min = 0.0, max = 6.0 }");
    let system = compiled(&text);
    let t = times(120, 4.0);
    let pump: Vec<f64> =
        t.iter().map(|t| if (*t as u32 / 100).is_multiple_of(2) { 6.0 } else { 0.1 }).collect();
    let record = record(t.clone(), vec![Signal::new(&t, &pump, Hold::Zero)]);
    let start = [4.0, 3.0];
    let parameters = system.model().nominals();
    let found = whole(&system, &record, (&start, &parameters), &[], &steps(4)).expect("a simulation");
    assert!(found.values.contains(&6.0), "the lower tank reaches its upper bound");
    assert!(found.values.iter().all(|level| (0.0..=6.0).contains(level)));
    let error = derivative_error(&system, &record, &start, &steps(4));
    assert!(error < 1e-5, "{error}");
}

#[test]
fn a_rate_that_turns_away_from_a_bound_just_inside_it_is_refused() {
    // At the bound the level rises, and 1e-9 away from it falls: it would reach and leave the bound without end.
    let text = "scenario = \"system\"\n[states]\nlevel_m = { start = 1.0, min = 0.0 }\n[parameters]\nw_m = { nominal = 1e-9, frozen = true }\n\
        [rates]\nlevel_m = \"1.0 - 2.0 * tanh((level_m / w_m)^2)\"\n[outputs]\nlevel_m = { value = \"level_m\", sd = 0.01 }\n";
    let system = compiled(text);
    let found = whole(&system, &record(times(30, 0.1), Vec::new()), (&[1.0], &[1e-9]), &[], &steps(4));
    let error = found.expect_err("no end");
    assert!(
        matches!(&error, SimulationError::Chatter { state, time, .. } if state == "level_m" && (*time - 1.0).abs() < 0.03),
        "{error}"
    );
}

#[test]
fn a_rest_ends_when_its_condition_holds() {
    let system = compiled(example("mass-spring-stop").expect("the example"));
    let t = times(200, 0.02);
    // Pressed against the stop for two seconds, then pulled away.
    let force: Vec<f64> = t.iter().map(|t| if *t < 2.0 { 20.0 } else { 20.0 - 25.0 * (t - 2.0) }).collect();
    let record = record(t.clone(), vec![Signal::new(&t, &force, Hold::Linear)]);
    let parameters = system.model().nominals();
    let found = whole(&system, &record, (&[0.0, 0.0], &parameters), &[], &steps(4)).expect("a simulation");
    assert!(found.events.iter().any(|e| e.begins_rest));
    assert!((found.values[95] - 0.05).abs() < 1e-9, "at the stop: {}", found.values[95]);
    // Force and spring balance at 20 - 25 s = 80 * 0.05, so that it leaves at 2.64 s.
    assert!(
        (found.values[131] - 0.05).abs() < 1e-9 && found.values[140] < 0.0499,
        "{:?}",
        &found.values[130..141]
    );
    let error = derivative_error(&system, &record, &[0.0, 0.0], &steps(4));
    assert!(error < 1e-4, "{error}");
}

#[test]
fn a_delay_has_an_exact_derivative_for_every_hold() {
    for (hold, limit) in [("zero", 1e-6), ("linear", 1e-6), ("spline", 1e-6)] {
        let text = example("cart-pole").expect("the example");
        let text = text
            .replace("hold = \"zero\"", &format!("hold = \"{hold}\""))
            .replace("nominal = 0.0, min = 0.0, max = 0.02", "nominal = 0.013, min = 0.0, max = 0.05");
        let system = compiled(&text);
        let t = times(50, 0.02);
        let volts: Vec<f64> = t.iter().map(|t| 5.0 * (9.0 * t).sin()).collect();
        let kind = system.model().inputs[0].hold.expect("a hold");
        let record = record(t.clone(), vec![Signal::new(&t, &volts, kind)]);
        // The steps' ends move with the delay, which changes their error of order 4: many steps make it
        // small.
        let error = derivative_error(&system, &record, &[0.0, 0.1, 0.3, 0.0], &steps(16));
        assert!(error < limit, "{hold}: {error}");
    }
}

#[test]
fn fixed_steps_agree_with_the_adaptive_reference() {
    let (system, record, starts, parameters) = scene();
    let reference = Options { method: Method::Reference { tolerance: 1e-11 }, substeps: 1 };
    for i in [3, 40, 90] {
        let start = (&starts[i][..], &parameters[i][..]);
        let fixed = whole(&system, &record, start, &[], &steps(8)).expect("a simulation");
        let exact = whole(&system, &record, start, &[], &reference).expect("a simulation");
        let off = fixed.values.iter().zip(&exact.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-8, "window {i}: {off} m");
        assert_eq!(fixed.events.len(), exact.events.len());
    }
}

const STIFF: &str = r#"
scenario = "system"
[states]
x_m = { start = 1.0 }
y_m = { start = 0.0 }
[parameters]
fast_per_s = { nominal = 3.1e4 }
slow_per_s = { nominal = 2.0 }
[rates]
x_m = "-slow_per_s * x_m"
y_m = "fast_per_s * (x_m - y_m)"
[outputs]
out_m = { value = "y_m", sd = 0.001 }
"#;

#[test]
fn a_stiff_system_is_solved_by_the_implicit_method() {
    let system = compiled(STIFF);
    let record = record(times(21, 0.05), vec![]);
    let parameters = system.model().nominals();
    let window = Window { record: &record, first: 0, last: 20, start: &[1.0, 0.0], parameters: &parameters };
    let chosen = system.choose_steps(std::slice::from_ref(&window), &[0.001]).expect("implicit steps");
    assert_eq!(chosen.options.method, Method::Implicit);
    assert!(chosen.options.substeps <= 8 && chosen.change <= 0.01, "{chosen:?}");
    let found =
        whole(&system, &record, (&[1.0, 0.0], &parameters), &[], &chosen.options).expect("a simulation");
    for (t, y) in record.times().iter().zip(&found.values).skip(1) {
        let exact = (-2.0 * t).exp() * 3.1e4 / (3.1e4 - 2.0);
        assert!((y - exact).abs() < 1e-4, "{t} s: {y} {exact}");
    }
    let options = Options { method: Method::Implicit, substeps: 4 };
    let error = derivative_error(&system, &record, &[1.0, 0.5], &options);
    assert!(error < 1e-6, "{error}");
}

#[test]
fn a_system_that_is_too_stiff_for_declared_explicit_steps_is_refused() {
    let text = format!("{STIFF}\n[numerics]\nintegrator = \"explicit\"\n").replace("3.1e4", "3.1e5");
    let system = compiled(&text);
    let record = record(times(21, 0.05), vec![]);
    let parameters = system.model().nominals();
    let window = Window { record: &record, first: 0, last: 20, start: &[1.0, 0.0], parameters: &parameters };
    let error = system.choose_steps(&[window], &[0.001]).expect_err("too stiff for explicit steps");
    assert!(
        error.to_string().starts_with(
            "rates.y_m is stiff: its fastest rate is 3.1e5 per second, 15500 times the sample rate; check the unit of time \
             (--time COLUMN:UNIT) and the values of the parameters; if both are right, set [numerics] integrator = \"implicit\", or increase sign_width"
        ),
        "{error}"
    );
}

#[test]
fn explicit_steps_stay_stable_whatever_the_parameters() {
    // At `z = -2.73` one step per sample multiplies the state by 0.92, as if the rate were 30 times slower. The rates of a trial of a fit, from far
    // below the limit of one step to far above it:
    let system =
        compiled(&STIFF.replace("y_m = \"fast_per_s * (x_m - y_m)\"", "y_m = \"-fast_per_s * y_m\""));
    let record = record(times(21, 0.05), vec![]);
    for product in [0.1, 1.0, 2.4, 2.73, 2.9, 10.0, 300.0, 2000.0] {
        let parameters = [product / 0.05, 0.0];
        let found =
            whole(&system, &record, (&[0.0, 1.0], &parameters), &[], &steps(1)).expect("stable steps");
        // The largest error of one explicit step within the limit is that at its edge: R(-2.5) - exp(-2.5) = 0.57.
        let after_one_sample = found.values[1];
        assert!((after_one_sample - (-product).exp()).abs() < 0.57, "{product}: {after_one_sample}");
        let after_four = found.values[4];
        assert!(after_four.abs() < 0.36 + (-4.0 * product).exp(), "{product}: {after_four}");
    }
}

#[test]
fn a_pause_that_is_too_long_to_simulate_is_named() {
    let system = compiled(STIFF);
    let mut sample_times = times(20, 0.05);
    sample_times.extend([1e6, 1e6 + 0.05]);
    let record = record(sample_times, vec![]);
    let error =
        whole(&system, &record, (&[1.0, 0.0], &[4.0, 1.0]), &[], &steps(1)).expect_err("a long pause");
    assert_eq!(
        error.to_string(),
        "trajectory 3: the pause from t = 0.95 s to 1e6 s is too long to simulate across (the \
         fastest rate of rates.y_m is 4.0e0 per second); give the rows after it a `trajectory` of their own"
    );
}

#[test]
fn a_rate_that_is_not_finite_names_its_operation() {
    let text = BALL.replace("\"-gravity_m_s2\"", "\"-gravity_m_s2 * 1 / (height_m * sin(0 * height_m))\"");
    let system = compiled(&text);
    let record = record(times(5, 0.1), vec![]);
    let error =
        whole(&system, &record, (&[1.0, 0.0], &[9.81, 0.8]), &[], &steps(1)).expect_err("a division by 0");
    assert_eq!(
        error.to_string(),
        "trajectory 3: the simulation diverged at t = 0 s: rates.velocity_m_s is not finite: \
         division by `height_m * sin(0 * height_m)` = 0"
    );
}

#[test]
fn an_if_whose_branches_agree_is_not_smoothed() {
    let rate = |text: &str| BALL.replace("\"-gravity_m_s2\"", &format!("\"-gravity_m_s2 + {text}\""));
    let continuous = rate("if(height_m < 0.2, 500 * (0.2 - height_m), 0)");
    assert!(compiled(&continuous).widths().is_empty());
    let jumping = rate("if(height_m < 0.2, 50, 0)");
    assert_eq!(compiled(&jumping).widths(), [0.01]);
}

#[test]
fn undeclared_widths_follow_from_the_motion() {
    let text = example("servo").expect("the example").replace("sign_width = { speed_rad_s = 0.05 }", "");
    let mut system = compiled(&text);
    let t = times(200, 0.01);
    let record = record(t.clone(), vec![Signal::new(&t, &vec![1.0; 200], Hold::Zero)]);
    let parameters = system.model().nominals();
    let window = Window { record: &record, first: 0, last: 199, start: &[0.0, 0.0], parameters: &parameters };
    system.fit_widths(&[window], &steps(16)).expect("a simulation");
    // The motor runs at (400 - 5) / 12 = 32.9 rad/s most of the time.
    assert!((system.widths()[0] - 0.32).abs() < 0.02, "{:?}", system.widths());
}

/// A body that dry friction holds against nine tenths of its force.
const HELD: &str = r#"
scenario = "system"
[states]
position_m = { start = "position_m" }
speed_m_s = { start = 0 }
[parameters]
force_m_s2 = { nominal = 9.0, frozen = true }
dry_m_s2 = { nominal = 10.0, frozen = true }
[rates]
position_m = "speed_m_s"
speed_m_s = "force_m_s2 - dry_m_s2 * sign(speed_m_s)"
[outputs]
position_m = { value = "position_m", sd = "estimate" }
"#;

#[test]
fn widths_are_halved_until_a_held_body_creeps_little() {
    // It creeps with w atanh(0.9); halving w = 0.01 m/s changes the position by half of that times t.
    let change = 0.005 * 0.9_f64.atanh() / 3.0_f64.sqrt();
    let record = record(times(1001, 0.001), vec![]);
    for (change_in_noise, halvings) in [(0.04, 0), (0.09, 1), (0.18, 2), (100.0, 4)] {
        let mut system = compiled(HELD);
        let parameters = system.model().nominals();
        let window =
            Window { record: &record, first: 0, last: 1000, start: &[0.0, 0.0], parameters: &parameters };
        let noise = [change / change_in_noise];
        let windows = [window];
        let chosen = system.choose_steps(&windows, &noise).expect("a simulation").options;
        system.narrow_widths(&windows, &noise, chosen);
        assert_eq!(system.widths(), [0.01 / f64::from(1 << halvings)], "{change_in_noise} of the noise");
    }
}

#[test]
fn widths_that_need_too_many_steps_are_not_taken() {
    // Where the speed is 0 the rate is 10 / w. With a reserve of 2, 64 steps of 0.01 s are stable to w = 0.00125 m/s.
    let mut system = compiled(&HELD.replace("nominal = 9.0", "nominal = 1.0"));
    let record = record(times(101, 0.01), vec![]);
    let parameters = system.model().nominals();
    let windows =
        [Window { record: &record, first: 0, last: 100, start: &[0.0, 0.0], parameters: &parameters }];
    let noise = [1e-7];
    let chosen = system.choose_steps(&windows, &noise).expect("a simulation").options;
    let options = system.narrow_widths(&windows, &noise, chosen);
    assert_eq!((system.widths(), options.substeps), (&[0.01 / 8.0][..], 64));
    let simulated = system.simulate(&windows, &all_seeds(&system), &options).pop().expect("one window");
    assert!(simulated.expect("a simulation").slopes.iter().all(|slope| slope.abs() < 2.0));
}

#[test]
fn windows_that_do_not_fit_their_system_are_refused() {
    let system = compiled(BALL);
    let record = record(times(5, 0.1), vec![]);
    let window = |last, start, parameters| Window { record: &record, first: 0, last, start, parameters };
    let error_of = |window: Window<'_>, seeds: &[Seed]| {
        system
            .simulate(&[window], seeds, &steps(1))
            .pop()
            .expect("a result")
            .expect_err("an error")
            .to_string()
    };
    assert_eq!(
        error_of(window(9, &[1.0, 0.0], &[9.81, 0.8]), &[]),
        "trajectory 3: samples 0 to 9 are not within its 5 samples"
    );
    assert_eq!(
        error_of(window(4, &[1.0], &[9.81, 0.8]), &[]),
        "trajectory 3: start has 1 values, but 2 are needed"
    );
    let frozen = System::compile(system.model(), &[0]).expect("compiles");
    let error =
        frozen.simulate(&[window(4, &[1.0, 0.0], &[9.81, 0.8])], &[Seed::Parameter(1)], &steps(1)).remove(0);
    assert!(
        error.expect_err("not active").to_string().contains("the parameter `restitution` has no derivative")
    );
    assert!(
        Record::new("r", vec![0.0, 0.0], vec![])
            .expect_err("equal times")
            .to_string()
            .contains("time must increase")
    );
}
