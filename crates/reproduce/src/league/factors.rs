//! Training settings that every model class of the league tries.

/// `(factor of the learning rate, factor of the hidden layer width)`, relative to the defaults of a class.
pub type Factors = (f64, f64);

/// Settings that every model class tries, in this order.
pub const SETTINGS: [Factors; 4] = [(1.0, 1.0), (0.3, 1.0), (3.0, 1.0), (1.0, 2.0)];
