//! Discovery: calibrates a model on data and finds the effects that it lacks.

use crate::equations::records::{OpenTable, open};
use crate::usage::{Inapplicable, Takes, UnknownName};
use crate::{DataFrom, Subject, Usage, allowed_effects, equations};
use augsim_data::checks::{Check, check_data};
use augsim_data::{DataError, Dataset, MissingCells, Trajectory};
use augsim_discovery::{Discovery, Observer, Options, Progress};
use augsim_equations::Model;
use augsim_physics::model::ModelFile;
use std::collections::BTreeSet;
use std::time::Instant;

/// A user's request for a discovery.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DiscoverRequest {
    /// Names of the groups of trajectories to use; empty means all.
    pub groups: Vec<String>,
    /// Data checks to skip: those of the options, in the order in which the user named them.
    pub accept: Vec<Check>,
    /// Options of the discovery.
    pub options: Options,
}

/// Maximum number of simulated null data sets, which contain no missing effect.
///
/// With 1000 of them, an estimated false-alarm rate of 1 % has a standard error of 0.3 %.
const MAX_NULL_RUNS: usize = 1000;

/// Share of the time limit of a discovery for the first calibration; the search then fits the parameters again.
const CALIBRATION_SHARE: f64 = 0.5;

/// Data of a discovery whose file is opened, but whose rows are not read yet.
#[derive(Debug)]
pub struct OpenData {
    from: DataFrom,
    /// The opened table, for an equation model, which names its columns; `None` for a built-in scenario.
    table: Option<OpenTable>,
}

impl OpenData {
    /// Opens the data of a discovery; for a built-in scenario they are opened when they are read.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn open(subject: &Subject, from: &DataFrom) -> anyhow::Result<Self> {
        let table = match subject {
            Subject::Equations(_) => Some(open(from)?),
            Subject::BuiltIn(_) => None,
        };
        Ok(Self { from: from.clone(), table })
    }

    /// Sentences on the column taken as time and on the unit conversions of the columns; empty for a built-in scenario.
    pub fn reading(&self, subject: &Subject) -> Vec<String> {
        match (subject, &self.table) {
            (Subject::Equations(model), Some(table)) => table.reading(model),
            _ => Vec::new(),
        }
    }

    /// Reads the data in the columns that the model needs.
    ///
    /// # Errors
    /// The data cannot be read.
    pub fn read(self, subject: &Subject) -> anyhow::Result<Dataset> {
        match (subject, self.table) {
            (Subject::Equations(model), Some(table)) => Ok(table.read(model)?.data),
            _ => Ok(self.from.read(MissingCells::AsGap)?),
        }
    }
}

/// The result of a discovery, with the data that it read.
#[derive(Debug)]
pub struct Discovered {
    /// The result of the discovery.
    pub found: Discovery,
    /// The data of all groups, in the columns of the model.
    pub data: Dataset,
}

/// Finds the effects that the model lacks; reports each stage, and the best result so far, to `observer`.
///
/// # Errors
/// The data do not fit the model, the model cannot be simulated, an option is out of range, or a group is
/// unknown.
pub fn discover(
    subject: &Subject,
    data: &DataFrom,
    wanted: &DiscoverRequest,
    observer: &mut dyn Observer,
) -> anyhow::Result<Discovery> {
    check_request(subject, wanted)?;
    Ok(discover_in(subject, OpenData::open(subject, data)?, wanted, observer)?.found)
}

/// Runs [`discover`] on data that are already opened; also returns the data.
///
/// # Errors
/// As [`discover`].
pub fn discover_in(
    subject: &Subject,
    data: OpenData,
    wanted: &DiscoverRequest,
    observer: &mut dyn Observer,
) -> anyhow::Result<Discovered> {
    check_request(subject, wanted)?;
    let effects = allowed_effects::resolve(subject, &wanted.options)?;
    let options = &Options { effects, ..wanted.options.clone() };
    let from = data.from.clone();
    if matches!(subject, Subject::Equations(_)) {
        observer.report(Progress::Calibration);
    }
    let data = data.read(subject)?;
    let found = match subject {
        Subject::Equations(model) => in_columns(model, &from, &data, (&wanted.groups, options), observer)?,
        Subject::BuiltIn(model) => {
            let set = select_groups(&wanted.groups, &from, data.clone())?;
            let mut model = ModelFile::clone(model);
            if !wanted.groups.is_empty() {
                // The model may have parameter values for groups that were not requested.
                model.keep_groups(&wanted.groups);
            }
            augsim_discovery::discover(model.declaration(), &set, options, observer)?
        }
    };
    Ok(Discovered { found, data })
}

