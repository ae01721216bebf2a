//! Simulates a data set: a plant with an effect that its model lacks, measured with noise.

use super::effects::Memory;
use super::plants::{Case, PLANTS, Plant};
use crate::sealed_systems::runge_kutta_step;
use augsim_data::random_stream;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write as _;

/// Number of integration steps per sample.
const STEPS_PER_SAMPLE: usize = 20;
/// RMS of a static law, relative to that of the rate to which it is added.
const STATIC_SHARE: f64 = 0.2;

/// Values of an effect's parameters, drawn for one set.
#[derive(Clone, Copy, Debug)]
struct Sizes {
    /// Time constant of the hidden state, s.
    lag_s: f64,
    /// Ratio of the second capacity to the first, or of the second mass to the first.
    ratio: f64,
    /// Delay of the input in samples.
    delay: usize,
    /// Angular frequency of the second mass with the first held, rad/s, and its damping ratio.
    mode: (f64, f64),
    /// Force of friction, in the unit of the rate, and the distance over which it builds up.
    friction: (f64, f64),
    /// Typical absolute value of the state that gets the effect, and of its rate.
    typical: (f64, f64),
}

/// Returns the text of a data file (CSV) for a case, with inputs and the noisy output.
pub fn draw((plant, memory): Case, seed: u64) -> String {
    let plant = &PLANTS[plant];
    let mut rng = random_stream(seed, "sealed memory", 0);
    let mut uniform = |low: f64, high: f64| -> f64 { rng.random_range(low..high) };
    let mut sizes = Sizes {
        lag_s: plant.time_constant_s * uniform(0.12, 0.35),
        ratio: uniform(0.25, 0.6),
        delay: uniform(2.0, 6.0) as usize,
        mode: (uniform(3.0, 7.0) / plant.time_constant_s, uniform(0.03, 0.1)),
        friction: (uniform(0.15, 0.4), uniform(0.1, 0.35)),
        typical: (1.0, 1.0),
    };
    let (records, samples, _) = plant.size;
    let records: Vec<(Vec<f64>, Vec<f64>)> = (0..records)
        .map(|_| {
            let start = plant.start.iter().map(|(middle, half)| middle + half * uniform(-1.0, 1.0)).collect();
            let levels: Vec<f64> = (0..=samples / plant.hold)
                .map(|_| plant.input.0 + plant.input.1 * uniform(-1.0, 1.0))
                .collect();
            (start, (0..samples).map(|k| levels[k / plant.hold]).collect())
        })
        .collect();
    let plain: Vec<(f64, f64)> = records
        .iter()
        .flat_map(|(start, inputs)| {
            let states = states_along(plant, Memory::None, sizes, start, inputs);
            let at =
                |(k, x): (usize, Vec<f64>)| (x[plant.equation], (plant.rates)(&x, inputs[k])[plant.equation]);
            states.into_iter().enumerate().map(at).collect::<Vec<_>>()
        })
        .collect();
    let rms = |value: fn(&(f64, f64)) -> f64| {
        (plain.iter().map(|p| value(p).powi(2)).sum::<f64>() / plain.len() as f64).sqrt()
    };
    sizes.typical = (rms(|p| p.0), rms(|p| p.1));
    let mut noise_rng = random_stream(seed, "sealed memory noise", 0);
    let mut csv = format!("trajectory,t_s,{}\n", plant.header);
    for (j, (start, inputs)) in records.iter().enumerate() {
        for (k, x) in states_along(plant, memory, sizes, start, inputs).iter().enumerate() {
            let u = actual_input(plant, memory, sizes, x, inputs, k);
            let y = measured(plant, memory, x, u);
            let normal: f64 = StandardNormal.sample(&mut noise_rng);
            // Writing to a string cannot fail.
            let _ = write!(csv, "{j},{:.6}", k as f64 * plant.size.2);
            if plant.input.1 > 0.0 {
                let _ = write!(csv, ",{:.9}", inputs[k]);
            }
            let _ = writeln!(csv, ",{:.9}", y + plant.noise * normal);
        }
    }
    csv
}

/// Number of hidden states of an effect; they follow the declared states of the plant.
fn hidden_states(memory: Memory) -> usize {
    match memory {
        Memory::None | Memory::Static(_) | Memory::InputDelay => 0,
        Memory::ElasticMode => 2,
        _ => 1,
    }
}

/// States at all samples: the declared ones, then the hidden ones.
///
/// Hidden states begin in equilibrium with the plant.
fn states_along(plant: &Plant, memory: Memory, sizes: Sizes, start: &[f64], inputs: &[f64]) -> Vec<Vec<f64>> {
    let mut state = start.to_vec();
    let equilibrium = match memory {
        Memory::SensorLag => (plant.output)(start, inputs[0]),
        Memory::InputLag => inputs[0],
        Memory::SecondMass | Memory::LossySecondMass => start[plant.equation],
        _ => 0.0,
    };
    state.extend(std::iter::repeat_n(equilibrium, hidden_states(memory)));
    if memory == Memory::ElasticMode {
        // The second mass moves with the first.
        state[plant.start.len() + 1] = start[plant.equation];
    }
    let dt = plant.size.2 / STEPS_PER_SAMPLE as f64;
    let mut states = Vec::with_capacity(inputs.len());
    for k in 0..inputs.len() {
        states.push(state.clone());
        for _ in 0..STEPS_PER_SAMPLE {
            state = runge_kutta_step(&state, 0.0, dt, &|x, _| rates(plant, memory, sizes, x, inputs, k));
        }
    }
    states
}

