//! Implements the system interface of calibration and discovery for systems of equations.
//!
//! The interface is [`augsim_system::System`].

mod decimation;
mod declaration;
mod process_noise;
mod records;
mod schema;
mod state_channels;
mod tables;
mod tuning;

use crate::engine::{Method, Options, Seed as EngineSeed, Simulated as Lanes, Window};
use crate::error::ModelError;
use crate::library::{Candidate, Scales, candidates, formulas, table_draft};
use crate::limits::MAX_SUBSTEPS;
use crate::model::{Model, Target as ModelTarget};
use crate::system::{CycleRate, System as Compiled};
use augsim_system::{
    Augment, Describe, Effect, Event, ModelTerm, Objection, Parameter, Prepare, Quantity, Record, Schema,
    Seed, Simulate, Simulated, SimulationError, System, SystemError, Table, Task,
};
pub use declaration::CalibratedModel;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// Number of windows that are simulated together in one pass when sensitivities are computed.
const BATCH_WINDOWS: usize = 16;
/// Number of integration steps per sample interval if neither the file nor data determine it.
const DEFAULT_SUBSTEPS: usize = 4;
/// Number of first samples from which a forecast may estimate its initial state: as many as `slope` in a `start` uses.
const START_SAMPLES: usize = 5;

/// A system of equations from a model file, in the interface of calibration and discovery.
#[derive(Debug, Clone)]
pub struct EquationSystem {
    schema: Arc<Schema>,
    /// All candidate effects of the model, with the same indices as `library`.
    candidates: Arc<[Candidate]>,
    library: Arc<[Effect]>,
    compiled: Arc<Compiled>,
    /// The system compiled with derivatives with respect to all parameters, frozen ones included.
    ///
    /// Compiled when a task first needs it; `None` if that fails.
    complete: Arc<OnceLock<Option<Compiled>>>,
    options: Options,
    /// Duration of the windows into which records are cut for a fit, s; `None` for whole records.
    window_s: Option<f64>,
    parameters: Vec<Parameter>,
    /// For each of `parameters`, its index in the model.
    places: Vec<usize>,
    laws: Vec<ModelTerm>,
    /// Table effects that discovery may try: functions of a single quantity that varies in the data.
    tables: Arc<[Table]>,
    /// Start values of fits of the declared parameters; if empty, fits start from the nominal values.
    start_value: Vec<f64>,
    /// For each group of the model: index of each parameter with a value of its own, and the difference of this value
    /// from the nominal one. Simulations of a record add the differences of its group; empty if they add none.
    group_offsets: Arc<[Vec<(usize, f64)>]>,
}

impl EquationSystem {
    /// Creates the system of a model with its library of candidate effects, scaled by `scales` of the data.
    ///
    /// # Errors
    /// A model that cannot be compiled, or a candidate with an unknown place.
    pub fn new(model: &Model, scales: &Scales) -> Result<Self, ModelError> {
        let mut candidates = candidates(model)?;
        candidates.extend(formulas(model)?);
        candidates.par_iter_mut().for_each(|candidate| scales.resolve(candidate, model));
        let mut system = Self::with_candidates(model, candidates)?;
        let effects = system.candidates.iter().map(|candidate| Effect {
            formula_domain: schema::grammar(candidate, model, scales),
            ..schema::effect(candidate)
        });
        system.library = effects.collect();
        system.schema = Arc::new(tables::with_typical_sizes((*system.schema).clone(), model, scales));
        system.tables = tables::tables(model, &system.schema, scales).into();
        Ok(system)
    }

    /// Creates the system of a model without a library, for fits of declared parameters and for forecasts.
    ///
    /// # Errors
    /// A model that cannot be compiled.
    pub fn declared_only(model: &Model) -> Result<Self, ModelError> {
        Self::with_candidates(model, Vec::new())
    }

