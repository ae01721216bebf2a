//! Simulations of a model from given starts: one trajectory with the nominal values, or samples of what is not known.

use crate::usage::{Oversized, PlanFault};
use crate::{Subject, Usage, written};
use augsim_data::{Limit, random_stream};
use augsim_physics::model::{ModelFile, Parameter};
use augsim_physics::system::{
    Begin, Declaration, Offsets, Record, ScatterPer, Schema, Simulated, Stream, System, Task,
};
use augsim_written::WrittenSystem;
use augsim_written::model::Hold;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::sync::Arc;

/// Draws of an event's parameter: events beyond them take its nominal value.
const MOST_EVENTS: usize = 1000;

/// Values up to which a simulation stays on the calling thread: handing it to others would take longer on a busy machine.
pub const BRIEF: usize = 20_000;

/// A column of numbers with its name.
pub type Named = (String, Vec<f64>);

/// Starts, times and inputs of a simulation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Plan {
    /// First value of every state, and of what is known of a whole trajectory (`spin_rad_s`), by name: one for each trajectory
    /// of the batch.
    pub start: Vec<Named>,
    /// Times of the samples, s, increasing.
    pub times: Vec<f64>,
    /// Inputs at these times by name, the same for the whole batch.
    pub inputs: Vec<Named>,
    /// Draws of parameters within their intervals, scatter and sensor noise for each trajectory; 0: the nominal values, once.
    pub samples: usize,
    /// Seed of the draws.
    pub seed: u64,
}

/// Simulated trajectories.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectories {
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Trajectories, samples of each, times.
    pub shape: [usize; 3],
    /// Values `[trajectory, sample, time, column]`, in the units of the columns.
    pub values: Vec<f64>,
}

/// Simulates a model from given starts. Each draw has a random stream of its own: the values do not depend on threads.
///
/// ```
/// use augsim_session::Subject;
/// use augsim_session::simulate::{Plan, simulate};
/// let text = "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = 9.81\nrestitution = 0.5\n";
/// let model = Subject::parse(text, "model.toml")?;
/// let start = vec![("height_m".to_owned(), vec![20.0]), ("velocity_m_s".to_owned(), vec![0.0])];
/// let fall = simulate(&model, &Plan { start, times: vec![0.0, 1.0], ..Plan::default() })?;
/// assert_eq!((fall.shape, &fall.columns[..]), ([1, 1, 2], &["height_m".to_owned()][..]));
/// assert!((fall.values[1] - (20.0 - 9.81 / 2.0)).abs() < 1e-12);
/// # Ok::<(), anyhow::Error>(())
/// ```
///
/// # Errors
/// [`Usage`], where a start, an input or the times do not fit the model; an error of the engine otherwise.
pub fn simulate(subject: &Subject, plan: &Plan) -> anyhow::Result<Trajectories> {
    check_times(&plan.times)?;
    let batch = plan.start.first().map_or(0, |(_, values)| values.len());
    if batch == 0 {
        return Err(Usage::Plan(PlanFault::NoStart).into());
    }
    for (name, values) in &plan.start {
        if values.len() != batch {
            let (name, found) = (name.clone(), values.len());
            return Err(Usage::Plan(PlanFault::StartCount { name, found, others: batch }).into());
        }
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            let (name, value) = (name.clone(), values[at]);
            return Err(Usage::Plan(PlanFault::StartValue { name, at, value }).into());
        }
    }
    let opened = Opened::new(subject, plan, batch)?;
    let (schema, samples) = (opened.system.schema(), plan.samples.max(1));
    let columns: Vec<String> = schema.channels.iter().map(|c| c.column.clone()).collect();
    let each = plan.times.len() * columns.len();
    let cells = (batch as u64).saturating_mul(samples as u64).saturating_mul(each as u64);
    let oversized = Oversized::Simulation { trajectories: batch, samples };
    Limit::Cells.check(cells).map_err(|exceeded| Usage::Limit { oversized, exceeded })?;
    let mut values = vec![0.0; batch * samples * each];
    let simulated = |(trajectory, values): (usize, &mut [f64])| {
        let mut out = Simulated::default();
        let mut all = values.chunks_exact_mut(each).enumerate();
        all.try_for_each(|(sample, values)| opened.one(plan, trajectory, sample, &mut out, values))
    };
    match values.len() <= BRIEF {
        true => values.chunks_mut(samples * each).enumerate().try_for_each(simulated)?,
        false => values.par_chunks_mut(samples * each).enumerate().try_for_each(simulated)?,
    }
    Ok(Trajectories { columns, shape: [batch, samples, plan.times.len()], values })
}

