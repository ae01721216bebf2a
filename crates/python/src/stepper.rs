//! Step-by-step forecasts of a network through preallocated arrays.

use crate::error::{defect, raised};
use crate::run::Run;
use augsim_trainer::TrainerError;
use pyo3::buffer::PyBuffer;
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Python class of a trained network that forecasts step by step.
#[pyclass(module = "augsim._augsim")]
pub struct Stepper {
    inner: augsim_trainer::Stepper,
    /// Arrays `[S]` of the caller, S the number of states: current state, and mean and standard deviation of
    /// the next state.
    state: PyBuffer<f64>,
    mean: PyBuffer<f64>,
    sd: PyBuffer<f64>,
    now: Vec<f64>,
}

impl Stepper {
    /// Runs `work` and converts its errors and panics to exceptions. Steps are too short to release the GIL.
    fn guarded(
        &mut self,
        py: Python<'_>,
        work: impl FnOnce(&mut Self) -> Result<PyResult<()>, TrainerError>,
    ) -> PyResult<()> {
        match catch_unwind(AssertUnwindSafe(|| work(self))) {
            Ok(Ok(done)) => done,
            Ok(Err(error)) => Err(raised(py, &error.into())),
            Err(panic) => Err(defect(panic)),
        }
    }
}

#[pymethods]
impl Stepper {
    /// Creates a stepper of a trained network, with arrays `[S]` of its S states. They hold the current
    /// state, and the mean and standard deviation of the next state.
    #[new]
    fn new(
        py: Python<'_>,
        run: &Run,
        state: PyBuffer<f64>,
        mean: PyBuffer<f64>,
        sd: PyBuffer<f64>,
    ) -> PyResult<Self> {
        let inner = augsim_trainer::Stepper::new(&run.model).map_err(|e| raised(py, &e.into()))?;
        let now = vec![0.0; inner.states()];
        Ok(Stepper { inner, state, mean, sd, now })
    }

    /// Starts a forecast of trajectory number `index` from the state in the array.
    fn begin(&mut self, py: Python<'_>, index: u64) -> PyResult<()> {
        self.state.copy_to_slice(py, &mut self.now)?;
        self.guarded(py, |s| s.inner.begin(&s.now, index).map(Ok))
    }

    /// Forecasts one step, from the state in the array if `from_state` is true, else from the last state
    /// given.
    fn step(&mut self, py: Python<'_>, from_state: bool) -> PyResult<()> {
        if from_state {
            self.state.copy_to_slice(py, &mut self.now)?;
        }
        self.guarded(py, |s| {
            let next = s.inner.step(from_state.then_some(&s.now))?;
            Ok(s.mean.copy_from_slice(py, next.mean).and_then(|()| s.sd.copy_from_slice(py, next.sd)))
        })
    }
}
