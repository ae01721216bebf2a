//! Random friction maps.

use crate::push::field::Field;
use crate::push::planar::Vector;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// Nodes per correlation length.
const NODES_PER_LENGTH: f64 = 3.0;

/// A Gaussian random field of mean 1 and standard deviation `scatter`, with correlation `exp(-r²/(2 length²))`, on a square
/// around `centre` that reaches `reach_m` to each side. White noise, smoothed along both axes; never below 0.1.
pub fn draw(
    scatter: f64,
    length_m: f64,
    centre: Vector<f64>,
    reach_m: f64,
    rng: &mut impl Rng,
) -> Option<Field> {
    let pitch = length_m / NODES_PER_LENGTH;
    let nodes = (2.0 * reach_m / pitch).ceil() as usize + 2;
    // A kernel of width length/√2 twice over (itself and its mirror) has the correlation asked for.
    let width = length_m / std::f64::consts::SQRT_2 / pitch;
    let half = (3.0 * width).ceil() as usize;
    let mut kernel: Vec<f64> =
        (0..=2 * half).map(|i| (-0.5 * ((i as f64 - half as f64) / width).powi(2)).exp()).collect();
    let size = kernel.iter().map(|k| k * k).sum::<f64>().sqrt();
    kernel.iter_mut().for_each(|k| *k /= size);
    let padded = nodes + 2 * half;
    let noise: Vec<f64> = (0..padded * padded).map(|_| StandardNormal.sample(rng)).collect();
    let smooth = |values: &[f64], at: usize, stride: usize| -> f64 {
        kernel.iter().enumerate().map(|(k, weight)| weight * values[at + k * stride]).sum()
    };
    let rows: Vec<f64> = (0..padded)
        .flat_map(|j| (0..nodes).map(move |i| (i, j)))
        .map(|(i, j)| smooth(&noise, j * padded + i, 1))
        .collect();
    let values = (0..nodes * nodes).map(|k| (1.0 + scatter * smooth(&rows, k, nodes)).max(0.1)).collect();
    Field::new([centre[0] - reach_m, centre[1] - reach_m], pitch, nodes, values)
}

#[cfg(test)]
mod tests {
    //! Contract: the map has the mean, scatter and correlation that were asked for.
    use super::*;
    use augsim_data::random_stream;

    #[test]
    fn mean_scatter_and_correlation_are_those_asked_for() {
        let (scatter, length) = (0.12, 0.03);
        let (mut sum, mut square, mut product, mut count) = (0.0, 0.0, 0.0, 0.0);
        for seed in 0..400 {
            let mut rng = random_stream(seed, "test-map", 0);
            let field = draw(scatter, length, [0.35, -0.03], 0.1, &mut rng).expect("a field");
            for place in [[0.35, -0.03], [0.28, 0.03], [0.41, -0.1]] {
                let (a, b) = (field.factor(place), field.factor([place[0] + length, place[1]]));
                sum += a;
                square += (a - 1.0) * (a - 1.0);
                product += (a - 1.0) * (b - 1.0);
                count += 1.0;
            }
        }
        // Standard errors with 1200 draws: 0.35 % of the mean, 2 % of the scatter, 0.03 of the correlation. Reading between
        // nodes a third of a length apart takes up to 5 % off the scatter.
        assert!((sum / count - 1.0).abs() < 0.012, "{}", sum / count);
        let sd = (square / count).sqrt();
        assert!((sd / scatter - 0.98).abs() < 0.08, "{sd}");
        let correlation = product / square;
        assert!((correlation - (-0.5f64).exp()).abs() < 0.1, "{correlation}");
    }
}
