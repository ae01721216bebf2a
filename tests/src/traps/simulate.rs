//! Simulates a plant over one recording: Runge-Kutta steps of order four, 50 per sample.

use super::kinds::{Layout, Logging, Trap};
use super::plants::{Conditions, Plant, State};
use augsim_data::random_stream;
use rand::RngExt;
use std::ops::Range;

/// Number of integration steps per sample.
const SUBSTEPS: usize = 50;
/// Number of input samples before the first row and after the last one, so that a log can be early or late.
pub const MARGIN_SAMPLES: usize = 8;
/// Number of samples for which the input is constant.
const HOLD_SAMPLES: usize = 12;

/// Initial state, input and times of one recording, chosen before the simulation.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Initial state of the recording.
    pub start: State,
    /// Input values: that of row k is at `MARGIN_SAMPLES + k`, and those before row 0 equal it.
    pub levels: Vec<f64>,
    /// Times of the rows (samples), s.
    pub times: Vec<f64>,
}

/// Simulated states and inputs at the rows (samples) of one recording.
#[derive(Clone, Debug)]
pub struct Motion {
    /// True state at each row.
    pub states: Vec<State>,
    /// Inputs that act from each row to the next.
    pub inputs: Vec<f64>,
}

/// Draws initial states, inputs and times of all recordings of a set.
pub fn plans(plant: &Plant, trap: &Trap, seed: u64) -> Vec<Plan> {
    let mut rng = random_stream(seed, "trap plans", 0);
    let (recordings, samples) = match trap {
        Trap::Layout(Layout::One) => (1, 800),
        Trap::Layout(Layout::VeryShort) => (10, 15),
        Trap::Layout(Layout::ManyShort) => (40, 25),
        _ => (8, 200),
    };
    let hold_samples = if *trap == Trap::Logging(Logging::LinearHold) { 3 } else { HOLD_SAMPLES };
    let mut plan = || {
        let start = plant.start.map(|(middle, half)| middle + half * rng.random_range(-1.0..1.0));
        let (middle, half) = plant.drive;
        let drawn: Vec<f64> = (0..=(samples + MARGIN_SAMPLES) / hold_samples)
            .map(|_| middle + half * rng.random_range(-1.0..1.0))
            .collect();
        let later = (0..=samples + MARGIN_SAMPLES).map(|k| drawn[k / hold_samples]);
        let levels = std::iter::repeat_n(drawn[0], MARGIN_SAMPLES).chain(later).collect();
        let mut time = 0.0;
        let times = (0..samples).map(|_| {
            let now = time;
            let share = if *trap == Trap::Uneven { rng.random_range(0.5..1.5) } else { 1.0 };
            time += share * plant.step_s;
            now
        });
        Plan { start: [start[0], start[1], start[0]], levels, times: times.collect() }
    };
    if *trap == Trap::Layout(Layout::Repeats) {
        return vec![plan(); recordings];
    }
    (0..recordings).map(|_| plan()).collect()
}

/// Simulates the motion of one recording.
///
/// `input` takes a row and its state, and returns the input at both ends of the interval after the row.
pub fn simulate(
    plant: &Plant,
    plan: &Plan,
    input: &mut dyn FnMut(usize, &State) -> Range<f64>,
    conditions: &dyn Fn(usize) -> Conditions,
) -> Motion {
    let mut state = plan.start;
    let mut motion = Motion { states: Vec::new(), inputs: Vec::new() };
    for (k, time) in plan.times.iter().enumerate() {
        let u = input(k, &state);
        let now = conditions(k);
        motion.states.push(state);
        motion.inputs.push(u.start);
        let duration = plan.times.get(k + 1).map_or(0.0, |next| next - time);
        let dt = duration / SUBSTEPS as f64;
        for n in 0..SUBSTEPS {
            let input_at = |share: f64| u.start + (u.end - u.start) * (n as f64 + share) / SUBSTEPS as f64;
            let inputs = [input_at(0.0), input_at(0.5), input_at(1.0)];
            state = runge_kutta(&state, dt, |x, stage| (plant.rates)(x, inputs[stage], &now));
        }
    }
    motion
}

/// State after one Runge-Kutta step of length `dt`.
///
/// `rates` takes a state and 0, 1 or 2 for start, middle and end of the step.
fn runge_kutta(state: &State, dt: f64, rates: impl Fn(&State, usize) -> State) -> State {
    let shifted = |k: &State, by: f64| std::array::from_fn(|i| state[i] + by * k[i]);
    let k1 = rates(state, 0);
    let k2 = rates(&shifted(&k1, 0.5 * dt), 1);
    let k3 = rates(&shifted(&k2, 0.5 * dt), 1);
    let k4 = rates(&shifted(&k3, dt), 2);
    std::array::from_fn(|i| state[i] + dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

/// Planned input after each row, held until the next row or linear between rows.
pub fn open_loop(plan: &Plan, is_linear: bool) -> impl FnMut(usize, &State) -> Range<f64> {
    move |k, _| {
        let u = plan.levels[MARGIN_SAMPLES + k];
        u..if is_linear { plan.levels[MARGIN_SAMPLES + k + 1] } else { u }
    }
}

/// Input of a PI controller that reads the first output with measurement errors `errors`.
///
/// The input values of the plan, scaled, are its reference.
pub fn closed_loop(
    plant: &Plant,
    plan: &Plan,
    errors: &[[f64; 2]],
) -> impl FnMut(usize, &State) -> Range<f64> {
    let (middle, half) = plant.drive;
    let ((offset, reach), proportional, integral) = plant.control;
    let mut sum = 0.0;
    move |k, state| {
        let reference = offset + reach * (plan.levels[MARGIN_SAMPLES + k] - middle) / half;
        let measured = (plant.measured)(state, &plant.truth())[0] + errors[k][0];
        sum += (reference - measured) * plant.step_s;
        let u = middle + proportional * (reference - measured) + integral * sum;
        let u = u.clamp(middle - half, middle + half);
        u..u
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the motion agrees with a closed-form solution, and the input before the first row equals the
    //! first one.
    use super::super::draw::undisturbed;
    use super::super::plants::PLANTS;
    use super::*;

    #[test]
    fn a_free_spring_follows_its_closed_form_solution() {
        let plant = PLANTS[0];
        let times: Vec<f64> = (0..200).map(|k| f64::from(k) * 0.01).collect();
        let plan = Plan { start: [0.05, 0.0, 0.0], levels: vec![0.0; 200 + 2 * MARGIN_SAMPLES], times };
        let motion = simulate(&plant, &plan, &mut open_loop(&plan, false), &|_| undisturbed(&plant));
        let [mass, stiffness, damping] = plant.truth();
        let decay = damping / (2.0 * mass);
        let omega = (stiffness / mass - decay * decay).sqrt();
        for (time, state) in plan.times.iter().zip(&motion.states) {
            let wave = (omega * time).cos() + decay / omega * (omega * time).sin();
            assert!((state[0] - 0.05 * (-decay * time).exp() * wave).abs() < 1e-10, "{time}");
        }
    }

    #[test]
    fn the_input_is_constant_before_the_first_row() {
        for plan in plans(&PLANTS[2], &Trap::DropOuts, 7) {
            assert!(
                plan.levels[..MARGIN_SAMPLES + HOLD_SAMPLES]
                    .iter()
                    .all(|u| *u == plan.levels[MARGIN_SAMPLES])
            );
            assert_eq!(plan.levels.len(), plan.times.len() + 2 * MARGIN_SAMPLES + 1);
        }
    }
}
