//! A system of one's own in Rust, calibrated and asked what it lacks: `cargo run --release -p augsim-session --example own_system`.
//!
//! A tank of surveyed shape drains through an outlet: its cross-section is a table, which no formula says. One effect may be
//! missing, seepage through the wall. Equations say how it moves, a declaration says how the loop opens it and writes it down.

use augsim_data::checks::Expected;
use augsim_data::{Dataset, Trajectory, random_stream};
use augsim_discovery::{Discovery, Options, discover};
use augsim_physics::Scalar;
use augsim_physics::model::Parameter;
use augsim_physics::ode::{At, Equations, Ode};
use augsim_physics::system::{
    Addition, Augmentation, Begin, Channel, Declaration, Effect, EffectParameter, Measure, NotReadable,
    Objection, Quantity, Schema, State, System,
};
use rand_distr::{Distribution, Normal};
use std::sync::Arc;

/// Cross-sections at every 0.1 m of height, m².
const SURVEY_M2: [f64; 7] = [0.010, 0.014, 0.021, 0.024, 0.022, 0.017, 0.015];
const GRAVITY_M_S2: f64 = 9.81;
/// The outlet and the seepage of the tank that is measured here.
pub const TRUTH: [f64; 2] = [2.1e-5, 3e-5];
/// Standard deviation of the level's sensor, m.
const SENSOR_M: f64 = 5e-4;

/// Cross-section at a level, in straight lines between the surveyed ones, m².
fn section<S: Scalar>(level: S) -> S {
    let place = (level.value() / 0.1).clamp(0.0, 5.999);
    let (below, above) = (SURVEY_M2[place as usize], SURVEY_M2[place as usize + 1]);
    (level * 10.0 - place.floor()) * (above - below) + below
}

/// Rate of the level, m/s, under an outlet (m²) and a seepage (m²/s).
fn rate<S: Scalar>(level: S, outlet: S, seepage: S) -> S {
    // Torricelli; Darcy for the wall, whose wet height is the level. An empty tank stays empty.
    match level.value() > 0.0 {
        true => -(outlet * (level * (2.0 * GRAVITY_M_S2)).sqrt() + seepage * level) / section(level),
        false => S::zero(),
    }
}

/// The tank: what it is, its declared parameter, and the effect that it may lack.
#[derive(Debug)]
struct Tank(Schema, Vec<Parameter>, Vec<Effect>);

impl Tank {
    fn new() -> Self {
        let schema = Schema {
            system: "tank".into(),
            record: ["draining".into(), "drainings".into()],
            states: vec![State { quantity: Quantity::new("level", "m"), begin: Begin::Measured(0) }],
            channels: vec![Channel { column: "level_m".into(), unit: "m".into(), ..Channel::default() }],
            measures: vec![Measure {
                name: "level".into(),
                channels: vec![0],
                unit: ("mm".into(), 1e3),
                length: false,
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
            place: "outflow".into(),
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
        // Behind the declared parameter stands that of the effect, at its null until it is in the model.
        rates[0] = rate(at.states[0], at.parameters[0], at.parameters[1]);
    }

    fn output<S: Scalar>(&self, at: &At<'_, S>, channels: &mut [S]) {
        channels[0] = at.states[0];
    }
}

/// The tank as the loop sees it; a system in Rust has no model file, so its text is for readers only.
#[derive(Debug)]
struct Declared;

impl Declaration for Declared {
    fn file(&self) -> &str {
        "own_system.rs"
    }

    fn expected(&self) -> Expected {
        Expected::default()
    }

    fn open(&self, has: &dyn Fn(&str) -> bool) -> Result<Arc<dyn System>, Objection> {
        match has("level_m") {
            true => Ok(Arc::new(Ode::new(Tank::new()))),
            false => Err(Objection::new(std::io::Error::other("the recordings have no column level_m"))),
        }
    }

    fn augmented(&self, found: &Augmentation) -> Result<String, NotReadable> {
        let declared = found.declared.iter().map(|(place, fitted)| format!("parameter {place}: {fitted:?}"));
        let additions = found.additions.iter().map(|addition| match addition {
            Addition::Law(law, fitted) => format!("{law:?}: {fitted:?}"),
            Addition::Scatter(per, sd) => format!("scatter per {per:?}: {sd}"),
        });
        Ok(declared.chain(additions).collect::<Vec<_>>().join("\n"))
    }
}

/// Levels of twelve drainings, once a second for a minute, by small steps of Euler.
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

/// Discovery of the law that the tank's model lacks to explain its drainings.
pub fn found() -> Result<Discovery, Box<dyn std::error::Error>> {
    Ok(discover(&Declared, &measured()?, &Options::default(), &mut |_| {})?)
}

/// Prints it.
#[expect(clippy::print_stdout, reason = "an example talks to who runs it")]
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let found = found()?;
    println!("{}", found.sentence);
    println!("outlet_m2 = {:?} (truth {})", found.parameters["outlet_m2"], TRUTH[0]);
    for effect in &found.effects {
        println!("{}: {:?} (truth {})", effect.kind, effect.parameters, TRUTH[1]);
    }
    Ok(())
}
