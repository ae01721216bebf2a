//! Independent generator of fleets: units of one machine, whose parameters are equal or differ from unit to unit.
//!
//! Nothing here uses the engine under test: plants are integrated by a separate Runge-Kutta method. The discovery
//! gets a model file and a table with the column `group`, and the truth is read only after its answer.

mod plants;
mod score;

pub use plants::{FLEETS, FleetPlant};
pub use score::{Kind, Row, Summary, run};

use crate::sealed_systems::runge_kutta_step;
use augsim_data::random_stream;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write as _;

/// Number of integration steps per sample.
const STEPS_PER_SAMPLE: usize = 20;
/// Number of samples for which the input is constant.
const HOLD_SAMPLES: usize = 10;
/// Numbers of units in a fleet, in turn.
const UNITS: [usize; 5] = [4, 6, 8, 12, 20];
/// Standard deviation over units of the logarithm of a parameter that differs, smallest and largest.
const SPREAD: [f64; 2] = [0.1, 0.3];

/// What is true of a generated fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Names of the parameters that differ from unit to unit.
    pub individual: Vec<&'static str>,
    /// Kind of the effect that the model lacks; `None` if it lacks none.
    pub effect: Option<&'static str>,
    /// Number of units.
    pub units: usize,
    /// Values of the parameters of each unit, `[unit][parameter]`.
    pub values: Vec<Vec<f64>>,
}

/// A generated fleet: its data file (CSV) and what is true of it.
#[derive(Debug, Clone)]
pub struct Fleet {
    /// Text of the data file, with the columns `trajectory`, `group`, `t_s`, the input and the outputs.
    pub csv: String,
    /// What is true of the fleet.
    pub truth: Truth,
}

/// Draws the truth of the fleet with this seed: `differing` parameters differ, and an effect may be missing.
fn truth(plant: &FleetPlant, differing: usize, has_effect: bool, seed: u64) -> Truth {
    let mut rng = random_stream(seed, "fleet truth", 0);
    let units = UNITS[(seed / FLEETS.len() as u64) as usize % UNITS.len()];
    let mut places: Vec<usize> = (0..plant.parameters.len()).collect();
    let mut individual = Vec::new();
    while individual.len() < differing.min(places.len()) {
        let chosen = rng.random_range(0..places.len());
        individual.push(places.swap_remove(chosen));
    }
    individual.sort_unstable();
    let mut values = vec![plant.parameters.iter().map(|p| p.1).collect::<Vec<f64>>(); units];
    for place in &individual {
        let spread = rng.random_range(SPREAD[0]..SPREAD[1]);
        for unit in &mut values {
            unit[*place] *= (spread * normal(&mut rng)).exp();
        }
    }
    Truth {
        individual: individual.iter().map(|place| plant.parameters[*place].0).collect(),
        effect: has_effect.then_some(plant.effect),
        units,
        values,
    }
}

/// One standard normal value.
fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Generates the fleet with this seed, of which `differing` parameters differ; an effect may be missing from the model.
pub fn draw(plant: &FleetPlant, differing: usize, has_effect: bool, seed: u64) -> Fleet {
    let truth = truth(plant, differing, has_effect, seed);
    let mut rng = random_stream(seed, "fleet motion", 0);
    let runs = 1 + (seed % 3) as usize;
    let amount = if has_effect { plant.effect_amount } else { 0.0 };
    let mut rows: Vec<(String, Vec<f64>)> = Vec::new();
    for (unit, values) in truth.values.iter().enumerate() {
        for run in 0..runs {
            let levels: Vec<f64> = (0..plant.samples / HOLD_SAMPLES + 2)
                .map(|_| rng.random_range(plant.input[0]..plant.input[1]))
                .collect();
            let mut state = plant.start.to_vec();
            for k in 0..plant.samples {
                let row = vec![k as f64 * plant.step_s, levels[k / HOLD_SAMPLES], state[plant.measured]];
                rows.push((format!("unit{unit}run{run},unit {}", unit + 1), row));
                let input = levels[k / HOLD_SAMPLES];
                let rate = |x: &[f64], _: f64| (plant.rate)(x, input, values, amount);
                for _ in 0..STEPS_PER_SAMPLE {
                    state = runge_kutta_step(&state, 0.0, plant.step_s / STEPS_PER_SAMPLE as f64, &rate);
                }
            }
        }
    }
    let mean = rows.iter().map(|(_, row)| row[2]).sum::<f64>() / rows.len() as f64;
    let spread =
        (rows.iter().map(|(_, row)| (row[2] - mean).powi(2)).sum::<f64>() / rows.len() as f64).sqrt();
    let mut csv = format!("trajectory,group,t_s,{},{}\n", plant.input_column, plant.output_column);
    for (label, row) in &rows {
        let measured = row[2] + plant.noise * spread * normal(&mut rng);
        let _ = writeln!(csv, "{label},{:.4},{:.6},{measured:.7}", row[0], row[1]);
    }
    Fleet { csv, truth }
}

#[cfg(test)]
mod tests {
    //! Contract: a fleet depends on its seed alone; the units differ in the parameters that the truth names and in no
    //! other; a missing effect changes the data.
    use super::*;

    #[test]
    fn units_differ_in_the_named_parameters_only() {
        for plant in &FLEETS {
            let (fleet, again) = (draw(plant, 1, false, 3), draw(plant, 1, false, 3));
            assert_eq!((&fleet.csv, fleet.truth.individual.len()), (&again.csv, 1), "{}", plant.name);
            for (place, (name, _)) in plant.parameters.iter().enumerate() {
                let differs = fleet.truth.values.iter().any(|v| v[place] != fleet.truth.values[0][place]);
                assert_eq!(differs, fleet.truth.individual.contains(name), "{} {name}", plant.name);
            }
            assert!(!fleet.csv.contains("NaN") && !fleet.csv.contains("inf"), "{}", plant.name);
            let equal = draw(plant, 0, false, 3);
            assert!(equal.truth.individual.is_empty() && equal.csv != draw(plant, 0, true, 3).csv);
        }
    }
}
