//! A model file of any kind behind a prefix.

use super::{Timed, View};
use crate::written::fit::prepared;
use crate::written::records;
use crate::{DataFrom, Subject};
use anyhow::Context;
use augsim_data::{Dataset, MissingCells, Trajectory};
use augsim_physics::model::{ModelFile, PushModel};
use augsim_physics::push::effects::{SCATTER_KIND, index_of};
use augsim_physics::system::{Declaration, Law, Record, Stream, System};
use augsim_trainer::filter::{Sensor, StartLaw, SystemFilter};
use augsim_trainer::{Sequence, Sequences};
use augsim_written::WrittenSystem;
use std::collections::BTreeSet;
use std::sync::Arc;

/// The effect whose parameters the centre of pressure is: it differs from push to push where friction scatters.
const CENTRE_KIND: &str = "pressure-offset";

/// Places of parameters that differ from trajectory to trajectory, and their standard deviations.
type Own = Vec<(usize, f64)>;

/// A model file with what it is shown.
#[derive(Debug)]
pub struct OfSystem {
    /// The model.
    pub filter: SystemFilter,
    /// The trajectories.
    pub data: Timed,
    /// The sensor: 0 where its noise is neither stated nor declared, and is estimated from the rows seen.
    pub sensor: Sensor,
    /// Not used by a system, whose schema says what is known of a start.
    pub start: StartLaw,
}

/// A model as it stands for measured trajectories, for those of `only` where they are named.
///
/// # Errors
/// Model and data do not go together, or the data cannot be read.
pub fn of_system(
    model: &Subject,
    from: &DataFrom,
    view: &View,
    only: Option<&BTreeSet<String>>,
) -> anyhow::Result<OfSystem> {
    match model {
        Subject::Written(model) => {
            let measured = records::read(from, model)?;
            let mut list = records::records(&measured.data, model, false)?;
            list.retain(|r| only.is_none_or(|only| only.contains(&r.id)));
            let system = WrittenSystem::declared_only(model)?;
            let windows = prepared(&system, &list)?;
            let system = system.tuned(&windows)?;
            let groups = vec![None; list.len()];
            together(Arc::new(system), list, &groups, view)
        }
        Subject::BuiltIn(model) => {
            let data = from.read(MissingCells::AsGap)?;
            of_built_in(model, &data, view, only).with_context(|| from.to_string())
        }
    }
}

/// A model of a built-in scenario as it stands for trajectories that were read.
///
/// # Errors
/// As [`of_system`].
pub fn of_built_in(
    model: &ModelFile,
    data: &Dataset,
    view: &View,
    only: Option<&BTreeSet<String>>,
) -> anyhow::Result<OfSystem> {
    let (system, reference, own): (Arc<dyn System>, _, _) = match model {
        ModelFile::Ball(model) => {
            let opened = model as &dyn Declaration;
            let system = opened
                .open(&|column| data.has_column(column))
                .map_err(anyhow::Error::new)
                .with_context(|| opened.file().to_owned())?;
            (system, Some(opened.clock_reference_s()), Vec::new())
        }
        ModelFile::Push(model) => {
            let (system, own) = pushing(model)?;
            (system, None, own)
        }
    };
    let (list, groups) = read(&*system, data)?;
    let is_asked = |r: &Record| only.is_none_or(|only| only.contains(&r.id));
    let asked = list.into_iter().zip(&groups).filter(|(r, _)| is_asked(r));
    let (mut list, groups): (Vec<Record>, Vec<_>) = asked.unzip();
    if let (Some(reference), Some(clock)) = (reference, system.schema().clock) {
        count_from(&mut list, clock, reference);
    }
    let groups: Vec<Option<&str>> = groups.into_iter().map(|g| g.as_deref()).collect();
    let mut of = together(system, list, &groups, view)?;
    for (parameter, sd) in own {
        of.filter = of.filter.with_own(parameter, sd);
    }
    Ok(of)
}

