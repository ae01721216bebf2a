//! A written system as the loop sees it: [`augsim_physics::system::System`] over the engine in lanes.

mod declaration;
mod pushes;
mod records;
mod schema;
mod shown;
mod tables;
mod thinned;
mod tune;

use crate::engine::{Method, Options, Seed as EngineSeed, Simulated as Lanes, Window};
use crate::error::ModelError;
use crate::library::{Candidate, Scales, candidates, formulas, table_draft};
use crate::model::{Model, Target as ModelTarget};
use crate::system::System as Compiled;
use augsim_physics::model::Parameter;
use augsim_physics::system::{
    Effect, Event, Law, Objection, Quantity, Record, Schema, Seed, Simulated, SimulationError, System,
    SystemError, Table, Task,
};
pub use declaration::MeasuredModel;
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// Windows that the engine carries side by side with sensitivities.
const SIDE_BY_SIDE: usize = 16;
/// Steps of a sample interval where neither the file nor data say how many.
const SUBSTEPS: usize = 4;
/// Samples that a forecast may begin from: as many as `slope` in a `start` looks at.
const KNOWN: usize = 5;

/// A system of equations behind the loop's trait.
#[derive(Debug, Clone)]
pub struct WrittenSystem {
    schema: Arc<Schema>,
    /// Everything that may be missing, by the places of `library`.
    candidates: Arc<[Candidate]>,
    library: Arc<[Effect]>,
    compiled: Arc<Compiled>,
    /// The system compiled with derivatives by frozen parameters too, once somebody asks for one.
    complete: Arc<OnceLock<Option<Compiled>>>,
    options: Options,
    /// Seconds that a window of a fit lasts; whole records without it.
    window_s: Option<f64>,
    parameters: Vec<Parameter>,
    /// Place of each of these among the parameters of the model.
    places: Vec<usize>,
    laws: Vec<Law>,
    /// Laws of one feature that the data behind its library can speak about.
    tables: Arc<[Table]>,
    /// Values that fits of declared parameters begin at; empty: the nominal ones.
    fit_from: Vec<f64>,
}

impl WrittenSystem {
    /// The system of a model. Numbers of its library are those of `scales`, which come from data.
    ///
    /// # Errors
    /// A model that cannot be compiled, or a candidate that cannot be placed.
    pub fn new(model: &Model, scales: &Scales) -> Result<Self, ModelError> {
        let mut found = candidates(model)?;
        found.extend(formulas(model)?);
        found.iter_mut().for_each(|candidate| scales.resolve(candidate, model));
        let mut system = Self::with_candidates(model, found)?;
        let effects = system.candidates.iter().map(|candidate| Effect {
            grammar: schema::grammar(candidate, model, scales),
            ..schema::effect(candidate)
        });
        system.library = effects.collect();
        system.schema = Arc::new(tables::with_sizes((*system.schema).clone(), model, scales));
        system.tables = tables::tables(model, &system.schema, scales).into();
        Ok(system)
    }

    /// The system of a model without a library: for fits of what is declared, and for forecasts.
    ///
    /// # Errors
    /// A model that cannot be compiled.
    pub fn declared_only(model: &Model) -> Result<Self, ModelError> {
        Self::with_candidates(model, Vec::new())
    }

    fn with_candidates(model: &Model, found: Vec<Candidate>) -> Result<Self, ModelError> {
        let library: Arc<[Effect]> = found.iter().map(schema::effect).collect();
        let compiled = Compiled::compile(model, &schema::active(model))?;
        let options = Options {
            method: compiled.declared_method(),
            substeps: model.numerics.substeps.unwrap_or(SUBSTEPS),
        };
        Ok(Self {
            schema: Arc::new(schema::of(model)),
            candidates: found.into(),
            library,
            complete: Arc::default(),
            options,
            window_s: None,
            parameters: model.parameters.iter().map(schema::parameter).collect(),
            places: (0..model.parameters.len()).collect(),
            laws: Vec::new(),
            tables: Arc::default(),
            fit_from: Vec::new(),
            compiled: Arc::new(compiled),
        })
    }

