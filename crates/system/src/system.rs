//! The roles of a system: [`Simulate`], [`Prepare`], [`Augment`] and [`Describe`], and all four as [`System`].
//!
//! A system describes its states, channels and inputs in a [`Schema`] and simulates windows of records together
//! with any number of derivatives. The traits are object-safe: their users are compiled once, and how derivatives
//! are computed stays behind [`Simulate::simulate`]. [`Augment::augmented`] returns a new system with more effects,
//! so that a system of equations is compiled once per model structure, not once per simulation.
//!
//! To add a system, implement the methods that have no default (the roles [`Prepare`] and [`Describe`] have none
//! without); [`in_blocks`](crate::in_blocks) splits the derivatives of a task among runs of a limited width.

use crate::design::Designs;
use crate::effect::Effect;
use crate::error::{Objection, SimulationError, SystemError};
use crate::model_term::{ModelTerm, Table};
use crate::parameter::Parameter;
use crate::quantity::Quantity;
use crate::record::Record;
use crate::schema::Schema;
use crate::simulated::{Event, Simulated};
use crate::task::Task;
use crate::top_view::TopView;
use std::fmt::Debug;
use std::ops::Range;
use std::sync::Arc;

/// Simulates windows of records, with derivatives: all that a fit, a filter or a forecast needs of a system.
pub trait Simulate: Debug + Send + Sync {
    /// Describes the states, channels, inputs, covariates, features and targets of the system, with their units.
    fn schema(&self) -> &Schema;

    /// Parameters of the system, in the order of its parameter vector: declared ones, then those of added effects.
    fn parameters(&self) -> &[Parameter];

