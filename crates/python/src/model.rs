//! Python class of model files.

use crate::background;
use crate::error::{exception, raised, unlocked};
use crate::external::{Function, Operation};
use crate::numbers::{Numbers, memory};
use crate::source::{Data, Source, accepted};
use augsim_discovery::{PredictOptions, PredictionSet};
use augsim_session::Subject;
use augsim_session::equations::fitted::calibrate;
use augsim_session::equations::forecast::NothingToScore;
use augsim_session::export::{Language, export, export_files};
use augsim_session::predict::table::bands;
use augsim_session::predict::{measure_scores, predict};
use augsim_session::simulate::{MAX_SERIAL_VALUES, Plan, simulate};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use std::path::PathBuf;
use std::sync::Arc;

/// Python class of a model file of any scenario.
#[pyclass(frozen, module = "augsim._augsim")]
pub struct Model {
    pub subject: Subject,
    /// Path of the model file; `None` for a model parsed from text.
    pub path: Option<PathBuf>,
    /// Function of Python for the rates; `None` for a model whose file has its equations.
    pub function: Option<Arc<Function>>,
}

/// Parameter of a model: name, value, lower and upper bound, whether it is frozen, and its 95 % interval.
type Parameter = (String, f64, f64, f64, bool, Option<(f64, f64)>);

/// Numeric columns, each with its name.
type NamedColumns = Vec<(String, Numbers)>;

fn owned(columns: NamedColumns) -> Vec<(String, Vec<f64>)> {
    columns.into_iter().map(|(name, values)| (name, values.into_vec())).collect()
}

impl Model {
    /// Begins an operation on the model.
    ///
    /// # Errors
    /// The function of the model itself begins it, and would wait for its own end.
    pub fn begin(&self, py: Python<'_>) -> PyResult<Operation> {
        if self.function.as_ref().is_some_and(|function| function.is_called_here()) {
            let text = "the function of a model uses this model; compute its rates without it, or make another model for that";
            return Err(exception(py, "UsageError", text.to_owned()));
        }
        Ok(Operation::new(&self.subject, self.function.as_ref()))
    }

    /// Predicts every trajectory of the data, and computes what `of` makes of the predictions.
    fn predicted<T: Send + 'static>(
        &self,
        py: Python<'_>,
        data: &Source,
        burn_in: usize,
        options: PredictOptions,
        of: impl FnOnce(&PredictionSet) -> anyhow::Result<T> + Send + 'static,
    ) -> PyResult<T> {
        let (operation, data) = (self.begin(py)?, data.from.clone());
        let at_work = operation.clone();
        let result = background::run(py, None, move |_| {
            at_work.run(None, || of(&predict(&at_work.subject, &data, burn_in, &options)?))
        });
        operation.finish(py, result)
    }
}