fn check_times(times: &[f64]) -> Result<(), Usage> {
    if times.is_empty() {
        return Err(Usage::Plan(PlanFault::NoTimes));
    }
    match (0..times.len()).find(|&i| !times[i].is_finite() || (i > 0 && times[i] <= times[i - 1])) {
        Some(at) => Err(Usage::Plan(PlanFault::Time { at, value: times[at] })),
        None => Ok(()),
    }
}

/// A model that is ready to be simulated.
struct Opened {
    system: Arc<dyn System>,
    /// One record for each trajectory: the clock, the inputs, and what is known of the whole.
    records: Vec<Record>,
    /// States at the first sample of each.
    starts: Vec<Vec<f64>>,
}

impl Opened {
    fn new(subject: &Subject, plan: &Plan, batch: usize) -> anyhow::Result<Self> {
        match subject {
            Subject::BuiltIn(model) => {
                let given = |name: &str| plan.start.iter().any(|(n, _)| n == name);
                let declaration: &dyn Declaration = match &**model {
                    ModelFile::Ball(model) => model,
                    ModelFile::Push(model) => {
                        let system = model.open();
                        let names = built_in_states(system.schema());
                        return Self::with_system(Arc::new(system), &names, plan, batch);
                    }
                };
                let system = declaration.open(&given).map_err(|e| Usage::Plan(PlanFault::Objection(e)))?;
                let names = built_in_states(system.schema());
                Self::with_system(system, &names, plan, batch)
            }
            Subject::Written(model) => {
                let mut model = augsim_written::Model::clone(model);
                model.inputs.iter_mut().for_each(|input| input.hold = input.hold.or(Some(Hold::Linear)));
                let system = WrittenSystem::declared_only(&model)?;
                let names: Vec<String> = model.states.iter().map(|s| s.name.clone()).collect();
                let opened = Self::with_system(Arc::new(system.clone()), &names, plan, batch)?;
                let mut records = written::fit::prepared(&system, &opened.records)?;
                for (record, start) in records.iter_mut().zip(&opened.starts) {
                    record.windows.iter_mut().for_each(|window| window.start.clone_from(start));
                }
                // Steps are chosen by what is simulated.
                Ok(Opened { system: Arc::new(system.tuned(&records)?), records, ..opened })
            }
        }
    }

    fn with_system(
        system: Arc<dyn System>,
        names: &[String],
        plan: &Plan,
        batch: usize,
    ) -> anyhow::Result<Self> {
        let schema = system.schema();
        let known = |name: &str| plan.start.iter().find(|(n, _)| n == name).map(|(_, values)| values);
        // A covariate goes by the columns of data that its system reads it from.
        let read = std::cell::RefCell::new(Vec::new());
        let mut covariates = Vec::with_capacity(batch);
        for trajectory in 0..batch {
            covariates.push(system.covariates(&|name| {
                read.borrow_mut().push(name.to_owned());
                known(name).map(|values| values[trajectory])
            }));
        }
        let read = read.into_inner();
        let is_known = |name: &String| names.contains(name) || read.contains(name);
        if let Some((name, _)) = plan.start.iter().find(|(name, _)| !is_known(name)) {
            let (name, states) = (name.clone(), names.to_vec());
            return Err(Usage::Plan(PlanFault::UnknownState { name, states }).into());
        }
        let mut starts = vec![Vec::with_capacity(names.len()); batch];
        for (name, state) in names.iter().zip(&schema.states) {
            let values = match (known(name), state.begin) {
                (Some(values), _) => values.clone(),
                (None, Begin::Fixed(value) | Begin::Prior(value, _)) => vec![value; batch],
                (None, _) => {
                    let (name, states) = (name.clone(), names.to_vec());
                    return Err(Usage::Plan(PlanFault::MissingState { name, states }).into());
                }
            };
            starts.iter_mut().zip(values).for_each(|(start, value)| start.push(value));
        }
        let inputs: Arc<[Stream]> = streams(schema, plan)?.into();
        let blank = vec![vec![f64::NAN; plan.times.len()]; schema.channels.len()];
        let records = covariates.into_iter().enumerate().map(|(i, covariates)| Record {
            id: i.to_string(),
            times: plan.times.clone(),
            values: blank.clone(),
            inputs: inputs.clone(),
            covariates,
            ..Record::default()
        });
        Ok(Opened { records: records.collect(), system, starts })
    }

