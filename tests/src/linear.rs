//! A test system that is linear in its parameters, so that every statistic of the discovery has a closed form.
//!
//! ```text
//! y(t) = θ0 t + θ1 x sin 3t + Σ κi (1 + x/2) sin (4+i)t + s + Σ ξm max(t - τm, 0)
//! ```
//!
//! θ0 and θ1 are declared parameters, `x` is a covariate of the record, κ are any number of effects, `s` is
//! the initial level of each record, and ξ are changes of slope at fixed times τ. The derivatives of y form
//! the design matrix.

use augsim_system::{
    Augment, Channel, Describe, Effect, EffectParameter, ErrorFigure, EventSchema, InitialValue, ModelTerm,
    Offsets, Parameter, Prepare, Quantity, Schema, Seed, Simulate, Simulated, SimulationError, State, System,
    SystemError, Task,
};
use std::sync::Arc;

/// Times τ at which the slope changes, s.
pub const EVENTS_S: [f64; 3] = [0.5, 1.0, 1.5];

/// The linear test system, with its schema and its effects.
#[derive(Clone, Debug)]
pub struct Linear {
    schema: Schema,
    parameters: Vec<Parameter>,
    library: Vec<Effect>,
    laws: Vec<ModelTerm>,
}

impl Linear {
    /// Makes the system with `effects` effects in its library.
    pub fn new(effects: usize) -> Self {
        let bounds = |name: &str| Parameter::free(name.into(), 0.0, -1e3, 1e3);
        let schema = Schema {
            system: "linear".into(),
            record: ["record".into(), "records".into()],
            states: vec![State { quantity: Quantity::new("level", "m"), initial: InitialValue::Free }],
            channels: vec![Channel { column: "y_m".into(), unit: "m".into(), ..Channel::default() }],
            covariates: vec![Quantity::new("x", "")],
            features: vec![Quantity::new("time", "s")],
            error_figures: vec![ErrorFigure {
                name: "y".into(),
                channels: vec![0],
                unit: ("mm".into(), 1e3),
                is_euclidean: false,
            }],
            event: Some(EventSchema {
                nouns: ["step".into(), "steps".into()],
                parameter: 0,
                scatter: scatter(),
                declared: None,
                periodic_scale_feature: None,
            }),
            ..Schema::default()
        };
        let parameters = vec![bounds("slope_m_s"), bounds("sway_m")];
        Self { schema, parameters, library: (0..effects).map(effect).collect(), laws: vec![] }
    }

    /// Entry of the design matrix for parameter number `parameter`, at time `t` (s), for covariate `x`.
    pub fn column(&self, parameter: usize, t: f64, x: f64) -> f64 {
        match parameter {
            0 => t,
            1 => x * (3.0 * t).sin(),
            _ => match self.laws.get(parameter - 2) {
                Some(ModelTerm::Effect(i)) => (1.0 + 0.5 * x) * ((4.0 + *i as f64) * t).sin(),
                _ => 0.0,
            },
        }
    }

    /// Change of y at time `t` (s) per unit change ξ of the slope at event number `event`.
    fn offset(event: usize, t: f64) -> f64 {
        EVENTS_S.get(event).map_or(0.0, |tau| (t - tau).max(0.0))
    }
}

/// Makes effect number `i` of the library, with coefficient κi.
fn effect(i: usize) -> Effect {
    let amount = EffectParameter {
        name: "k_m".into(),
        unit: "m".into(),
        min: -1e3,
        max: 1e3,
        typical: 0.1,
        null: 0.0,
    };
    Effect {
        kind: format!("tone-{i}"),
        location: "motion".into(),
        parameters: vec![amount],
        formula: format!("y += k (1 + x/2) sin({} t)", 4 + i),
        source: "made for tests".into(),
        ..Effect::default()
    }
}

/// Makes the random effect: the change ξ of the slope at each event.
fn scatter() -> Effect {
    let (name, unit) = ("sd".into(), "m/s".into());
    let sd = EffectParameter { name, unit, min: 0.0, max: 10.0, typical: 0.1, null: 0.0 };
    Effect {
        kind: "slope-scatter".into(),
        location: "motion".into(),
        parameters: vec![sd],
        ..Effect::default()
    }
}

impl Simulate for Linear {
    fn schema(&self) -> &Schema {
        &self.schema
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn simulate(&self, task: &Task<'_>, out: &mut Simulated) -> Result<(), SimulationError> {
        task.check(&self.schema, self.parameters.len())?;
        let times = task.times();
        let x = task.record.covariate(0).unwrap_or(0.0);
        out.reset(times.len(), 1, task.seeds.len(), self.schema.features.len());
        for (k, &t) in times.iter().enumerate() {
            let mut y = task.start[0];
            y += task.parameters.iter().enumerate().map(|(i, p)| p * self.column(i, t, x)).sum::<f64>();
            y += match task.offsets {
                Offsets::None => 0.0,
                Offsets::Shared(xi) => xi * (0..EVENTS_S.len()).map(|m| Self::offset(m, t)).sum::<f64>(),
                Offsets::PerEvent(list) => {
                    list.iter().enumerate().map(|(m, xi)| xi * Self::offset(m, t)).sum::<f64>()
                }
            };
            let derivative = |seed: &Seed| match (*seed, task.offsets) {
                (Seed::Parameter(i), _) => self.column(i, t, x),
                (Seed::Start(_), _) => 1.0,
                (Seed::Offset(_), Offsets::Shared(_)) => {
                    (0..EVENTS_S.len()).map(|m| Self::offset(m, t)).sum()
                }
                (Seed::Offset(m), _) => Self::offset(m, t),
            };
            out.set_row(k, 0, y, task.seeds.iter().map(derivative));
        }
        let first = times.first().copied().unwrap_or(f64::INFINITY);
        let last = times.last().copied().unwrap_or(f64::NEG_INFINITY);
        for tau in EVENTS_S.into_iter().filter(|tau| first <= *tau && *tau <= last) {
            out.push_event(tau, [tau]);
        }
        Ok(())
    }
}

impl Augment for Linear {
    fn library(&self) -> &[Effect] {
        &self.library
    }

    fn terms(&self) -> &[ModelTerm] {
        &self.laws
    }

    fn augmented(&self, laws: &[ModelTerm]) -> Result<Arc<dyn System>, SystemError> {
        let mut system = self.clone();
        for law in laws {
            let index = match law {
                ModelTerm::Effect(index) => *index,
                ModelTerm::Table(t) => {
                    return Err(SystemError::Table { target: t.target, against: t.feature });
                }
            };
            let count = self.library.len();
            let effect = self.library.get(index).ok_or(SystemError::Effect { index, count })?;
            system.parameters.extend(effect.parameters.iter().map(Parameter::added));
            system.laws.push(law.clone());
        }
        Ok(Arc::new(system))
    }
}

impl Prepare for Linear {}

impl Describe for Linear {}
