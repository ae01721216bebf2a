//! Generates a data set with one peculiarity from its seed: simulation, noise, logging fault, two files.

use super::kinds::{Defect, Kind, Logging, Noise, Trap};
use super::logging::{Recording, apply_fault, late_inputs, settling_sensor};
use super::noise::{readings, white};
use super::plants::{Conditions, DECLARED_DELAY, Law, Plant};
use super::simulate::{Motion, Plan, closed_loop, open_loop, plans, simulate};
use augsim_data::random_stream;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::fmt::Write as _;

/// Number of samples for which process noise is constant, as in the long recordings of `sealed_systems`.
const PUSH_HOLD_SAMPLES: usize = 12;
/// Duration of a bump of the rig, samples, and its size in units of the RMS of the rate.
const BUMP: (usize, f64) = (3, 8.0);

/// A generated data set: model file and data file.
#[derive(Debug)]
pub struct GeneratedSet {
    /// Text of the model file that is given to the discovery.
    pub model: String,
    /// Text of the data file (CSV) that is given to the discovery.
    pub csv: String,
}

/// Generates the files of one data set of a plant, with the peculiarity `kind`, from its seed.
pub fn draw(plant: &Plant, kind: &Kind, seed: u64) -> GeneratedSet {
    let mut recordings = recordings(plant, kind, seed);
    let mut rng = random_stream(seed, "trap log", 0);
    if let Trap::Logging(fault) = kind.trap {
        apply_fault(&mut recordings, fault, &mut rng);
    }
    for recording in &mut recordings {
        empty_cells(recording, &kind.trap, &mut rng);
        if kind.trap == Trap::Jitter {
            let add_jitter = |time: &mut f64| *time += plant.step_s * rng.random_range(-0.03..0.03);
            recording.times.iter_mut().skip(1).for_each(add_jitter);
        }
    }
    GeneratedSet { model: plant.model(kind), csv: table(plant, kind, &recordings) }
}

/// True conditions of the plant without any peculiarity.
pub fn undisturbed(plant: &Plant) -> Conditions {
    Conditions { parameters: plant.truth(), surroundings: 0.0, push: 0.0, has_hidden_lag: false, law: None }
}

/// Simulates and measures all recordings of a set, before logging faults are applied.
fn recordings(plant: &Plant, kind: &Kind, seed: u64) -> Vec<Recording> {
    let trap = &kind.trap;
    let plans = plans(plant, trap, seed);
    let size = rate_size(plant, &plans[0]);
    let differing = random_stream(seed, "trap defect", 0).random_range(0..plans.len());
    let recording = |(j, plan): (usize, &Plan)| {
        let mut rng = random_stream(seed, "trap noise", j as u64);
        let errors = white(&mut rng, plan.times.len());
        let truth = Truth { plant, trap, recording: j, is_one: j == differing, rate: size, seed };
        let motion = simulated_motion(plan, &truth, &errors);
        measure(plan, &truth, &motion, &errors, &mut rng)
    };
    plans.iter().enumerate().map(recording).collect()
}

/// RMS of the rate on which disturbances act, in a recording without peculiarity.
fn rate_size(plant: &Plant, plan: &Plan) -> f64 {
    let now = undisturbed(plant);
    let plain = simulate(plant, plan, &mut open_loop(plan, false), &|_| now);
    let rate = |(state, u): (&_, &f64)| (plant.rates)(state, *u, &now)[plant.pushed].powi(2);
    (plain.states.iter().zip(&plain.inputs).map(rate).sum::<f64>() / plain.states.len() as f64).sqrt()
}

/// Plant, peculiarity and seed from which the true motion of one recording is simulated.
struct Truth<'a> {
    plant: &'a Plant,
    trap: &'a Trap,
    recording: usize,
    /// Whether this is the one recording that differs from the others, if the peculiarity affects only one.
    is_one: bool,
    rate: f64,
    seed: u64,
}

impl Truth<'_> {
    /// True conditions of the recording, from each row (sample) to the next.
    fn conditions(&self, samples: usize) -> Vec<Conditions> {
        let mut rng = random_stream(self.seed, "trap pushes", self.recording as u64);
        let pushes: Vec<f64> =
            (0..=samples / PUSH_HOLD_SAMPLES).map(|_| StandardNormal.sample(&mut rng)).collect();
        let bump = rng.random_range(samples / 4..samples / 2);
        let conditions_at = |k: usize| {
            let mut now = undisturbed(self.plant);
            match self.trap {
                Trap::ProcessNoise(share) => now.push = share * self.rate * pushes[k / PUSH_HOLD_SAMPLES],
                Trap::Declared(law) => now.law = Some(*law),
                Trap::Defect(Defect::ParameterInOne) if self.is_one => now.parameters[0] *= 1.5,
                Trap::Defect(Defect::DriftBetween) => now.parameters[1] *= 1.0 + 0.02 * self.recording as f64,
                Trap::Defect(Defect::SurroundingsInOne) if self.is_one => {
                    now.surroundings = self.plant.other_surroundings;
                }
                Trap::Defect(Defect::HiddenLag) => now.has_hidden_lag = true,
                Trap::Defect(Defect::Bump) if self.is_one && (bump..bump + BUMP.0).contains(&k) => {
                    now.push = BUMP.1 * self.rate;
                }
                Trap::Defect(Defect::StepHalfWay) if 2 * k >= samples => now.parameters[1] *= 1.25,
                _ => {}
            }
            now
        };
        (0..samples).map(conditions_at).collect()
    }
}

