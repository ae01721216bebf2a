//! Functions of Python that compute the rates of a model.

use crate::known_threads;
use crate::numbers::memory;
use augsim_equations::{ExternalFunction, ExternalRates};
use augsim_session::Subject;
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::thread::ThreadId;

/// A function of Python for the rates of a model, as the Python package has wrapped it.
///
/// Its method `rates(points, bytes)` gets the arguments `[argument, point]` and returns the bytes of the rates
/// `[state, point]`; `derivatives(points, bytes)` returns those of the derivatives `[state, argument, point]`, or `None`.
#[derive(Debug)]
pub struct Function {
    wrapper: Py<PyAny>,
    states: usize,
    typical_sizes: Vec<f64>,
    has_derivatives: bool,
    is_costly: bool,
    /// Held during a call: a function may use objects that only one thread at a time may touch, such as a simulator,
    /// and release the GIL meanwhile.
    in_call: Mutex<()>,
    /// The thread that is in a call.
    caller: Mutex<Option<ThreadId>>,
}

impl Function {
    /// Reads the properties of a function that the Python package has wrapped.
    pub fn new(wrapper: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Function {
            states: wrapper.getattr("states")?.extract()?,
            typical_sizes: wrapper.getattr("typical_sizes")?.extract()?,
            has_derivatives: wrapper.getattr("has_derivatives")?.extract()?,
            is_costly: wrapper.getattr("is_costly")?.extract()?,
            wrapper: wrapper.clone().unbind(),
            in_call: Mutex::new(()),
            caller: Mutex::new(None),
        })
    }

    /// The wrapped function as an object of Python.
    pub fn wrapper(&self, py: Python<'_>) -> Py<PyAny> {
        self.wrapper.clone_ref(py)
    }

    fn set_caller(&self, caller: Option<ThreadId>) {
        *self.caller.lock().unwrap_or_else(PoisonError::into_inner) = caller;
    }

    /// Whether this thread is in a call of the function. An operation that the function itself begins would wait for its end.
    pub fn is_called_here(&self) -> bool {
        *self.caller.lock().unwrap_or_else(PoisonError::into_inner) == Some(std::thread::current().id())
    }
}

/// The operations with a function that are not over yet.
static BEGUN: Mutex<Vec<Weak<Calls>>> = Mutex::new(Vec::new());

/// Ends all operations with a function, before the interpreter ends: no thread may call Python after that.
///
/// Waits for at most [`known_threads::MAX_WAIT`]; a function that takes longer is left alone.
#[pyfunction]
pub fn end_functions(py: Python<'_>) {
    let begun = std::mem::take(&mut *BEGUN.lock().unwrap_or_else(PoisonError::into_inner));
    begun.iter().filter_map(Weak::upgrade).for_each(|calls| calls.stop());
    py.detach(known_threads::wait_for_end);
}

/// The calls of a function during one operation, such as a fit.
///
/// After an exception, or when the operation is to stop, the function is no longer called: all rates are NaN, so that
/// every simulation fails at once and the operation ends.
#[derive(Debug)]
pub struct Calls {
    function: Arc<Function>,
    has_ended: AtomicBool,
    raised: Mutex<Option<PyErr>>,
}

impl Calls {
    /// Begins an operation.
    pub fn new(function: Arc<Function>) -> Arc<Self> {
        let calls = Arc::new(Calls { function, has_ended: AtomicBool::new(false), raised: Mutex::new(None) });
        let mut begun = BEGUN.lock().unwrap_or_else(PoisonError::into_inner);
        begun.retain(|other| other.strong_count() > 0);
        begun.push(Arc::downgrade(&calls));
        calls
    }

    /// The function that is called.
    pub fn function(&self) -> &Arc<Function> {
        &self.function
    }

    /// Makes all further calls return NaN.
    pub fn stop(&self) {
        self.has_ended.store(true, Ordering::Relaxed);
    }

    /// The exception that the function has raised, if any.
    pub fn raised(&self, py: Python<'_>) -> Option<PyErr> {
        let raised = self.raised.lock().unwrap_or_else(PoisonError::into_inner);
        raised.as_ref().map(|e| e.clone_ref(py))
    }

