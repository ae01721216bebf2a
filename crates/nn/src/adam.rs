//! The optimiser Adam (Kingma and Ba, ICLR 2015), with weight decay as an L2 term in the gradient.
//!
//! It is `torch.optim.Adam`. Step t with the gradient g and the parameters p is
//!
//! ```text
//! (1)  g <- g + λ p
//! (2)  m <- β1 m + (1 - β1) g,   v <- β2 v + (1 - β2) g²
//! (3)  p <- p - lr m / (1 - β1^t) / (sqrt(v / (1 - β2^t)) + ε)
//! ```

use augsim_tensor::Scalar;
use serde::{Deserialize, Serialize};

/// Settings of the Adam optimiser.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Adam {
    /// β1, the decay rate of the first moment of the gradient.
    pub beta1: f64,
    /// β2, the decay rate of the second moment of the gradient.
    pub beta2: f64,
    /// ε, added to the square root of the second moment in the denominator of a step.
    pub eps: f64,
    /// λ, the factor of the weight decay (L2 term) in the gradient.
    pub weight_decay: f64,
}

impl Default for Adam {
    fn default() -> Self {
        Adam { beta1: 0.9, beta2: 0.999, eps: 1e-8, weight_decay: 0.0 }
    }
}

/// State of the Adam optimiser: moments m and v of every parameter, and the number of steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AdamState<T> {
    steps: u64,
    first: Vec<T>,
    second: Vec<T>,
}

impl<T: Scalar> AdamState<T> {
    /// Creates the optimiser state before the first step, for `n` parameters.
    pub fn new(n: usize) -> Self {
        AdamState { steps: 0, first: vec![T::ZERO; n], second: vec![T::ZERO; n] }
    }

    /// Number of parameters that are optimised.
    pub fn len(&self) -> usize {
        self.first.len()
    }

    /// Whether there are no parameters to optimise.
    pub fn is_empty(&self) -> bool {
        self.first.is_empty()
    }
}

impl Adam {
    /// Takes one Adam step of `params` with the learning rate `lr`.
    ///
    /// ```
    /// use augsim_nn::{Adam, AdamState};
    /// // The size of the first step is the learning rate, independent of the size of the gradient.
    /// let (mut params, mut state) = ([1.0_f64, 1.0], AdamState::new(2));
    /// Adam::default().step(&mut state, &mut params, &[1e-3, -40.0], 0.1);
    /// assert!((params[0] - 0.9).abs() < 1e-5 && (params[1] - 1.1).abs() < 1e-5);
    /// ```
    pub fn step<T: Scalar>(&self, state: &mut AdamState<T>, params: &mut [T], grads: &[T], lr: f64) {
        state.steps += 1;
        let t = i32::try_from(state.steps).unwrap_or(i32::MAX);
        // The moments start at 0, so they are too small by the factor 1 - β^t at first (Kingma and Ba,
        // section 3). Both corrections are scalars here; ε is added after the correction of v, as in PyTorch.
        let step = T::from_f64(lr / (1.0 - self.beta1.powi(t)));
        let scale = T::from_f64((1.0 - self.beta2.powi(t)).sqrt());
        let [b1, b2, eps, decay] = [self.beta1, self.beta2, self.eps, self.weight_decay].map(T::from_f64);
        let moments = state.first.iter_mut().zip(&mut state.second);
        for ((p, g), (m, v)) in params.iter_mut().zip(grads).zip(moments) {
            let g = *g + decay * *p;
            *m = b1 * *m + (T::ONE - b1) * g;
            *v = b2 * *v + (T::ONE - b2) * g * g;
            *p -= step * *m / (v.sqrt() / scale + eps);
        }
    }
}
