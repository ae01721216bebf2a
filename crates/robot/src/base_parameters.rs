//! Combinations of inertial parameters that joint torques identify: the base parameters.
//!
//! The torques are linear in the parameters: torque = regressor * parameters. Columns of the regressor that are linear
//! combinations of others belong to parameters whose effect cannot be separated from that of the others: of the independent
//! columns, only combinations of parameters are identifiable (Gautier, "Numerical calculation of the base inertial parameters
//! of robots", ICRA 1990).

use crate::triangular_factor::TriangularFactor;

/// Share of a column that other columns do not explain below which it is rounding.
///
/// Sums of about a hundred products have a relative error of 1e-14; the square root of the precision is far above that.
pub const ROUNDING: f64 = 1e-8;

/// Share of an independent part that comes from a rounded angle in the description file.
///
/// Files write a right angle as 1.5708 or 1.571, with an error of up to 2e-4 rad, and so separate columns by 2e-4. The weakest
/// column of a six-axis arm (Stäubli TX40) that is independent in truth has a share of 0.6.
const ROUNDED_ANGLE: f64 = 1e-3;

/// Which columns count as independent.
#[derive(Debug, Clone, PartialEq)]
pub enum Independence {
    /// All whose part that the columns before do not explain exceeds this share of the column.
    ///
    /// [`ROUNDING`] keeps all but rounding.
    Share(f64),
    /// Those that the log identifies.
    ///
    /// The standard deviation of the parameter's estimate, at fixed later parameters, is below its plausible size. It is the
    /// torque's standard deviation over the norm of the column's part that the columns before do not explain.
    Noise {
        /// Standard deviation of the torque's noise in each row, N m; 1 if the rows were divided by theirs.
        torque_sd: f64,
        /// Plausible size of each parameter, `[parameters]`, for example its value in the description file.
        plausible: Vec<f64>,
    },
}

/// A parameter whose column is a combination of independent columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Dependent {
    /// Index of the parameter.
    pub parameter: usize,
    /// Positions in [`BaseParameters::independent`] and coefficients, without those that are 0.
    pub coefficients: Vec<(usize, f64)>,
}

/// Identifiable combinations of parameters.
///
/// Combination `k` is the parameter `independent[k]`, plus each dependent parameter times its coefficient on `k`.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseParameters {
    /// Names of the parameters.
    pub names: Vec<String>,
    /// Parameters with independent columns, in the order of the columns.
    pub independent: Vec<usize>,
    /// Parameters with dependent columns, in the order of the columns.
    pub dependent: Vec<Dependent>,
    /// Parameters without any effect on the torques.
    pub without_effect: Vec<usize>,
}