    /// Creates the system of a model with these candidate effects.
    fn with_candidates(model: &Model, candidates: Vec<Candidate>) -> Result<Self, ModelError> {
        let library: Arc<[Effect]> = candidates.iter().map(schema::effect).collect();
        let compiled = Compiled::compile(model, &schema::active(model))?;
        let options = Options {
            method: compiled.declared_method(),
            substeps: model.numerics.substeps.unwrap_or(DEFAULT_SUBSTEPS),
        };
        Ok(Self {
            schema: Arc::new(schema::schema_of(model)),
            candidates: candidates.into(),
            library,
            complete: Arc::default(),
            options,
            window_s: None,
            parameters: schema::parameters(model),
            places: (0..model.parameters.len()).collect(),
            laws: Vec::new(),
            tables: Arc::default(),
            start_value: Vec::new(),
            group_offsets: Arc::default(),
            compiled: Arc::new(compiled),
        })
    }

    /// Sets the integration method and the number of steps per sample interval.
    pub fn with_options(mut self, options: Options) -> Self {
        self.options = options;
        self
    }

    /// Sets the start values of fits, and the upper bound of each output's noise standard deviation.
    pub fn with_fit(mut self, values: Vec<f64>, noise: &[f64]) -> Self {
        self.start_value = values;
        let mut schema = (*self.schema).clone();
        schema.channels.iter_mut().zip(noise).for_each(|(c, sd)| c.max_sd = Some(*sd));
        self.schema = Arc::new(schema);
        self
    }

    /// Sets the duration of the windows into which records are cut for fits, s; `None` for whole records.
    pub fn with_windows(mut self, seconds: Option<f64>) -> Self {
        self.window_s = seconds;
        self
    }

    /// Simulates each record with the values that the model has for its group.
    ///
    /// The group of a record is its index in the sorted names of the model's groups. The values of a task are then those
    /// of a mean group: a record gets them plus the differences of its group from the nominal values. A record of
    /// another group gets them as they are.
    pub fn with_group_values(mut self) -> Self {
        let model = self.model();
        let offsets = |group: &String| {
            let by_group = model.parameters.iter().enumerate().filter(|(_, p)| p.by_group.is_some());
            by_group.map(|(index, p)| (index, p.value_for(Some(group)) - p.nominal)).collect()
        };
        self.group_offsets = model.group_names().iter().map(offsets).collect();
        self
    }

    /// Simulates all records with the values of a task, whatever their groups.
    pub fn without_group_values(mut self) -> Self {
        self.group_offsets = Arc::default();
        self
    }

    /// The model, with the effects that were added to it.
    pub fn model(&self) -> &Model {
        self.compiled.model()
    }

    /// The compiled form of the system, which simulates.
    pub fn compiled(&self) -> &Compiled {
        &self.compiled
    }

    /// Integration method and number of steps per sample interval.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The candidate effect of the model with this index in the library.
    pub fn candidate(&self, effect: usize) -> Option<&Candidate> {
        self.candidates.get(effect)
    }

    /// Index in the model of the parameter with this index in a task.
    pub fn model_parameter(&self, parameter: usize) -> Option<usize> {
        self.places.get(parameter).copied()
    }

    /// Replaces the equations of this system by those of `model`, which must have the same parameters.
    fn with_equations(&self, model: &Model) -> Result<Self, ModelError> {
        let compiled = Compiled::compile(model, self.compiled.active())?.with_widths_of(&self.compiled);
        let (schema, compiled) = (Arc::new(schema::schema_of(model)), Arc::new(compiled));
        Ok(Self { schema, compiled, complete: Arc::default(), ..self.clone() })
    }

    /// Adds an effect to `model`; returns the effect's parameters with their indices in the model.
    fn add(&self, model: &mut Model, law: &ModelTerm) -> Result<Vec<(Parameter, usize)>, SystemError> {
        let first = model.parameters.len();
        match law {
            ModelTerm::Effect(index) => {
                let missing = SystemError::Effect { index: *index, count: self.library.len() };
                let candidate = self.candidates.get(*index).ok_or(missing)?;
                model.add(&candidate.draft(&candidate.nulls())).map_err(|_| SystemError::Full)?;
                let free = candidate.parameters.iter().enumerate().filter(|(_, p)| !p.frozen);
                let effect = &self.library[*index];
                let parameters = effect.parameters.iter().map(Parameter::added);
                Ok(parameters.zip(free.map(|(i, _)| first + i)).collect())
            }
            ModelTerm::Table(table) => {
                let missing = SystemError::Table { target: table.target, against: table.feature };
                let states = model.declared_states();
                let target = match table.target {
                    state if state < states => ModelTarget::Rate(state),
                    other if other - states < model.outputs.len() => ModelTarget::Output(other - states),
                    _ => return Err(missing),
                };
                let target_quantity = self.schema.targets.get(table.target).ok_or(missing)?;
                let against = self.schema.features.get(table.feature).ok_or(missing)?;
                let zeros = vec![0.0; table.knots];
                let end_knots = (table.first, table.last);
                let draft =
                    table_draft(target, &target_quantity.quantity.name, &against.name, end_knots, &zeros);
                model.add(&draft).map_err(|_| SystemError::Full)?;
                let bound = tables::knot_bound(target_quantity.typical);
                let knot = |i: usize| Parameter { min: -bound, max: bound, ..Parameter::knot(i) };
                Ok((0..table.knots).map(|i| (knot(i), first + i)).collect())
            }
        }
    }

