//! Python class of plans: the next experiment, designed and judged.

use crate::background;
use crate::error::unlocked;
use crate::source::Source;
use augsim_session::next::{
    Known, ListenRequest, PlanOptions, Planned, State, listen, listen_page, plan_page, recordings,
};
use pyo3::prelude::*;
use std::path::PathBuf;

/// A plan with its designed runs, or what recordings say about it.
#[pyclass(frozen, module = "augsim._augsim")]
pub struct Plan {
    state: State,
    /// The page as HTML; `None` for a folder without one.
    page: Option<String>,
    /// Name and text of the CSV file of each designed run; empty for what recordings say.
    files: Vec<(String, String)>,
}

/// Designs the runs that separate explanations, and promises their odds.
#[pyfunction]
#[pyo3(signature = (explanations, data, *, is_fitted_to_data, limits, budget, odds, sequences, seed, progress))]
#[expect(clippy::too_many_arguments, reason = "all but two are keywords of Python")]
pub fn next(
    py: Python<'_>,
    explanations: Vec<PathBuf>,
    data: Option<&Source>,
    is_fitted_to_data: bool,
    limits: Option<PathBuf>,
    budget: u16,
    odds: f64,
    sequences: u32,
    seed: u64,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Plan> {
    let data = data.map(|source| source.from.clone());
    background::run(py, progress.as_ref(), move |line| {
        let mut known = Known::open(&explanations, data.is_some())?;
        data.into_iter().try_for_each(|data| known.read(data, !is_fitted_to_data))?;
        line.step("designing the runs and simulating their odds".to_owned(), None);
        line.end_if_stopped();
        let options =
            PlanOptions { budget: usize::from(budget), odds, sequences: u64::from(sequences), seed };
        let planned = known.plan(limits.as_deref(), options)?;
        let page = Some(plan_page(&planned, seed).render());
        let Planned { state, files, .. } = planned;
        Ok(Plan { state, page, files })
    })
}

#[pymethods]
impl Plan {
    /// Reads the folder of a plan.
    #[staticmethod]
    fn read(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        unlocked(py, || {
            let state = State::read(&folder)?;
            let page = augsim_data::read_text(&folder.join("report.html")).ok();
            let file = |run: &augsim_session::next::PlannedRun| {
                let text = augsim_data::read_text(&folder.join(&run.file)).ok()?;
                Some((run.file.clone(), text))
            };
            let files = state.plan.iter().filter_map(file).collect();
            Ok(Plan { state, page, files })
        })
    }

    /// Returns the text of `plan.json`.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        unlocked(py, || Ok(serde_json::to_string_pretty(&self.state)?))
    }

    /// Returns the name and the text of the CSV file of each designed run.
    fn files(&self) -> Vec<(String, String)> {
        self.files.clone()
    }

    /// Returns the page as HTML; `None` for a folder without one.
    fn page(&self) -> Option<String> {
        self.page.clone()
    }

    /// Judges new recordings, one after the other.
    fn listen(&self, py: Python<'_>, data: &Source) -> PyResult<Plan> {
        let (state, data) = (self.state.clone(), data.from.clone());
        background::run(py, None, move |_| {
            let records = recordings(data, &state.first_model()?)?;
            let heard = listen(&ListenRequest { state: &state, records: &records })?;
            let page = Some(listen_page(&heard).render());
            Ok(Plan { state: heard, page, files: Vec::new() })
        })
    }
}
