//! Settings that every class tries.

/// Factors of the learning rate and of the hidden layer width.
pub type Factors = (f64, f64);

/// Factors that are tried, in this order.
pub const SETTINGS: [Factors; 4] = [(1.0, 1.0), (0.3, 1.0), (3.0, 1.0), (1.0, 2.0)];
