//! Cells: the part of one window that lies in one block, with its sums of products.

use super::rows::WindowRows;
use crate::linear::Square;
use augsim_linear::gram_of_rows;

/// Sums of products over the rows of one window that lie in one block.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    pub window: usize,
    pub block: usize,
    pub is_prior: bool,
    /// Sum of products `J'J` of the sensitivities in the cell, without the window's weight.
    pub h: Square,
    /// Sum `J'r` of sensitivities times residuals, without the window's weight.
    pub g: Vec<f64>,
    /// Sum of squared residuals `r'r`, without the window's weight.
    pub c: f64,
}

/// Terms of the robust cost of a window.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    pub weight: f64,
    pub degrees_of_freedom: f64,
    pub is_tolerance: bool,
    pub constant: f64,
}

/// Divides the rows of window `w` into cells: its measured rows by block, and its prior rows by block.
pub(super) fn cells(w: usize, window: &WindowRows, width: usize) -> Vec<Cell> {
    let measured = window.samples();
    let mut blocks: Vec<(u16, bool)> =
        window.block_and_channel.iter().enumerate().map(|(k, p)| (p.0, k >= measured)).collect();
    blocks.sort_unstable();
    blocks.dedup();
    let p = width - 1;
    let cell = |(block, is_prior): (u16, bool)| {
        let places = window.block_and_channel.iter().zip(window.values.chunks_exact(width)).enumerate();
        let rows: Vec<f64> = places
            .filter(|(k, (place, _))| place.0 == block && (*k >= measured) == is_prior)
            .flat_map(|(_, (_, row))| row.iter().copied())
            .collect();
        let gram = gram_of_rows(&rows, width);
        let mut h = Square::zero(p);
        (0..p).for_each(|i| (0..p).for_each(|j| *h.at_mut(i, j) = gram[i * width + j]));
        let g = (0..p).map(|i| gram[i * width + p]).collect();
        Cell { window: w, block: usize::from(block), is_prior, h, g, c: gram[p * width + p] }
    };
    blocks.into_iter().map(cell).collect()
}
