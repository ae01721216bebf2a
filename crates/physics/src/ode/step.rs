//! One Runge-Kutta step of fixed length, in the scalar of the simulation.

use super::tableau::{DENSE, ERROR_WEIGHTS, NODES, STAGE_WEIGHTS, STAGES};
use crate::Scalar;

/// A Runge-Kutta step with the stages that its dense output needs. Its buffers are reused.
#[derive(Clone, Debug)]
pub(super) struct Step<S> {
    /// Number of states of the system.
    n: usize,
    /// Time at which the step begins, s.
    pub time: S,
    /// Length of the step, s. It carries derivatives if the step ends at an event or at a fixed time.
    pub length: S,
    /// States at the beginning of the step.
    pub start: Vec<S>,
    /// States at the end of the step.
    pub end: Vec<S>,
    /// Time derivatives of the states at the stages, `[stage][state]`.
    rates: Vec<S>,
}

impl<S: Scalar> Step<S> {
    /// A step that begins with the states `start` at `time`; nothing is computed yet.
    pub fn new(time: S, start: Vec<S>) -> Self {
        let n = start.len();
        let zero = S::zero();
        Self { n, time, length: zero, end: start.clone(), start, rates: vec![zero; STAGES * n] }
    }

    /// Makes a step of `length`, s, with the equations `rate(time, states, rates)`.
    ///
    /// With `first_known` the step already holds the rates at its start.
    pub fn take(&mut self, length: S, first_known: bool, rate: &mut impl FnMut(S, &[S], &mut [S])) {
        self.length = length;
        for stage in usize::from(first_known)..STAGES {
            self.end.copy_from_slice(&self.start);
            for (earlier, &weight) in STAGE_WEIGHTS[stage].iter().enumerate() {
                let along = length * weight;
                let known = &self.rates[earlier * self.n..][..self.n];
                self.end.iter_mut().zip(known).for_each(|(x, &k)| *x += k * along);
            }
            // The last stage is evaluated at the end of the step, which `end` then holds.
            let time = self.time + length * NODES[stage];
            rate(time, &self.end, &mut self.rates[stage * self.n..][..self.n]);
        }
    }

    /// Begins the next step at `time` with the states and rates at the end of this one.
    pub fn advance(&mut self, time: S) {
        self.time = time;
        std::mem::swap(&mut self.start, &mut self.end);
        self.rates.copy_within((STAGES - 1) * self.n.., 0);
    }

    /// Begins the next step at `time` with other states, whose rates are not known.
    pub fn begin(&mut self, time: S, states: &[S]) {
        self.time = time;
        self.start.copy_from_slice(states);
    }

    /// Time derivatives of the states at the end of the step.
    pub fn end_rates(&self) -> &[S] {
        &self.rates[(STAGES - 1) * self.n..]
    }

    /// Time derivatives of the states at the start of the step.
    pub fn start_rates(&self) -> &[S] {
        &self.rates[..self.n]
    }

    /// Root mean square over the states of the local error divided by the tolerance of the state.
    pub fn error(&self, relative: f64, absolute: f64) -> f64 {
        let length = self.length.value();
        let sum: f64 = (0..self.n)
            .map(|i| {
                let rates =
                    ERROR_WEIGHTS.iter().enumerate().map(|(s, w)| w * self.rates[s * self.n + i].value());
                let size = self.start[i].value().abs().max(self.end[i].value().abs());
                (length * rates.sum::<f64>() / (absolute + relative * size)).powi(2)
            })
            .sum();
        (sum / self.n.max(1) as f64).sqrt()
    }

    /// Writes the interpolated states at the fraction `share` of the step to `out`.
    pub fn at(&self, share: S, out: &mut Vec<S>) {
        out.clear();
        out.extend_from_slice(&self.start);
        for (stage, [a, b, c, d]) in DENSE.into_iter().enumerate() {
            let weight = (((share * d + c) * share + b) * share + a) * share * self.length;
            let rates = &self.rates[stage * self.n..][..self.n];
            out.iter_mut().zip(rates).for_each(|(x, &k)| *x += k * weight);
        }
    }

    /// Copy of the step without derivatives.
    pub fn values(&self) -> Step<f64> {
        let plain = |list: &[S]| list.iter().map(|x| x.value()).collect();
        Step {
            n: self.n,
            time: self.time.value(),
            length: self.length.value(),
            start: plain(&self.start),
            end: plain(&self.end),
            rates: plain(&self.rates),
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the result of a step is of fifth order, and its dense output of fourth.
    //!
    //! The orders are fitted slopes of the error against the step length, over two halvings of a step whose
    //! error is far from rounding.
    use super::*;

    /// Errors of one step of `length` of x' = v, v' = -x t: at its end, and at 0.4 of it.
    ///
    /// The reference is the same interval in 64 steps.
    fn errors(length: f64) -> [f64; 2] {
        let mut rate = |t: f64, x: &[f64], out: &mut [f64]| (out[0], out[1]) = (x[1], -x[0] * t);
        let mut one = Step::new(1.0, vec![0.8, 0.3]);
        one.take(length, false, &mut rate);
        let mut part = Step::new(1.0, vec![0.8, 0.3]);
        let mut inside = 0.0;
        for i in 1..=80 {
            part.take(length / 80.0, false, &mut rate);
            part.advance(1.0 + length * f64::from(i) / 80.0);
            if i == 32 {
                inside = part.start[0];
            }
        }
        let mut middle = Vec::new();
        one.at(0.4, &mut middle);
        [(one.end[0] - part.start[0]).abs(), (middle[0] - inside).abs()]
    }

    #[test]
    fn the_orders_are_fitted_slopes() {
        let [coarse, fine] = [0.4, 0.1].map(errors);
        // The local error is one order higher than that of the method.
        let slopes = [0, 1].map(|i| (coarse[i] / fine[i]).log2() / 2.0);
        assert!(slopes[0] > 5.7 && slopes[1] > 4.7, "{slopes:?} {coarse:?} {fine:?}");
    }
}
