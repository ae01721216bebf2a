//! Description of an effect, as used by discovery, model files, reports and the documentation.

use augsim_system::{
    Effect, EffectParameter, Join as EffectJoin, Polar, Rival as EffectRival, Start as EffectStart,
};

/// Part of the simulation in which an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Location {
    /// The effect acts in flight, between impacts.
    Flight,
    /// The effect acts at impacts.
    Impact,
    /// The effect acts in the measurement, not in the motion.
    Sensor,
    /// The effect acts between a pushed object and the surface it lies on.
    Support,
    /// The effect acts between a pushed object and the rod.
    Contact,
    /// The effect acts in the rod and its drive.
    Rod,
}

impl Location {
    /// Name of the location in reports and in `result.json`.
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

/// Description of one parameter of an effect: name, unit, bounds, typical and null value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterSpec {
    /// Name of the parameter with the unit as suffix, as in model files.
    pub name: &'static str,
    /// Unit of the parameter in reports; empty for a dimensionless number.
    pub unit: &'static str,
    /// Lower bound of plausible parameter values.
    pub min: f64,
    /// Upper bound of plausible parameter values.
    pub max: f64,
    /// Typical magnitude of the parameter, for scaling and as start value of fits.
    pub typical: f64,
    /// Null value of the parameter: the effect vanishes where all its amplitudes have their null values.
    pub null: f64,
}

/// Data without which discovery cannot search for an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// The effect needs no special data.
    Nothing,
    /// The effect needs a horizontal coordinate.
    Horizontal,
    /// The effect needs a horizontal coordinate, and the ball's radius if balls spin.
    Slip,
    /// The effect needs two horizontal coordinates.
    Lateral,
    /// The effect needs a recorded spin that is not always zero, and a horizontal coordinate.
    Spin,
    /// The effect needs a recorded spin and all three coordinates.
    SpinInSpace,
    /// The effect needs a recorded start time of each trajectory.
    StartTime,
    /// The effect needs `mass_kg` and `radius_m` of every trajectory, with different ratios of area to mass.
    AreaPerMass,
    /// The effect needs a declared release at rest at `t_s = 0`.
    ReleaseAtRest,
    /// The effect has one value per trajectory. Only a model file can declare it; discovery does not.
    PerTrajectory,
    /// The effect needs a rod so fast that the object slides on ahead of it by more than the noise.
    Coasting,
}

impl Needs {
    /// The data that an effect needs, as a phrase for reports; empty if none.
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

/// Alternative explanation that an effect may be confused with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rival {
    /// The effect of this kind is the alternative.
    Kind(&'static str),
    /// Any effect that acts at this location is an alternative.
    At(Location),
    /// Any other effect is an alternative.
    Any,
}

/// Another effect (carrier) through which an effect acts, such as the drag for a wind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Join {
    /// Kind of the carrier effect, which has to be in the model.
    pub kind: &'static str,
    /// Start values of the carrier's parameters when effect and carrier are tried together.
    pub carrier_start: &'static [f64],
    /// Start values of the effect's own parameters when tried with the carrier; one fit per list.
    pub effect_starts: &'static [&'static [f64]],
}

/// Where the fit of a model with an added effect starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// Fits start from the one-step estimate of the effect's score test.
    Estimate,
    /// Fits start from the one-step estimate, clamped to these bounds (one pair per parameter).
    Within(&'static [[f64; 2]]),
    /// Fits start from these parameter values.
    At(&'static [f64]),
}

/// Description of an effect. The effect vanishes where every parameter has its null value.
///
/// All properties of a single effect that discovery needs are declared here, next to its formula.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectSpec {
    /// Name of the effect in model files, reports and `result.json`.
    pub kind: &'static str,
    /// Part of the simulation in which the effect acts.
    pub location: Location,
    /// Parameters of the effect, in the order of its vector of values.
    pub parameters: &'static [ParameterSpec],
    /// Data without which discovery does not search for the effect.
    pub needs: Needs,
    /// Other physical causes with the same formula, not distinguishable with data of one apparatus.
    pub equivalent_causes: &'static [&'static str],
    /// Kinds of effects that describe the same phenomenon otherwise; a model has at most one of them.
    pub excludes: &'static [&'static str],
    /// Formula of the effect in one line.
    pub formula: &'static str,
    /// Literature reference of the formula.
    pub source: &'static str,
    /// Base parameter with the same effect. If it is calibrated, discovery does not search for the effect.
    pub same_as: Option<&'static str>,
    /// Effect (carrier) that this effect acts through; `None` if it acts alone.
    ///
    /// Both are also tried together, as neither may improve the fit alone.
    pub joins: Option<Join>,
    /// Simpler kind of effect to which this one reduces where some of its parameters have their null value.
    ///
    /// The additional parameters are tested as one further step.
    pub reduces_to: Option<&'static str>,
    /// Kind whose score test replaces that of this effect: where that kind is fitted, this one is too.
    ///
    /// For an effect whose own score test, a linearisation at the null values, does not predict its gain.
    pub indicated_by: Option<&'static str>,
    /// Whether the effect slows down every simulation (no closed form); tested apart from cheap effects.
    pub costly: bool,
    /// Start values of a fit with this effect.
    pub start: Start,
    /// Parameter values of the first simulation, if the effect is singular at its null values; else empty.
    pub first_simulated_at: &'static [f64],
    /// Number of leading parameters that are amplitudes of the effect; `None` if all of them are.
    ///
    /// The others are directions or scales and have no null value of their own.
    pub amplitude_count: Option<usize>,
    /// How the effect's two parameters form an amplitude and a direction; `None` if they do not.
    pub polar: Option<Polar>,
    /// Experiments that distinguish the effect from alternative explanations.
    pub separated_by: &'static [(Rival, &'static str)],
    /// Experiment that confirms the effect, where there is no alternative explanation.
    pub confirmed_by: Option<&'static str>,
}

impl EffectSpec {
    /// Description with default values, to write other descriptions by struct update syntax.
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
            has_states: false,
            depends_on_past: false,
            added_to_reading: None,
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
            is_offered: false,
            formula_domain: None,
        }
    }
}