    /// Selects a compiled system that has derivatives with respect to all seeds of a task.
    fn compiled_for(&self, seeds: &[Seed]) -> &Compiled {
        let is_active = |seed: &Seed| match seed {
            Seed::Parameter(p) => self.places.get(*p).is_none_or(|p| self.compiled.active().contains(p)),
            _ => true,
        };
        if seeds.iter().all(is_active) {
            return &self.compiled;
        }
        let complete = self.complete.get_or_init(|| {
            let all_parameters: Vec<usize> = (0..self.model().parameters.len()).collect();
            Compiled::compile(self.model(), &all_parameters).ok().map(|c| c.with_widths_of(&self.compiled))
        });
        complete.as_ref().unwrap_or(&self.compiled)
    }

    /// Index of a seed of a declared initial state, and a state of an effect that begins with the same value, for all such
    /// states.
    fn followers(&self, seeds: &[EngineSeed]) -> Vec<(usize, usize)> {
        let of_seed = |(column, seed): (usize, &EngineSeed)| -> Vec<(usize, usize)> {
            let EngineSeed::Start(state) = seed else { return Vec::new() };
            self.model().states_that_start_as(*state).map(|other| (column, other)).collect()
        };
        seeds.iter().enumerate().flat_map(of_seed).collect()
    }

