//! Splitting of the derivatives of a simulation into blocks of at most the widest dual number.
//!
//! Dual numbers have a fixed number of lanes. A task with more seeds than the widest runs once per block of
//! seeds. Each block repeats the simulation of the values, and the result is bit-identical to that of one
//! wider run.

use super::{Seed, Simulated, SimulationError, Task};
use crate::Scalar;

/// Runs a task in blocks of at most `widest` seeds and assembles the derivatives in `out`.
///
/// # Errors
/// The first error of `run`.
pub fn in_blocks(
    task: &Task<'_>,
    widest: usize,
    out: &mut Simulated,
    mut run: impl FnMut(&Task<'_>, &mut Simulated) -> Result<(), SimulationError>,
) -> Result<(), SimulationError> {
    let lanes = task.seeds.len();
    if lanes <= widest {
        return run(task, out);
    }
    // Blocks of equal width: 41 lanes are two times 21 and not 40 and 1.
    let blocks = lanes.div_ceil(widest);
    let width = lanes.div_ceil(blocks);
    let mut block = out.take_block();
    let mut done = Ok(());
    for first in (0..lanes).step_by(width) {
        let seeds = &task.seeds[first..(first + width).min(lanes)];
        done = run(&Task { seeds, ..task.clone() }, &mut block);
        if done.is_err() {
            break;
        }
        out.merge(&block, first, lanes);
    }
    out.put_block(block);
    done
}

/// Converts `values` to scalars: element `place(seed)` becomes the variable of the seed's lane.
pub fn seeded<S: Scalar>(values: &[f64], seeds: &[Seed], place: impl Fn(Seed) -> Option<usize>) -> Vec<S> {
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

/// Evaluates an expression with the narrowest scalar type that has at least `count` lanes.
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
