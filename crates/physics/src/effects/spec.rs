//! The description of an effect: everything that the loop, a reader, a model file and a report read of it.

use std::f64::consts::PI;

/// Where an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Location {
    /// The effect acts between impacts.
    Flight,
    /// The effect acts at impacts.
    Impact,
    /// The effect is in what is measured, not in the motion.
    Sensor,
    /// The effect acts between a pushed object and what it lies on.
    Support,
    /// The effect acts between a pushed object and the rod.
    Contact,
    /// The effect is in the rod and what moves it.
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

/// Data that an effect needs before it can be looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// Nothing special.
    Nothing,
    /// A horizontal coordinate.
    Horizontal,
    /// A horizontal coordinate, and the ball's radius where balls spin.
    Slip,
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
    /// Values of each trajectory: a model file declares them, and no search over what all share does.
    OfEach,
    /// A rod so fast that the object coasts from it by more than the noise.
    Coasting,
}

impl Needs {
    /// Quantities that have to be in the data, in words; empty where nothing special is needed.
    pub fn words(self) -> &'static str {
        match self {
            Needs::Nothing => "",
            Needs::Horizontal => "a horizontal coordinate (x_m)",
            Needs::Slip => "a horizontal coordinate, and the radius where balls spin",
            Needs::Lateral => "two horizontal coordinates (x_m, y_m)",
            Needs::Spin => "a recorded spin (spin_rad_s) and a horizontal coordinate",
            Needs::SpinInSpace => "a recorded spin (spin_x_rad_s, …) and all three coordinates",
            Needs::StartTime => "the start of each trajectory on the session's clock (start_time_s)",
            Needs::AreaPerMass => "radius_m and mass_kg of balls that differ in them",
            Needs::ReleaseAtRest => "a release at rest at t_s = 0, which the model declares",
            Needs::OfEach => "a model file that declares it with per = \"trajectory\"",
            Needs::Coasting => "a rod so fast that the object coasts from it",
        }
    }
}

/// Another explanation, seen from an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rival {
    /// An effect of this kind.
    Kind(&'static str),
    /// Any kind that acts at this place.
    At(Location),
    /// Any other kind.
    Any,
}

/// An effect that acts through another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Join {
    /// The kind that has to be in the model.
    pub kind: &'static str,
    /// Where its parameters begin when both are tried together.
    pub start: &'static [f64],
    /// Where the parameters of the effect itself begin then: one attempt each.
    pub own: &'static [&'static [f64]],
}

/// Where a fit of an added effect begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// At the one-step estimate of its test.
    Estimate,
    /// At the one-step estimate, brought into these bounds (one pair for each parameter).
    Within(&'static [[f64; 2]]),
    /// At these values.
    At(&'static [f64]),
}

/// Parameters of an amount and a direction, which has no meaning where the amount vanishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Polar {
    /// A ratio of two axes, 1 for none: the axis repeats after half a turn, and its inverse is a quarter turn.
    Axis,
    /// A size, 0 for none: the direction repeats after a turn.
    Direction,
}

impl Polar {
    /// Brings an amount and its direction, rad, to the values that say the same: a ratio of 1 or more, an angle within half a
    /// period of 0.
    ///
    /// ```
    /// use augsim_physics::effects::Polar;
    /// let (mut ratio, mut angle) = (0.5, 0.0); // an axis half as long is the other axis twice as long
    /// Polar::Axis.bring_round(&mut ratio, &mut angle);
    /// assert_eq!((ratio, angle.abs()), (2.0, std::f64::consts::FRAC_PI_2));
    /// ```
    pub fn bring_round(self, amount: &mut f64, angle: &mut f64) {
        match self {
            Polar::Axis => {
                if *amount > 0.0 && *amount < 1.0 {
                    *amount = 1.0 / *amount;
                    *angle += 0.5 * PI;
                }
                *angle -= (*angle / PI).round() * PI;
            }
            Polar::Direction => {
                if *amount < 0.0 {
                    *amount = -*amount;
                    *angle += PI;
                }
                *angle -= (*angle / (2.0 * PI)).round() * 2.0 * PI;
            }
        }
    }

    /// The values a linear `step` away from `at`, taken along the plane of amount and direction.
    pub fn step(self, at: [f64; 2], step: [f64; 2]) -> [f64; 2] {
        let (turns, zero) = match self {
            Polar::Axis => (2.0, 1.0),
            Polar::Direction => (1.0, 0.0),
        };
        let amount = at[0] - zero;
        let (along, across) = (amount + step[0], amount * turns * step[1]);
        [zero + along.hypot(across), at[1] + across.atan2(along) / turns]
    }
}

/// The description of an effect. Where every parameter has its null value, the effect vanishes.
///
/// Everything that the loop has to know of one effect and not of others stands here, beside its law: what it joins, contains
/// and starts from, and what it is confused with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectSpec {
    /// Name in model files, reports and `result.json`.
    pub kind: &'static str,
    /// Where it acts.
    pub location: Location,
    /// Parameters of the effect, in the order of its vector of values.
    pub parameters: &'static [ParameterSpec],
    /// Data without which it is not looked for.
    pub needs: Needs,
    /// Other causes with the same mathematical term, which data of one apparatus cannot tell apart (alias class).
    pub stands_for: &'static [&'static str],
    /// Kinds that describe the same thing in another form; at most one of them in a model.
    pub excludes: &'static [&'static str],
    /// The law in one line.
    pub formula: &'static str,
    /// Where it is from.
    pub source: &'static str,
    /// A declared parameter that is the same term: where it is free, the effect is not looked for.
    pub same_as: Option<&'static str>,
    /// The effect that it acts through, if it does: the two are also tried together, because neither shows without the other.
    pub joins: Option<Join>,
    /// A simpler kind that it turns into where some of its parameters have their null: what it has beyond that is a further
    /// step, tested once.
    pub contains: Option<&'static str>,
    /// A kind whose test promises what this one would bring, for a law that no test forecasts from afar: where that kind is
    /// fitted, this one is fitted too.
    pub foretold_by: Option<&'static str>,
    /// Whether it makes every simulation dearer (flight without a closed form): such effects are tested apart from cheap ones.
    pub costly: bool,
    /// Where a fit with it begins.
    pub start: Start,
    /// Values at which it is first simulated, for a law that is singular at its null; empty: there.
    pub probe: &'static [f64],
    /// How many of its parameters, from the first, say how much of it there is; the others are its direction or its scale and
    /// have no null of their own. Absent: all of them.
    pub amounts: Option<usize>,
    /// Whether its two parameters are an amount and a direction.
    pub polar: Option<Polar>,
    /// The experiment that tells it from another explanation.
    pub separated_by: &'static [(Rival, &'static str)],
    /// The experiment that confirms it, where there is no other explanation.
    pub confirmed_by: Option<&'static str>,
}

impl EffectSpec {
    /// A description of nothing, for the fields that an effect leaves as they usually are.
    pub const PLAIN: EffectSpec = EffectSpec {
        kind: "",
        location: Location::Flight,
        parameters: &[],
        needs: Needs::Nothing,
        stands_for: &[],
        excludes: &[],
        formula: "",
        source: "",
        same_as: None,
        joins: None,
        contains: None,
        foretold_by: None,
        costly: false,
        start: Start::Estimate,
        probe: &[],
        amounts: None,
        polar: None,
        separated_by: &[],
        confirmed_by: None,
    };
}
