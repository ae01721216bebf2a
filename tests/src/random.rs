//! Reproducible random inputs.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// `n` standard normal values from `seed`.
pub fn normals(seed: u64, n: usize) -> Vec<f64> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    (0..n).map(|_| StandardNormal.sample(&mut rng)).collect()
}

/// `n` standard normal values from `seed`, in single precision.
pub fn normals_f32(seed: u64, n: usize) -> Vec<f32> {
    normals(seed, n).into_iter().map(|x| x as f32).collect()
}
