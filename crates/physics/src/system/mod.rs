//! The trait through which the loop sees any system: it moves, it is measured, and its model may be wrong.
//!
//! A [`System`] says by its [`Schema`] what its states, channels and inputs are, has declared parameters and a library of
//! effects that may be missing, and simulates windows of records with any number of derivatives. It is object-safe: the
//! loop is compiled once, and dual numbers stay behind [`System::simulate`]. Laws are added by [`System::augmented`], whose
//! answer is a system like any other: a written system is compiled once for a set of laws and not once for a simulation,
//! and whatever takes a system takes an augmented one.
//!
//! Adding a system: implement the five methods without a default; [`in_blocks`] and `with_lanes` choose the widths of the
//! dual numbers. Adding one from Rust by its equations: see `Equations` in the `ode` module.

mod declaration;
mod design;
pub(crate) mod effect;
mod error;
mod lanes;
mod law;
mod quantity;
mod record;
mod scatter;
mod schema;
mod simulated;
mod task;
mod top_view;

use crate::model::parameter::Parameter;
use std::fmt::Debug;
use std::ops::Range;
use std::sync::Arc;

pub use declaration::{Addition, Augmentation, Declaration, Fitted, FittedValues, NotReadable};
pub use design::{Design, Designs};
pub use effect::{Effect, EffectParameter, Grammar, Join, Rival, Start, known_separation};
pub use error::{Objection, SimulationError, SystemError};
pub(crate) use lanes::with_lanes;
pub use lanes::{in_blocks, seeded};
pub use law::{Law, Table};
pub use quantity::Quantity;
pub use record::{MEMORY, Record, SeenEvent, Stream, Window, pieces_of, spread, typical_step};
pub use scatter::{Scatter, ScatterPer};
pub use schema::{Begin, Between, Channel, Drawn, EventSchema, Input, Measure, Schema, State, Target};
pub use simulated::{Event, Simulated};
pub use task::{Offsets, Seed, Task};
pub use top_view::TopView;

/// A system that moves, is measured, and has a model that may be wrong.
pub trait System: Debug + Send + Sync {
    /// States, channels, inputs, covariates, features and targets with their units, and the words for them.
    fn schema(&self) -> &Schema;

    /// Parameters in the order of a task's vector: the declared ones, then those of the added laws.
    fn parameters(&self) -> &[Parameter];

    /// Effects that may be missing, in the order in which they act; the same for a system and its augmented ones.
    fn library(&self) -> &[Effect];

    /// The laws that [`augmented`](System::augmented) has added, in the order of their parameters.
    fn laws(&self) -> &[Law];

    /// This system with more laws; their parameters follow those that are there, in the order of `laws`.
    ///
    /// # Errors
    /// A law that the system does not have.
    fn augmented(&self, laws: &[Law]) -> Result<Arc<dyn System>, SystemError>;

