//! Joint uncertainty of the fitted parameters: the `[covariance]` section that `fit` and `discover` write.
//!
//! Intervals alone would let parameters that compensate for each other, such as a loss and a table of the same
//! quantity, vary independently, and prediction bands would be far too wide.

use super::Model;
use super::entries::section;
use super::toml_reader::Item;
use crate::error::ModelError;
use crate::limits;

/// Share of a variance below which its part not explained by other parameters counts as 0 (rounding error).
const ROUNDING_RATIO: f64 = 1e-12;

/// Covariance matrix of the fitted parameters.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Covariance {
    /// Index in the model of the parameter of each row.
    pub parameters: Vec<usize>,
    /// Covariance matrix, `[parameter][parameter]`; each element has the product of the two parameters' units.
    pub rows: Vec<Vec<f64>>,
}

impl Covariance {
    /// Lower Cholesky factor of the matrix, `[parameter][number of the normal draw]`.
    ///
    /// For a singular matrix, some columns are zero.
    pub fn factor(&self) -> Vec<Vec<f64>> {
        let n = self.rows.len();
        let mut factor = vec![vec![0.0; n]; n];
        for j in 0..n {
            let left = self.rows[j][j] - (0..j).map(|k| factor[j][k] * factor[j][k]).sum::<f64>();
            if left.is_nan() || left <= ROUNDING_RATIO * self.rows[j][j] {
                continue;
            }
            let diagonal = left.sqrt();
            for i in j..n {
                let dot: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                factor[i][j] = (self.rows[i][j] - dot) / diagonal;
            }
        }
        factor
    }
}

/// Reads the `[covariance]` section of a model whose parameters and effects are read already.
pub(super) fn read(file: &Item<'_, '_>, model: &Model) -> Result<Option<Covariance>, ModelError> {
    let entries = section(file, "covariance", "rows of [covariance]", limits::MAX_PARAMETERS)?;
    if entries.is_empty() {
        return Ok(None);
    }
    let count = entries.len();
    let mut found = Covariance::default();
    for (name, item) in entries {
        let stale = "a parameter of the model; [covariance] is written by a fit: remove it after an edit";
        found.parameters.push(model.parameter(name).ok_or_else(|| item.wrong(stale))?);
        let row = item.numbers("a list of numbers, one for each row of [covariance]")?;
        if row.len() != count {
            return Err(item.wrong("a list of numbers, one for each row of [covariance]"));
        }
        found.rows.push(row);
    }
    Ok(Some(found))
}

#[cfg(test)]
mod tests {
    //! Contract: the factor times its transpose is the matrix, also of a singular one; a section reads back as
    //! it was written.
    use super::*;

    #[test]
    fn factors_reproduce_the_matrix() {
        for rows in [vec![vec![4.0, 2.0], vec![2.0, 5.0]], vec![vec![1.0, -2.0], vec![-2.0, 4.0]]] {
            let covariance = Covariance { parameters: vec![0, 1], rows: rows.clone() };
            let factor = covariance.factor();
            for i in 0..2 {
                for j in 0..2 {
                    let product: f64 = (0..2).map(|k| factor[i][k] * factor[j][k]).sum();
                    assert!((product - rows[i][j]).abs() < 1e-12, "{factor:?}");
                }
            }
        }
    }

    #[test]
    fn the_section_reads_back_and_a_stale_one_is_refused() {
        let mut model = crate::model::parse(crate::example("pendulum").unwrap(), "pendulum.toml").unwrap();
        model.covariance =
            Some(Covariance { parameters: vec![0, 1], rows: vec![vec![1.0, 0.5], vec![0.5, 2.0]] });
        let text = model.to_toml().unwrap();
        assert_eq!(crate::model::parse(&text, "pendulum.toml").unwrap().covariance, model.covariance);
        let stale = format!("{text}\n").replace("[covariance]", "[covariance]\ngone = [1.0, 2.0, 3.0]");
        let error = crate::model::parse(&stale, "pendulum.toml").unwrap_err().to_string();
        assert!(error.contains("remove it after an edit"), "{error}");
        model.covariance = None;
        assert!(!model.to_toml().unwrap().contains("covariance"));
    }
}