    /// Sets the steps, as they were chosen from data.
    pub fn with_options(mut self, options: Options) -> Self {
        self.options = options;
        self
    }

    /// Sets the values that fits of declared parameters begin at, and the standard deviation that the sensor of each
    /// output does not exceed.
    pub fn with_fit(mut self, values: Vec<f64>, noise: &[f64]) -> Self {
        self.fit_from = values;
        let mut schema = (*self.schema).clone();
        schema.channels.iter_mut().zip(noise).for_each(|(c, sd)| c.sd_at_most = Some(*sd));
        self.schema = Arc::new(schema);
        self
    }

    /// Sets the seconds that windows of prepared records last.
    pub fn with_windows(mut self, seconds: Option<f64>) -> Self {
        self.window_s = seconds;
        self
    }

    /// The model with all laws in it.
    pub fn model(&self) -> &Model {
        self.compiled.model()
    }

    /// The compiled system.
    pub fn compiled(&self) -> &Compiled {
        &self.compiled
    }

    /// How it steps.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The candidate behind an effect of the library.
    pub fn candidate(&self, effect: usize) -> Option<&Candidate> {
        self.candidates.get(effect)
    }

    /// Place among the parameters of the model of one in a task's vector.
    pub fn place(&self, parameter: usize) -> Option<usize> {
        self.places.get(parameter).copied()
    }

    /// This system with the equations of `model`, which has the same parameters.
    fn with_equations(&self, model: &Model) -> Result<Self, ModelError> {
        let compiled = Compiled::compile(model, self.compiled.active())?.with_widths_of(&self.compiled);
        let (schema, compiled) = (Arc::new(schema::of(model)), Arc::new(compiled));
        Ok(Self { schema, compiled, complete: Arc::default(), ..self.clone() })
    }

    /// Adds one law to `model`; gives its parameters and their places.
    fn add(&self, model: &mut Model, law: &Law) -> Result<Vec<(Parameter, usize)>, SystemError> {
        let first = model.parameters.len();
        match law {
            Law::Effect(index) => {
                let missing = SystemError::Effect { index: *index, count: self.library.len() };
                let candidate = self.candidates.get(*index).ok_or(missing)?;
                model.add(&candidate.draft(&candidate.nulls())).map_err(|_| SystemError::Full)?;
                let free = candidate.parameters.iter().enumerate().filter(|(_, p)| !p.frozen);
                let effect = &self.library[*index];
                let parameters = effect.parameters.iter().map(Parameter::added);
                Ok(parameters.zip(free.map(|(i, _)| first + i)).collect())
            }
            Law::Table(table) => {
                let missing = SystemError::Table { target: table.target, against: table.against };
                let states = model.declared_states();
                let target = match table.target {
                    state if state < states => ModelTarget::Rate(state),
                    other if other - states < model.outputs.len() => ModelTarget::Output(other - states),
                    _ => return Err(missing),
                };
                let on = self.schema.targets.get(table.target).ok_or(missing)?;
                let against = self.schema.features.get(table.against).ok_or(missing)?;
                let zeros = vec![0.0; table.knots];
                let ends = (table.first, table.last);
                let draft = table_draft(target, &on.quantity.name, &against.name, ends, &zeros);
                model.add(&draft).map_err(|_| SystemError::Full)?;
                let most = tables::most_of_a_knot(on.usual);
                let knot = |i: usize| Parameter { min: -most, max: most, ..Parameter::knot(i) };
                Ok((0..table.knots).map(|i| (knot(i), first + i)).collect())
            }
        }
    }

