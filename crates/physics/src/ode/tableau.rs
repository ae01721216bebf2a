//! Coefficients of the Runge-Kutta pair of order 5(4) that integrates equations, and its dense output.
//!
//! Source: Tsitouras, Runge-Kutta pairs of order 5(4) satisfying only the first column simplifying
//! assumption, Comput. Math. Appl. 62 (2011) 770. Fifth order at the ends of a step, an interpolant of fourth
//! order within it. The last stage is the first one of the next step.

/// Number of stages of a step.
pub(super) const STAGES: usize = 7;

/// Times of the stages, as fractions of the step.
pub(super) const NODES: [f64; STAGES] = [0.0, 0.161, 0.327, 0.9, 0.980_025_540_904_509_7, 1.0, 1.0];

/// Weights of the earlier stages' rates in each stage; the last row gives the result of the step.
pub(super) const STAGE_WEIGHTS: [&[f64]; STAGES] = [
    &[],
    &[0.161],
    &[-0.008_480_655_492_356_989, 0.335_480_655_492_357],
    &[2.897_153_057_105_493_5, -6.359_448_489_975_075, 4.362_295_432_869_581_5],
    &[5.325_864_828_439_257, -11.748_883_564_062_828, 7.495_539_342_889_836_5, -0.092_495_066_361_755_25],
    &[
        5.861_455_442_946_42,
        -12.920_969_317_847_11,
        8.159_367_898_576_159,
        -0.071_584_973_281_401,
        -0.028_269_050_394_068_383,
    ],
    &[
        0.096_460_766_818_065_23,
        0.01,
        0.479_889_650_414_499_6,
        1.379_008_574_103_742,
        -3.290_069_515_436_081,
        2.324_710_524_099_774,
    ],
];

/// Weights of the stages' rates in the error estimate, the difference of fifth and fourth order.
pub(super) const ERROR_WEIGHTS: [f64; STAGES] = [
    -0.001_780_011_052_225_777,
    -0.000_816_434_459_656_746_9,
    0.007_880_878_010_261_995,
    -0.144_711_007_173_262_9,
    0.582_357_165_452_555_2,
    -0.458_082_105_929_187,
    1.0 / 66.0,
];

/// Coefficients of θ, θ², θ³ and θ⁴ in the weight of each stage at the fraction θ of a step.
pub(super) const DENSE: [[f64; 4]; STAGES] = [
    [1.0, -2.763_706_197_274_826, 2.913_255_461_821_912_6, -1.053_088_497_729_021_6],
    [0.0, 0.1317, -0.2234, 0.1017],
    [0.0, 3.930_296_236_894_751_6, -5.941_033_872_131_505, 2.490_627_285_651_253],
    [0.0, -12.411_077_166_933_676, 30.338_188_630_282_32, -16.548_102_889_244_902],
    [0.0, 37.509_313_416_511_04, -88.178_904_894_766_4, 47.379_521_962_819_28],
    [0.0, -27.896_526_289_197_286, 65.091_894_674_793_66, -34.870_657_861_496_61],
    [0.0, 1.5, -4.0, 2.5],
];

#[cfg(test)]
mod tests {
    //! Contract: the coefficients satisfy conditions that a wrong digit violates.
    //!
    //! The weights of every stage sum to its node, both orders agree on quadrature up to the third power, and
    //! the dense output ends at the result of the step.
    use super::*;

    #[test]
    fn every_stage_stands_at_its_node() {
        for (weights, node) in STAGE_WEIGHTS.iter().zip(NODES) {
            assert!((weights.iter().sum::<f64>() - node).abs() < 1e-14, "{node}");
        }
    }

    #[test]
    fn the_step_is_exact_for_quadrature_and_its_error_vanishes_there() {
        let last = STAGE_WEIGHTS[STAGES - 1];
        for power in 0..5 {
            let sum =
                |weights: &[f64]| -> f64 { weights.iter().zip(NODES).map(|(w, c)| w * c.powi(power)).sum() };
            assert!((sum(last) - 1.0 / f64::from(power + 1)).abs() < 1e-14, "{power}");
            if power < 4 {
                assert!(sum(&ERROR_WEIGHTS).abs() < 1e-14, "{power}: {}", sum(&ERROR_WEIGHTS));
            }
        }
    }

    #[test]
    fn the_dense_output_ends_where_the_step_does() {
        for (stage, weights) in DENSE.iter().enumerate() {
            let end = STAGE_WEIGHTS[STAGES - 1].get(stage).copied().unwrap_or(0.0);
            assert!((weights.iter().sum::<f64>() - end).abs() < 1e-13, "{stage}");
        }
    }
}
