//! Simulation of a model from given initial states, with nominal or drawn parameters.

use crate::usage::{Oversized, PlanFault};
use crate::{Subject, Usage, equations};
use augsim_data::{Limit, random_stream};
use augsim_equations::EquationSystem;
use augsim_equations::model::Hold;
use augsim_physics::model::ModelFile;
use augsim_system::{
    Declaration, InitialValue, Offsets, Parameter, Prepare, Record, ScatterPer, Schema, Simulate, Simulated,
    Stream, Task,
};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::sync::Arc;

/// Maximum number of events with a drawn offset of the event parameter; later events use the nominal value.
const MAX_EVENT_DRAWS: usize = 1000;

/// Maximum number of simulated values for which all simulations run on the calling thread.
///
/// Smaller tasks gain nothing from several threads.
pub const MAX_SERIAL_VALUES: usize = 20_000;

/// Name and values of a column or of an input.
pub type Named = (String, Vec<f64>);

/// What to simulate: initial states, times and inputs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Plan {
    /// Initial value of every state and covariate (e.g. `spin_rad_s`), by name.
    ///
    /// Each has one value per trajectory of the batch.
    pub start: Vec<Named>,
    /// Times of the samples to simulate, s, increasing.
    pub times: Vec<f64>,
    /// Values of the inputs at the sample times, by name, shared by all trajectories of the batch.
    pub inputs: Vec<Named>,
    /// Number of draws per trajectory; 0 means one noise-free nominal run.
    ///
    /// A draw has its own parameters, random effects and measurement noise.
    pub samples: usize,
    /// Seed of the random draws.
    pub seed: u64,
}

/// Simulated trajectories of a batch.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectories {
    /// Names of the simulated columns.
    pub columns: Vec<String>,
    /// Number of trajectories, of samples (draws) per trajectory, and of times: sizes of `values`.
    pub shape: [usize; 3],
    /// Simulated values `[trajectory, sample, time, column]`, in the units of the columns.
    pub values: Vec<f64>,
}