    /// Simulates tasks that have equal seeds together.
    fn simulate_group(
        &self,
        tasks: &[&Task<'_>],
        out: &mut [&mut Simulated],
        results: &mut [Option<Result<(), SimulationError>>],
    ) {
        let Some(first) = tasks.first() else { return };
        let compiled = self.compiled_for(first.seeds);
        let mut seeds = Vec::with_capacity(first.seeds.len());
        for seed in first.seeds {
            match seed {
                Seed::Parameter(p) => seeds.extend(self.places.get(*p).map(|p| EngineSeed::Parameter(*p))),
                Seed::Start(state) => seeds.push(EngineSeed::Start(*state)),
                // A task with offsets is refused before: the schema has no event with an offset parameter.
                Seed::Offset(_) => {}
            }
        }
        let mut tasks_to_run = Vec::new();
        for (index, task) in tasks.iter().enumerate() {
            match self.engine_task(task) {
                Ok(engine_task) => tasks_to_run.push((index, engine_task)),
                Err(error) => results[index] = Some(Err(error)),
            }
        }
        let followers = if tasks_to_run.iter().any(|(_, task)| task.computes_starts) {
            self.followers(&seeds)
        } else {
            Vec::new()
        };
        let wanted = seeds.len();
        seeds.extend(followers.iter().map(|(_, state)| EngineSeed::Start(*state)));
        let windows: Vec<Window<'_>> = tasks_to_run
            .iter()
            .map(|(_, engine_task)| Window {
                record: &engine_task.record,
                first: 0,
                last: engine_task.record.times().len() - 1,
                start: &engine_task.start,
                parameters: &engine_task.parameters,
            })
            .collect();
        let simulated = compiled.simulate(&windows, &seeds, &self.options);
        for ((index, task), result) in tasks_to_run.iter().zip(simulated) {
            results[*index] = Some(match result {
                Ok(mut lanes) => {
                    let added: &[_] = if task.computes_starts { &followers } else { &[] };
                    merge_slopes(&mut lanes, seeds.len(), wanted, added);
                    copy_result(&lanes, self.schema.channels.len(), wanted, out[*index]);
                    Ok(())
                }
                Err(error) => Err(SimulationError::Engine(Box::new(error))),
            });
        }
    }
}

/// Keeps the derivatives with respect to the first `wanted` of `seeds` seeds, and adds to that with respect to each
/// declared initial state those with respect to the states that begin with it.
fn merge_slopes(lanes: &mut Lanes, seeds: usize, wanted: usize, followers: &[(usize, usize)]) {
    if seeds == wanted {
        return;
    }
    let merge = |row: &[f64]| {
        let mut merged = row[..wanted].to_vec();
        followers.iter().zip(&row[wanted..]).for_each(|((column, _), slope)| merged[*column] += slope);
        merged
    };
    lanes.slopes = lanes.slopes.chunks_exact(seeds).flat_map(merge).collect();
}

/// Copies the result of the engine for one window into the result of a task.
fn copy_result(lanes: &Lanes, channels: usize, seeds: usize, out: &mut Simulated) {
    let samples = lanes.values.len() / channels.max(1);
    out.reset(samples, channels, seeds, 0);
    for (index, value) in lanes.values.iter().enumerate() {
        let slopes = lanes.slopes[index * seeds..(index + 1) * seeds].iter().copied();
        out.set_row(index / channels, index % channels, *value, slopes);
    }
    lanes.events.iter().for_each(|event| out.push_event(event.time, []));
}

impl Simulate for EquationSystem {
    fn schema(&self) -> &Schema {
        &self.schema
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn simulate(&self, task: &Task<'_>, out: &mut Simulated) -> Result<(), SimulationError> {
        let mut results = [None];
        self.simulate_group(&[task], &mut [out], &mut results);
        results[0].take().unwrap_or(Ok(()))
    }

    fn simulate_batch(&self, tasks: &[Task<'_>], out: &mut [Simulated]) -> Vec<Result<(), SimulationError>> {
        // Tasks with equal seeds share a run; the grouping does not change a bit of any result.
        let mut groups: BTreeMap<&[Seed], Vec<usize>> = BTreeMap::new();
        for (index, task) in tasks.iter().enumerate().take(out.len()) {
            groups.entry(task.seeds).or_default().push(index);
        }
        let out_count = out.len();
        let refused = |_| Err(SimulationError::missing_output(&self.schema, tasks.len(), out_count));
        let mut results: Vec<Result<(), SimulationError>> = (0..tasks.len()).map(refused).collect();
        let mut slots: Vec<Option<&mut Simulated>> = out.iter_mut().map(Some).collect();
        for indices in groups.into_values() {
            let group: Vec<&Task<'_>> = indices.iter().map(|i| &tasks[*i]).collect();
            let mut group_out: Vec<&mut Simulated> =
                indices.iter().filter_map(|i| slots.get_mut(*i).and_then(Option::take)).collect();
            let mut group_results: Vec<Option<Result<(), SimulationError>>> =
                indices.iter().map(|_| None).collect();
            self.simulate_group(&group, &mut group_out, &mut group_results);
            for (index, group_results) in indices.into_iter().zip(group_results) {
                results[index] = group_results.unwrap_or(Ok(()));
            }
        }
        results
    }

    fn simd_batch_size(&self) -> usize {
        BATCH_WINDOWS
    }

    fn start_mean(&self, record: &Record, state: usize, parameters: &[f64], start: &[f64]) -> f64 {
        self.mean_of_start(record, state, parameters, start)
    }

    fn effect_starts(&self, record: &Record, first: usize, declared: &[f64]) -> Vec<f64> {
        self.starts_of_effects(record, first, declared)
    }
}

impl Augment for EquationSystem {
    fn library(&self) -> &[Effect] {
        &self.library
    }

    fn terms(&self) -> &[ModelTerm] {
        &self.laws
    }

    fn augmented(&self, laws: &[ModelTerm]) -> Result<Arc<dyn System>, SystemError> {
        let mut model = self.model().clone();
        let mut system = self.clone();
        for law in laws {
            for (parameter, place) in self.add(&mut model, law)? {
                system.parameters.push(parameter);
                system.places.push(place);
            }
            system.laws.push(law.clone());
        }
        let cycles = system.cycles();
        let mut active = schema::active(&model);
        active.extend(system.places.iter().filter(|p| **p >= self.model().parameters.len()));
        active.sort_unstable();
        active.dedup();
        let compiled = Compiled::compile(&model, &active).map_err(|_| SystemError::Full)?;
        let mut schema = (*self.schema).clone();
        schema.states = schema::states(&model);
        system.schema = Arc::new(schema);
        // Data do not determine rates that are this much faster than the sampling, and each fit would take minutes.
        let max_substeps = MAX_SUBSTEPS.max(self.options.substeps);
        system.compiled = Arc::new(
            compiled
                .with_widths_of(&self.compiled)
                .with_max_stable_substeps(max_substeps)
                .with_cycles(cycles),
        );
        system.complete = Arc::default();
        Ok(Arc::new(system))
    }

    /// Returns true: the rows of the library are general forms, not parts of a known apparatus.
    fn groupwise_effects_need_shared(&self) -> bool {
        true
    }

    fn null_points(&self, effect: usize) -> Vec<Vec<f64>> {
        self.free_points(effect, Candidate::null_points)
    }

    fn scan_points(&self, effect: usize) -> Vec<Vec<f64>> {
        self.free_points(effect, Candidate::scan_points)
    }

    fn cycle_points(&self, effect: usize) -> Vec<Vec<f64>> {
        self.free_points(effect, Candidate::cycle_points)
    }

    fn candidate_tables(&self, _records: &[&Record], _events: &[Vec<Event>]) -> Vec<Table> {
        self.tables.to_vec()
    }
}

impl Prepare for EquationSystem {
    fn prepare(&self, record: &mut Record, _sd: &[f64]) -> Result<(), Objection> {
        self.prepare_record(record);
        Ok(())
    }

    fn starts_from_first_samples(&self) -> bool {
        true
    }

    fn start_value(&self, parameter: usize) -> Option<f64> {
        self.start_value.get(parameter).copied()
    }
}

impl Describe for EquationSystem {
    fn quantity(&self, parameter: usize) -> Quantity {
        let unit = self.model_parameter(parameter).and_then(|place| self.model().parameters.get(place)?.unit);
        let name = self.parameters.get(parameter).map_or("", |p| &p.name);
        Quantity::new(name, &unit.map_or_else(String::new, |unit| unit.symbol()))
    }

    /// Lists time, outputs and inputs as the axes against which residuals are plotted.
    fn residual_axes(&self, record: &Record, _events: &[Event]) -> Vec<(String, Vec<f64>)> {
        let channels = self.schema.channels.iter().zip(&record.values);
        let mut columns = vec![("time_s".to_owned(), record.times.clone())];
        columns.extend(channels.map(|(c, values)| (c.column.clone(), values.clone())));
        for (input, stream) in self.model().inputs.iter().zip(record.inputs.iter()) {
            let signal = records::signal(input, stream);
            let values = record.times.iter().map(|t| signal.at(*t)).collect();
            columns.push((input.name.clone(), values));
        }
        columns
    }
}

impl EquationSystem {
    /// Removes the frozen parameters from the points of a candidate effect.
    fn free_points(&self, effect: usize, points_of: impl Fn(&Candidate) -> Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let Some(candidate) = self.candidates.get(effect) else { return Vec::new() };
        let keep_free = |point: Vec<f64>| -> Vec<f64> {
            point.into_iter().zip(&candidate.parameters).filter(|(_, p)| !p.frozen).map(|(v, _)| v).collect()
        };
        points_of(candidate).into_iter().map(keep_free).collect()
    }

    /// Periods and frequencies of the added effects.
    fn cycles(&self) -> Vec<CycleRate> {
        let mut first = self.declared_count();
        let mut out = Vec::new();
        for law in &self.laws {
            if let ModelTerm::Effect(index) = law {
                let free = self.candidates[*index].parameters.iter().filter(|p| !p.frozen);
                for (p, &parameter) in free.zip(&self.places[first..]) {
                    out.extend(p.cycle.map(|cycle| CycleRate { parameter, cycle, speed: p.cycle_speed }));
                }
            }
            first += law.size(&self.library);
        }
        out
    }

    /// Whether the system is integrated with the steps of [`Method::Implicit`].
    pub fn is_implicit(&self) -> bool {
        self.options.method == Method::Implicit
    }
}
