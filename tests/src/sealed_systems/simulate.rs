//! Simulates a generated data set: a plant with effects that its model lacks, measured with noise.

use super::laws::Law;
use super::plants::Plant;
use augsim_data::random_stream;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write as _;

/// Number of integration steps per sample.
const STEPS_PER_SAMPLE: usize = 20;
/// Number of samples for which the input is constant.
const HOLD_SAMPLES: usize = 12;

/// A generated data set, with the coefficients of its true effects.
#[derive(Debug)]
pub struct GeneratedSet {
    /// Text of the data file (CSV), with inputs and noisy outputs.
    pub csv: String,
    /// True coefficient of each effect, in the unit of the rate to which it is added.
    pub amounts: Vec<f64>,
    /// Seed with which it was drawn.
    pub seed: u64,
}

/// Added to the seed of a set whose plant diverges, to draw the set again.
const NEXT_DRAW: u64 = 1_000_000_000;

/// Generates a data set of `plant` with the effects `laws`.
///
/// Each effect comes with its size relative to the RMS of the equation's rate. A set in which a state is not finite is drawn
/// again with another seed.
///
/// # Panics
/// If each of ten draws diverges.
pub fn draw(plant: &Plant, laws: &[(Law, f64)], seed: u64) -> GeneratedSet {
    let draws = (0..10).map(|repeat| draw_once(plant, laws, seed + repeat * NEXT_DRAW));
    draws.flatten().next().unwrap_or_else(|| panic!("{} diverges with seed {seed}", plant.name))
}

/// Generates a data set; `None` if a state diverges.
fn draw_once(plant: &Plant, laws: &[(Law, f64)], seed: u64) -> Option<GeneratedSet> {
    let starts = starts(plant, seed);
    let Sizes { undisturbed, rate, x, v } = Sizes::measure(plant, &starts);
    let (equation, law_state) = plant.law_equation;
    let rms = |quantity: &dyn Fn(&Run, usize) -> f64| rms(&undisturbed, quantity);
    let duration = plant.size.1 as f64 * plant.size.2;
    let value = |law: &Law, state: &[f64], time: f64| {
        let (a, b) = (state[law_state] / x, state[equation] / v);
        if law.depends_on_speed {
            (law.term)(b, a, time / duration)
        } else {
            (law.term)(a, b, time / duration)
        }
    };
    let amounts: Vec<f64> = laws
        .iter()
        .map(|(law, share)| {
            let size = rms(&|r, k| value(law, &r.states[k], k as f64 * plant.size.2));
            share * rate / size.max(1e-12)
        })
        .collect();
    let mut process_rng = random_stream(seed, "sealed system motion", 0);
    let process_noise: Vec<f64> = (0..plant.size.1 / HOLD_SAMPLES + 2)
        .map(|_| -> f64 { StandardNormal.sample(&mut process_rng) })
        .map(|normal| plant.process_noise * rate * normal)
        .collect();
    let term = |state: &[f64], _: f64, time: f64| {
        let effects = laws.iter().zip(&amounts).map(|((law, _), amount)| amount * value(law, state, time));
        effects.sum::<f64>() + process_noise[(time / (plant.size.2 * HOLD_SAMPLES as f64)) as usize]
    };
    let mut rng = random_stream(seed, "sealed system noise", 0);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut csv = format!("trajectory,t_s,{}\n", plant.header);
    for (j, start) in starts.iter().enumerate() {
        let run = run(plant, &start.0, &start.1, &term);
        if run.states.iter().flatten().any(|value| !value.is_finite()) {
            return None;
        }
        for (k, state) in run.states.iter().enumerate() {
            // Writing to a string cannot fail.
            let _ = write!(csv, "{j},{:.6}", k as f64 * plant.size.2);
            if plant.input.1 > 0.0 {
                let _ = write!(csv, ",{:.9}", run.inputs[k]);
            }
            for (output, sd) in plant.outputs {
                let _ = write!(csv, ",{:.9}", state[*output] + sd * normal());
            }
            csv.push('\n');
        }
    }
    Some(GeneratedSet { csv, amounts, seed })
}

/// Converts a true coefficient `amount` of a library effect to the convention of the effect's kind.
///
/// `amount` applies to states in units of the typical sizes of the plant.
///
/// `None` for effects that are not powers of one state.
pub fn coefficient(plant: &Plant, law: &Law, amount: f64, seed: u64) -> Option<f64> {
    let Sizes { x, v, .. } = Sizes::measure(plant, &starts(plant, seed));
    let size = if law.depends_on_speed { v } else { x };
    let power = match law.name {
        "constant" => return Some(-amount),
        "asymmetric-damping" => 1,
        "quadratic-damping" | "asymmetric-stiffness" | "leak-square" => 2,
        "cubic-damping" | "cubic-stiffness" => 3,
        _ => return None,
    };
    Some(amount / size.powi(power))
}

/// Simulated runs of a plant without effects, and the RMS of its states and rates in them.
struct Sizes {
    undisturbed: Vec<Run>,
    /// RMS of the rate to which effects are added.
    rate: f64,
    /// RMS of the position or level in that equation.
    x: f64,
    /// RMS of the speed in that equation.
    v: f64,
}

