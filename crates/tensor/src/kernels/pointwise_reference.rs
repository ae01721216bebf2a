//! Elementwise functions in plain loops: the reference for [`super::pointwise`], and used for `f64`.

use crate::Scalar;

/// Computes softplus, `y = ln(1 + exp(x))`, element by element.
pub fn softplus<T: Scalar>(x: &[T], y: &mut [T]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y = x.softplus();
    }
}

/// Computes `y = tanh x`, element by element.
pub fn tanh<T: Scalar>(x: &[T], y: &mut [T]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y = x.tanh();
    }
}

/// Adds the gradient of softplus: `dx += g sigmoid(x)`.
pub fn softplus_vjp<T: Scalar>(x: &[T], g: &[T], dx: &mut [T]) {
    for ((d, x), g) in dx.iter_mut().zip(x).zip(g) {
        *d += *g * x.sigmoid();
    }
}

/// Computes the Kullback-Leibler divergence KL(q
/// p) of Gaussians, from `[mean_q, sd_q, mean_p, sd_p]`.
///
/// `ln(sd_p / sd_q) + (sd_q^2 + (mean_q - mean_p)^2) / (2 sd_p^2) - 1/2`.
pub fn gaussian_kl<T: Scalar>([mq, sq, mp, sp]: [&[T]; 4], y: &mut [T]) {
    let half = T::from_f64(0.5);
    for (i, y) in y.iter_mut().enumerate() {
        let (ratio, shift) = (sq[i] / sp[i], (mq[i] - mp[i]) / sp[i]);
        *y = half * (ratio * ratio + shift * shift) - half - ratio.ln();
    }
}

/// Adds the gradients of the four operands of [`gaussian_kl`], given the gradient `g` of its result.
pub fn gaussian_kl_vjp<T: Scalar>([mq, sq, mp, sp]: [&[T]; 4], g: &[T], grads: [&mut [T]; 4]) {
    let [d_mq, d_sq, d_mp, d_sp] = grads;
    for (i, g) in g.iter().enumerate() {
        let (variance, shift) = (sp[i] * sp[i], mq[i] - mp[i]);
        d_mq[i] += *g * shift / variance;
        d_sq[i] += *g * (sq[i] / variance - T::ONE / sq[i]);
        d_mp[i] -= *g * shift / variance;
        d_sp[i] += *g * (T::ONE - (sq[i] * sq[i] + shift * shift) / variance) / sp[i];
    }
}

/// Computes the Gaussian negative log-likelihood `ln sd + (x - mean)^2 / (2 sd^2)`, from `[x, mean, sd]`.
pub fn gaussian_nll<T: Scalar>([x, mean, sd]: [&[T]; 3], y: &mut [T]) {
    let half = T::from_f64(0.5);
    for (i, y) in y.iter_mut().enumerate() {
        let e = (x[i] - mean[i]) / sd[i];
        *y = sd[i].ln() + half * e * e;
    }
}

/// Adds the gradients of the three operands of [`gaussian_nll`], given the gradient `g` of its result.
pub fn gaussian_nll_vjp<T: Scalar>([x, mean, sd]: [&[T]; 3], g: &[T], grads: [&mut [T]; 3]) {
    let [d_x, d_mean, d_sd] = grads;
    for (i, g) in g.iter().enumerate() {
        let e = (x[i] - mean[i]) / sd[i];
        d_x[i] += *g * e / sd[i];
        d_mean[i] -= *g * e / sd[i];
        d_sd[i] += *g * (T::ONE - e * e) / sd[i];
    }
}