    /// One sample of one trajectory, `[time, column]`.
    fn one(
        &self,
        plan: &Plan,
        trajectory: usize,
        sample: usize,
        out: &mut Simulated,
        values: &mut [f64],
    ) -> anyhow::Result<()> {
        let system = &*self.system;
        let schema = system.schema();
        let mut parameters: Vec<f64> = system.parameters().iter().map(|p| p.nominal).collect();
        let mut offsets = Vec::new();
        let mut rng = random_stream(plan.seed, "simulate", ((trajectory as u64) << 32) + sample as u64);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let scatter = schema.event.as_ref().and_then(|event| event.declared);
        if plan.samples > 0 {
            for (value, p) in parameters.iter_mut().zip(system.parameters()) {
                *value = drawn(p, &mut normal);
            }
            let draws = scatter.map_or(0, |s| if s.per == ScatterPer::Event { MOST_EVENTS } else { 1 });
            offsets.extend((0..draws).map(|_| scatter.map_or(0.0, |s| s.sd) * normal()));
        }
        let offsets = match (&offsets[..], scatter.map(|s| s.per)) {
            ([], _) => Offsets::None,
            ([one], Some(ScatterPer::Record)) => Offsets::Shared(*one),
            (all, _) => Offsets::Each(all),
        };
        let record = &self.records[trajectory];
        let start = &self.starts[trajectory];
        let task = Task {
            parameters: &parameters,
            record,
            window: 0..record.times.len(),
            start,
            offsets,
            seeds: &[],
        };
        system.simulate(&task, out)?;
        for (k, row) in values.chunks_exact_mut(schema.channels.len()).enumerate() {
            for ((c, value), channel) in row.iter_mut().enumerate().zip(&schema.channels) {
                let noise = channel.sd.filter(|_| plan.samples > 0).map_or(0.0, |sd| sd * normal());
                *value = out.value(k, c) + noise;
            }
        }
        Ok(())
    }
}

/// A parameter drawn from the normal law of its interval, within its bounds; its nominal value where it has none.
fn drawn(p: &Parameter, normal: &mut dyn FnMut() -> f64) -> f64 {
    match p.standard_deviation() {
        Some(sd) => (p.nominal + sd * normal()).clamp(p.min, p.max),
        None => p.nominal,
    }
}

/// Names of a built-in scenario's states as a start has them: of a measured one its data column, of the velocity of `x_m`
/// `velocity_x_m_s`, of that of the only position `velocity_m_s`.
fn built_in_states(schema: &Schema) -> Vec<String> {
    let single = schema.channels.len() == 1;
    let name = |state: &augsim_physics::system::State| match state.begin {
        Begin::Measured(channel) => schema.channels[channel].column.clone(),
        _ => match state.quantity.name.strip_prefix("velocity of ") {
            Some(_) if single => "velocity_m_s".to_owned(),
            Some(axis) => format!("velocity_{axis}_m_s"),
            None => state.quantity.name.clone(),
        },
    };
    schema.states.iter().map(name).collect()
}

/// The inputs on the clock of the samples.
fn streams(schema: &Schema, plan: &Plan) -> Result<Vec<Stream>, Usage> {
    let wanted: Vec<&String> = schema.inputs.iter().flat_map(|input| &input.columns).collect();
    let names = || wanted.iter().map(|name| (*name).clone()).collect::<Vec<String>>();
    if let Some((name, _)) = plan.inputs.iter().find(|(name, _)| !wanted.contains(&name)) {
        return Err(Usage::Plan(PlanFault::UnknownInput { name: name.clone(), inputs: names() }));
    }
    let values = |column: &String| {
        let given = plan.inputs.iter().find(|(name, _)| name == column);
        let (_, values) = given
            .ok_or_else(|| Usage::Plan(PlanFault::MissingInput { name: column.clone(), inputs: names() }))?;
        if values.len() != plan.times.len() {
            let (found, times) = (values.len(), plan.times.len());
            return Err(Usage::Plan(PlanFault::InputCount { name: column.clone(), found, times }));
        }
        match values.iter().position(|v| !v.is_finite()) {
            Some(at) => {
                let (name, value) = (column.clone(), values[at]);
                Err(Usage::Plan(PlanFault::InputValue { name, at, value }))
            }
            None => Ok(values.clone()),
        }
    };
    let stream = |input: &augsim_physics::system::Input| {
        let values = input.columns.iter().map(values).collect::<Result<Vec<_>, _>>()?;
        Ok(Stream { times: plan.times.clone(), values })
    };
    schema.inputs.iter().map(stream).collect()
}