/// Simulates one recording under its true conditions.
fn simulated_motion(plan: &Plan, truth: &Truth, errors: &[[f64; 2]]) -> Motion {
    let plant = truth.plant;
    let conditions = truth.conditions(plan.times.len());
    let conditions_at = |k: usize| conditions[k];
    if *truth.trap == Trap::ClosedLoop {
        let errors: Vec<[f64; 2]> = errors.iter().map(|e| [e[0] * plant.sd[0], e[1] * plant.sd[1]]).collect();
        return simulate(plant, plan, &mut closed_loop(plant, plan, &errors), &conditions_at);
    }
    let is_linear = *truth.trap == Trap::Logging(Logging::LinearHold);
    simulate(plant, plan, &mut open_loop(plan, is_linear), &conditions_at)
}

/// Measures one simulated recording: noisy outputs and logged inputs.
fn measure(
    plan: &Plan,
    truth: &Truth,
    motion: &Motion,
    errors: &[[f64; 2]],
    rng: &mut Xoshiro256PlusPlus,
) -> Recording {
    let plant = truth.plant;
    let noise = if let Trap::Noise(noise) = truth.trap { *noise } else { Noise::White };
    let conditions = truth.conditions(plan.times.len());
    let mut output = |i: usize| {
        let rows = motion.states.iter().zip(&conditions);
        let mut values: Vec<f64> =
            rows.map(|(state, now)| (plant.measured)(state, &now.parameters)[i]).collect();
        if *truth.trap == Trap::Logging(Logging::SettlingSensor) && i == 0 {
            values = settling_sensor(&values);
        }
        let normal: Vec<f64> = errors.iter().map(|e| e[i]).collect();
        let mut read = readings(noise, (&values, &normal), (plant.sd[i], plant.zero[i]), rng);
        if *truth.trap == Trap::Declared(Law::SensorRange) && i == 0 {
            let [low, high] = plant.range;
            read.iter_mut().for_each(|y| *y = y.clamp(low, high));
        }
        read
    };
    let outputs = vec![output(0), output(1)];
    let inputs = match truth.trap {
        Trap::Logging(Logging::InputLate(late)) => late_inputs(plan, *late),
        Trap::Declared(Law::Delay) => late_inputs(plan, -(DECLARED_DELAY as isize)),
        _ => motion.inputs.clone(),
    };
    Recording { times: plan.times.clone(), inputs, outputs }
}

/// Empties cells of the outputs if the peculiarity `trap` consists of empty cells.
fn empty_cells(recording: &mut Recording, trap: &Trap, rng: &mut Xoshiro256PlusPlus) {
    let samples = recording.times.len();
    match trap {
        Trap::DropOuts => {
            for cell in recording.outputs.iter_mut().flatten() {
                *cell = if rng.random_bool(0.15) { f64::NAN } else { *cell };
            }
        }
        Trap::DropOutRuns => {
            for column in &mut recording.outputs {
                let (first, length) = (rng.random_range(0..samples - 25), rng.random_range(10..=25));
                column[first..first + length].fill(f64::NAN);
            }
        }
        Trap::TwoRates => {
            let slow = recording.outputs[1].iter_mut().enumerate();
            slow.filter(|(k, _)| k % 5 != 0).for_each(|(_, cell)| *cell = f64::NAN);
        }
        _ => {}
    }
}

/// Text of the data file (CSV) of the recordings.
fn table(plant: &Plant, kind: &Kind, recordings: &[Recording]) -> String {
    let outputs = plant.measured_outputs(kind);
    let names: Vec<&str> = plant.outputs.iter().take(outputs).map(|(name, _)| *name).collect();
    let mut csv = format!("trajectory,t_s,{},{}\n", plant.input, names.join(","));
    for (j, recording) in recordings.iter().enumerate() {
        for (k, (time, input)) in recording.times.iter().zip(&recording.inputs).enumerate() {
            // Writing to a string cannot fail.
            let _ = write!(csv, "r{j:02},{time:.7},{input:.9}");
            for column in recording.outputs.iter().take(outputs) {
                let _ = if column[k].is_nan() { write!(csv, ",") } else { write!(csv, ",{:.9}", column[k]) };
            }
            csv.push('\n');
        }
    }
    csv
}
