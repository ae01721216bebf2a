//! The loop on a model of any kind and data from anywhere.

use crate::usage::{Inapplicable, Takes, UnknownName};
use crate::{DataFrom, Subject, Usage, written};
use augsim_data::checks::{Check, admit};
use augsim_data::{DataError, Dataset, MissingCells, Trajectory};
use augsim_discovery::{Discovery, Options, Progress};
use augsim_physics::model::ModelFile;
use std::collections::BTreeSet;

/// Wishes of a user about a discovery.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Wanted {
    /// Only trajectories of these groups; all where there is none.
    pub groups: Vec<String>,
    /// Checks of suspicious data that are not made: the same as in the options, in the order in which they were named.
    pub accept: Vec<Check>,
    /// Choices of the loop.
    pub options: Options,
}

/// Largest number of records without a missing effect: the standard error of a rate of 1 % is 0.3 % then.
const MAX_NULL_RUNS: usize = 1000;

/// Finds what the model lacks to explain the data; `told` hears of each step when it begins.
///
/// # Errors
/// The model or the data do not allow an answer, or a group is not in the data.
pub fn discover(
    subject: &Subject,
    data: &DataFrom,
    wanted: &Wanted,
    told: &mut dyn FnMut(Progress),
) -> anyhow::Result<Discovery> {
    if wanted.options.null_runs > MAX_NULL_RUNS {
        let takes = Takes::AtMost { most: MAX_NULL_RUNS };
        return Err(Usage::option("--null-runs", wanted.options.null_runs, takes).into());
    }
    if !wanted.options.library && matches!(subject, Subject::BuiltIn(_)) {
        return Err(Usage::Inapplicable(Inapplicable::FormulasOfBuiltIn).into());
    }
    let Wanted { groups, options, .. } = wanted;
    match subject {
        Subject::Written(model) => {
            told(Progress::Calibration);
            // A mistake in the data is named before the model is fitted to it: a clock in milliseconds makes the equations stiff.
            let check = |read: &Dataset| -> anyhow::Result<()> {
                let set = of_groups(groups, data, read.clone())?;
                admit(set, &model.expected(), options.accepted).map_err(DataError::from)?;
                Ok(())
            };
            let against = written::discovery::measured(model, data, &check)?;
            let set = of_groups(groups, data, against.data)?;
            let mut found = augsim_discovery::discover(&against.declared, &set, options, told)?;
            found.notes.splice(0..0, against.notes);
            written::discovery::complete(&mut found, &model.file, &set)?;
            Ok(found)
        }
        Subject::BuiltIn(model) => {
            let set = of_groups(groups, data, data.read(MissingCells::AsGap)?)?;
            let mut model = ModelFile::clone(model);
            if !groups.is_empty() {
                // The model may have values for groups that were not asked for.
                model.keep_groups(groups);
            }
            Ok(augsim_discovery::discover(model.declaration(), &set, options, told)?)
        }
    }
}

/// The trajectories of the groups asked for; all without such a wish.
fn of_groups(groups: &[String], from: &DataFrom, data: Dataset) -> anyhow::Result<Dataset> {
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
    let all = data.trajectories().iter().enumerate();
    let indices: Vec<usize> = all.filter(|(_, t)| is_wanted(t)).map(|(i, _)| i).collect();
    Ok(data.select(&indices))
}
