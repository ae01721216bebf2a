//! One Runge-Kutta step of fixed length, in the scalar of the simulation.

use super::tableau::{DENSE, ERROR_WEIGHTS, NODES, STAGE_WEIGHTS, STAGES};
use crate::Scalar;

/// A step with what its dense output needs. Buffers are kept from step to step.
#[derive(Clone, Debug)]
pub(super) struct Step<S> {
    /// Number of states.
    n: usize,
    /// When it begins, s.
    pub time: S,
    /// How long it is, s. Where it ends at an event or at a fixed time its length depends on the seeds.
    pub length: S,
    /// States at its beginning.
    pub start: Vec<S>,
    /// States at its end.
    pub end: Vec<S>,
    /// Rates at the stages, `[stage][state]`.
    rates: Vec<S>,
}

impl<S: Scalar> Step<S> {
    /// A step that begins with `start` at `time`; nothing is computed yet.
    pub fn new(time: S, start: Vec<S>) -> Self {
        let n = start.len();
        let zero = S::zero();
        Self { n, time, length: zero, end: start.clone(), start, rates: vec![zero; STAGES * n] }
    }

    /// Takes a step of `length` from the start; `rate(time, states, rates)` are the equations. With `first_known` the rates at
    /// the start are those that the step holds already.
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

    /// Begins the next step where this one ends; the rates there are known.
    pub fn advance(&mut self, time: S) {
        self.time = time;
        std::mem::swap(&mut self.start, &mut self.end);
        self.rates.copy_within((STAGES - 1) * self.n.., 0);
    }

    /// Begins the next step with `states` at `time`; the rates there are not known.
    pub fn begin(&mut self, time: S, states: &[S]) {
        self.time = time;
        self.start.copy_from_slice(states);
    }

    /// Rates at the end of the step.
    pub fn end_rates(&self) -> &[S] {
        &self.rates[(STAGES - 1) * self.n..]
    }

    /// Rates at the start of the step.
    pub fn start_rates(&self) -> &[S] {
        &self.rates[..self.n]
    }

    /// Root mean square of the local error, in units of the tolerance of each state.
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

    /// States at the share `share` of the step, into `out`.
    pub fn at(&self, share: S, out: &mut Vec<S>) {
        out.clear();
        out.extend_from_slice(&self.start);
        for (stage, [a, b, c, d]) in DENSE.into_iter().enumerate() {
            let weight = (((share * d + c) * share + b) * share + a) * share * self.length;
            let rates = &self.rates[stage * self.n..][..self.n];
            out.iter_mut().zip(rates).for_each(|(x, &k)| *x += k * weight);
        }
    }

    /// Copies the step without derivatives.
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
    //! Contract: a step is of fifth order at its end and its dense output of fourth; both as fitted slopes of the error
    //! against the length, over two halvings of a step that is neither coarse nor at rounding.
    use super::*;

    /// Error of one step of `length` of x' = v, v' = -x t at its end, and at 0.4 of it, against a step in 64 parts.
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
