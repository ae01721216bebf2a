//! Arithmetic on `N` numbers at once, such as the same joint position of `N` samples.

use crate::algebra::Algebra;

/// Arithmetic on arrays of `N` numbers, element by element.
///
/// The compiler turns each operation into vector instructions. The fastest `N` is 4 for targets with vectors of two or four
/// numbers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Lanes<const N: usize>;

impl<const N: usize> Algebra for Lanes<N> {
    type Value = [f64; N];

    #[inline(always)]
    fn constant(&mut self, value: f64) -> [f64; N] {
        [value; N]
    }
    #[inline(always)]
    fn add(&mut self, a: [f64; N], b: [f64; N]) -> [f64; N] {
        std::array::from_fn(|lane| a[lane] + b[lane])
    }
    #[inline(always)]
    fn subtract(&mut self, a: [f64; N], b: [f64; N]) -> [f64; N] {
        std::array::from_fn(|lane| a[lane] - b[lane])
    }
    #[inline(always)]
    fn multiply(&mut self, a: [f64; N], b: [f64; N]) -> [f64; N] {
        std::array::from_fn(|lane| a[lane] * b[lane])
    }
    #[inline(always)]
    fn divide(&mut self, a: [f64; N], b: [f64; N]) -> [f64; N] {
        std::array::from_fn(|lane| a[lane] / b[lane])
    }
    #[inline(always)]
    fn negate(&mut self, a: [f64; N]) -> [f64; N] {
        a.map(|a| -a)
    }
    #[inline(always)]
    fn sin(&mut self, a: [f64; N]) -> [f64; N] {
        a.map(f64::sin)
    }
    #[inline(always)]
    fn cos(&mut self, a: [f64; N]) -> [f64; N] {
        a.map(f64::cos)
    }
}
