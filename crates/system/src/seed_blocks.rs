//! Splits the derivatives of a simulation into blocks of at most the widest dual number.
//!
//! Dual numbers have a fixed number of lanes, one per derivative. A task with more seeds (variables of
//! differentiation) than the widest dual number has lanes runs once per block of seeds. Each block repeats
//! the simulation of the values, and the result is bit-identical to that of one wider run.

use crate::error::SimulationError;
use crate::simulated::Simulated;
use crate::task::Task;

/// Simulates a task in blocks of at most `widest` seeds, and assembles the derivatives in `out`.
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
