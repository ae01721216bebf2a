//! A user-defined system in Rust, with discovery of its missing effect:
//! `cargo run --release -p augsim-session --example own_system`.
//!
//! A tank drains through an outlet; its cross-section is a measured table. One effect may be missing, seepage
//! through the wall. [`Equations`] implements the dynamics; [`Declaration`] tells discovery how to open the
//! system and how to write the result.

use augsim_data::checks::ExpectedData;
use augsim_data::{Dataset, Trajectory, random_stream};
use augsim_discovery::{Discovery, Options, discover};
use augsim_physics::Scalar;
use augsim_physics::ode::{At, Equations, Ode};
use augsim_system::{
    Addition, Augmentation, Channel, Declaration, Effect, EffectParameter, ErrorFigure, InitialValue,
    Objection, Parameter, Quantity, RoundTripError, Schema, State, System,
};
use rand_distr::{Distribution, Normal};
use std::sync::Arc;

/// Measured cross-sections of the tank at every 0.1 m of height, m².
const SURVEY_M2: [f64; 7] = [0.010, 0.014, 0.021, 0.024, 0.022, 0.017, 0.015];
const GRAVITY_M_S2: f64 = 9.81;
/// True outlet area, m², and seepage coefficient, m²/s.
pub const TRUTH: [f64; 2] = [2.1e-5, 3e-5];
/// Standard deviation of the noise of the level measurement, m.
const SENSOR_M: f64 = 5e-4;

/// Cross-section of the tank at a level, linearly interpolated, m².
fn section<S: Scalar>(level: S) -> S {
    let position = (level.value() / 0.1).clamp(0.0, 5.999);
    let (below, above) = (SURVEY_M2[position as usize], SURVEY_M2[position as usize + 1]);
    (level * 10.0 - position.floor()) * (above - below) + below
}

/// Rate of change of the level, m/s, for an outlet area (m²) and a seepage coefficient (m²/s).
fn rate<S: Scalar>(level: S, outlet: S, seepage: S) -> S {
    // Torricelli's law for the outlet, Darcy's law for the wall, which is wet up to the level. An empty tank
    // stays empty.
    match level.value() > 0.0 {
        true => -(outlet * (level * (2.0 * GRAVITY_M_S2)).sqrt() + seepage * level) / section(level),
        false => S::zero(),
    }
}

/// The tank: its schema, its declared parameter, and the candidate effect.
#[derive(Debug)]
struct Tank(Schema, Vec<Parameter>, Vec<Effect>);

impl Tank {
    fn new() -> Self {
        let schema = Schema {
            system: "tank".into(),
            record: ["draining".into(), "drainings".into()],
            states: vec![State { quantity: Quantity::new("level", "m"), initial: InitialValue::Measured(0) }],
            channels: vec![Channel { column: "level_m".into(), unit: "m".into(), ..Channel::default() }],
            error_figures: vec![ErrorFigure {
                name: "level".into(),
                channels: vec![0],
                unit: ("mm".into(), 1e3),
                is_euclidean: false,
            }],
            ..Schema::default()
        };
        let seepage = EffectParameter {
            name: "k_m2_s".into(),
            unit: "m²/s".into(),
            min: -1e-3,
            max: 1e-3,
            typical: 1e-5,
            null: 0.0,
        };
        let seepage = Effect {
            kind: "seepage".into(),
            location: "outflow".into(),
            parameters: vec![seepage],
            formula: "q = k h".into(),
            source: "Darcy 1856".into(),
            ..Effect::default()
        };
        Tank(schema, vec![Parameter::free("outlet_m2".into(), 1.5e-5, 1e-6, 1e-4)], vec![seepage])
    }
}

impl Equations for Tank {
    fn schema(&self) -> &Schema {
        &self.0
    }

    fn parameters(&self) -> &[Parameter] {
        &self.1
    }

    fn library(&self) -> &[Effect] {
        &self.2
    }

    fn derivative<S: Scalar>(&self, at: &At<'_, S>, rates: &mut [S]) {
        // The effect's parameter follows the declared one; it is at its null value until the effect is added
        // to the model.
        rates[0] = rate(at.states[0], at.parameters[0], at.parameters[1]);
    }

    fn output<S: Scalar>(&self, at: &At<'_, S>, channels: &mut [S]) {
        channels[0] = at.states[0];
    }
}

/// The tank as a declared model for discovery. A system in Rust has no model file, so its text is for display only.
#[derive(Debug)]
struct Declared;

impl Declaration for Declared {
    fn file(&self) -> &str {
        "own_system.rs"
    }

    fn expected(&self) -> ExpectedData {
        ExpectedData::default()
    }

    fn open(&self, has: &dyn Fn(&str) -> bool) -> Result<Arc<dyn System>, Objection> {
        match has("level_m") {
            true => Ok(Arc::new(Ode::new(Tank::new()))),
            false => Err(Objection::new(std::io::Error::other("the recordings have no column level_m"))),
        }
    }

    fn augmented(&self, found: &Augmentation) -> Result<String, RoundTripError> {
        let declared = found.declared.iter().map(|(place, fitted)| format!("parameter {place}: {fitted:?}"));
        let additions = found.additions.iter().map(|addition| match addition {
            Addition::Term(law, fitted) => format!("{law:?}: {fitted:?}"),
            Addition::Scatter(per, sd) => format!("scatter per {per:?}: {sd}"),
        });
        Ok(declared.chain(additions).collect::<Vec<_>>().join("\n"))
    }
}

/// Simulates measured levels of twelve drainings, once a second for a minute, with small Euler steps.
fn measured() -> Result<Dataset, Box<dyn std::error::Error>> {
    const STEPS_PER_S: usize = 1000;
    let noise = Normal::new(0.0, SENSOR_M)?;
    let draining = |number: u64| {
        let mut random = random_stream(1, "drainings", number);
        let mut level = 0.15 + 0.035 * number as f64;
        let mut levels = Vec::new();
        for _ in 0..60 {
            levels.push(level + noise.sample(&mut random));
            for _ in 0..STEPS_PER_S {
                level += rate(level, TRUTH[0], TRUTH[1]) / STEPS_PER_S as f64;
            }
        }
        Trajectory::new(format!("{number}"), (0..60).map(f64::from).collect(), vec![levels])
    };
    Ok(Dataset::from_names(&["level_m"], (0..12).map(draining).collect::<Result<_, _>>()?)?)
}

/// Runs the discovery of the effect that the tank's model lacks.
pub fn found() -> Result<Discovery, Box<dyn std::error::Error>> {
    Ok(discover(&Declared, &measured()?, &Options::default(), &mut |_| {})?)
}

/// Prints the discovered parameters beside their true values.
#[expect(clippy::print_stdout, reason = "an example prints its result")]
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let found = found()?;
    println!("{}", found.sentence);
    println!("outlet_m2 = {:?} (truth {})", found.parameters["outlet_m2"], TRUTH[0]);
    for effect in &found.effects {
        println!("{}: {:?} (truth {})", effect.kind, effect.parameters, TRUTH[1]);
    }
    Ok(())
}