/// Simulates a model from given initial states.
///
/// Each draw has its own random stream, so the values do not depend on the number of threads.
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
/// [`Usage`] if an initial state, an input or the times do not fit the model; otherwise an error of the
/// engine.
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
    let opened = Simulation::new(subject, plan, batch)?;
    let (schema, samples) = (opened.system.schema(), plan.samples.max(1));
    let columns: Vec<String> = schema.channels.iter().map(|c| c.column.clone()).collect();
    let run_size = plan.times.len() * columns.len();
    let cells = (batch as u64).saturating_mul(samples as u64).saturating_mul(run_size as u64);
    let oversized = Oversized::Simulation { trajectories: batch, samples };
    Limit::Cells.check(cells).map_err(|exceeded| Usage::Limit { oversized, exceeded })?;
    let mut values = vec![0.0; batch * samples * run_size];
    let simulate_samples = |(trajectory, values): (usize, &mut [f64])| {
        let mut out = Simulated::default();
        let mut runs = values.chunks_exact_mut(run_size).enumerate();
        runs.try_for_each(|(sample, values)| opened.simulate(plan, trajectory, sample, &mut out, values))
    };
    match values.len() <= MAX_SERIAL_VALUES {
        true => values.chunks_mut(samples * run_size).enumerate().try_for_each(simulate_samples)?,
        false => values.par_chunks_mut(samples * run_size).enumerate().try_for_each(simulate_samples)?,
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

/// A model with the records and initial states of its simulation.
struct Simulation {
    system: Arc<dyn Prepare>,
    /// One record for each trajectory, with times, inputs and covariates.
    records: Vec<Record>,
    /// Initial state of each trajectory, `[trajectory][state]`.
    starts: Vec<Vec<f64>>,
}

impl Simulation {
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
            Subject::Equations(model) => {
                let mut model = augsim_equations::Model::clone(model);
                model.inputs.iter_mut().for_each(|input| input.hold = input.hold.or(Some(Hold::Linear)));
                let system = EquationSystem::declared_only(&model)?;
                let names: Vec<String> = model.states.iter().map(|s| s.name.clone()).collect();
                let opened = Self::with_system(Arc::new(system.clone()), &names, plan, batch)?;
                let mut records = equations::fit::prepare_records(&system, &opened.records)?;
                for (record, start) in records.iter_mut().zip(&opened.starts) {
                    record.windows.iter_mut().for_each(|window| window.start.clone_from(start));
                }
                // The integration steps are chosen from the trajectories to be simulated.
                Ok(Simulation { system: Arc::new(system.tuned(&records)?), records, ..opened })
            }
        }
    }

    fn with_system(
        system: Arc<dyn Prepare>,
        names: &[String],
        plan: &Plan,
        batch: usize,
    ) -> anyhow::Result<Self> {
        let schema = system.schema();
        let known = |name: &str| plan.start.iter().find(|(n, _)| n == name).map(|(_, values)| values);
        // Covariates are named by the data columns that the system asks for; the closure records these names.
        let covariate_columns = std::cell::RefCell::new(Vec::new());
        let mut covariates = Vec::with_capacity(batch);
        for trajectory in 0..batch {
            covariates.push(system.covariates(&|name| {
                covariate_columns.borrow_mut().push(name.to_owned());
                known(name).map(|values| values[trajectory])
            }));
        }
        let covariate_columns = covariate_columns.into_inner();
        let is_known = |name: &String| names.contains(name) || covariate_columns.contains(name);
        if let Some((name, _)) = plan.start.iter().find(|(name, _)| !is_known(name)) {
            let (name, states) = (name.clone(), names.to_vec());
            return Err(Usage::Plan(PlanFault::UnknownState { name, states }).into());
        }
        let mut starts = vec![Vec::with_capacity(names.len()); batch];
        for (name, state) in names.iter().zip(&schema.states) {
            let values = match (known(name), state.initial) {
                (Some(values), _) => values.clone(),
                (None, InitialValue::Fixed(value) | InitialValue::Prior(value, _)) => vec![value; batch],
                (None, InitialValue::FromRecord | InitialValue::PriorAboutRecord(_)) => vec![f64::NAN; batch],
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
        Ok(Simulation { records: records.collect(), system, starts })
    }

    /// Simulates one sample (draw) of one trajectory into `values`, `[time, column]`.
    fn simulate(
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
                *value = draw_parameter(p, &mut normal);
            }
            let draws = scatter.map_or(0, |s| if s.per == ScatterPer::Event { MAX_EVENT_DRAWS } else { 1 });
            offsets.extend((0..draws).map(|_| scatter.map_or(0.0, |s| s.sd) * normal()));
        }
        let offsets = match (&offsets[..], scatter.map(|s| s.per)) {
            ([], _) => Offsets::None,
            ([one], Some(ScatterPer::Record)) => Offsets::Shared(*one),
            (all, _) => Offsets::PerEvent(all),
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

/// Draws a parameter from the normal distribution of its 95 % interval, clamped to its bounds.
///
/// A parameter without an interval has its nominal value.
fn draw_parameter(p: &Parameter, normal: &mut dyn FnMut() -> f64) -> f64 {
    match p.standard_deviation() {
        Some(sd) => (p.nominal + sd * normal()).clamp(p.min, p.max),
        None => p.nominal,
    }
}

/// Names of the states of a built-in scenario in [`Plan::start`].
///
/// A measured state has the name of its data column. The velocity of an axis is e.g. `velocity_x_m_s`, or
/// `velocity_m_s` if there is only one position.
fn built_in_states(schema: &Schema) -> Vec<String> {
    let has_one_channel = schema.channels.len() == 1;
    let name = |state: &augsim_system::State| match state.initial {
        InitialValue::Measured(channel) => schema.channels[channel].column.clone(),
        _ => match state.quantity.name.strip_prefix("velocity of ") {
            Some(_) if has_one_channel => "velocity_m_s".to_owned(),
            Some(axis) => format!("velocity_{axis}_m_s"),
            None => state.quantity.name.clone(),
        },
    };
    schema.states.iter().map(name).collect()
}

/// Converts the plan's inputs, at the sample times, to the input streams of the schema.
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
    let stream = |input: &augsim_system::Input| {
        let values = input.columns.iter().map(values).collect::<Result<Vec<_>, _>>()?;
        Ok(Stream { times: plan.times.clone(), values })
    };
    schema.inputs.iter().map(stream).collect()
}