impl Sizes {
    /// Simulates the plant without effects and computes the RMS of its rate, position and speed.
    fn measure(plant: &Plant, starts: &[(Vec<f64>, Vec<f64>)]) -> Self {
        let undisturbed: Vec<Run> = starts.iter().map(|s| run(plant, &s.0, &s.1, &|_, _, _| 0.0)).collect();
        let (equation, law_state) = plant.law_equation;
        let rate = rms(&undisturbed, &|r, k| (plant.rates)(&r.states[k], r.inputs[k])[equation]);
        let (x, v) = (
            rms(&undisturbed, &|r, k| r.states[k][law_state]),
            rms(&undisturbed, &|r, k| r.states[k][equation]),
        );
        Self { undisturbed, rate, x, v }
    }
}

/// Root mean square of `quantity(run, sample)` over all samples of all runs.
fn rms(runs: &[Run], quantity: &dyn Fn(&Run, usize) -> f64) -> f64 {
    let values: Vec<f64> =
        runs.iter().flat_map(|r| (0..r.states.len()).map(move |k| quantity(r, k))).collect();
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

/// Draws the initial state and the input samples of each record.
fn starts(plant: &Plant, seed: u64) -> Vec<(Vec<f64>, Vec<f64>)> {
    let mut rng = random_stream(seed, "sealed system starts", 0);
    let (records, samples, _) = plant.size;
    (0..records)
        .map(|_| {
            let start = plant.start.iter().map(|largest| {
                let share: f64 = rng.random_range(0.3..1.0);
                let sign = if plant.is_force && rng.random_bool(0.5) { -1.0 } else { 1.0 };
                sign * share * largest
            });
            let start: Vec<f64> = start.collect();
            let (middle, half) = plant.input;
            let levels: Vec<f64> =
                (0..=samples / HOLD_SAMPLES).map(|_| middle + half * rng.random_range(-1.0..1.0)).collect();
            (start, (0..samples).map(|k| levels[k / HOLD_SAMPLES]).collect())
        })
        .collect()
}

/// Simulated states and inputs of one record, sample by sample.
struct Run {
    states: Vec<Vec<f64>>,
    inputs: Vec<f64>,
}

/// Simulates one record, with `term(state, input, time)` added to the equation of effects.
fn run(plant: &Plant, start: &[f64], inputs: &[f64], term: &dyn Fn(&[f64], f64, f64) -> f64) -> Run {
    let dt = plant.size.2 / STEPS_PER_SAMPLE as f64;
    let mut state = start.to_vec();
    let mut states = Vec::with_capacity(inputs.len());
    for (k, &u) in inputs.iter().enumerate() {
        states.push(state.clone());
        for n in 0..STEPS_PER_SAMPLE {
            let time = k as f64 * plant.size.2 + n as f64 * dt;
            state = stepped(plant, &state, u, time, dt, term);
        }
    }
    Run { states, inputs: inputs.to_vec() }
}

/// State after one integration step of length `dt` (s), with a rebound if it reaches the stop.
fn stepped(
    plant: &Plant,
    state: &[f64],
    u: f64,
    time: f64,
    dt: f64,
    term: &dyn Fn(&[f64], f64, f64) -> f64,
) -> Vec<f64> {
    let step = |dt: f64| runge_kutta(plant, state, u, time, dt, term);
    let full_step = step(dt);
    let Some((stop, restitution)) = plant.stop.filter(|(stop, _)| state[0] <= *stop && full_step[0] > *stop)
    else {
        return full_step;
    };
    let (mut early, mut late) = (0.0, dt);
    for _ in 0..50 {
        let middle = 0.5 * (early + late);
        if step(middle)[0] > stop { late = middle } else { early = middle }
    }
    let mut at_stop = step(early);
    at_stop[1] *= -restitution;
    // Complete the step; a second impact within it does not happen.
    runge_kutta(plant, &at_stop, u, time + early, dt - early, term)
}

/// State after one Runge-Kutta step of order four and length `dt` (s).
fn runge_kutta(
    plant: &Plant,
    state: &[f64],
    u: f64,
    time: f64,
    dt: f64,
    term: &dyn Fn(&[f64], f64, f64) -> f64,
) -> Vec<f64> {
    let rates = |x: &[f64], t: f64| {
        let mut rates = (plant.rates)(x, u);
        rates[plant.law_equation.0] += term(x, u, t);
        rates
    };
    runge_kutta_step(state, time, dt, &rates)
}

/// State after one Runge-Kutta step of order four and length `dt` (s) with these rates of state and time.
pub(crate) fn runge_kutta_step(
    state: &[f64],
    time: f64,
    dt: f64,
    rates: &dyn Fn(&[f64], f64) -> Vec<f64>,
) -> Vec<f64> {
    let shifted = |k: &[f64], by: f64| -> Vec<f64> { state.iter().zip(k).map(|(x, k)| x + by * k).collect() };
    let k1 = rates(state, time);
    let k2 = rates(&shifted(&k1, 0.5 * dt), time + 0.5 * dt);
    let k3 = rates(&shifted(&k2, 0.5 * dt), time + 0.5 * dt);
    let k4 = rates(&shifted(&k3, dt), time + dt);
    (0..state.len()).map(|i| state[i] + dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])).collect()
}
