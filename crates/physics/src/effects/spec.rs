//! What a reader, a model file and a report need to know of an effect.

/// Where an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Location {
    /// Between impacts.
    Flight,
    /// At impacts.
    Impact,
    /// In what is measured, not in the motion.
    Sensor,
    /// Between a pushed object and what it lies on.
    Support,
    /// Between a pushed object and the rod.
    Contact,
    /// In the rod and what moves it.
    Rod,
}

impl Location {
    /// The word that reports and `result.json` use.
    pub fn name(self) -> &'static str {
        match self {
            Location::Flight => "flight",
            Location::Impact => "impact",
            Location::Sensor => "sensor",
            Location::Support => "support",
            Location::Contact => "contact",
            Location::Rod => "rod",
        }
    }
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterSpec {
    /// Name with the unit in it, as in model files.
    pub name: &'static str,
    /// Unit in print; empty for a pure number.
    pub unit: &'static str,
    /// Smallest value that makes sense.
    pub min: f64,
    /// Largest value that makes sense.
    pub max: f64,
    /// A size at which the effect is usually seen: the scale of numbers and starts of fits.
    pub typical: f64,
    /// The value at which the effect vanishes, when all parameters that scale it have theirs.
    pub null: f64,
}

/// What data an effect needs before it can be looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// Nothing special.
    Nothing,
    /// A horizontal coordinate.
    Horizontal,
    /// Two horizontal coordinates.
    Lateral,
    /// A recorded spin that is not zero everywhere, and a horizontal coordinate.
    Spin,
    /// A recorded spin, and all three coordinates.
    SpinInSpace,
    /// A recorded start time of each trajectory.
    StartTime,
    /// Recorded `mass_kg` and `radius_m` of every trajectory whose ratio of area to mass is not the same in all.
    AreaPerMass,
    /// A declared release at rest at `t_s = 0`.
    ReleaseAtRest,
    /// Another effect in the model, by kind.
    Effect(&'static str),
}

/// The description of an effect. Where every parameter has its null value, the effect vanishes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectSpec {
    /// Name in model files, reports and `result.json`.
    pub kind: &'static str,
    /// Where it acts.
    pub location: Location,
    /// Its parameters, in order.
    pub parameters: &'static [ParameterSpec],
    /// What it needs in the data.
    pub needs: Needs,
    /// What the same mathematical term may stand for, when data of one apparatus cannot tell (alias class).
    pub stands_for: &'static [&'static str],
    /// Kinds that describe the same thing in another form; at most one of them in a model.
    pub excludes: &'static [&'static str],
    /// The law in one line.
    pub formula: &'static str,
    /// Where it is from.
    pub source: &'static str,
}