    /// Simulates one window of a record: the channels, and their derivatives with respect to the seeds of the task, however
    /// many.
    ///
    /// # Errors
    /// [`SimulationError`]: the window cannot be simulated at these values; `out` is then undefined.
    fn simulate(&self, task: &Task<'_>, out: &mut Simulated) -> Result<(), SimulationError>;

    /// Simulates many windows: result and place of `out` number `i` are those of task `i`, to the last bit those of
    /// [`simulate`](System::simulate), whatever else stands in the list. Runs on the calling thread: a caller with several
    /// hands out parts of its list, best in multiples of [`side_by_side`](System::side_by_side).
    ///
    /// The default simulates one after the other. A system that carries several windows in one pass overrides it.
    ///
    /// # Errors
    /// Of each task its own [`SimulationError`], which concerns no other; its place of `out` is then undefined. A task
    /// without a place in `out` is refused.
    fn simulate_all(&self, tasks: &[Task<'_>], out: &mut [Simulated]) -> Vec<Result<(), SimulationError>> {
        let places = out.len();
        let mut places_left = out.iter_mut();
        let simulate = |task| match places_left.next() {
            Some(out) => self.simulate(task, out),
            None => Err(SimulationError::no_place(self.schema(), tasks.len(), places)),
        };
        tasks.iter().map(simulate).collect()
    }

    /// How many windows with the same seeds [`simulate_all`](System::simulate_all) carries in one pass.
    fn side_by_side(&self) -> usize {
        1
    }

    /// Values of an effect's parameters at which it vanishes, each a place to score it at and to fit it from. An inner
    /// parameter, such as a width or a threshold, has no null of its own and stands on a grid there; its derivative is 0
    /// at every one of these points.
    ///
    /// The default is one point, that of the nulls; none for an effect that the library does not have.
    fn null_points(&self, effect: usize) -> Vec<Vec<f64>> {
        let nulls = |effect: &Effect| effect.parameters.iter().map(|p| p.null).collect();
        self.library().get(effect).map(nulls).into_iter().collect()
    }

    /// Values of an effect's parameters from which it is fitted without being scored: thresholds of laws that have no slope
    /// at their null, such as the overflow of a tank, scanned over the range of what they watch. At these the effect acts.
    fn scan_points(&self, _effect: usize) -> Vec<Vec<f64>> {
        Vec::new()
    }

    /// Name and unit of a declared parameter in results.
    fn quantity(&self, parameter: usize) -> Quantity {
        let name = self.parameters().get(parameter).map_or("", |p| &p.name);
        Quantity::new(name, "")
    }

    /// A value that fits of a declared parameter begin at, where a better one than the nominal value is known.
    fn fit_from(&self, _parameter: usize) -> Option<f64> {
        None
    }

    /// Covariates of a record, in the order of the schema, from its constant columns; NaN where not recorded.
    ///
    /// The default takes the column of the covariate's own name.
    fn covariates(&self, constant: &dyn Fn(&str) -> Option<f64>) -> Vec<f64> {
        self.schema().covariates.iter().map(|c| constant(&c.name).unwrap_or(f64::NAN)).collect()
    }

    /// Completes a record that was read by the schema: events seen in the data, smooth pieces, windows and their rough
    /// starts. `sd` is a rough noise of each channel, in its unit.
    ///
    /// The default takes the whole record as one window, from its first samples, and names no pieces; states that are no channel
    /// start at 0, or where the schema puts them.
    ///
    /// # Errors
    /// Why nothing can be made of this record.
    fn prepare(&self, record: &mut Record, sd: &[f64]) -> Result<(), Objection> {
        let _ = sd;
        record.whole(self.schema());
        Ok(())
    }

    /// Whether the rough starts of prepared windows come from their first samples alone: a window that such a start does not follow
    /// is then begun over ever longer beginnings.
    ///
    /// The default is false: a system that knows its events takes them into account.
    fn begins_from_first_samples(&self) -> bool {
        false
    }

    /// This system with what the prepared records show of its scene, such as where the floor lies, as parameters to calibrate;
    /// `None` where the declared scene is as good.
    fn settled(&self, _records: &[&Record]) -> Option<Arc<dyn System>> {
        None
    }

    /// Why no answer can come of these prepared records, in one sentence that says what to do. Wrong samples are no numbers;
    /// `sd` is the noise of each channel, in its unit.
    fn objection(&self, _records: &[Record], _sd: &[f64]) -> Option<Objection> {
        None
    }

    /// Why these records are not of such a system, whatever its parameters are, in one sentence with the likeliest remedy.
    fn unlike(&self, _records: &[&Record], _sd: &[f64]) -> Option<Objection> {
        None
    }

    /// Why calibrated values of the declared parameters cannot be those of such a system, in one sentence with the likeliest
    /// remedy; `values` stand in the order of [`parameters`](System::parameters).
    fn implausible(&self, _values: &[f64]) -> Option<Objection> {
        None
    }

    /// Whether these records can speak about an effect of the library, and the declared model does not have it already.
    fn possible(&self, _effect: usize, _records: &[&Record]) -> bool {
        true
    }

    /// Whether a model of this system can give an effect of the library a value for each group.
    ///
    /// The default leaves out effects that act through another one.
    fn by_group(&self, effect: usize) -> bool {
        self.library().get(effect).is_some_and(|e| e.joins.is_none())
    }

    /// Laws of one feature that these records can speak about; `events` are those that a simulation of each record passed.
    fn tables(&self, _records: &[&Record], _events: &[Vec<Event>]) -> Vec<Table> {
        Vec::new()
    }

    /// Quantities that residuals are shown against, by name, with their values sample by sample (NaN where there is none);
    /// `events` are those that the simulation passed.
    fn shown_against(&self, record: &Record, _events: &[Event]) -> Vec<(String, Vec<f64>)> {
        let channels = self.schema().channels.iter().zip(&record.values);
        let time = ("time_s".to_string(), record.times.clone());
        std::iter::once(time).chain(channels.map(|(c, values)| (c.column.clone(), values.clone()))).collect()
    }

    /// Scene of a view from above beside the states, at these times of a record, with parameter `values`; none for a system that
    /// has no such view.
    fn scene(&self, _record: &Record, _times: &[f64], _values: &[f64]) -> Option<TopView> {
        None
    }

    /// Experiments that could be made, sampled every `step_s` seconds.
    fn designs(&self, _records: &[&Record], _step_s: f64) -> Designs {
        Designs::default()
    }

    /// Deviation of a channel, in its unit, to which the engine and its laws are accurate; smaller effects are none.
    ///
    /// Where it is not 0, the laws are idealisations and something smooth is always left: gains are then measured in units of
    /// the dispersion of what is left.
    fn resolution(&self, _channel: usize) -> f64 {
        0.0
    }

    /// Number of declared parameters: those that no added law owns.
    fn declared(&self) -> usize {
        let added: usize = self.laws().iter().map(|law| law.size(self.library())).sum();
        self.parameters().len() - added
    }

    /// Places of each added law's parameters in a task's vector.
    fn places(&self) -> Vec<Range<usize>> {
        let mut first = self.declared();
        self.laws()
            .iter()
            .map(|law| {
                let place = first..first + law.size(self.library());
                first = place.end;
                place
            })
            .collect()
    }
}
