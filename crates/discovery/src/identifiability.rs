//! Parameters that are not identifiable from the data.

use crate::linear::Square;

/// Eigenvalue of the scaled information matrix below which a direction of the parameters is not identifiable.
const FLAT_CURVATURE: f64 = 1e-9;
/// Component of an unidentifiable direction above which a parameter counts as part of it.
const MIN_COMPONENT: f64 = 0.05;

/// Marks the parameters that can change, alone or together with others, without changing the cost.
pub(crate) fn unidentifiable(information: &Square) -> Vec<bool> {
    let p = information.n;
    let scale: Vec<f64> = (0..p).map(|i| information.at(i, i).max(1e-300).sqrt().recip()).collect();
    let mut unit = information.clone();
    for i in 0..p {
        for j in 0..p {
            *unit.at_mut(i, j) *= scale[i] * scale[j];
        }
    }
    let (values, vectors) = unit.eigen();
    let part = |i: usize, k: usize| values[k] < FLAT_CURVATURE && vectors.at(i, k).abs() > MIN_COMPONENT;
    (0..p).map(|i| information.at(i, i) <= 0.0 || (0..p).any(|k| part(i, k))).collect()
}

#[cfg(test)]
mod tests {
    //! Contract: parameters in directions without information are marked.
    use super::*;

    #[test]
    fn parameters_that_act_only_together_are_unidentifiable() {
        let mut information = Square::zero(3);
        for i in 0..2 {
            for j in 0..2 {
                *information.at_mut(i, j) = 4.0;
            }
        }
        *information.at_mut(2, 2) = 1.0;
        assert_eq!(unidentifiable(&information), [true, true, false]);
    }
    #[test]
    fn a_direction_is_flat_below_a_billionth_of_the_curvature() {
        let is_flat = |value: f64| {
            let mut information = Square::zero(2);
            for i in 0..2 {
                for j in 0..2 {
                    *information.at_mut(i, j) = if i == j { 1.0 } else { 1.0 - value };
                }
            }
            unidentifiable(&information) == [true, true]
        };
        assert!(is_flat(7e-10) && !is_flat(1.5e-9));
    }

    #[test]
    fn a_parameter_takes_part_in_a_flat_direction_above_a_component_of_a_twentieth() {
        // The information I - v v' has the flat direction v; after scaling, its last component is 1.4
        // `last`.
        let parts = |last: f64| {
            let side = (0.5 * (1.0 - last * last)).sqrt();
            let v = [side, side, last];
            let mut information = Square::zero(3);
            for i in 0..3 {
                for j in 0..3 {
                    *information.at_mut(i, j) = f64::from(u8::from(i == j)) - v[i] * v[j];
                }
            }
            unidentifiable(&information)
        };
        assert_eq!((parts(0.028), parts(0.05)), (vec![true, true, false], vec![true; 3]));
    }
}
