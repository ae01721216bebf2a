//! Description of an effect, as used by discovery, model files, reports and the documentation.

use augsim_system::{
    Effect, EffectParameter, Join as EffectJoin, Polar, Rival as EffectRival, Start as EffectStart,
};

/// Where an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Location {
    /// Between impacts.
    Flight,
    /// At impacts.
    Impact,
    /// In the measurement, not in the motion.
    Sensor,
    /// Between a pushed object and the surface it lies on.
    Support,
    /// Between a pushed object and the rod.
    Contact,
    /// In the rod and its drive.
    Rod,
}

impl Location {
    /// Name in reports and in `result.json`.
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
    /// Name with the unit as suffix, as in model files.
    pub name: &'static str,
    /// Unit as printed; empty for a dimensionless number.
    pub unit: &'static str,
    /// Lower bound of plausible values.
    pub min: f64,
    /// Upper bound of plausible values.
    pub max: f64,
    /// Typical magnitude; used for scaling and as start value of fits.
    pub typical: f64,
    /// Null value: the effect vanishes where all its amplitude parameters have theirs.
    pub null: f64,
}

/// Data without which an effect cannot be searched for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// No special data.
    Nothing,
    /// A horizontal coordinate.
    Horizontal,
    /// A horizontal coordinate, and the ball's radius if balls spin.
    Slip,
    /// Two horizontal coordinates.
    Lateral,
    /// A recorded spin that is not always zero, and a horizontal coordinate.
    Spin,
    /// A recorded spin, and all three coordinates.
    SpinInSpace,
    /// A recorded start time of each trajectory.
    StartTime,
    /// Recorded `mass_kg` and `radius_m` of every trajectory, with different ratios of area to mass.
    AreaPerMass,
    /// A declared release at rest at `t_s = 0`.
    ReleaseAtRest,
    /// One value per trajectory, which only a model file can declare; discovery does not search for it.
    PerTrajectory,
    /// A rod fast enough that the object slides on ahead of it by more than the noise.
    Coasting,
}

impl Needs {
    /// The required data as a phrase for reports; empty if none.
    pub fn description(self) -> &'static str {
        match self {
            Needs::Nothing => "",
            Needs::Horizontal => "a horizontal coordinate (x_m)",
            Needs::Slip => "a horizontal coordinate, and the radius (radius_m) if balls spin",
            Needs::Lateral => "two horizontal coordinates (x_m, y_m)",
            Needs::Spin => "a recorded spin (spin_rad_s) and a horizontal coordinate",
            Needs::SpinInSpace => "a recorded spin (spin_x_rad_s, …) and all three coordinates",
            Needs::StartTime => "the session time at the start of each trajectory (start_time_s)",
            Needs::AreaPerMass => "radius_m and mass_kg, with different area-to-mass ratios",
            Needs::ReleaseAtRest => "a model that declares a release at rest at t_s = 0",
            Needs::PerTrajectory => "a model file that declares it with per = \"trajectory\"",
            Needs::Coasting => "a rod fast enough that the object slides on ahead of it",
        }
    }
}

/// An alternative explanation that an effect may be confused with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rival {
    /// The effect of this kind.
    Kind(&'static str),
    /// Any effect that acts at this place.
    At(Location),
    /// Any other effect.
    Any,
}

/// The carrier that an effect acts through, such as the drag for a wind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Join {
    /// Kind of the carrier, which has to be in the model.
    pub kind: &'static str,
    /// Start values of the carrier's parameters when both are tried together.
    pub carrier_start: &'static [f64],
    /// Start values of the effect's own parameters then: one fit from each.
    pub effect_starts: &'static [&'static [f64]],
}

