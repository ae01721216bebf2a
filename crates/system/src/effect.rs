//! An effect of a system's library, with all properties that calibration and discovery use.

use crate::quantity::Quantity;
use std::f64::consts::PI;

/// A parameter of an effect, with its bounds and its null value.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectParameter {
    /// Name of the parameter with the unit as suffix, as in model files.
    pub name: String,
    /// Unit of the parameter as printed; empty for a dimensionless number.
    pub unit: String,
    /// Lower bound of plausible values of the parameter.
    pub min: f64,
    /// Upper bound of plausible values of the parameter.
    pub max: f64,
    /// Typical magnitude of the parameter, used for scaling.
    pub typical: f64,
    /// Null value of the parameter, at which the effect vanishes.
    pub null: f64,
}

/// The other effect (carrier) that an effect acts through, such as the drag for a wind.
#[derive(Clone, Debug, PartialEq)]
pub struct Join {
    /// Kind of the carrier effect, which has to be in the model.
    pub kind: String,
    /// Start values of the carrier's parameters when carrier and effect are tried together.
    pub carrier_start: Vec<f64>,
    /// Start values of the effect's own parameters when both are tried together: one fit from each.
    pub effect_starts: Vec<Vec<f64>>,
}

/// Where the fit of an added effect starts.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Start {
    /// Start at the one-step estimate from the score test of the effect.
    #[default]
    Estimate,
    /// Start at the one-step estimate, clamped to these bounds (one pair of lower and upper per parameter).
    Within(Vec<[f64; 2]>),
    /// Start at these parameter values.
    At(Vec<f64>),
}

/// An alternative explanation with which an effect may be confused.
#[derive(Clone, Debug, PartialEq)]
pub enum Rival {
    /// The effect of this kind is the alternative.
    Kind(String),
    /// Any effect that acts at this location is an alternative.
    At(String),
    /// Any other effect is an alternative.
    Any,
}

/// Form of two effect parameters: an amplitude, and a direction that is undefined where the amplitude vanishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Polar {
    /// The amplitude is an axis ratio, 1 for no effect.
    ///
    /// The angle has a period of half a turn; a quarter turn inverts the ratio.
    Axis,
    /// The amplitude is a magnitude, 0 for no effect; the angle has a period of a full turn.
    Direction,
}

