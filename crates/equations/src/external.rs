//! Rates that a function outside the engine computes, such as a function of Python.

use crate::call_memory::CallMemory;
use std::fmt;
use std::sync::Arc;

/// Computes the rates of all declared states of a model outside the engine.
///
/// The arguments of the function are, in this order: the time in s, the declared states, the inputs, the declared
/// parameters without the delays of inputs, and the generalised forces of the section `[external]`.
pub trait ExternalRates: Send + Sync {
    /// Number of rates that the function computes: that of the declared states.
    fn states(&self) -> usize;

    /// Computes the rates at `points` points at once, per second.
    ///
    /// `arguments` is `[argument][point]`, and `rates` is `[state][point]`. A point whose rates cannot be computed
    /// gets NaN.
    fn rates(&self, points: usize, arguments: &[f64], rates: &mut [f64]);

    /// Computes the derivatives of the rates with respect to all arguments, `[state][argument][point]`.
    ///
    /// Returns false, with nothing written, if the function has none; finite differences are then used.
    fn derivatives(&self, points: usize, arguments: &[f64], derivatives: &mut [f64]) -> bool;

    /// Whether a point costs so much that finite differences are to be one-sided: half as many points, less accurate.
    fn is_costly(&self) -> bool;

    /// Typical size of each argument in its unit, below which the step of a finite difference no longer shrinks.
    fn typical_sizes(&self) -> &[f64];
}

/// Bytes of the latest calls that are kept for each function: 47,000 calls for four windows of four states with seven derivatives each.
const MEMORY_BYTES: usize = 64 << 20;

/// A function for external rates that the copies of a model share, with its latest results.
#[derive(Clone)]
pub struct ExternalFunction {
    function: Arc<dyn ExternalRates>,
    latest: Arc<CallMemory<Evaluated>>,
}

impl fmt::Debug for ExternalFunction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("ExternalFunction")
    }
}

impl PartialEq for ExternalFunction {
    /// Whether both are the same function, not only functions with the same values.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.function, &other.function)
    }
}

/// Relative step of a central finite difference: the cube root of the machine precision, as a power of two.
const CENTRAL_STEP: f64 = 1.0 / 131_072.0;
/// Relative step of a one-sided finite difference: a few times the square root of the machine precision.
const ONE_SIDED_STEP: f64 = 1.0 / 16_777_216.0;

/// Rates at several points, and their derivatives with respect to some of the arguments.
#[derive(Debug, Default)]
pub(crate) struct Evaluated {
    /// Rates, `[state][point]`.
    pub(crate) rates: Vec<f64>,
    /// Derivatives, `[state][wanted argument][point]`.
    pub(crate) derivatives: Vec<f64>,
}

impl ExternalFunction {
    /// A function of which nothing has been computed yet. It must give the same rates for the same arguments.
    pub fn new(function: Arc<dyn ExternalRates>) -> Self {
        ExternalFunction { function, latest: Arc::new(CallMemory::new(MEMORY_BYTES)) }
    }

    /// Rates at points and derivatives with respect to the arguments `wanted`, computed or from an equal call before.
    ///
    /// `arguments` is `[argument][point]`. Only whole calls are looked up: the last bits of a point may depend on the points
    /// beside it, and with them results would depend on the order of calls.
    pub(crate) fn evaluate(&self, points: usize, arguments: &[f64], wanted: &[usize]) -> Arc<Evaluated> {
        let shape = [points, wanted.len()].into_iter().chain(wanted.iter().copied());
        let call = shape.map(|n| n as u64).chain(arguments.iter().map(|x| x.to_bits())).collect();
        let size = |found: &Evaluated| size_of::<f64>() * (found.rates.len() + found.derivatives.len());
        self.latest.of(call, || self.compute(points, arguments, wanted), size)
    }

    /// Computes the rates at points, with the derivatives with respect to the arguments `wanted`.
    ///
    /// `arguments` is `[argument][point]`. Without derivatives of the function's own they are finite differences, for
    /// which all shifted points are computed in one call; beside a point whose rates are not finite central differences
    /// become one-sided.
    fn compute(&self, points: usize, arguments: &[f64], wanted: &[usize]) -> Evaluated {
        let (states, count) = (self.function.states(), arguments.len() / points.max(1));
        let mut rates = vec![0.0; states * points];
        if wanted.is_empty() {
            self.function.rates(points, arguments, &mut rates);
            return Evaluated { rates, derivatives: Vec::new() };
        }
        let mut full = vec![0.0; states * count * points];
        if self.function.derivatives(points, arguments, &mut full) {
            self.function.rates(points, arguments, &mut rates);
            let of = |state: usize, k: &usize| &full[(state * count + k) * points..][..points];
            let derivatives = (0..states).flat_map(|state| wanted.iter().flat_map(move |k| of(state, k)));
            return Evaluated { rates, derivatives: derivatives.copied().collect() };
        }
        self.differences(points, arguments, wanted)
    }