/// Checks the number of null data sets of a request, and that only equation models do without an effect library.
fn check_request(subject: &Subject, wanted: &DiscoverRequest) -> Result<(), Usage> {
    if wanted.options.null_runs > MAX_NULL_RUNS {
        let takes = Takes::AtMost { most: MAX_NULL_RUNS };
        return Err(Usage::option("--null-runs", wanted.options.null_runs, takes));
    }
    if !wanted.options.library && matches!(subject, Subject::BuiltIn(_)) {
        return Err(Usage::Inapplicable(Inapplicable::FormulasOfBuiltIn));
    }
    Ok(())
}

/// Calibrates an equation model on data in its columns, and finds the effects that it lacks.
fn in_columns(
    model: &Model,
    from: &DataFrom,
    data: &Dataset,
    (groups, options): (&[String], &Options),
    observer: &mut dyn Observer,
) -> anyhow::Result<Discovery> {
    // Check the data before the fit: a clock in milliseconds, for example, would make the equations stiff and
    // the fit slow.
    check_data(select_groups(groups, from, data.clone())?, &model.expected(), options.accepted)
        .map_err(DataError::from)?;
    let now = Instant::now();
    let until =
        options.until.map(|until| now + until.saturating_duration_since(now).mul_f64(CALIBRATION_SHARE));
    let calibrated =
        equations::discovery::calibrated_problem(model, data, options.accepted, until, observer)?;
    let gauges = calibrated.gauges;
    let set = select_groups(groups, from, calibrated.data)?;
    let mut observer = WithNotes { inner: observer, notes: calibrated.notes.clone() };
    let mut found = augsim_discovery::discover(&calibrated.declared, &set, options, &mut observer)?;
    found.notes.splice(0..0, calibrated.notes);
    equations::discovery::complete(&mut found, model, &set, &gauges)?;
    Ok(found)
}

/// An observer that adds the notes of the calibration to each interim result.
struct WithNotes<'a> {
    inner: &'a mut dyn Observer,
    notes: Vec<String>,
}

impl Observer for WithNotes<'_> {
    fn report(&mut self, progress: Progress) {
        self.inner.report(progress);
    }

    fn takes_interim(&self) -> bool {
        self.inner.takes_interim()
    }

    fn calibrated(&mut self, model_toml: String) {
        self.inner.calibrated(model_toml);
    }

    fn interim(&mut self, mut best_so_far: Discovery) {
        best_so_far.notes.splice(0..0, self.notes.iter().cloned());
        self.inner.interim(best_so_far);
    }
}

/// Selects the trajectories of the requested groups; all if no group is requested.
fn select_groups(groups: &[String], from: &DataFrom, data: Dataset) -> anyhow::Result<Dataset> {
    if groups.is_empty() {
        return Ok(data);
    }
    let known: BTreeSet<&str> = data.trajectories().iter().filter_map(Trajectory::group).collect();
    if let Some(unknown) = groups.iter().find(|g| !known.contains(g.as_str())) {
        let known = known.into_iter().map(str::to_owned).collect();
        let (name, data) = (unknown.clone(), from.to_string());
        return Err(Usage::Unknown(UnknownName::Group { name, data, known }).into());
    }
    let is_wanted = |t: &Trajectory| t.group().is_some_and(|g| groups.iter().any(|w| w == g));
    let trajectories = data.trajectories().iter().enumerate();
    let indices: Vec<usize> = trajectories.filter(|(_, t)| is_wanted(t)).map(|(i, _)| i).collect();
    Ok(data.select(&indices))
}
