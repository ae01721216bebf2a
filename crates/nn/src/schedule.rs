//! Learning-rate schedules.

use serde::{Deserialize, Serialize};

/// Learning-rate schedule: the rate is multiplied by `factor` every `every` iterations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StepDecay {
    /// Learning rate of the first iteration.
    pub initial: f64,
    /// Factor by which the learning rate is multiplied at each reduction.
    pub factor: f64,
    /// Number of iterations between reductions of the learning rate; 0 for a constant rate.
    pub every: u64,
}

impl StepDecay {
    /// Learning rate of iteration `i`, counted from 0.
    ///
    /// ```
    /// use augsim_nn::StepDecay;
    /// let halved = StepDecay { initial: 1e-3, factor: 0.5, every: 2500 };
    /// assert_eq!([halved.at(0), halved.at(2500), halved.at(7500)], [1e-3, 5e-4, 1.25e-4]);
    /// ```
    pub fn at(&self, i: u64) -> f64 {
        let steps = i.checked_div(self.every).unwrap_or(0);
        self.initial * self.factor.powi(i32::try_from(steps).unwrap_or(i32::MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::StepDecay;

    #[test]
    fn rate_is_reduced_at_multiples_of_the_interval() {
        let s = StepDecay { initial: 1e-3, factor: 0.5, every: 2500 };
        assert_eq!([s.at(0), s.at(2499), s.at(2500), s.at(9999)], [1e-3, 1e-3, 5e-4, 1.25e-4]);
        assert_eq!(StepDecay { every: 0, ..s }.at(1_000_000), 1e-3);
    }
}
