//! A net in a control loop: numbers go in and out through arrays that are made once.

use crate::error::{defect, raised};
use crate::run::Run;
use augsim_trainer::TrainerError;
use pyo3::buffer::PyBuffer;
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A trained net that goes step by step.
#[pyclass(module = "augsim._augsim")]
pub struct Stepper {
    inner: augsim_trainer::Stepper,
    /// Arrays `[S]` of the caller's: the state to step from, mean and standard deviation of the next.
    state: PyBuffer<f64>,
    mean: PyBuffer<f64>,
    sd: PyBuffer<f64>,
    now: Vec<f64>,
}

impl Stepper {
    /// Does `work` without letting a panic out. Steps are too short to give the interpreter's lock away.
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
    /// Of a run, with arrays `[S]` for the state, and for mean and standard deviation of the next.
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

    /// Begins trajectory number `index` at the state in the array.
    fn begin(&mut self, py: Python<'_>, index: u64) -> PyResult<()> {
        self.state.copy_to_slice(py, &mut self.now)?;
        self.guarded(py, |s| s.inner.begin(&s.now, index).map(Ok))
    }

    /// One step, from the state in the array or, without it, from that which was given last.
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