    /// Calls a method of the wrapped function, and copies its numbers to `into`; NaN after an exception.
    fn call(&self, method: &str, points: usize, arguments: &[f64], into: &mut [f64]) {
        into.fill(f64::NAN);
        if self.has_ended.load(Ordering::Relaxed) {
            return;
        }
        // Taken before the GIL, so that a thread that waits for it holds no lock of Python.
        let in_call = self.function.in_call.lock().unwrap_or_else(PoisonError::into_inner);
        if self.has_ended.load(Ordering::Relaxed) {
            return;
        }
        self.function.set_caller(Some(std::thread::current().id()));
        let done = Python::try_attach(|py| {
            let result = self.call_attached(py, method, points, arguments, into);
            if let Err(error) = result {
                self.stop();
                self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            }
        });
        self.function.set_caller(None);
        drop(in_call);
        // Without an interpreter the program is ending.
        if done.is_none() {
            self.stop();
        }
    }

    fn call_attached(
        &self,
        py: Python<'_>,
        method: &str,
        points: usize,
        arguments: &[f64],
        into: &mut [f64],
    ) -> PyResult<()> {
        let bytes = memory(py, arguments)?;
        let result = self.function.wrapper.bind(py).call_method1(method, (points, bytes))?;
        let bytes = result.cast::<PyBytes>()?.as_bytes();
        if bytes.len() != size_of_val(into) {
            return Err(PyValueError::new_err("the wrapped function returned an array of the wrong size"));
        }
        for (to, number) in into.iter_mut().zip(bytes.chunks_exact(size_of::<f64>())) {
            let number =
                number.try_into().map_err(|_| PyRuntimeError::new_err("a number of another size"))?;
            *to = f64::from_ne_bytes(number);
        }
        Ok(())
    }
}

impl ExternalRates for Calls {
    fn states(&self) -> usize {
        self.function.states
    }

    fn rates(&self, points: usize, arguments: &[f64], rates: &mut [f64]) {
        self.call("rates", points, arguments, rates);
    }

    fn derivatives(&self, points: usize, arguments: &[f64], derivatives: &mut [f64]) -> bool {
        if self.function.has_derivatives {
            self.call("derivatives", points, arguments, derivatives);
        }
        self.function.has_derivatives
    }

    fn is_costly(&self) -> bool {
        self.function.is_costly
    }

    fn typical_sizes(&self) -> &[f64] {
        &self.function.typical_sizes
    }
}

/// An operation on a model: the model, and the calls of its function of Python, if it has one.
#[derive(Debug, Clone)]
pub struct Operation {
    /// The model, whose function is that of the operation.
    pub subject: Subject,
    calls: Option<Arc<Calls>>,
}

impl Operation {
    /// Begins an operation on a model.
    pub fn new(subject: &Subject, function: Option<&Arc<Function>>) -> Self {
        let mut subject = subject.clone();
        let calls = function.map(|function| Calls::new(Arc::clone(function)));
        if let (Subject::Equations(model), Some(calls)) = (&mut subject, &calls)
            && let Some(external) = &mut model.external
        {
            external.rates = Some(ExternalFunction::new(Arc::<Calls>::clone(calls)));
        }
        Operation { subject, calls }
    }

    /// The function of the model; `None` if the model has none.
    pub fn function(&self) -> Option<Arc<Function>> {
        self.calls.as_ref().map(|calls| Arc::clone(calls.function()))
    }

    /// Runs the work of the operation on this number of threads; `None` for as many as there are cores, or for one if a function
    /// of Python is called.
    ///
    /// Only one thread at a time can be in the function, and most of the time is spent there. Threads that take turns move its
    /// memory from core to core: two of them took a third longer than one.
    ///
    /// # Errors
    /// That of the work, or threads cannot be started.
    pub fn run<T: Send>(
        &self,
        threads: Option<usize>,
        work: impl FnOnce() -> anyhow::Result<T> + Send,
    ) -> anyhow::Result<T> {
        match (&self.calls, threads) {
            (None, None) => work(),
            (None, Some(threads)) => {
                rayon::ThreadPoolBuilder::new().num_threads(threads).build()?.install(work)
            }
            (Some(_), _) => known_threads::run(threads.unwrap_or(1), work)?,
        }
    }

    /// Ends the operation: its result, or the exception that the function has raised.
    ///
    /// # Errors
    /// That of the result. An interrupt comes before the exception of the function.
    pub fn finish<T>(&self, py: Python<'_>, result: PyResult<T>) -> PyResult<T> {
        let Some(calls) = &self.calls else { return result };
        if let Err(error) = &result {
            calls.stop();
            if error.is_instance_of::<PyKeyboardInterrupt>(py) {
                return result;
            }
        }
        calls.raised(py).map_or(result, Err)
    }
}
