//! Filtered forecasts by a model file of any kind.

use super::{ObservedColumns, TimedSequences};
use crate::equations::fit::prepare_records;
use crate::equations::records;
use crate::{DataFrom, Subject};
use anyhow::Context;
use augsim_data::{Dataset, MissingCells, Trajectory};
use augsim_equations::EquationSystem;
use augsim_physics::model::{ModelFile, PushModel};
use augsim_physics::push::effects::{SCATTER_KIND, index_of};
use augsim_system::{Declaration, ModelTerm, Prepare, Record, RecordReader, System, shift_session_clocks};
use augsim_trainer::filter::{InitialStatePrior, Sensor, SystemFilter};
use augsim_trainer::{Sequence, Sequences};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Kind of the effect whose parameters are the centre of pressure of a pushed object.
///
/// It varies between pushes if the model has friction scatter.
const CENTRE_KIND: &str = "pressure-offset";

/// Random effects: index of each parameter that differs between trajectories, and its standard deviation.
type RandomEffects = Vec<(usize, f64)>;

/// A model, with the data and the sensor model of a filtered forecast.
#[derive(Debug)]
pub struct SystemOnPrefix {
    /// The particle filter of the model.
    pub filter: SystemFilter,
    /// The measured trajectories to be observed and forecast.
    pub data: TimedSequences,
    /// Observed columns and their measurement noise.
    ///
    /// A standard deviation of 0, if neither given nor declared, is estimated from the observed rows.
    pub sensor: Sensor,
    /// Prior of the initial state; not used, since the schema of the system has its own.
    pub start: InitialStatePrior,
}

/// Prepares a model for filtered forecasts of the measured trajectories, or of those named in `only`.
///
/// # Errors
/// The data do not fit the model, or cannot be read.
pub fn system_on_prefix(
    model: &Subject,
    from: &DataFrom,
    view: &ObservedColumns,
    only: Option<&BTreeSet<String>>,
) -> anyhow::Result<SystemOnPrefix> {
    match model {
        Subject::Equations(model) => {
            let measured = records::read(from, model)?;
            let mut list = records::records(&measured.data, model, false)?;
            list.retain(|r| only.is_none_or(|only| only.contains(&r.id)));
            let system = EquationSystem::declared_only(model)?;
            let windows = prepare_records(&system, &list)?;
            let system = system.tuned(&windows)?;
            let groups = vec![None; list.len()];
            with_filter(Arc::new(system), list, &groups, view)
        }
        Subject::BuiltIn(model) => {
            let data = from.read(MissingCells::AsGap)?;
            built_in_on_prefix(model, &data, view, only).with_context(|| from.to_string())
        }
    }
}

/// Prepares a built-in model for filtered forecasts of trajectories in memory, or of those named in `only`.
///
/// # Errors
/// As [`system_on_prefix`].
pub fn built_in_on_prefix(
    model: &ModelFile,
    data: &Dataset,
    view: &ObservedColumns,
    only: Option<&BTreeSet<String>>,
) -> anyhow::Result<SystemOnPrefix> {
    let (system, reference, random_effects): (Arc<dyn System>, _, _) = match model {
        ModelFile::Ball(model) => {
            let opened = model as &dyn Declaration;
            let system = opened
                .open(&|column| data.has_column(column))
                .map_err(anyhow::Error::new)
                .with_context(|| opened.file().to_owned())?;
            (system, Some(opened.clock_reference_s()), Vec::new())
        }
        ModelFile::Push(model) => {
            let (system, random_effects) = pushing(model)?;
            (system, None, random_effects)
        }
    };
    let (list, groups) = read(&*system, data)?;
    let is_selected = |r: &Record| only.is_none_or(|only| only.contains(&r.id));
    let selected = list.into_iter().zip(&groups).filter(|(r, _)| is_selected(r));
    let (mut list, groups): (Vec<Record>, Vec<_>) = selected.unzip();
    if let (Some(reference), Some(clock)) = (reference, system.schema().clock) {
        shift_session_clocks(&mut list, clock, reference);
    }
    let groups: Vec<Option<&str>> = groups.into_iter().map(|g| g.as_deref()).collect();
    let mut prepared = with_filter(system, list, &groups, view)?;
    for (parameter, sd) in random_effects {
        prepared.filter = prepared.filter.with_random_parameter(parameter, sd);
    }
    Ok(prepared)
}

/// Opens the pushing system, with the random effects of its friction scatter on the centre of pressure.
fn pushing(model: &PushModel) -> anyhow::Result<(Arc<dyn System>, RandomEffects)> {
    let system: Arc<dyn System> = Arc::new(model.open());
    let scatter = model.effects.iter().find(|b| b.kind == SCATTER_KIND);
    let Some(sd_m) = scatter.and_then(|b| b.parameters.first()).map(|p| p.nominal) else {
        return Ok((system, Vec::new()));
    };
    let mut place = model.parameters.len();
    for block in model.effects.iter().filter(|b| index_of(&b.kind).is_some()) {
        if block.kind == CENTRE_KIND {
            return Ok((system, (place..place + block.parameters.len()).map(|i| (i, sd_m)).collect()));
        }
        place += block.parameters.len();
    }
    let Some(index) = index_of(CENTRE_KIND) else { return Ok((system, Vec::new())) };
    let before = system.parameters().len();
    let system = system.augmented(&[ModelTerm::Effect(index)])?;
    let random_effects = (before..system.parameters().len()).map(|i| (i, sd_m)).collect();
    Ok((system, random_effects))
}

/// Reads records with the channels and inputs of a system, and the group name of each.
fn read(system: &dyn Prepare, data: &Dataset) -> anyhow::Result<(Vec<Record>, Vec<Option<String>>)> {
    // The filter observes every row, also those that only repeat the last measurement.
    let reader = RecordReader::new(system.schema(), data)?.with_every_row();
    let record = |t: &Trajectory| {
        let covariates = system.covariates(&|column| reader.first_value(t, column));
        Record { covariates, ..reader.read(t) }
    };
    let records = data.trajectories().iter().map(record).collect();
    let groups = data.trajectories().iter().map(|t| t.group().map(str::to_owned)).collect();
    Ok((records, groups))
}

/// Builds the particle filter of a system and the trajectories that it observes.
fn with_filter(
    system: Arc<dyn Prepare>,
    mut list: Vec<Record>,
    groups: &[Option<&str>],
    view: &ObservedColumns,
) -> anyhow::Result<SystemOnPrefix> {
    let schema = system.schema();
    list.iter_mut().for_each(|record| record.unwrap_angles(schema));
    let columns: Vec<String> = schema.channels.iter().map(|c| c.column.clone()).collect();
    let sensor = view.sensor(&columns)?;
    let item = |record: &Record| {
        let rows = 0..record.times.len();
        Sequence {
            id: record.id.clone(),
            time: record.times.len(),
            states: rows.flat_map(|k| record.values.iter().map(move |v| v[k])).collect(),
            actions: Vec::new(),
        }
    };
    let items = list.iter().map(item).collect();
    let times = list.iter().map(|r| r.times.clone()).collect();
    let start = InitialStatePrior { mean: vec![0.0; columns.len()], sd: vec![0.0; columns.len()] };
    let set = Sequences { columns, action_columns: Vec::new(), items };
    let filter = SystemFilter::new(system, &list, groups);
    Ok(SystemOnPrefix { filter, data: TimedSequences { set, times }, sensor, start })
}
