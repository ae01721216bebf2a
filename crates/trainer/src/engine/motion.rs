//! The trait of a system that nets correct: single steps, and roll-outs from an initial state.

use augsim_data::checks::ExpectedData;
use std::any::Any;
use std::fmt::Debug;

/// A simulated system at the nominal values of its parameters.
/// To add one of a model file, implement this trait and construct it in
/// [`SystemEngine::new`](super::SystemEngine::new).
pub(super) trait EngineModel: Any + Debug + Send + Sync {
    /// Names of the state columns, with units.
    fn columns(&self) -> Vec<&str>;

    /// Names of the action columns, with units; empty without actions.
    fn action_columns(&self) -> Vec<&str> {
        Vec::new()
    }

    /// Time step, s; `None` if the actions include the time, so that the step may vary.
    fn step_s(&self) -> Option<f64> {
        None
    }

    /// Properties that the training data should show.
    fn expected(&self) -> ExpectedData {
        ExpectedData::default()
    }

    /// Height of flat ground in the data, m; `None` for systems that do not only move vertically.
    fn ground_m(&self) -> Option<f64> {
        None
    }

    /// Writes the state one step after `state` to `next`, while the actions go from `from` to `to`.
    fn step(&self, state: &[f64], from: &[f64], to: &[f64], next: &mut [f64]);

    /// Number P of trajectory-specific parameters in [`trajectory_sensitivities`](Self::trajectory_sensitivities).
    fn sensitivity_count(&self) -> usize {
        0
    }

    /// Computes how per-trajectory parameters change the state after a [`step`](Self::step), `[P, S]`.
    /// First order, for a change of each parameter (such as a restitution) by its typical spread.
    fn trajectory_sensitivities(&self, _state: &[f64], _from: &[f64], _to: &[f64], _changes: &mut [f64]) {}

    /// Simulates states `[time, S]` under `actions [time, A]`; the first state is `start`.
    fn rollout(&self, start: &[f64], actions: &[f64], time: usize) -> Vec<f64> {
        let (s, a) = (start.len(), self.action_columns().len());
        let action = |t: usize| &actions[t * a..(t + 1) * a];
        let mut out = start.repeat(time);
        for t in 1..time {
            let (previous, next) = out.split_at_mut(t * s);
            self.step(&previous[(t - 1) * s..], action(t - 1), action(t), &mut next[..s]);
        }
        out
    }

    /// Kinds of the model's effects that the engine ignores: sensor effects and random effects.
    fn ignored_effects(&self) -> &[String] {
        &[]
    }

    /// Duration of contacts that single steps treat as instantaneous, s; `None` if the model has no such effect.
    fn contact_duration_s(&self) -> Option<f64> {
        None
    }
}
