//! Converts seeded values of a task to dual numbers, and stores results with their derivatives.

use crate::Scalar;
use augsim_system::{Seed, Simulated};

/// Converts `values` to scalars; element `place(seed)` becomes the independent variable of that seed.
pub(crate) fn seeded<S: Scalar>(
    values: &[f64],
    seeds: &[Seed],
    place: impl Fn(Seed) -> Option<usize>,
) -> Vec<S> {
    let mut out: Vec<S> = values.iter().map(|&v| S::constant(v)).collect();
    for (lane, seed) in seeds.iter().enumerate() {
        if let Some(i) = place(*seed)
            && let (Some(slot), Some(&value)) = (out.get_mut(i), values.get(i))
        {
            *slot = S::variable(value, lane);
        }
    }
    out
}

/// Stores the value and the derivatives of a channel at a sample; ignores more lanes than there are seeds.
pub(crate) fn store<S: Scalar>(out: &mut Simulated, sample: usize, channel: usize, x: S) {
    out.set_row(sample, channel, x.value(), x.derivatives().iter().copied());
}

/// Evaluates an expression with the narrowest scalar type that carries at least `count` derivatives.
///
/// That is `f64` for 0, otherwise the first sufficient width of the list (in increasing order), or the
/// widest.
macro_rules! with_lanes {
    ($count:expr, [$($lanes:literal),* ; $widest:literal], $scalar:ident => $run:expr) => {
        match $count {
            0 => {
                type $scalar = f64;
                $run
            }
            $(n if n <= $lanes => {
                type $scalar = $crate::Dual<$lanes>;
                $run
            })*
            _ => {
                type $scalar = $crate::Dual<$widest>;
                $run
            }
        }
    };
}

pub(crate) use with_lanes;
