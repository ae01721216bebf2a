//! A sealed set: a plant with laws, simulated and measured with noise.

use super::laws::Law;
use super::plants::Plant;
use augsim_data::random_stream;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write as _;

/// Steps of a sample.
const STEPS: usize = 20;
/// Samples for which an input is held.
const HELD: usize = 12;

/// A drawn set.
#[derive(Debug)]
pub struct Drawn {
    /// The table.
    pub csv: String,
    /// Amount of each law, in the unit of the rate.
    pub amounts: Vec<f64>,
}

/// Draws a set of `plant` with `laws`, each with a share of the root mean square of the equation's declared rate.
pub fn draw(plant: &Plant, laws: &[(Law, f64)], seed: u64) -> Drawn {
    let starts = starts(plant, seed);
    let Sizes { plain, rate, x, v } = Sizes::of(plant, &starts);
    let (equation, moved) = plant.law_in;
    let rms = |of: &dyn Fn(&Run, usize) -> f64| rms(&plain, of);
    let lasts = plant.size.1 as f64 * plant.size.2;
    let value = |law: &Law, state: &[f64], time: f64| {
        let (a, b) = (state[moved] / x, state[equation] / v);
        if law.of_speed { (law.term)(b, a, time / lasts) } else { (law.term)(a, b, time / lasts) }
    };
    let amounts: Vec<f64> = laws
        .iter()
        .map(|(law, share)| {
            let size = rms(&|r, k| value(law, &r.states[k], k as f64 * plant.size.2));
            share * rate / size.max(1e-12)
        })
        .collect();
    let mut shake = random_stream(seed, "sealed system motion", 0);
    let shakes: Vec<f64> = (0..plant.size.1 / HELD + 2)
        .map(|_| -> f64 { StandardNormal.sample(&mut shake) })
        .map(|normal| plant.motion * rate * normal)
        .collect();
    let term = |state: &[f64], _: f64, time: f64| {
        let lawful = laws.iter().zip(&amounts).map(|((law, _), amount)| amount * value(law, state, time));
        lawful.sum::<f64>() + shakes[(time / (plant.size.2 * HELD as f64)) as usize]
    };
    let mut rng = random_stream(seed, "sealed system noise", 0);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut csv = format!("trajectory,t_s,{}\n", plant.header);
    for (j, start) in starts.iter().enumerate() {
        let run = run(plant, &start.0, &start.1, &term);
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
    Drawn { csv, amounts }
}

/// The amount of a law of the library as its kind measures it, from its amount in units of the plant's sizes: polynomials of one
/// quantity; nothing for others.
pub fn amount(plant: &Plant, law: &Law, amount: f64, seed: u64) -> Option<f64> {
    let Sizes { x, v, .. } = Sizes::of(plant, &starts(plant, seed));
    let size = if law.of_speed { v } else { x };
    let power = match law.name {
        "constant" => return Some(-amount),
        "asymmetric-damping" => 1,
        "quadratic-damping" | "asymmetric-stiffness" | "leak-square" => 2,
        "cubic-damping" | "cubic-stiffness" => 3,
        _ => return None,
    };
    Some(amount / size.powi(power))
}

/// Runs of a plant without laws, and sizes in them.
struct Sizes {
    plain: Vec<Run>,
    /// Of the rate that laws are added to.
    rate: f64,
    /// Of the position or level, and of the speed, that laws are of.
    x: f64,
    v: f64,
}

impl Sizes {
    fn of(plant: &Plant, starts: &[(Vec<f64>, Vec<f64>)]) -> Self {
        let plain: Vec<Run> = starts.iter().map(|s| run(plant, &s.0, &s.1, &|_, _, _| 0.0)).collect();
        let (equation, moved) = plant.law_in;
        let rate = rms(&plain, &|r, k| (plant.rates)(&r.states[k], r.inputs[k])[equation]);
        let (x, v) = (rms(&plain, &|r, k| r.states[k][moved]), rms(&plain, &|r, k| r.states[k][equation]));
        Self { plain, rate, x, v }
    }
}

/// Root mean square of a quantity over runs.
fn rms(runs: &[Run], of: &dyn Fn(&Run, usize) -> f64) -> f64 {
    let all: Vec<f64> = runs.iter().flat_map(|r| (0..r.states.len()).map(move |k| of(r, k))).collect();
    (all.iter().map(|x| x * x).sum::<f64>() / all.len() as f64).sqrt()
}

/// Starts and inputs of all records.
fn starts(plant: &Plant, seed: u64) -> Vec<(Vec<f64>, Vec<f64>)> {
    let mut rng = random_stream(seed, "sealed system starts", 0);
    let (records, samples, _) = plant.size;
    (0..records)
        .map(|_| {
            let start = plant.start.iter().map(|most| {
                let share: f64 = rng.random_range(0.3..1.0);
                let sign = if plant.is_force && rng.random_bool(0.5) { -1.0 } else { 1.0 };
                sign * share * most
            });
            let start: Vec<f64> = start.collect();
            let (middle, half) = plant.input;
            let levels: Vec<f64> =
                (0..=samples / HELD).map(|_| middle + half * rng.random_range(-1.0..1.0)).collect();
            (start, (0..samples).map(|k| levels[k / HELD]).collect())
        })
        .collect()
}

struct Run {
    states: Vec<Vec<f64>>,
    inputs: Vec<f64>,
}

fn run(plant: &Plant, start: &[f64], inputs: &[f64], term: &dyn Fn(&[f64], f64, f64) -> f64) -> Run {
    let dt = plant.size.2 / STEPS as f64;
    let mut state = start.to_vec();
    let mut states = Vec::with_capacity(inputs.len());
    for (k, &u) in inputs.iter().enumerate() {
        states.push(state.clone());
        for n in 0..STEPS {
            let time = k as f64 * plant.size.2 + n as f64 * dt;
            state = stepped(plant, &state, u, time, dt, term);
        }
    }
    Run { states, inputs: inputs.to_vec() }
}

/// A step that stops and turns back at the stop.
fn stepped(
    plant: &Plant,
    state: &[f64],
    u: f64,
    time: f64,
    dt: f64,
    term: &dyn Fn(&[f64], f64, f64) -> f64,
) -> Vec<f64> {
    let step = |dt: f64| runge_kutta(plant, state, u, time, dt, term);
    let whole = step(dt);
    let Some((stop, restitution)) = plant.stop.filter(|(stop, _)| state[0] <= *stop && whole[0] > *stop)
    else {
        return whole;
    };
    let (mut early, mut late) = (0.0, dt);
    for _ in 0..50 {
        let middle = 0.5 * (early + late);
        if step(middle)[0] > stop { late = middle } else { early = middle }
    }
    let mut there = step(early);
    there[1] *= -restitution;
    // What is left of the step; a second impact within it would need many thousand.
    runge_kutta(plant, &there, u, time + early, dt - early, term)
}

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
        rates[plant.law_in.0] += term(x, u, t);
        rates
    };
    let at = |k: &[f64], by: f64| -> Vec<f64> { state.iter().zip(k).map(|(x, k)| x + by * k).collect() };
    let k1 = rates(state, time);
    let k2 = rates(&at(&k1, 0.5 * dt), time + 0.5 * dt);
    let k3 = rates(&at(&k2, 0.5 * dt), time + 0.5 * dt);
    let k4 = rates(&at(&k3, dt), time + dt);
    (0..state.len()).map(|i| state[i] + dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])).collect()
}
