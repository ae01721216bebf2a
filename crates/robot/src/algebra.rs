//! Arithmetic on numbers, lanes of numbers, or nodes of an expression graph, on which the dynamics are written once.

/// Arithmetic on values of one kind.
///
/// The equations of motion are written once over this trait. [`Numbers`] evaluates them; the compiler of model files
/// implements the trait on its expression graph, so that the same equations are compiled, differentiated and exported.
/// Implementations may simplify, for example drop products with the constant 0.
pub trait Algebra {
    /// A number, a vector of numbers, or the result of an operation.
    type Value: Copy;

    /// Whether products with 0 and 1, and sums with 0, are left out where the description file fixes the factor.
    ///
    /// This keeps expression graphs short. Vectors of numbers are faster without the tests of each factor.
    const SKIPS_CONSTANTS: bool = true;

    /// The value of a constant.
    fn constant(&mut self, value: f64) -> Self::Value;
    /// The sum `a + b`.
    fn add(&mut self, a: Self::Value, b: Self::Value) -> Self::Value;
    /// The difference `a - b`.
    fn subtract(&mut self, a: Self::Value, b: Self::Value) -> Self::Value;
    /// The product `a * b`.
    fn multiply(&mut self, a: Self::Value, b: Self::Value) -> Self::Value;
    /// The quotient `a / b`.
    fn divide(&mut self, a: Self::Value, b: Self::Value) -> Self::Value;
    /// The negative value `-a`.
    fn negate(&mut self, a: Self::Value) -> Self::Value;
    /// The sine of `a`, which is in rad.
    fn sin(&mut self, a: Self::Value) -> Self::Value;
    /// The cosine of `a`, which is in rad.
    fn cos(&mut self, a: Self::Value) -> Self::Value;
}

/// Arithmetic on `f64`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Numbers;

impl Algebra for Numbers {
    type Value = f64;
    const SKIPS_CONSTANTS: bool = false;

    #[inline]
    fn constant(&mut self, value: f64) -> f64 {
        value
    }
    #[inline]
    fn add(&mut self, a: f64, b: f64) -> f64 {
        a + b
    }
    #[inline]
    fn subtract(&mut self, a: f64, b: f64) -> f64 {
        a - b
    }
    #[inline]
    fn multiply(&mut self, a: f64, b: f64) -> f64 {
        a * b
    }
    #[inline]
    fn divide(&mut self, a: f64, b: f64) -> f64 {
        a / b
    }
    #[inline]
    fn negate(&mut self, a: f64) -> f64 {
        -a
    }
    #[inline]
    fn sin(&mut self, a: f64) -> f64 {
        a.sin()
    }
    #[inline]
    fn cos(&mut self, a: f64) -> f64 {
        a.cos()
    }
}