    /// The compiled system that has derivatives by all seeds of a task.
    fn compiled_for(&self, seeds: &[Seed]) -> &Compiled {
        let is_active = |seed: &Seed| match seed {
            Seed::Parameter(p) => self.places.get(*p).is_none_or(|p| self.compiled.active().contains(p)),
            _ => true,
        };
        if seeds.iter().all(is_active) {
            return &self.compiled;
        }
        let complete = self.complete.get_or_init(|| {
            let all: Vec<usize> = (0..self.model().parameters.len()).collect();
            Compiled::compile(self.model(), &all).ok().map(|c| c.with_widths_of(&self.compiled))
        });
        complete.as_ref().unwrap_or(&self.compiled)
    }

    /// Simulates tasks that share their seeds, side by side.
    fn simulate_alike(
        &self,
        tasks: &[&Task<'_>],
        out: &mut [&mut Simulated],
        done: &mut [Option<Result<(), SimulationError>>],
    ) {
        let Some(first) = tasks.first() else { return };
        let compiled = self.compiled_for(first.seeds);
        let mut seeds = Vec::with_capacity(first.seeds.len());
        for seed in first.seeds {
            match seed {
                Seed::Parameter(p) => seeds.extend(self.places.get(*p).map(|p| EngineSeed::Parameter(*p))),
                Seed::Start(state) => seeds.push(EngineSeed::Start(*state)),
                // A task with offsets was refused: the schema has no event whose parameter they are of.
                Seed::Offset(_) => {}
            }
        }
        let mut usable = Vec::new();
        for (index, task) in tasks.iter().enumerate() {
            match self.scene(task) {
                Ok(scene) => usable.push((index, scene)),
                Err(error) => done[index] = Some(Err(error)),
            }
        }
        let windows: Vec<Window<'_>> = usable
            .iter()
            .map(|(_, scene)| Window {
                record: &scene.record,
                first: 0,
                last: scene.record.times().len() - 1,
                start: &scene.start,
                parameters: &scene.parameters,
            })
            .collect();
        let results = compiled.simulate(&windows, &seeds, &self.options);
        for ((index, _), result) in usable.iter().zip(results) {
            done[*index] = Some(match result {
                Ok(lanes) => {
                    write(&lanes, self.schema.channels.len(), seeds.len(), out[*index]);
                    Ok(())
                }
                Err(error) => Err(SimulationError::Engine(Box::new(error))),
            });
        }
    }
}

/// Hands the result of a lane over.
fn write(lanes: &Lanes, channels: usize, seeds: usize, out: &mut Simulated) {
    let samples = lanes.values.len() / channels.max(1);
    out.reset(samples, channels, seeds, 0);
    for (at, value) in lanes.values.iter().enumerate() {
        let slopes = lanes.slopes[at * seeds..(at + 1) * seeds].iter().copied();
        out.set_row(at / channels, at % channels, *value, slopes);
    }
    lanes.events.iter().for_each(|event| out.push_event(event.time, []));
}

impl System for WrittenSystem {
    fn schema(&self) -> &Schema {
        &self.schema
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn library(&self) -> &[Effect] {
        &self.library
    }

    fn laws(&self) -> &[Law] {
        &self.laws
    }

    fn augmented(&self, laws: &[Law]) -> Result<Arc<dyn System>, SystemError> {
        let mut model = self.model().clone();
        let mut system = self.clone();
        for law in laws {
            for (parameter, place) in self.add(&mut model, law)? {
                system.parameters.push(parameter);
                system.places.push(place);
            }
            system.laws.push(law.clone());
        }
        let mut active = schema::active(&model);
        active.extend(system.places.iter().filter(|p| **p >= self.model().parameters.len()));
        active.sort_unstable();
        active.dedup();
        let compiled = Compiled::compile(&model, &active).map_err(|_| SystemError::Full)?;
        let mut schema = (*self.schema).clone();
        schema.states = schema::states(&model);
        system.schema = Arc::new(schema);
        system.compiled = Arc::new(compiled.with_widths_of(&self.compiled));
        system.complete = Arc::default();
        Ok(Arc::new(system))
    }

    fn simulate(&self, task: &Task<'_>, out: &mut Simulated) -> Result<(), SimulationError> {
        let mut done = [None];
        self.simulate_alike(&[task], &mut [out], &mut done);
        done[0].take().unwrap_or(Ok(()))
    }

    fn simulate_all(&self, tasks: &[Task<'_>], out: &mut [Simulated]) -> Vec<Result<(), SimulationError>> {
        // Tasks with the same seeds share a run; which those are does not change a bit of any.
        let mut alike: BTreeMap<&[Seed], Vec<usize>> = BTreeMap::new();
        for (index, task) in tasks.iter().enumerate().take(out.len()) {
            alike.entry(task.seeds).or_default().push(index);
        }
        let places = out.len();
        let refused = |_| Err(SimulationError::no_place(&self.schema, tasks.len(), places));
        let mut results: Vec<Result<(), SimulationError>> = (0..tasks.len()).map(refused).collect();
        let mut slots: Vec<Option<&mut Simulated>> = out.iter_mut().map(Some).collect();
        for indices in alike.into_values() {
            let group: Vec<&Task<'_>> = indices.iter().map(|i| &tasks[*i]).collect();
            let mut places: Vec<&mut Simulated> =
                indices.iter().filter_map(|i| slots.get_mut(*i).and_then(Option::take)).collect();
            let mut done: Vec<Option<Result<(), SimulationError>>> = indices.iter().map(|_| None).collect();
            self.simulate_alike(&group, &mut places, &mut done);
            for (index, done) in indices.into_iter().zip(done) {
                results[index] = done.unwrap_or(Ok(()));
            }
        }
        results
    }

    fn side_by_side(&self) -> usize {
        SIDE_BY_SIDE
    }

    fn null_points(&self, effect: usize) -> Vec<Vec<f64>> {
        self.free_points(effect, Candidate::null_points)
    }

    fn scan_points(&self, effect: usize) -> Vec<Vec<f64>> {
        self.free_points(effect, Candidate::scan_points)
    }

    fn fit_from(&self, parameter: usize) -> Option<f64> {
        self.fit_from.get(parameter).copied()
    }

    fn quantity(&self, parameter: usize) -> Quantity {
        let unit = self.place(parameter).and_then(|place| self.model().parameters.get(place)?.unit);
        let name = self.parameters.get(parameter).map_or("", |p| &p.name);
        Quantity::new(name, &unit.map_or_else(String::new, |unit| unit.symbol()))
    }

    fn prepare(&self, record: &mut Record, _sd: &[f64]) -> Result<(), Objection> {
        self.prepare_record(record);
        Ok(())
    }

    fn begins_from_first_samples(&self) -> bool {
        true
    }

    fn tables(&self, _records: &[&Record], _events: &[Vec<Event>]) -> Vec<Table> {
        self.tables.to_vec()
    }

    /// Time, channels and inputs.
    fn shown_against(&self, record: &Record, _events: &[Event]) -> Vec<(String, Vec<f64>)> {
        let channels = self.schema.channels.iter().zip(&record.values);
        let mut shown = vec![("time_s".to_owned(), record.times.clone())];
        shown.extend(channels.map(|(c, values)| (c.column.clone(), values.clone())));
        for (input, stream) in self.model().inputs.iter().zip(record.inputs.iter()) {
            let signal = records::signal(input, stream);
            let values = record.times.iter().map(|t| signal.at(*t)).collect();
            shown.push((input.name.clone(), values));
        }
        shown
    }
}

impl WrittenSystem {
    /// Points of a candidate without the parameters that are frozen.
    fn free_points(&self, effect: usize, of: impl Fn(&Candidate) -> Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let Some(candidate) = self.candidates.get(effect) else { return Vec::new() };
        let free = |point: Vec<f64>| -> Vec<f64> {
            point.into_iter().zip(&candidate.parameters).filter(|(_, p)| !p.frozen).map(|(v, _)| v).collect()
        };
        of(candidate).into_iter().map(free).collect()
    }

    /// Whether steps have to be chosen by [`Method::Implicit`].
    pub fn is_implicit(&self) -> bool {
        self.options.method == Method::Implicit
    }
}
