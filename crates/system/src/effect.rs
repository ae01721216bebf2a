//! An effect of a system's library, with all properties that calibration and discovery use.

use crate::quantity::Quantity;
use std::f64::consts::PI;

/// One parameter of an effect.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectParameter {
    /// Name with the unit as suffix, as in model files.
    pub name: String,
    /// Unit as printed; empty for a dimensionless number.
    pub unit: String,
    /// Lower bound of plausible values.
    pub min: f64,
    /// Upper bound of plausible values.
    pub max: f64,
    /// Typical magnitude; used for scaling.
    pub typical: f64,
    /// Null value: the effect vanishes there.
    pub null: f64,
}

/// The carrier that an effect acts through, such as the drag for a wind.
#[derive(Clone, Debug, PartialEq)]
pub struct Join {
    /// Kind of the carrier, which has to be in the model.
    pub kind: String,
    /// Start values of the carrier's parameters when both are tried together.
    pub carrier_start: Vec<f64>,
    /// Start values of the effect's own parameters then: one fit from each.
    pub effect_starts: Vec<Vec<f64>>,
}

/// Start values of the fit of an added effect.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Start {
    /// The one-step estimate of its score test.
    #[default]
    Estimate,
    /// The one-step estimate, clamped to these bounds (one pair per parameter).
    Within(Vec<[f64; 2]>),
    /// These values.
    At(Vec<f64>),
}

/// An alternative explanation that an effect may be confused with.
#[derive(Clone, Debug, PartialEq)]
pub enum Rival {
    /// The effect of this kind.
    Kind(String),
    /// Any effect that acts at this place.
    At(String),
    /// Any other effect.
    Any,
}

/// Polar parametrisation: an amplitude, and a direction that is undefined where it vanishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Polar {
    /// An axis ratio, 1 for none: the angle has a period of half a turn, a quarter turn inverts the ratio.
    Axis,
    /// A magnitude, 0 for none: the angle has a period of a full turn.
    Direction,
}

impl Polar {
    /// Normalises an amplitude and its angle, rad, to an equivalent pair.
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

    /// Adds a linear `step` to the point `at` (amplitude, angle) in Cartesian coordinates.
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
    /// Name in model files, reports and results.
    pub kind: String,
    /// Where it acts (`flight`, `impact`, `sensor`, …).
    pub location: String,
    /// Parameters, in the order of its vector of values.
    pub parameters: Vec<EffectParameter>,
    /// The formula in one line.
    pub formula: String,
    /// Literature reference.
    pub source: String,
    /// Other physical causes with the same term, not distinguishable with data of one apparatus.
    pub equivalent_causes: Vec<String>,
    /// Kinds that describe the same phenomenon in another form; a model has at most one of them.
    pub excludes: Vec<String>,
    /// The carrier that it acts through; both are also tried together, as neither may improve the fit alone.
    pub joins: Option<Join>,
    /// A simpler kind that it reduces to where some of its parameters have their null value.
    pub reduces_to: Option<String>,
    /// A kind whose score test stands in for this one's: where that kind is fitted, this one is fitted too.
    pub indicated_by: Option<String>,
    /// Whether it slows down every simulation; such effects are tested separately from cheap ones.
    pub costly: bool,
    /// Start values of a fit with it.
    pub start: Start,
    /// Values of its first simulation, if it is singular at its null values; empty: the null values.
    pub first_simulated_at: Vec<f64>,
    /// Number of leading parameters that are amplitudes; `None`: all of them.
    pub amplitude_count: Option<usize>,
    /// How its two parameters form an amplitude and a direction, if they do.
    pub polar: Option<Polar>,
    /// Experiments that distinguish it from alternative explanations.
    pub separated_by: Vec<(Rival, String)>,
    /// The experiment that confirms it, where there is no alternative explanation.
    pub confirmed_by: Option<String>,
    /// Complexity and domain, for a formula that was generated by a grammar.
    pub formula_domain: Option<FormulaDomain>,
}

/// Complexity and domain of a formula that was generated by a grammar.
#[derive(Clone, Debug, PartialEq)]
pub struct FormulaDomain {
    /// Number of nodes: constants, variables and operations.
    pub nodes: usize,
    /// The quantity that it is a function of.
    pub variable: Quantity,
    /// Smallest and largest value of that quantity in the data.
    pub range: [f64; 2],
}

/// The experiment that distinguishes two models, from the effects that only one of them has.
///
/// Entries for a pair of kinds take precedence over those for a kind and a place, and these over those for a
/// kind and any other.
pub fn known_distinguishing_experiment<'e>(one: &[&'e Effect], other: &[&'e Effect]) -> Option<&'e str> {
    let sides = [(one, other), (other, one)];
    let known = |applies: &dyn Fn(&Rival, &[&Effect]) -> bool| {
        sides.iter().find_map(|(effects, rivals)| {
            let mut entries = effects.iter().flat_map(|effect| &effect.separated_by);
            entries.find(|(rival, _)| applies(rival, rivals)).map(|(_, text)| text.as_str())
        })
    };
    let has_kind = |rival: &Rival, kind: &str| matches!(rival, Rival::Kind(k) if k == kind);
    let has_place = |rival: &Rival, place: &str| matches!(rival, Rival::At(p) if p == place);
    known(&|rival, rivals| rivals.iter().any(|e| has_kind(rival, &e.kind)))
        .or_else(|| known(&|rival, rivals| rivals.iter().any(|e| has_place(rival, &e.location))))
        .or_else(|| known(&|rival, _| *rival == Rival::Any))
}