    /// Computes rates and their finite differences from one call of the function.
    fn differences(&self, points: usize, arguments: &[f64], wanted: &[usize]) -> Evaluated {
        let (states, count) = (self.function.states(), arguments.len() / points.max(1));
        // The points themselves, then for each wanted argument the points with it increased, then decreased.
        let (sides, relative_step) =
            if self.function.is_costly() { (1, ONE_SIDED_STEP) } else { (2, CENTRAL_STEP) };
        let total = points * (1 + sides * wanted.len());
        let mut shifted = Vec::with_capacity(count * total);
        for argument in arguments.chunks_exact(points.max(1)) {
            (0..=sides * wanted.len()).for_each(|_| shifted.extend_from_slice(argument));
        }
        let sizes = self.function.typical_sizes();
        let mut widths = Vec::with_capacity(wanted.len() * points);
        for (index, k) in wanted.iter().enumerate() {
            let typical = sizes.get(*k).copied().unwrap_or(1.0);
            for point in 0..points {
                let middle = arguments[k * points + point];
                let step = relative_step * middle.abs().max(typical);
                let place = k * total + (1 + sides * index) * points + point;
                for (side, sign) in [1.0, -1.0].into_iter().enumerate().take(sides) {
                    shifted[place + side * points] = middle + sign * step;
                }
                widths.push([0, sides - 1].map(|side| (shifted[place + side * points] - middle).abs()));
            }
        }
        let mut values = vec![0.0; states * total];
        self.function.rates(total, &shifted, &mut values);
        let mut evaluated = Evaluated::default();
        for row in values.chunks_exact(total.max(1)) {
            evaluated.rates.extend_from_slice(&row[..points]);
            for index in 0..wanted.len() {
                for point in 0..points {
                    let up = row[(1 + sides * index) * points + point];
                    let down = if sides == 1 { f64::NAN } else { row[(2 + sides * index) * points + point] };
                    evaluated.derivatives.push(slope(row[point], [up, down], widths[index * points + point]));
                }
            }
        }
        evaluated
    }
}

/// Slope from the values above and below a point; one-sided if only one of them is finite.
fn slope(middle: f64, [up, down]: [f64; 2], [above, below]: [f64; 2]) -> f64 {
    match (up.is_finite(), down.is_finite()) {
        (true, false) => (up - middle) / above,
        (false, true) => (middle - down) / below,
        _ => (up - down) / (above + below),
    }
}

#[cfg(test)]
mod tests {
    //! Contract: finite differences agree with the derivatives of the function, also at the edge of where it is defined.
    use super::*;

    /// The rate `k ln(1 + x)` for positive `x`; says whether it is costly.
    struct Logarithm(bool);

    impl ExternalRates for Logarithm {
        fn states(&self) -> usize {
            1
        }

        fn rates(&self, points: usize, arguments: &[f64], rates: &mut [f64]) {
            for (point, rate) in rates.iter_mut().enumerate() {
                let [x, k] = [1, 2].map(|argument| arguments[argument * points + point]);
                *rate = if x < 0.0 { f64::NAN } else { k * (1.0 + x).ln() };
            }
        }

        fn derivatives(&self, _points: usize, _arguments: &[f64], _derivatives: &mut [f64]) -> bool {
            false
        }

        fn is_costly(&self) -> bool {
            self.0
        }

        fn typical_sizes(&self) -> &[f64] {
            &[1.0, 0.1, 1.0]
        }
    }

    #[test]
    fn differences_are_accurate_and_one_sided_at_an_edge() {
        for (is_costly, tolerance) in [(false, 1e-5), (true, 1e-6)] {
            let function = ExternalFunction::new(Arc::new(Logarithm(is_costly)));
            let arguments = [0.0, 0.0, 2.0, 0.0, 3.0, 3.0];
            let found = function.evaluate(2, &arguments, &[1, 2]);
            let expected = [1.0, 3.0, 3.0_f64.ln(), 0.0];
            assert_eq!(found.rates, [3.0 * 3.0_f64.ln(), 0.0]);
            for (found, expected) in found.derivatives.iter().zip(expected) {
                assert!((found - expected).abs() < tolerance, "{found} instead of {expected}");
            }
        }
    }
}
