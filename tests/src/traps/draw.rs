//! A trap set from its seed: the motion, the errors of the sensors, the fault of the log, and two files.

use super::kinds::{Defect, Kind, Logging, Noise, Trap};
use super::logging::{Recording, late_inputs, settling, spoil};
use super::noise::{readings, white};
use super::plants::{Conditions, DECLARED_DELAY, Law, Plant};
use super::simulate::{Motion, Plan, closed_loop, open_loop, plans, simulate};
use augsim_data::random_stream;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::fmt::Write as _;

/// Samples for which process noise pushes alike, as in the long recordings of the sealed systems.
const PUSHED: usize = 12;
/// Samples for which a bump lasts, and its size in units of the rate's root mean square.
const BUMP: (usize, f64) = (3, 8.0);

/// A drawn set.
#[derive(Debug)]
pub struct Drawn {
    /// Model file.
    pub model: String,
    /// Table of the recordings.
    pub csv: String,
}

/// Draws a set of a plant from its seed alone.
pub fn draw(plant: &Plant, kind: &Kind, seed: u64) -> Drawn {
    let mut recordings = recordings(plant, kind, seed);
    let mut rng = random_stream(seed, "trap log", 0);
    if let Trap::Logging(fault) = kind.trap {
        spoil(&mut recordings, fault, &mut rng);
    }
    for recording in &mut recordings {
        empty_cells(recording, &kind.trap, &mut rng);
        if kind.trap == Trap::Jitter {
            let errs = |time: &mut f64| *time += plant.step_s * rng.random_range(-0.03..0.03);
            recording.times.iter_mut().skip(1).for_each(errs);
        }
    }
    Drawn { model: plant.model(kind), csv: table(plant, kind, &recordings) }
}

/// Truth without a peculiarity.
pub fn undisturbed(plant: &Plant) -> Conditions {
    Conditions { parameters: plant.truth(), surroundings: 0.0, push: 0.0, has_hidden_lag: false, law: None }
}

/// Recordings before a fault of the log that concerns whole columns.
fn recordings(plant: &Plant, kind: &Kind, seed: u64) -> Vec<Recording> {
    let trap = &kind.trap;
    let plans = plans(plant, trap, seed);
    let size = rate_size(plant, &plans[0]);
    let one = random_stream(seed, "trap defect", 0).random_range(0..plans.len());
    let each = |(j, plan): (usize, &Plan)| {
        let mut rng = random_stream(seed, "trap noise", j as u64);
        let errors = white(&mut rng, plan.times.len());
        let truth = Truth { plant, trap, recording: j, is_one: j == one, rate: size, seed };
        let motion = moved(plan, &truth, &errors);
        measure(plan, &truth, &motion, &errors, &mut rng)
    };
    plans.iter().enumerate().map(each).collect()
}

/// Root mean square of the pushed rate in an undisturbed recording.
fn rate_size(plant: &Plant, plan: &Plan) -> f64 {
    let now = undisturbed(plant);
    let plain = simulate(plant, plan, &mut open_loop(plan, false), &|_| now);
    let rate = |(state, u): (&_, &f64)| (plant.rates)(state, *u, &now)[plant.pushed].powi(2);
    (plain.states.iter().zip(&plain.inputs).map(rate).sum::<f64>() / plain.states.len() as f64).sqrt()
}

/// The truth of one recording.
struct Truth<'a> {
    plant: &'a Plant,
    trap: &'a Trap,
    recording: usize,
    /// Whether this is the recording that differs, where one does.
    is_one: bool,
    rate: f64,
    seed: u64,
}

impl Truth<'_> {
    /// Conditions from each row on.
    fn conditions(&self, samples: usize) -> Vec<Conditions> {
        let mut rng = random_stream(self.seed, "trap pushes", self.recording as u64);
        let pushes: Vec<f64> = (0..=samples / PUSHED).map(|_| StandardNormal.sample(&mut rng)).collect();
        let bump = rng.random_range(samples / 4..samples / 2);
        let at = |k: usize| {
            let mut now = undisturbed(self.plant);
            match self.trap {
                Trap::ProcessNoise(share) => now.push = share * self.rate * pushes[k / PUSHED],
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
        (0..samples).map(at).collect()
    }
}

/// Simulates a recording under its truth.
fn moved(plan: &Plan, truth: &Truth, errors: &[[f64; 2]]) -> Motion {
    let plant = truth.plant;
    let conditions = truth.conditions(plan.times.len());
    let at = |k: usize| conditions[k];
    if *truth.trap == Trap::ClosedLoop {
        let errors: Vec<[f64; 2]> = errors.iter().map(|e| [e[0] * plant.sd[0], e[1] * plant.sd[1]]).collect();
        return simulate(plant, plan, &mut closed_loop(plant, plan, &errors), &at);
    }
    let is_linear = *truth.trap == Trap::Logging(Logging::LinearHold);
    simulate(plant, plan, &mut open_loop(plan, is_linear), &at)
}

/// Readings and logged inputs of a recording.
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
            values = settling(&values);
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

/// Empties cells of the outputs where the trap says so.
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
                let (first, lasts) = (rng.random_range(0..samples - 25), rng.random_range(10..=25));
                column[first..first + lasts].fill(f64::NAN);
            }
        }
        Trap::TwoRates => {
            let slow = recording.outputs[1].iter_mut().enumerate();
            slow.filter(|(k, _)| k % 5 != 0).for_each(|(_, cell)| *cell = f64::NAN);
        }
        _ => {}
    }
}

/// The table of a set.
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
