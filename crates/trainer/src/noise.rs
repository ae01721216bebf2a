//! Standard normal draws for many sequences at once: one stream per (seed, purpose, place).

use augsim_data::random_stream;
use augsim_tensor::kernels::normal::NormalLanes;
use rand::Rng;

/// Generators for the sequences `first..first + lanes` of a purpose.
pub(crate) fn normals(seed: u64, purpose: &str, first: u64, lanes: usize) -> NormalLanes {
    NormalLanes::new((first..first + lanes as u64).map(|i| {
        let mut stream = random_stream(seed, purpose, i);
        [stream.next_u64(), stream.next_u64()]
    }))
}