impl Polar {
    /// Normalises an amplitude and its angle (rad) to an equivalent pair.
    ///
    /// Afterwards a ratio is at least 1, a magnitude at least 0, and the angle is within half a period of 0.
    ///
    /// ```
    /// use augsim_system::Polar;
    /// let (mut ratio, mut angle) = (0.5, 0.0); // half as long along one axis is twice as long along the other
    /// Polar::Axis.normalise(&mut ratio, &mut angle);
    /// assert_eq!((ratio, angle.abs()), (2.0, std::f64::consts::FRAC_PI_2));
    /// ```
    pub fn normalise(self, amount: &mut f64, angle: &mut f64) {
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

    /// Adds a linear `step` to the point `at` (amplitude, angle in rad) in Cartesian coordinates.
    ///
    /// A linear step in the polar coordinates themselves would be wrong near the null value, where the angle
    /// is undefined.
    pub fn step(self, at: [f64; 2], step: [f64; 2]) -> [f64; 2] {
        let (angle_factor, null) = match self {
            Polar::Axis => (2.0, 1.0),
            Polar::Direction => (1.0, 0.0),
        };
        let amplitude = at[0] - null;
        let (along, across) = (amplitude + step[0], amplitude * angle_factor * step[1]);
        [null + along.hypot(across), at[1] + across.atan2(along) / angle_factor]
    }
}

/// A candidate effect of a system's library.
///
/// Built-in systems and equation systems each have a form of their own for effects, static or read from a file,
/// and convert it to this one, which is the only one that calibration and discovery use.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Effect {
    /// Kind of the effect: its name in model files, reports and results.
    pub kind: String,
    /// Location at which the effect acts (`flight`, `impact`, `sensor`, …).
    pub location: String,
    /// Parameters of the effect, in the order of its vector of values.
    pub parameters: Vec<EffectParameter>,
    /// Formula of the effect in one line.
    pub formula: String,
    /// Literature reference of the effect.
    pub source: String,
    /// Other physical causes with the same term, which data of one apparatus cannot distinguish from this effect.
    pub equivalent_causes: Vec<String>,
    /// Kinds of effects that describe the same phenomenon in another form; a model has at most one of them.
    pub excludes: Vec<String>,
    /// The carrier that the effect acts through; `None` if it acts by itself.
    ///
    /// Both are also tried together, as neither may improve the fit alone.
    pub joins: Option<Join>,
    /// Kind of the simpler effect that results where some parameters have their null value; `None` if there is none.
    pub reduces_to: Option<String>,
    /// Kind of another effect whose score test stands in for this one's; `None` if the effect is tested itself.
    ///
    /// Where the other effect is fitted, this one is fitted too.
    pub indicated_by: Option<String>,
    /// Whether the effect brings states of its own into the system.
    pub has_states: bool,
    /// Whether the effect depends on the past: it brings states of its own, or delays an input.
    pub depends_on_past: bool,
    /// The input or state that the effect adds to a reading (output), at once or with a lag; `None` for any other effect.
    pub added_to_reading: Option<String>,
    /// Whether the effect slows down every simulation; such effects are tested separately from cheap ones.
    pub costly: bool,
    /// Start values of the first fit of the effect.
    pub start: Start,
    /// Parameter values of the first simulation, if the effect is singular at its null values; empty: the null values.
    pub first_simulated_at: Vec<f64>,
    /// Number of leading parameters that are amplitudes; `None` if all of them are.
    pub amplitude_count: Option<usize>,
    /// How the effect's two parameters form an amplitude and a direction; `None` if they do not.
    pub polar: Option<Polar>,
    /// Experiments that distinguish the effect from alternative explanations: the alternative, and the experiment.
    pub separated_by: Vec<(Rival, String)>,
    /// Experiment that confirms the effect if there is no alternative explanation; `None` if none is known.
    pub confirmed_by: Option<String>,
    /// Whether the user's model file offers the effect; such effects are always tried.
    pub is_offered: bool,
    /// Complexity and domain of a formula that was generated by a grammar; `None` for other effects.
    pub formula_domain: Option<FormulaDomain>,
}

/// Complexity and domain of a formula that was generated by a grammar.
#[derive(Clone, Debug, PartialEq)]
pub struct FormulaDomain {
    /// Number of nodes of the formula: constants, variables and operations.
    pub nodes: usize,
    /// The quantity that the formula is a function of.
    pub variable: Quantity,
    /// Smallest and largest value in the data of the quantity that the formula depends on.
    pub range: [f64; 2],
}

/// Finds the experiment that distinguishes two models, from the effects that only one of them has.
///
/// A known experiment for a pair of effect kinds takes precedence over one for a kind and a location, and
/// this over one for a kind and any other effect. `None` if none is known.
pub fn known_distinguishing_experiment<'e>(one: &[&'e Effect], other: &[&'e Effect]) -> Option<&'e str> {
    let sides = [(one, other), (other, one)];
    let known = |applies: &dyn Fn(&Rival, &[&Effect]) -> bool| {
        sides.iter().find_map(|(effects, rivals)| {
            let mut entries = effects.iter().flat_map(|effect| &effect.separated_by);
            entries.find(|(rival, _)| applies(rival, rivals)).map(|(_, text)| text.as_str())
        })
    };
    // Effects of a system of equations have their place in their names: `input-lag on motor_V`.
    let is_kind =
        |k: &str, name: &str| name.strip_prefix(k).is_some_and(|r| r.is_empty() || r.starts_with(" on "));
    let has_kind = |rival: &Rival, name: &str| matches!(rival, Rival::Kind(k) if is_kind(k, name));
    let has_place = |rival: &Rival, place: &str| matches!(rival, Rival::At(p) if p == place);
    known(&|rival, rivals| rivals.iter().any(|e| has_kind(rival, &e.kind)))
        .or_else(|| known(&|rival, rivals| rivals.iter().any(|e| has_place(rival, &e.location))))
        .or_else(|| known(&|rival, _| *rival == Rival::Any))
}