#[pymethods]
impl Model {
    /// Reads a model file from a path.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let subject = unlocked(py, || Subject::read(&path))?;
        Ok(Model { subject, path: Some(path), function: None })
    }

    /// Parses the text of a model file, as if it stood at `place`, beside which the description of a robot is found.
    #[staticmethod]
    #[pyo3(signature = (text, place="model"))]
    fn parse(py: Python<'_>, text: &str, place: &str) -> PyResult<Self> {
        let subject = unlocked(py, || Subject::parse(text, place))?;
        Ok(Model { subject, path: None, function: None })
    }

    /// Parses the text of a model file whose section `[external]` stands for a wrapped function of Python.
    #[staticmethod]
    fn external(py: Python<'_>, text: &str, function: &Bound<'_, PyAny>) -> PyResult<Self> {
        let function = Arc::new(Function::new(function)?);
        let subject = unlocked(py, || Subject::parse(text, "model"))?;
        Ok(Model { subject, path: None, function: Some(function) })
    }

    /// Returns the wrapped function of Python for the rates; `None` for a model whose file has its equations.
    fn function(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        self.function.as_ref().map(|function| function.wrapper(py))
    }

    /// Returns the scenario of the model: `ball`, `push` or `system`.
    fn scenario(&self) -> &'static str {
        self.subject.scenario()
    }

    /// Returns the declared parameters of the model, then those of its effects.
    fn parameters(&self) -> Vec<Parameter> {
        self.subject
            .parameters()
            .into_iter()
            .map(|p| (p.name, p.nominal, p.min, p.max, p.frozen, p.ci95.map(|[low, high]| (low, high))))
            .collect()
    }

    /// Returns the text of the model file.
    fn to_toml(&self, py: Python<'_>) -> PyResult<String> {
        unlocked(py, || self.subject.to_toml())
    }

    /// Calibrates the declared parameters on data; returns the fitted model and the result as JSON.
    ///
    /// `accept` names the data checks whose findings are ignored.
    #[pyo3(signature = (data, *, accept))]
    fn fit(&self, py: Python<'_>, data: &Source, accept: Vec<String>) -> PyResult<(Model, String)> {
        let accept = accepted(&accept).map_err(|e| raised(py, &e))?.into_iter().collect();
        let (operation, data) = (self.begin(py)?, data.from.clone());
        let file = self.path.as_ref().map_or_else(|| "model".to_owned(), |path| path.display().to_string());
        let at_work = operation.clone();
        let result = background::run(py, None, move |_| {
            at_work.run(None, || {
                let subject = &at_work.subject;
                let (fitted, answer) = calibrate(subject, &file, &data, accept, false, None, &mut |_, _| {})?;
                Ok((fitted, serde_json::to_string_pretty(&answer)?))
            })
        });
        let (fitted, json) = operation.finish(py, result)?;
        let (subject, function) = (Subject::Equations(Box::new(fitted)), self.function.clone());
        Ok((Model { subject, path: None, function }, json))
    }

    /// Returns a model of equations with other values of the named parameters, which the caller has checked.
    ///
    /// A fitted interval of such a parameter no longer applies and is removed.
    fn with_parameters(&self, py: Python<'_>, values: Vec<(String, f64)>) -> PyResult<Model> {
        let mut subject = self.subject.clone();
        if let Subject::Equations(model) = &mut subject {
            for (name, value) in &values {
                for parameter in model.parameters.iter_mut().filter(|parameter| parameter.name == *name) {
                    (parameter.nominal, parameter.ci95) = (*value, None);
                }
            }
            model.covariance = None;
            // Read again, so that the text of the model has the values as well.
            **model = unlocked(py, || Ok(model.parse_changed(&model.to_toml()?)?))?;
        }
        Ok(Model { subject, path: None, function: self.function.clone() })
    }

    /// Returns the model as a text in another language; `None` if no language has this name.
    fn export(&self, py: Python<'_>, language: &str) -> PyResult<Option<String>> {
        let Some(language) = Language::named(language) else { return Ok(None) };
        unlocked(py, || Ok(Some(export(&self.subject, language)?)))
    }

    /// Writes the model in another language to the file `out` and files beside it. Returns their paths and the notes on what the
    /// export leaves out; `None` if no language has this name.
    fn export_to(
        &self,
        py: Python<'_>,
        language: &str,
        out: PathBuf,
    ) -> PyResult<Option<(Vec<PathBuf>, Vec<String>)>> {
        let Some(language) = Language::named(language) else { return Ok(None) };
        unlocked(py, || {
            let exported = export_files(&self.subject, language, &out)?;
            exported.write()?;
            let paths = exported.files.into_iter().map(|(path, _)| path).collect();
            Ok(Some((paths, exported.notes)))
        })
    }

    /// Predicts every trajectory of the data and returns the scores of all measures as JSON.
    #[pyo3(signature = (data, *, burn_in, samples, seed))]
    fn evaluate(
        &self,
        py: Python<'_>,
        data: &Source,
        burn_in: usize,
        samples: usize,
        seed: u64,
    ) -> PyResult<String> {
        let options = PredictOptions { seed, draws: samples, only: None };
        let name = data.from.to_string();
        self.predicted(py, data, burn_in, options, move |predicted| {
            let scores = measure_scores(predicted);
            if scores.is_empty() {
                return Err(NothingToScore { data: name, burn_in }.into());
            }
            Ok(serde_json::to_string(&scores)?)
        })
    }

    /// Predicts every trajectory of the data; returns mean, median, and the ends of the 50 % and 90 % bands of each column.
    #[pyo3(signature = (data, *, burn_in, samples, seed))]
    fn predict(
        &self,
        py: Python<'_>,
        data: &Source,
        burn_in: usize,
        samples: usize,
        seed: u64,
    ) -> PyResult<Data> {
        let options = PredictOptions { seed, draws: samples, only: None };
        let table = self.predicted(py, data, burn_in, options, |predicted| Ok(bands(predicted)?))?;
        Data::from_dataset(py, table)
    }

    /// Simulates trajectories. Returns the values `[trajectory, sample, time, column]`, the first three sizes
    /// of that array, and the column names.
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        start: NamedColumns,
        times: Numbers,
        inputs: NamedColumns,
        samples: usize,
        seed: u64,
    ) -> PyResult<(Bound<'py, PyByteArray>, [usize; 3], Vec<String>)> {
        let times = times.into_vec();
        let plan = Plan { start: owned(start), times, inputs: owned(inputs), samples, seed };
        let operation = self.begin(py)?;
        let subject = operation.subject.clone();
        let batch = plan.start.first().map_or(0, |(_, values)| values.len());
        let sizes = [plan.samples.max(1), plan.times.len()];
        let is_brief = sizes.iter().fold(batch, |all, size| all.saturating_mul(*size)) <= MAX_SERIAL_VALUES;
        let result = background::run_unless_brief(py, is_brief, move || simulate(&subject, &plan));
        let made = operation.finish(py, result)?;
        Ok((memory(py, &made.values)?, made.shape, made.columns))
    }
}
