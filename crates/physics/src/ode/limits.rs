//! How exactly and how far a window is integrated.

/// Most steps of one window, rejected ones included.
pub(super) const MAX_STEPS: usize = 1_000_000;
/// Most events of one window.
pub(super) const MAX_EVENTS: usize = 1_000;

/// How exactly a step is taken: its local error stays below `absolute + relative |state|`, in the unit of the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Share of the state.
    pub relative: f64,
    /// Error that is allowed, in the unit of the state.
    pub absolute: f64,
}

impl Default for Tolerance {
    /// 1e-9 and 1e-11: far below the noise of any sensor, so that no step shows in a residual.
    fn default() -> Self {
        Self { relative: 1e-9, absolute: 1e-11 }
    }
}