/// Start values of the fit of an added effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// The one-step estimate of its score test.
    Estimate,
    /// The one-step estimate, clamped to these bounds (one pair per parameter).
    Within(&'static [[f64; 2]]),
    /// These values.
    At(&'static [f64]),
}

/// Description of an effect. The effect vanishes where every parameter has its null value.
///
/// All properties of a single effect that discovery needs are declared here, next to its formula.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectSpec {
    /// Name in model files, reports and `result.json`.
    pub kind: &'static str,
    /// Where it acts.
    pub location: Location,
    /// Parameters, in the order of its vector of values.
    pub parameters: &'static [ParameterSpec],
    /// Data without which it is not searched for.
    pub needs: Needs,
    /// Other physical causes with the same term, not distinguishable with data of one apparatus.
    pub equivalent_causes: &'static [&'static str],
    /// Kinds that describe the same phenomenon in another form; a model has at most one of them.
    pub excludes: &'static [&'static str],
    /// The formula in one line.
    pub formula: &'static str,
    /// Literature reference.
    pub source: &'static str,
    /// A declared parameter with the same effect: if it is calibrated, the effect is not searched for.
    pub same_as: Option<&'static str>,
    /// The carrier that it acts through; both are also tried together, as neither may improve the fit alone.
    pub joins: Option<Join>,
    /// A simpler kind that it reduces to where some of its parameters have their null value.
    ///
    /// The additional parameters are tested as one further step.
    pub reduces_to: Option<&'static str>,
    /// A kind whose score test stands in for this one's: where that kind is fitted, this one is fitted too.
    ///
    /// For an effect whose own score test, a linearisation at the null values, does not predict its gain.
    pub indicated_by: Option<&'static str>,
    /// Whether it slows down every simulation (no closed form); tested separately from cheap effects.
    pub costly: bool,
    /// Start values of a fit with it.
    pub start: Start,
    /// Values of its first simulation, if it is singular at its null values; empty: the null values.
    pub first_simulated_at: &'static [f64],
    /// Number of leading parameters that are amplitudes; `None`: all of them.
    ///
    /// The others are directions or scales and have no null value of their own.
    pub amplitude_count: Option<usize>,
    /// How its two parameters form an amplitude and a direction, if they do.
    pub polar: Option<Polar>,
    /// Experiments that distinguish it from alternative explanations.
    pub separated_by: &'static [(Rival, &'static str)],
    /// The experiment that confirms it, where there is no alternative explanation.
    pub confirmed_by: Option<&'static str>,
}

impl EffectSpec {
    /// Default values of all fields, for struct update syntax.
    pub const DEFAULT: EffectSpec = EffectSpec {
        kind: "",
        location: Location::Flight,
        parameters: &[],
        needs: Needs::Nothing,
        equivalent_causes: &[],
        excludes: &[],
        formula: "",
        source: "",
        same_as: None,
        joins: None,
        reduces_to: None,
        indicated_by: None,
        costly: false,
        start: Start::Estimate,
        first_simulated_at: &[],
        amplitude_count: None,
        polar: None,
        separated_by: &[],
        confirmed_by: None,
    };
}

impl From<&ParameterSpec> for EffectParameter {
    fn from(p: &ParameterSpec) -> Self {
        let (name, unit) = (p.name.into(), p.unit.into());
        Self { name, unit, min: p.min, max: p.max, typical: p.typical, null: p.null }
    }
}

impl From<&EffectSpec> for Effect {
    fn from(spec: &EffectSpec) -> Self {
        let owned = |list: &[&str]| list.iter().map(|s| s.to_string()).collect();
        let rival = |rival: &Rival| match rival {
            Rival::Kind(kind) => EffectRival::Kind(kind.to_string()),
            Rival::At(location) => EffectRival::At(location.name().into()),
            Rival::Any => EffectRival::Any,
        };
        Self {
            kind: spec.kind.into(),
            location: spec.location.name().into(),
            parameters: spec.parameters.iter().map(EffectParameter::from).collect(),
            formula: spec.formula.into(),
            source: spec.source.into(),
            equivalent_causes: owned(spec.equivalent_causes),
            excludes: owned(spec.excludes),
            joins: spec.joins.map(|join| EffectJoin {
                kind: join.kind.into(),
                carrier_start: join.carrier_start.to_vec(),
                effect_starts: join.effect_starts.iter().map(|values| values.to_vec()).collect(),
            }),
            reduces_to: spec.reduces_to.map(Into::into),
            indicated_by: spec.indicated_by.map(Into::into),
            costly: spec.costly,
            start: match spec.start {
                Start::Estimate => EffectStart::Estimate,
                Start::Within(bounds) => EffectStart::Within(bounds.to_vec()),
                Start::At(values) => EffectStart::At(values.to_vec()),
            },
            first_simulated_at: spec.first_simulated_at.to_vec(),
            amplitude_count: spec.amplitude_count,
            polar: spec.polar,
            separated_by: spec.separated_by.iter().map(|(r, text)| (rival(r), text.to_string())).collect(),
            confirmed_by: spec.confirmed_by.map(Into::into),
            formula_domain: None,
        }
    }
}