/// The declared pushing, and the parameters that differ from push to push with their standard deviations.
fn pushing(model: &PushModel) -> anyhow::Result<(Arc<dyn System>, Own)> {
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
    let system = system.augmented(&[Law::Effect(index)])?;
    let own = (before..system.parameters().len()).map(|i| (i, sd_m)).collect();
    Ok((system, own))
}

/// Records of the columns that a system names, and the group of each.
fn read(system: &dyn System, data: &Dataset) -> anyhow::Result<(Vec<Record>, Vec<Option<String>>)> {
    let schema = system.schema();
    let places = |columns: &mut dyn Iterator<Item = &String>| {
        columns.map(|c| data.column_index(c)).collect::<Result<Vec<_>, _>>()
    };
    let channels = places(&mut schema.channels.iter().map(|c| &c.column))?;
    let inputs = schema.inputs.iter().map(|input| places(&mut input.columns.iter()));
    let inputs = inputs.collect::<Result<Vec<_>, _>>()?;
    let record = |t: &Trajectory| {
        let constant = |column: &str| {
            let i = data.column_index(column).ok()?;
            t.column(i).iter().copied().find(|v| v.is_finite())
        };
        // A row in which nothing was measured brings inputs alone, which have their own clock.
        let rows: Vec<usize> =
            (0..t.len()).filter(|&k| channels.iter().any(|&i| t.column(i)[k].is_finite())).collect();
        let at = |column: &[f64]| rows.iter().map(|&k| column[k]).collect::<Vec<_>>();
        Record {
            id: t.id().to_owned(),
            times: at(t.time_s()),
            values: channels.iter().map(|&i| at(t.column(i))).collect(),
            inputs: inputs.iter().map(|columns| stream(t, columns)).collect(),
            covariates: system.covariates(&constant),
            ..Record::default()
        }
    };
    let records = data.trajectories().iter().map(record).collect();
    let groups = data.trajectories().iter().map(|t| t.group().map(str::to_owned)).collect();
    Ok((records, groups))
}

/// An input on its own clock: the rows in which all of its columns have a value.
fn stream(t: &Trajectory, columns: &[usize]) -> Stream {
    let rows: Vec<usize> =
        (0..t.len()).filter(|&k| columns.iter().all(|&i| t.column(i)[k].is_finite())).collect();
    let at = |column: &[f64]| rows.iter().map(|&k| column[k]).collect::<Vec<_>>();
    Stream { times: at(t.time_s()), values: columns.iter().map(|&i| at(t.column(i))).collect() }
}

/// Lets the session clocks of the records count from the model's reference or, without one, from their mean.
fn count_from(list: &mut [Record], clock: usize, reference: Option<f64>) {
    let starts: Option<Vec<f64>> = list.iter().map(|r| r.covariate(clock)).collect();
    let Some(starts) = starts.filter(|s| !s.is_empty()) else { return };
    let mean = starts.iter().sum::<f64>() / starts.len() as f64;
    let reference = reference.unwrap_or(mean);
    list.iter_mut().for_each(|r| r.covariates[clock] -= reference);
}

/// System and records as a filter and the trajectories that it is shown.
fn together(
    system: Arc<dyn System>,
    mut list: Vec<Record>,
    groups: &[Option<&str>],
    view: &View,
) -> anyhow::Result<OfSystem> {
    let schema = system.schema();
    for record in &mut list {
        for (channel, values) in schema.channels.iter().zip(&mut record.values) {
            channel.period.into_iter().for_each(|period| unwrap(values, period));
        }
    }
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
    let start = StartLaw { mean: vec![0.0; columns.len()], sd: vec![0.0; columns.len()] };
    let set = Sequences { columns, action_columns: Vec::new(), items };
    let filter = SystemFilter::new(system, &list, groups);
    Ok(OfSystem { filter, data: Timed { set, times }, sensor, start })
}

/// Takes the jumps by a period out of an angle: each value goes to where it is nearest to the one measured before.
fn unwrap(values: &mut [f64], period: f64) {
    let mut before: Option<f64> = None;
    for v in values.iter_mut().filter(|v| v.is_finite()) {
        if let Some(before) = before {
            *v -= ((*v - before) / period).round() * period;
        }
        before = Some(*v);
    }
}
