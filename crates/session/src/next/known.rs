//! What is known before a plan: the explanations, and the recordings so far.

use super::limits::{default_limits, read_limits};
use super::plan::{PlanOptions, PlanRequest, Planned, plan};
use super::source::Source;
use super::sources::sources;
use super::state::State;
use crate::DataFrom;
use crate::equations::records::{read, records};
use augsim_equations::Model;
use augsim_system::Record;
use std::path::{Path, PathBuf};

/// The explanations, and the recordings so far.
#[derive(Debug)]
pub struct Known {
    sources: Vec<Source>,
    /// Plan to go on with.
    continued: Option<State>,
    records: Vec<Record>,
    is_estimated_again: bool,
}

impl Known {
    /// Opens folders and model files; without `data` the folder of a single plan is gone on with.
    ///
    /// # Errors
    /// As [`sources`].
    pub fn open(explanations: &[PathBuf], has_data: bool) -> anyhow::Result<Self> {
        let continued = match explanations {
            [folder] if !has_data => State::read_if_there(folder)?,
            _ => None,
        };
        let (sources, records) = match &continued {
            Some(state) => {
                (state.planned_sources()?, [state.earlier_records(), state.heard_records()].concat())
            }
            None => (sources(explanations)?, Vec::new()),
        };
        Ok(Self { sources, continued, records, is_estimated_again: false })
    }

    /// Whether an earlier plan is gone on with, which has its own recordings.
    pub fn is_continued(&self) -> bool {
        self.continued.is_some()
    }

    /// The model of the first explanation; all have the same inputs and outputs.
    pub fn model(&self) -> &Model {
        &self.sources[0].model
    }

    /// Reads the recordings so far.
    ///
    /// With `is_estimated_again` the parameters are estimated again from them; else they are the recordings that the models
    /// were fitted to, and the distributions of the models stay.
    ///
    /// # Errors
    /// The data cannot be read, or lack a column of the model.
    pub fn read(&mut self, data: DataFrom, is_estimated_again: bool) -> anyhow::Result<()> {
        self.records = recordings(data, self.model())?;
        self.is_estimated_again = is_estimated_again;
        Ok(())
    }

    /// Designs runs within the limits of a file, and promises their odds.
    ///
    /// # Errors
    /// As [`read_limits`]; or a model cannot be used, or no input keeps all explanations within the limits.
    pub fn plan(&self, limits: Option<&Path>, options: PlanOptions) -> anyhow::Result<Planned> {
        let limits = read_limits(limits, default_limits(self.model(), &self.records)?, &self.sources)?;
        plan(&PlanRequest {
            sources: &self.sources,
            limits: &limits,
            records: &self.records,
            is_estimated_again: self.is_estimated_again,
            continued: self.continued.as_ref(),
            options,
        })
    }
}

/// Reads recordings with the inputs and outputs of a model.
///
/// # Errors
/// The data cannot be read, or lack a column of the model.
pub fn recordings(data: DataFrom, model: &Model) -> anyhow::Result<Vec<Record>> {
    records(&read(data, model)?.data, model, true)
}