/// The input that acts on the plant during sample `k`.
fn actual_input(plant: &Plant, memory: Memory, sizes: Sizes, x: &[f64], inputs: &[f64], k: usize) -> f64 {
    match memory {
        Memory::InputLag => x[plant.start.len()],
        Memory::InputDelay => inputs[k.saturating_sub(sizes.delay)],
        Memory::Static("saturated input") => {
            let limit = 0.6 * plant.input.1;
            plant.input.0 + (inputs[k] - plant.input.0).clamp(-limit, limit)
        }
        _ => inputs[k],
    }
}

/// What the sensor shows, without noise.
fn measured(plant: &Plant, memory: Memory, x: &[f64], u: f64) -> f64 {
    let hidden = x.get(plant.start.len()).copied().unwrap_or(0.0);
    match memory {
        Memory::SensorLag => hidden,
        Memory::SecondRc => (plant.output)(x, u) - hidden,
        _ => (plant.output)(x, u),
    }
}

/// Rates of all states: the declared ones with the effect, then the hidden ones.
fn rates(plant: &Plant, memory: Memory, sizes: Sizes, x: &[f64], inputs: &[f64], k: usize) -> Vec<f64> {
    let (u, n, e) = (actual_input(plant, memory, sizes, x, inputs, k), plant.start.len(), plant.equation);
    let mut d = (plant.rates)(&x[..n], u);
    let (z, speed) = (x.get(n).copied().unwrap_or(0.0), x[e]);
    let (size, rate) = sizes.typical;
    let lag = sizes.lag_s;
    match memory {
        Memory::None | Memory::InputDelay => {}
        Memory::Static(law) => d[e] += STATIC_SHARE * rate * static_law(law, x[0], speed / size),
        Memory::SensorLag => d.push(((plant.output)(&x[..n], u) - z) / lag),
        Memory::InputLag => d.push((inputs[k] - z) / lag),
        Memory::SecondRc => d.push((0.025 * u - z) / lag),
        Memory::SecondMass | Memory::LossySecondMass => {
            // Heat that leaves the first capacity enters the second, which is `ratio` times as large.
            let flow = sizes.ratio * (x[e] - z) / lag;
            d[e] -= flow;
            let loss = if memory == Memory::LossySecondMass { 0.3 * (z - 22.0) / lag } else { 0.0 };
            d.push((x[e] - z) / lag - loss);
        }
        Memory::ElasticMode => {
            let (w, damping) = sizes.mode;
            let pull = w * w * z + 2.0 * damping * w * (speed - x[n + 1]);
            d[e] -= sizes.ratio * pull;
            d.push(speed - x[n + 1]);
            d.push(pull);
        }
        Memory::Dahl | Memory::BoucWen | Memory::LuGre => {
            let force = sizes.friction.0 * rate;
            // The typical deflection is that of a swing at the typical speed.
            let distance = sizes.friction.1 * size * plant.time_constant_s;
            let slide = match memory {
                Memory::Dahl => speed.abs() * z / distance,
                Memory::BoucWen => 0.5 * (speed.abs() * z + 0.7 * speed * z.abs()) / distance,
                _ => speed.abs() * z / (distance * (1.0 + 0.6 * (-(speed / (0.3 * size)).powi(2)).exp())),
            };
            d[e] -= force * z / distance;
            d.push(speed - slide);
        }
    }
    d
}

/// Value of a static law, about 1, at the first state and the state `z` that gets the effect over its size.
fn static_law(law: &str, first: f64, z: f64) -> f64 {
    match law {
        "cubic stiffness" => -(first / 0.15).powi(3),
        "quadratic loss" => -z.abs() * z,
        "cubic loss" => -z.powi(3),
        "linear loss" => -z,
        "radiation" => -((first + 273.0) / 300.0).powi(4),
        "dry friction" => -(z / 0.05).tanh(),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    //! Contract: all cases give finite data with the plant's columns, and the seed decides all of them.
    use super::super::plants::{MEMORY_CASES, NULL_CASES};
    use super::*;

    #[test]
    fn every_case_gives_finite_data() {
        for (number, case) in MEMORY_CASES.iter().chain(&NULL_CASES).enumerate() {
            let csv = draw(*case, 900 + number as u64);
            let (records, samples, _) = PLANTS[case.0].size;
            assert_eq!(csv.lines().count(), 1 + records * samples, "{case:?}");
            let mut cells = csv.lines().skip(1).flat_map(|line| line.split(','));
            assert!(cells.all(|cell| cell.parse::<f64>().is_ok_and(|x| x.abs() < 1e4)), "{case:?}");
            assert_eq!(csv, draw(*case, 900 + number as u64));
        }
    }
}
