//! Effects that a plant has and its model lacks: in the effect library, in the search grammar, or in neither.

/// An effect: a term of one equation of a plant, in units of the typical sizes in that plant.
#[derive(Clone, Copy, Debug)]
pub struct Law {
    /// Name of the effect: library kind, formula in which `z` is the state it depends on, or description.
    pub name: &'static str,
    /// Whether the term depends on the speed (possible in force equations) instead of the position or level.
    pub depends_on_speed: bool,
    /// The term as a function of the state it depends on, the other state (position or speed) and time.
    ///
    /// States are divided by their RMS, time by the duration of a record. The value is about 1.
    pub term: fn(f64, f64, f64) -> f64,
}

/// Makes a [`Law`].
const fn law(name: &'static str, depends_on_speed: bool, term: fn(f64, f64, f64) -> f64) -> Law {
    Law { name, depends_on_speed, term }
}

/// Effects that are in the effect library, for a force or a flow equation.
pub fn library_laws(is_force: bool) -> &'static [Law] {
    const FORCE: [Law; 6] = [
        law("quadratic-damping", true, |v, _, _| -v.abs() * v),
        law("cubic-damping", true, |v, _, _| -v.powi(3)),
        law("coulomb", true, |v, _, _| -(v / 0.05).tanh()),
        law("asymmetric-stiffness", false, |x, _, _| -x * x),
        law("cubic-stiffness", false, |x, _, _| -x.powi(3)),
        law("asymmetric-damping", true, |v, _, _| -v.abs()),
    ];
    const FLOW: [Law; 2] =
        [law("leak-square", false, |x, _, _| -x * x), law("constant", false, |_, _, _| -1.0)];
    if is_force { &FORCE } else { &FLOW }
}

/// Formulas that the search grammar can express, for a force or a flow equation.
pub fn grammar_laws(is_force: bool) -> &'static [Law] {
    const FORCE: [Law; 5] = [
        law("z^3", false, |x, _, _| -x.powi(3)),
        law("abs(z) * z", true, |v, _, _| -v.abs() * v),
        law("tanh(z / s)", true, |v, _, _| -(v / 0.1).tanh()),
        law("z * exp(-(z / s)^2)", true, |v, _, _| -2.0 * v * (-v * v).exp()),
        law("z^2", false, |x, _, _| x * x),
    ];
    const FLOW: [Law; 3] = [
        law("z^2", false, |x, _, _| -x * x),
        law("z^3", false, |x, _, _| -x.powi(3)),
        law("relu(z - s)", false, |x, _, _| -2.0 * (x - 0.8).max(0.0)),
    ];
    if is_force { &FORCE } else { &FLOW }
}

/// Effects that are neither in the effect library nor in the search grammar.
pub fn unlisted_laws(is_force: bool) -> &'static [Law] {
    const FORCE: [Law; 3] = [
        law(
            "a window of position",
            false,
            |x, _, _| if (0.3..0.6).contains(&x.abs()) { x.signum() } else { 0.0 },
        ),
        law("a fine ripple of position", false, |x, _, _| (47.0 * x).sin()),
        law("a chirp", false, |_, _, t| (40.0 * t * t).sin()),
    ];
    const FLOW: [Law; 2] = [
        law("a window of level", false, |x, _, _| if (0.9..1.1).contains(&x) { -1.0 } else { 0.0 }),
        law("a chirp", false, |_, _, t| (25.0 * t * t).sin()),
    ];
    if is_force { &FORCE } else { &FLOW }
}
