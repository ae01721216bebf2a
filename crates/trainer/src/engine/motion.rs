//! The trait of a system that nets correct: one step from a state, or the whole way from the first one.

use augsim_data::checks::Expected;
use std::any::Any;
use std::fmt::Debug;

/// A system at the nominal values of its parameters. Adding one of a model file: implement this, and open it in
/// [`SystemEngine::new`](super::SystemEngine::new).
pub(super) trait Motion: Any + Debug + Send + Sync {
    /// Names of the state columns, with units.
    fn columns(&self) -> Vec<&str>;

    /// Names of the action columns, with units; none where nobody acts.
    fn action_columns(&self) -> Vec<&str> {
        Vec::new()
    }

    /// Seconds from one state to the next, where they are always the same; otherwise the actions have a clock.
    fn step_s(&self) -> Option<f64> {
        None
    }

    /// Statements of the model about the data that it is to explain.
    fn expected(&self) -> Expected {
        Expected::default()
    }

    /// Height of the flat ground in the data, m, under what moves only up and down.
    fn ground_m(&self) -> Option<f64> {
        None
    }

    /// The state one step after `state`, while the actions go from `from` to `to`.
    fn step(&self, state: &[f64], from: &[f64], to: &[f64], next: &mut [f64]);

    /// Number P of the parameters that [`own_changes`](Self::own_changes) knows.
    fn own_parameters(&self) -> usize {
        0
    }

    /// Changes `[P, S]` of the state that [`step`](Self::step) gives, to first order, where a parameter that is likely to be a
    /// trajectory's own (a restitution) moves by its likely spread.
    fn own_changes(&self, _state: &[f64], _from: &[f64], _to: &[f64], _changes: &mut [f64]) {}

    /// States `[time, S]` from `start`, which is the first of them, under `actions [time, A]`.
    fn rollout(&self, start: &[f64], actions: &[f64], time: usize) -> Vec<f64> {
        let (s, a) = (start.len(), self.action_columns().len());
        let action = |t: usize| &actions[t * a..(t + 1) * a];
        let mut out = start.repeat(time);
        for t in 1..time {
            let (done, rest) = out.split_at_mut(t * s);
            self.step(&done[(t - 1) * s..], action(t - 1), action(t), &mut rest[..s]);
        }
        out
    }

    /// Kinds of the model's effects that take no part: what the sensor adds, and what is random.
    fn left_out(&self) -> &[String] {
        &[]
    }

    /// Seconds that contacts last which single steps take for an instant, where there are any.
    fn contact_s(&self) -> Option<f64> {
        None
    }
}
