//! Systems by their state equations: [`Equations`] in Rust, and [`Ode`], which makes a [`System`] of them.
//!
//! Rates are integrated by the Runge-Kutta pair of Tsitouras of order 5(4) with adaptive steps and dense output. Events are
//! located, carry their derivatives, and may reset the states or bring the system to rest.
//!
//! ```
//! use augsim_physics::Scalar;
//! use augsim_physics::ode::{At, Equations, Ode};
//! use augsim_system::{
//!     Channel, ErrorFigure, InitialValue, Offsets, Parameter, Quantity, Record, Schema, Seed, Simulate, Simulated, State,
//!     Task,
//! };
//!
//! /// A pendulum of one metre with viscous friction.
//! #[derive(Debug)]
//! struct Pendulum(Schema, Vec<Parameter>);
//!
//! impl Equations for Pendulum {
//!     fn schema(&self) -> &Schema {
//!         &self.0
//!     }
//!     fn parameters(&self) -> &[Parameter] {
//!         &self.1
//!     }
//!     fn derivative<S: Scalar>(&self, at: &At<'_, S>, rates: &mut [S]) {
//!         let (angle, speed, friction) = (at.states[0], at.states[1], at.parameters[0]);
//!         rates[0] = speed;
//!         rates[1] = -angle.sin() * 9.81 - friction * speed;
//!     }
//!     fn output<S: Scalar>(&self, at: &At<'_, S>, channels: &mut [S]) {
//!         channels[0] = at.states[0];
//!     }
//! }
//!
//! let state = |name, unit, initial| State { quantity: Quantity::new(name, unit), initial };
//! let schema = Schema {
//!     system: "pendulum".into(),
//!     record: ["swing".into(), "swings".into()],
//!     states: vec![state("angle", "rad", InitialValue::Measured(0)), state("speed", "rad/s", InitialValue::Fixed(0.0))],
//!     channels: vec![Channel { column: "theta_rad".into(), unit: "rad".into(), ..Channel::default() }],
//!     error_figures: vec![ErrorFigure { name: "angle".into(), channels: vec![0], unit: ("rad".into(), 1.0), is_euclidean: false }],
//!     ..Schema::default()
//! };
//! let pendulum = Ode::new(Pendulum(schema, vec![Parameter::free("b_per_s".into(), 0.1, 0.0, 5.0)]));
//! let record = Record { times: vec![0.0, 0.5, 1.0], ..Record::default() };
//! let task = Task {
//!     parameters: &[0.1],
//!     record: &record,
//!     window: 0..3,
//!     start: &[0.02, 0.0],
//!     offsets: Offsets::None,
//!     seeds: &[Seed::Parameter(0), Seed::Start(0)],
//! };
//! let mut out = Simulated::default();
//! pendulum.simulate(&task, &mut out).expect("it swings");
//! let small = 0.02 * (-0.05f64).exp() * 9.81f64.sqrt().cos();
//! assert!((out.value(2, 0) - small).abs() < 1e-3 && out.slopes(2, 0)[1].abs() <= 1.0);
//! ```

mod crossing;
mod equations;
mod inputs;
mod integrate;
mod limits;
mod step;
mod tableau;

use crate::Scalar;
use crate::lanes::with_lanes;
use augsim_system::{
    Augment, Describe, Effect, ModelTerm, Parameter, Prepare, Schema, Simulate, Simulated, SimulationError,
    System, SystemError, Task, in_blocks,
};
use integrate::Integration;
use std::sync::Arc;

pub use equations::{At, Equations};
pub use limits::Tolerance;

/// Maximum number of derivatives in one simulation; more are computed in blocks.
const WIDEST: usize = 24;
/// State equations as a [`System`], with the effects that were added to them.
#[derive(Debug)]
pub struct Ode<E> {
    equations: Arc<E>,
    tolerance: Tolerance,
    parameters: Vec<Parameter>,
    laws: Vec<ModelTerm>,
    /// Values of the declared parameters (nominal) and of the parameters of all library effects (null).
    values: Vec<f64>,
    /// Index in `values` of each parameter of a task.
    places: Vec<usize>,
}

impl<E: Equations> Ode<E> {
    /// The system of these equations without added effects.
    pub fn new(equations: E) -> Self {
        let parameters = equations.parameters().to_vec();
        let nulls = equations.library().iter().flat_map(|e| &e.parameters).map(|p| p.null);
        let values = parameters.iter().map(|p| p.nominal).chain(nulls).collect();
        let places = (0..parameters.len()).collect();
        let (equations, tolerance) = (Arc::new(equations), Tolerance::default());
        Self { equations, tolerance, parameters, laws: Vec::new(), values, places }
    }

    /// Sets the error tolerance of the integration.
    pub fn with_tolerance(mut self, tolerance: Tolerance) -> Self {
        self.tolerance = tolerance;
        self
    }

    fn run<S: Scalar>(&self, task: &Task<'_>, out: &mut Simulated) -> Result<(), SimulationError> {
        let mut values = self.values.clone();
        self.places.iter().zip(task.parameters).for_each(|(&place, &v)| values[place] = v);
        let place = |i: usize| self.places[i];
        Integration::<E, S>::new(&self.equations, task, self.tolerance, values, place).run(out)
    }
}

impl<E: Equations> Simulate for Ode<E> {
    fn schema(&self) -> &Schema {
        self.equations.schema()
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn simulate(&self, task: &Task<'_>, out: &mut Simulated) -> Result<(), SimulationError> {
        task.check(self.schema(), self.parameters.len())?;
        in_blocks(
            task,
            WIDEST,
            out,
            |task, out| with_lanes!(task.seeds.len(), [4, 8, 16; 24], S => self.run::<S>(task, out)),
        )
    }
}

impl<E: Equations> Augment for Ode<E> {
    fn library(&self) -> &[Effect] {
        self.equations.library()
    }

    fn terms(&self) -> &[ModelTerm] {
        &self.laws
    }

    fn augmented(&self, laws: &[ModelTerm]) -> Result<Arc<dyn System>, SystemError> {
        let library = self.equations.library();
        let (mut parameters, mut places, mut all) =
            (self.parameters.clone(), self.places.clone(), self.laws.clone());
        for law in laws {
            let index = match law {
                ModelTerm::Effect(index) => *index,
                ModelTerm::Table(t) => {
                    return Err(SystemError::Table { target: t.target, against: t.feature });
                }
            };
            let effect = library.get(index).ok_or(SystemError::Effect { index, count: library.len() })?;
            let before: usize = library[..index].iter().map(|e| e.parameters.len()).sum();
            let first = self.equations.parameters().len() + before;
            places.extend(first..first + effect.parameters.len());
            parameters.extend(effect.parameters.iter().map(Parameter::added));
            all.push(law.clone());
        }
        let (equations, values) = (self.equations.clone(), self.values.clone());
        Ok(Arc::new(Self { equations, tolerance: self.tolerance, parameters, laws: all, values, places }))
    }
}

impl<E: Equations> Prepare for Ode<E> {}

impl<E: Equations> Describe for Ode<E> {}