    /// Simulates one window: the channels and their derivatives with respect to the task's seeds.
    ///
    /// # Errors
    /// [`SimulationError`] if the window cannot be simulated at these values; `out` is then undefined.
    fn simulate(&self, task: &Task<'_>, out: &mut Simulated) -> Result<(), SimulationError>;

    /// Simulates many windows: element `i` of the result and of `out` belongs to task `i`.
    ///
    /// Each result is bit-identical to that of [`simulate`](Simulate::simulate), whatever the other tasks are.
    /// Runs on the calling thread; a caller with several threads splits its list, preferably into multiples
    /// of [`simd_batch_size`](Simulate::simd_batch_size). The default simulates one window after the other; a system
    /// that batches windows in SIMD lanes overrides it.
    ///
    /// # Errors
    /// One [`SimulationError`] per failed task, whose element of `out` is then undefined; the other tasks are
    /// not affected. A task without an element in `out` is refused.
    fn simulate_batch(&self, tasks: &[Task<'_>], out: &mut [Simulated]) -> Vec<Result<(), SimulationError>> {
        let out_count = out.len();
        let mut outputs = out.iter_mut();
        let simulate = |task| match outputs.next() {
            Some(output) => self.simulate(task, output),
            None => Err(SimulationError::missing_output(self.schema(), tasks.len(), out_count)),
        };
        tasks.iter().map(simulate).collect()
    }

    /// Number of windows with equal seeds that [`simulate_batch`](Simulate::simulate_batch) simulates in one pass.
    fn simd_batch_size(&self) -> usize {
        1
    }

    /// Mean of the prior of an initial state at the beginning of a record.
    ///
    /// For states with [`PriorAboutExpression`](crate::InitialValue::PriorAboutExpression).
    /// It may depend on the parameters and on the initial values `start` of the other states. The default is the
    /// rough initial state of the record.
    fn start_mean(&self, record: &Record, state: usize, _parameters: &[f64], _start: &[f64]) -> f64 {
        record.windows.first().and_then(|w| w.start.get(state)).copied().unwrap_or(f64::NAN)
    }

    /// Initial values of the states of effects in a window that begins at sample `first` of a record.
    ///
    /// They follow those of the declared states, whose initial values are `declared`. The default is for systems whose effects have no states.
    fn effect_starts(&self, _record: &Record, _first: usize, _declared: &[f64]) -> Vec<f64> {
        Vec::new()
    }

    /// Accuracy of the engine in a channel, in the channel's unit; effects smaller than this are not considered.
    ///
    /// If it is not 0, the model is an idealisation and always leaves smooth residuals: gains are then
    /// divided by a dispersion factor estimated from the residuals.
    fn resolution(&self, _channel: usize) -> f64 {
        0.0
    }
}

/// A system that a search for missing effects can extend by candidate effects.
pub trait Augment: Simulate {
    /// Candidate effects of the system, in the order in which they are applied; augmentation does not change it.
    fn library(&self) -> &[Effect];

    /// Effects that [`augmented`](Augment::augmented) has added, in the order of their parameters.
    fn terms(&self) -> &[ModelTerm];

    /// Returns this system with further effects added; their parameters are appended in the order of `laws`.
    ///
    /// # Errors
    /// [`SystemError`] if the system does not have one of the effects.
    fn augmented(&self, laws: &[ModelTerm]) -> Result<Arc<dyn System>, SystemError>;

    /// Parameter values at which an effect vanishes: points of its score test, and start values of its fit.
    ///
    /// An inner parameter, such as a width or a threshold, has no null value: it takes values on a grid, and
    /// its derivative is 0 at each of these points. The default is one point, the null values of all
    /// parameters; the list is empty for an index outside the library.
    fn null_points(&self, effect: usize) -> Vec<Vec<f64>> {
        let nulls = |effect: &Effect| effect.parameters.iter().map(|p| p.null).collect();
        self.library().get(effect).map(nulls).into_iter().collect()
    }

    /// Start values of an effect's fit at which it is active, for effects that a score test cannot detect.
    ///
    /// Example: the threshold of a tank overflow. Its derivative is 0 where the effect vanishes, so the
    /// threshold is scanned over the range of the quantity that it limits.
    fn scan_points(&self, _effect: usize) -> Vec<Vec<f64>> {
        Vec::new()
    }

    /// Parameter values at which the periodogram of a periodic effect is computed: its null values at many periods.
    ///
    /// The fit of a period converges only from within a fraction of a cycle over the range of the data. Empty for an
    /// effect without a period.
    fn cycle_points(&self, _effect: usize) -> Vec<Vec<f64>> {
        Vec::new()
    }

    /// Whether an effect of the library can be searched for in these records.
    ///
    /// False if the records lack the data that it needs, or if the declared model contains it already.
    fn can_search_effect(&self, _effect: usize, _records: &[&Record]) -> bool {
        true
    }

    /// Whether an effect of the library may have one value per group.
    ///
    /// The default is false for effects that act through another one.
    fn can_vary_by_group(&self, effect: usize) -> bool {
        self.library().get(effect).is_some_and(|e| e.joins.is_none())
    }

    /// Whether an effect gets one value per group only beside the same effect with one value (marginality: Nelder 1977).
    ///
    /// With a large library of general forms, many values of one form would stand in for another form.
    fn groupwise_effects_need_shared(&self) -> bool {
        false
    }

    /// Tables (functions of one feature) that may be added, given records and their simulated events.
    fn candidate_tables(&self, _records: &[&Record], _events: &[Vec<Event>]) -> Vec<Table> {
        Vec::new()
    }

    /// Number of declared parameters, not counting the parameters of the added effects.
    fn declared_count(&self) -> usize {
        let added: usize = self.terms().iter().map(|law| law.size(self.library())).sum();
        self.parameters().len() - added
    }

    /// For each added effect, the index range of its parameters in a task's parameter vector.
    fn term_parameter_ranges(&self) -> Vec<Range<usize>> {
        let mut first = self.declared_count();
        self.terms()
            .iter()
            .map(|law| {
                let range = first..first + law.size(self.library());
                first = range.end;
                range
            })
            .collect()
    }
}

/// Prepares measured records for fits: covariates, events, windows, rough values; and refuses unusable records.
pub trait Prepare: Simulate {
    /// Reads the covariates of a record from its constant columns, in schema order; NaN where not recorded.
    ///
    /// The default reads the column that has the covariate's name.
    fn covariates(&self, constant: &dyn Fn(&str) -> Option<f64>) -> Vec<f64> {
        self.schema().covariates.iter().map(|c| constant(&c.name).unwrap_or(f64::NAN)).collect()
    }

    /// Completes a record after reading: finds events, smooth segments, windows and rough initial states.
    ///
    /// `sd` is a rough noise standard deviation of each channel, in the channel's unit. The default takes the
    /// whole record as one window without segments; see [`Record::use_as_one_window`] for the initial state.
    ///
    /// # Errors
    /// [`Objection`] if the record is unusable.
    fn prepare(&self, record: &mut Record, sd: &[f64]) -> Result<(), Objection> {
        let _ = sd;
        record.use_as_one_window(self.schema());
        Ok(())
    }

    /// Estimates scene parameters, such as the floor height, from data; returns the system with them, calibrated.
    ///
    /// `None` if the declared scene agrees with the records.
    fn with_scene_from_data(&self, _records: &[&Record]) -> Option<Arc<dyn System>> {
        None
    }

    /// Whether the rough initial states of windows come from their first samples alone.
    ///
    /// Such a start may be poor; the caller then refines it by fitting longer and longer first parts of the
    /// window. The default is false: a system that detects events uses them for its initial states.
    fn starts_from_first_samples(&self) -> bool {
        false
    }

    /// Start value for fitting a declared parameter; `None` if there is none better than the nominal value.
    fn start_value(&self, _parameter: usize) -> Option<f64> {
        None
    }

    /// Reason why these prepared records cannot be used, as an error that says what to do; `None` if they can.
    ///
    /// Rejected samples are NaN; `sd` is the noise standard deviation of each channel, in the channel's unit.
    fn objection(&self, _records: &[Record], _sd: &[f64]) -> Option<Objection> {
        None
    }
}

/// Describes results and judges them: names, axes of residuals, drawings, further experiments, plausibility.
pub trait Describe: Simulate {
    /// Name and unit under which results list a parameter.
    fn quantity(&self, parameter: usize) -> Quantity {
        let name = self.parameters().get(parameter).map_or("", |p| &p.name);
        Quantity::new(name, "")
    }

    /// Quantities against which residuals are plotted: name, and one value per sample (NaN if undefined).
    ///
    /// `events` are the simulated events of the record.
    fn residual_axes(&self, record: &Record, _events: &[Event]) -> Vec<(String, Vec<f64>)> {
        let channels = self.schema().channels.iter().zip(&record.values);
        let time = ("time_s".to_string(), record.times.clone());
        std::iter::once(time).chain(channels.map(|(c, values)| (c.column.clone(), values.clone()))).collect()
    }

    /// Data for a top view of a record at these times, with parameter `values`; `None` if there is no such view.
    fn scene(&self, _record: &Record, _times: &[f64], _values: &[f64]) -> Option<TopView> {
        None
    }

    /// Candidate experiments for experiment design, sampled every `step_s` seconds.
    fn candidate_experiments(&self, _records: &[&Record], _step_s: f64) -> Designs {
        Designs::default()
    }

    /// Reason why no parameter values make the system fit these records, with a remedy; `None` if there is none.
    fn foreign_records_objection(&self, _records: &[&Record], _sd: &[f64]) -> Option<Objection> {
        None
    }

    /// Reason why calibrated parameter values are implausible, with a likely remedy; `None` if they are plausible.
    ///
    /// `values` are in the order of the system's [`parameters`](Simulate::parameters).
    fn implausible_values_objection(&self, _values: &[f64]) -> Option<Objection> {
        None
    }
}

/// A dynamic system with a measured output and a model that may lack effects: all four roles.
///
/// A function takes the narrowest role that it needs; a `&dyn System` converts to each.
pub trait System: Simulate + Augment + Prepare + Describe {}

impl<T: Simulate + Augment + Prepare + Describe> System for T {}
