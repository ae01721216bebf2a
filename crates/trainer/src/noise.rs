//! Standard normal draws from one random stream per (seed, purpose, index).

use augsim_data::random_stream;
use augsim_tensor::kernels::normal::NormalLanes;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// Creates standard normal generators, one per lane, from the random streams `first..first + lanes`.
pub(crate) fn normals(seed: u64, purpose: &str, first: u64, lanes: usize) -> NormalLanes {
    NormalLanes::new((first..first + lanes as u64).map(|i| {
        let mut stream = random_stream(seed, purpose, i);
        [stream.next_u64(), stream.next_u64()]
    }))
}

/// Draws `n` standard normal numbers from the random stream (seed, purpose, index).
pub(crate) fn standard(seed: u64, purpose: &str, index: u64, n: usize) -> Vec<f32> {
    let mut rng = random_stream(seed, purpose, index);
    (0..n).map(|_| StandardNormal.sample(&mut rng)).collect()
}
