//! Random friction maps of the table.

use crate::push::field::Field;
use crate::push::planar::Vector;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// Number of grid nodes of the friction map per correlation length.
const NODES_PER_LENGTH: f64 = 3.0;

/// Draws a random friction map: a Gaussian field with mean 1 and standard deviation `scatter`.
///
/// The correlation at distance r is `exp(-r²/(2 length²))`. The square grid is centred at `centre` and
/// extends `reach_m` to each side. White noise is smoothed along both axes; values below 0.1 are
/// set to 0.1, because friction must be positive.
pub fn draw(
    scatter: f64,
    length_m: f64,
    centre: Vector<f64>,
    reach_m: f64,
    rng: &mut impl Rng,
) -> Option<Field> {
    let pitch = length_m / NODES_PER_LENGTH;
    let nodes = (2.0 * reach_m / pitch).ceil() as usize + 2;
    // The convolution of a Gaussian kernel of width length/√2 with itself has the requested correlation.
    let width = length_m / std::f64::consts::SQRT_2 / pitch;
    let half = (3.0 * width).ceil() as usize;
    let mut kernel: Vec<f64> =
        (0..=2 * half).map(|i| (-0.5 * ((i as f64 - half as f64) / width).powi(2)).exp()).collect();
    let norm = kernel.iter().map(|k| k * k).sum::<f64>().sqrt();
    kernel.iter_mut().for_each(|k| *k /= norm);
    let padded = nodes + 2 * half;
    let noise: Vec<f64> = (0..padded * padded).map(|_| StandardNormal.sample(rng)).collect();
    let smoothed = |values: &[f64], first: usize, stride: usize| -> f64 {
        kernel.iter().enumerate().map(|(k, weight)| weight * values[first + k * stride]).sum()
    };
    let rows: Vec<f64> = (0..padded)
        .flat_map(|j| (0..nodes).map(move |i| (i, j)))
        .map(|(i, j)| smoothed(&noise, j * padded + i, 1))
        .collect();
    let values = (0..nodes * nodes).map(|k| (1.0 + scatter * smoothed(&rows, k, nodes)).max(0.1)).collect();
    Field::new([centre[0] - reach_m, centre[1] - reach_m], pitch, nodes, values)
}

#[cfg(test)]
mod tests {
    //! Contract: the map has the requested mean, scatter and correlation.
    use super::*;
    use augsim_data::random_stream;

    #[test]
    fn map_has_the_requested_mean_scatter_and_correlation() {
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
        // The standard errors with 1200 draws are 0.35 % of the mean, 2 % of the scatter and 0.03 of the
        // correlation. Interpolation between nodes 33 % of a correlation length apart reduces the scatter by
        // up to 5 %.
        assert!((sum / count - 1.0).abs() < 0.012, "{}", sum / count);
        let sd = (square / count).sqrt();
        assert!((sd / scatter - 0.98).abs() < 0.08, "{sd}");
        let correlation = product / square;
        assert!((correlation - (-0.5f64).exp()).abs() < 0.1, "{correlation}");
    }
}
