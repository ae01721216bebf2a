//! Parameters that the data do not determine.

use crate::linear::Square;

/// Curvature, in units of that of single parameters, below which a direction of the parameters changes nothing.
const FLAT: f64 = 1e-9;
/// Component of such a direction from which a parameter takes part in it.
const TAKES_PART: f64 = 0.05;

/// Marks the parameters that can be changed, together with others, without a change of the cost.
pub(crate) fn undetermined(information: &Square) -> Vec<bool> {
    let p = information.n;
    let scale: Vec<f64> = (0..p).map(|i| information.at(i, i).max(1e-300).sqrt().recip()).collect();
    let mut unit = information.clone();
    for i in 0..p {
        for j in 0..p {
            *unit.at_mut(i, j) *= scale[i] * scale[j];
        }
    }
    let (values, vectors) = unit.eigen();
    let part = |i: usize, k: usize| values[k] < FLAT && vectors.at(i, k).abs() > TAKES_PART;
    (0..p).map(|i| information.at(i, i) <= 0.0 || (0..p).any(|k| part(i, k))).collect()
}

#[cfg(test)]
mod tests {
    //! Contract: a direction without information is said to be one.
    use super::*;

    #[test]
    fn parameters_that_act_only_together_are_undetermined() {
        let mut information = Square::zero(3);
        for i in 0..2 {
            for j in 0..2 {
                *information.at_mut(i, j) = 4.0;
            }
        }
        *information.at_mut(2, 2) = 1.0;
        assert_eq!(undetermined(&information), [true, true, false]);
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
            undetermined(&information) == [true, true]
        };
        assert!(is_flat(7e-10) && !is_flat(1.5e-9));
    }

    #[test]
    fn a_parameter_with_four_hundredths_of_a_flat_direction_takes_no_part_and_one_with_seven_does() {
        // The information I - v v' has the flat direction v; in units of single parameters its last component is 1.4 `last`.
        let parts = |last: f64| {
            let side = (0.5 * (1.0 - last * last)).sqrt();
            let v = [side, side, last];
            let mut information = Square::zero(3);
            for i in 0..3 {
                for j in 0..3 {
                    *information.at_mut(i, j) = f64::from(u8::from(i == j)) - v[i] * v[j];
                }
            }
            undetermined(&information)
        };
        assert_eq!((parts(0.028), parts(0.05)), (vec![true, true, false], vec![true; 3]));
    }
}
