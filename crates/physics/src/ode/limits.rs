//! Tolerances of the integration, and limits on its steps and events.

/// Maximum number of steps in one window, including rejected ones.
pub(super) const MAX_STEPS: usize = 1_000_000;
/// Maximum number of events in one window.
pub(super) const MAX_EVENTS: usize = 1_000;

/// Error tolerance of a step: its local error stays below `absolute + relative |state|`.
///
/// Both sides are in the unit of the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Tolerated error relative to the size of the state.
    pub relative: f64,
    /// Absolute tolerated error, in the unit of the state.
    pub absolute: f64,
}

impl Default for Tolerance {
    /// Relative 1e-9 and absolute 1e-11: far below sensor noise, so that residuals show no step.
    fn default() -> Self {
        Self { relative: 1e-9, absolute: 1e-11 }
    }
}