/// Finds the identifiable combinations from the rows of a regressor.
///
/// `factor` holds the stacked regressor, `[rows, parameters]`; rows of joints with different noise are divided by their standard
/// deviations. Of parameters that cannot be separated, those that come first in the order of the columns are independent. In
/// the usual order, link by link from the base, the parameters of a link are added to those of the links before it. Columns are
/// scaled to length 1.
///
/// # Panics
/// If there are fewer names, or plausible sizes, than columns.
pub fn base_parameters(
    factor: &TriangularFactor,
    names: &[String],
    independence: &Independence,
) -> BaseParameters {
    let p = factor.width();
    let upper = factor.clone().upper();
    let column = |j: usize| -> Vec<f64> { (0..p).map(|i| upper[i * p + j]).collect() };
    let norms: Vec<f64> = (0..p).map(|j| norm(&column(j))).collect();
    let largest = norms.iter().copied().fold(0.0, f64::max);
    let rounding = if let Independence::Share(share) = independence { *share } else { ROUNDING };
    let mut basis = Basis { vectors: Vec::new(), triangle: Vec::new() };
    let mut base = BaseParameters {
        names: names.to_vec(),
        independent: Vec::new(),
        dependent: Vec::new(),
        without_effect: Vec::new(),
    };
    for j in 0..p {
        if norms[j] <= rounding * largest {
            base.without_effect.push(j);
            continue;
        }
        let unit: Vec<f64> = column(j).iter().map(|value| value / norms[j]).collect();
        let (projections, residual) = basis.project(unit);
        let share = norm(&residual);
        let needed = match independence {
            Independence::Share(share) => *share,
            Independence::Noise { torque_sd, plausible } => {
                (torque_sd / (norms[j] * plausible[j].abs())).max(ROUNDING)
            }
        };
        if share > needed {
            basis.push(projections, &residual, share);
            base.independent.push(j);
            continue;
        }
        // A coefficient is as uncertain as the part that is not explained.
        let coefficients = basis.solve(&projections).into_iter().enumerate();
        let coefficients = coefficients
            .filter(|(_, value)| value.abs() > share.max(rounding))
            .map(|(k, value)| (k, value * norms[j] / norms[base.independent[k]]))
            .collect();
        base.dependent.push(Dependent { parameter: j, coefficients });
    }
    base
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Orthonormal basis of the independent columns, by the Gram-Schmidt method.
struct Basis {
    vectors: Vec<Vec<f64>>,
    /// Independent column k in the basis, `[k + 1]`.
    triangle: Vec<Vec<f64>>,
}

impl Basis {
    /// Components of a vector in the basis, and the part of the vector that is orthogonal to it.
    fn project(&self, mut x: Vec<f64>) -> (Vec<f64>, Vec<f64>) {
        let mut components = vec![0.0; self.vectors.len()];
        // The second pass removes what the rounding of the first has left ("twice is enough", Giraud et al. 2005).
        for _ in 0..2 {
            for (component, vector) in components.iter_mut().zip(&self.vectors) {
                let product: f64 = vector.iter().zip(&x).map(|(v, x)| v * x).sum();
                x.iter_mut().zip(vector).for_each(|(x, v)| *x -= product * v);
                *component += product;
            }
        }
        (components, x)
    }

    fn push(&mut self, mut components: Vec<f64>, residual: &[f64], length: f64) {
        self.vectors.push(residual.iter().map(|x| x / length).collect());
        components.push(length);
        self.triangle.push(components);
    }

    /// Coefficients on the independent columns of a vector with these components in the basis.
    fn solve(&self, components: &[f64]) -> Vec<f64> {
        let mut x = components.to_vec();
        for k in (0..x.len()).rev() {
            x[k] /= self.triangle[k][k];
            for i in 0..k {
                x[i] -= self.triangle[k][i] * x[k];
            }
        }
        x
    }
}

impl BaseParameters {
    /// Parameters and factors of combination `k`; the first factor is 1.
    pub fn combination(&self, k: usize) -> Vec<(usize, f64)> {
        let mut terms = vec![(self.independent[k], 1.0)];
        for dependent in &self.dependent {
            let own = dependent.coefficients.iter().filter(|(position, _)| *position == k);
            terms.extend(own.map(|(_, value)| (dependent.parameter, *value)));
        }
        terms
    }

    /// Combination `k` as a sum, such as `link2_moment_x + 0.4 link3_mass`, with factors of four digits.
    pub fn combination_text(&self, k: usize) -> String {
        let mut text = String::new();
        for (parameter, factor) in self.combination(k) {
            let sign = match (text.is_empty(), factor < 0.0) {
                (true, false) => "",
                (true, true) => "-",
                (false, false) => " + ",
                (false, true) => " - ",
            };
            text.push_str(sign);
            let digits = four_digits(factor.abs());
            if digits != "1" {
                text.push_str(&digits);
                text.push(' ');
            }
            text.push_str(&self.names[parameter]);
        }
        text
    }

    /// Factors of all combinations, `[combinations][parameters]`: combinations = factors * parameters.
    pub fn factors(&self) -> Vec<Vec<f64>> {
        let row = |k: usize| {
            let mut row = vec![0.0; self.names.len()];
            self.combination(k).into_iter().for_each(|(parameter, factor)| row[parameter] = factor);
            row
        };
        (0..self.independent.len()).map(row).collect()
    }

    /// Values of the combinations for parameter values, `[parameters]`.
    pub fn values(&self, parameters: &[f64]) -> Vec<f64> {
        let value = |k: usize| {
            self.combination(k).iter().map(|(parameter, factor)| factor * parameters[*parameter]).sum()
        };
        (0..self.independent.len()).map(value).collect()
    }

    /// Columns of a regressor's row that belong to the combinations.
    ///
    /// Their product with the combinations is the torque.
    pub fn base_row(&self, row: &[f64]) -> Vec<f64> {
        self.independent.iter().map(|parameter| row[*parameter]).collect()
    }
}

/// A positive number with four significant digits, without trailing zeros.
fn four_digits(value: f64) -> String {
    if !(1e-3..1e5).contains(&value) {
        let text = format!("{value:.3e}");
        return match text.split_once('e') {
            Some((digits, exponent)) => {
                format!("{}e{exponent}", digits.trim_end_matches('0').trim_end_matches('.'))
            }
            None => text,
        };
    }
    let decimals = (3 - value.log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

/// Identifiable combinations of a robot's model, whatever the log: those that random motion excites.
///
/// `regressor` returns the rows, `[joints][parameters]` row by row, for positions, speeds and accelerations, `[coordinates]` each.
/// Positions are within `ranges`, speeds within 2 rad/s or m/s, and accelerations within 10 rad/s2 or m/s2. The motion is the
/// same in every call.
pub fn structurally_identifiable(
    names: &[String],
    ranges: &[[f64; 2]],
    mut regressor: impl FnMut(&[f64], &[f64], &[f64]) -> Vec<f64>,
) -> BaseParameters {
    let n = ranges.len();
    let roots = roots_of_primes(3 * n);
    let mut factor = TriangularFactor::new(names.len());
    // Four rows for each parameter, even if only one joint's torque depends on it.
    for i in 1..=4 * names.len() + 16 {
        // Multiples of irrational numbers modulo 1 fill the cube evenly (Weyl 1916), without random numbers.
        let draw =
            |k: usize, range: [f64; 2]| range[0] + (range[1] - range[0]) * (i as f64 * roots[k]).fract();
        let position: Vec<f64> = (0..n).map(|k| draw(k, ranges[k])).collect();
        let speed: Vec<f64> = (0..n).map(|k| draw(n + k, [-2.0, 2.0])).collect();
        let acceleration: Vec<f64> = (0..n).map(|k| draw(2 * n + k, [-10.0, 10.0])).collect();
        factor.add_rows(&regressor(&position, &speed, &acceleration));
    }
    base_parameters(&factor, names, &Independence::Share(ROUNDED_ANGLE))
}

/// Square roots of the first prime numbers.
fn roots_of_primes(count: usize) -> Vec<f64> {
    let mut primes: Vec<u32> = Vec::new();
    let mut candidate = 2_u32;
    while primes.len() < count {
        if primes.iter().all(|prime| !candidate.is_multiple_of(*prime)) {
            primes.push(candidate);
        }
        candidate += 1;
    }
    primes.into_iter().map(|prime| f64::from(prime).sqrt()).collect()
}

#[cfg(test)]
mod tests;
