//! Arithmetic on `N` numbers at once, such as the same joint position of `N` samples.

use crate::algebra::Algebra;

/// Arithmetic on arrays of `N` numbers, element by element.
///
/// The compiler turns each operation into vector instructions; 4 is a good `N` for processors whose vectors hold two or
/// four numbers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Lanes<const N: usize>;

impl<const N: usize> Algebra for Lanes<N> {
    type Value = [f64; N];
    const SKIPS_CONSTANTS: bool = false;

    #[inline(always)]
    fn constant(&mut self, value: f64) -> [f64; N] {
        [value; N]
    }
    #[inline(always)]
    fn add(&mut self, a: [f64; N], b: [f64; N]) -> [f64; N] {
        element_wise(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn subtract(&mut self, a: [f64; N], b: [f64; N]) -> [f64; N] {
        element_wise(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn multiply(&mut self, a: [f64; N], b: [f64; N]) -> [f64; N] {
        element_wise(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn divide(&mut self, a: [f64; N], b: [f64; N]) -> [f64; N] {
        element_wise(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn negate(&mut self, a: [f64; N]) -> [f64; N] {
        element_wise(a, a, |a, _| -a)
    }
    #[inline(always)]
    fn sin(&mut self, a: [f64; N]) -> [f64; N] {
        element_wise(a, a, |a, _| a.sin())
    }
    #[inline(always)]
    fn cos(&mut self, a: [f64; N]) -> [f64; N] {
        element_wise(a, a, |a, _| a.cos())
    }
}

/// Applies an operation to each pair of elements.
///
/// A plain loop: `std::array::from_fn` and `map` leave calls in long functions, which are then not vectorised.
#[inline(always)]
fn element_wise<const N: usize>(a: [f64; N], b: [f64; N], operation: impl Fn(f64, f64) -> f64) -> [f64; N] {
    let mut result = a;
    for lane in 0..N {
        result[lane] = operation(a[lane], b[lane]);
    }
    result
}
