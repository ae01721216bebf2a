//! Python class of discoveries and their reports.

use crate::background;
use crate::error::{raised, unlocked};
use crate::external::Operation;
use crate::model::Model;
use crate::source::{Source, accepted};
use augsim_discovery::{AllowedEffects, Options};
use augsim_report::page::Page;
use augsim_session::discovery_page::page;
use augsim_session::joints::ResultFile;
use augsim_session::provenance::fingerprint;
use augsim_session::{DataFrom, DiscoverRequest, ReportContext, Subject};
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Width in pixels of a figure that is exported alone.
const FIGURE_WIDTH: f64 = 640.0;

/// Result of a discovery, with the model and the data that it was made from.
#[pyclass(frozen, module = "augsim._augsim")]
pub struct Discovery {
    found: augsim_discovery::Discovery,
    operation: Operation,
    model: Option<PathBuf>,
    data: DataFrom,
    request: DiscoverRequest,
}

/// Searches for the effects that a model lacks to explain the data.
#[pyfunction]
#[pyo3(signature = (model, data, *, seed, groups, null_runs, library, only, exclude, accept, time_limit, threads, progress))]
#[expect(clippy::too_many_arguments, reason = "all but two are keywords of Python")]
pub fn discover(
    py: Python<'_>,
    model: &Model,
    data: &Source,
    seed: u64,
    groups: Vec<String>,
    null_runs: usize,
    library: bool,
    only: Vec<String>,
    exclude: Vec<String>,
    accept: Vec<String>,
    time_limit: Option<Duration>,
    threads: Option<usize>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Discovery> {
    let accept = accepted(&accept).map_err(|e| raised(py, &e))?;
    let accepted = accept.iter().copied().collect();
    let effects = AllowedEffects { only, exclude };
    let until = time_limit.and_then(|limit| Instant::now().checked_add(limit));
    let options = Options { seed, null_runs, accepted, library, effects, until };
    let request = DiscoverRequest { groups, accept, options };
    let (operation, path, data) = (model.begin(py)?, model.path.clone(), data.from.clone());
    let at_work = operation.clone();
    let result = background::run(py, progress.as_ref(), move |line| {
        let mut report = |step: augsim_discovery::Progress| {
            line.end_if_stopped();
            line.step(step.describe().to_owned(), Some(step.fraction()));
        };
        let found = at_work
            .run(threads, || augsim_session::discover(&at_work.subject, &data, &request, &mut report))?;
        Ok(Discovery { found, operation: at_work, model: path, data, request })
    });
    operation.finish(py, result)
}

impl Discovery {
    fn report(&self, folder: &Path) -> Page {
        let context =
            ReportContext::new(self.model.as_deref(), &self.data, &self.request, folder, &fingerprint);
        page(&context, &self.operation.subject, &self.found)
    }

    /// Path of the declared model file, beside which the description of a robot is found; `model` for a text.
    fn file(&self) -> &str {
        match &self.operation.subject {
            Subject::Equations(model) => &model.file,
            Subject::BuiltIn(_) => "model",
        }
    }
}

#[pymethods]
impl Discovery {
    /// Returns the result as the text of `result.json`.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        unlocked(py, || {
            Ok(serde_json::to_string_pretty(&ResultFile::new(&self.operation.subject, &self.found, None))?)
        })
    }

    /// Returns the model with the added effects.
    fn model(&self, py: Python<'_>) -> PyResult<Model> {
        let subject = unlocked(py, || Subject::parse(&self.found.model_toml, self.file()))?;
        Ok(Model { subject, path: None, function: self.operation.function() })
    }

    /// Returns the path of the declared model file, beside which the description of a robot is found.
    fn place(&self) -> String {
        self.file().to_owned()
    }

    /// Returns the report page as HTML, with links relative to `folder`.
    fn page(&self, py: Python<'_>, folder: PathBuf) -> PyResult<String> {
        unlocked(py, || Ok(self.report(&folder).render()))
    }

    /// Returns the first part of the report page as HTML.
    fn excerpt(&self, py: Python<'_>) -> PyResult<String> {
        unlocked(py, || Ok(self.report(Path::new("")).excerpt().render()))
    }

    /// Returns the title and the SVG document of each figure in the report.
    fn figures(&self, py: Python<'_>) -> PyResult<Vec<(String, String)>> {
        let drawn = |figure: &augsim_report::figure::Figure| {
            (figure.title().to_owned(), figure.svg_document(FIGURE_WIDTH))
        };
        unlocked(py, || Ok(self.report(Path::new("")).into_figures().iter().map(drawn).collect()))
    }
}
