//! Simulation of many pushes in parallel.

use super::engine::{Push, PushError, Run, simulate};
use super::path::Path;
use super::planar::Pose;
use rayon::prelude::*;

/// Simulates `pushes` on all threads; push `index` is sampled at `times(index)`.
///
/// The result is that of [`simulate`] for each push, in order, for any number of threads.
///
/// # Errors
/// Index and error of the first push, in order, that cannot be simulated.
pub fn simulate_batch<'t, P: Path<f64>>(
    pushes: &[Push<'_, f64, P>],
    times: impl Fn(usize) -> &'t [f64] + Sync,
) -> Result<Vec<Vec<Pose<f64>>>, (usize, PushError)> {
    let results: Vec<_> = pushes
        .par_iter()
        .enumerate()
        .map_init(Run::default, |run, (i, push)| match simulate(push, times(i), run) {
            Ok(()) => Ok(run.poses.clone()),
            Err(error) => Err((i, error)),
        })
        .collect();
    results.into_iter().collect()
}
