//! Learning curves (error over the size of the training set) of the best model classes.

use super::rows::{Row, Scored};
use super::runs::Runs;
use crate::experiment::data::part;
use augsim_trainer::{Recipe, Sequences};

/// Number of best model classes that get a learning curve.
const BEST_CLASSES: usize = 5;

/// Training sets of increasing size for the learning curves.
#[derive(Debug)]
pub struct Sizes<'a> {
    /// Pool of trajectories; each training set consists of its first ones.
    pub pool: &'a Sequences,
    /// Numbers of trajectories of the training sets, ascending.
    pub counts: &'static [usize],
    /// Number of seeds per model class and size.
    pub seeds: u64,
}

impl Sizes<'_> {
    /// Returns the learning-curve rows of the best classes on the first test set; `None` if interrupted.
    ///
    /// There is one row per class and size, trained with the settings chosen for the table. A row of the
    /// table is reused if its size matches.
    pub fn rows(&self, runs: &Runs<'_>, table: &[Scored]) -> anyhow::Result<Option<Vec<Row>>> {
        let mut out = Vec::new();
        for (recipe, table_row) in best(table) {
            let factors = table_row.row.factors();
            for &count in self.counts {
                let row = if table_row.row.trained_on == Some(count) {
                    Some(table_row.row.clone())
                } else {
                    runs.train_at_size(recipe, factors, &part(self.pool, 0, count), self.seeds)?
                };
                match row {
                    Some(row) => out.push(row),
                    None => return Ok(None),
                }
            }
        }
        Ok(Some(out))
    }
}

/// Returns the best trained model classes on the first test set with their rows, best first.
fn best(table: &[Scored]) -> Vec<(Recipe, &Scored)> {
    let first = table.first().map(|s| s.row.set.as_str());
    let here = table.iter().filter(|s| Some(s.row.set.as_str()) == first);
    let mut all: Vec<(Recipe, &Scored)> = here.filter_map(|s| Some((s.recipe?, s))).collect();
    all.sort_by(|(_, a), (_, b)| a.mean_crps().total_cmp(&b.mean_crps()));
    all.truncate(BEST_CLASSES);
    all
}

#[cfg(test)]
mod tests {
    //! Contract: the best classes are the trained ones with the smallest CRPS on the first set.
    use super::*;
    use std::collections::BTreeMap;

    fn scored(model: &str, set: &str, recipe: Option<Recipe>, crps: f64) -> Scored {
        let row = Row {
            model: model.to_owned(),
            set: set.to_owned(),
            seeds: 1,
            figures: BTreeMap::new(),
            crps_ci95: None,
            parameters: None,
            trained_on: None,
            tried: Vec::new(),
            cpu_s: None,
            microseconds: None,
        };
        Scored { row, recipe, crps: vec![crps, crps] }
    }

    #[test]
    fn selects_five_trained_classes_of_the_first_set() {
        let recipes: Vec<Recipe> = Recipe::all().take(6).collect();
        let mut table = vec![scored("Physics", "test", None, 0.1)];
        for (k, recipe) in recipes.iter().enumerate() {
            table.push(scored(recipe.label(), "test", Some(*recipe), 6.0 - k as f64));
            table.push(scored(recipe.label(), "rect1 on pu", Some(*recipe), 0.01));
        }
        let found: Vec<Recipe> = best(&table).into_iter().map(|(recipe, _)| recipe).collect();
        let expected: Vec<Recipe> = recipes.into_iter().rev().take(5).collect();
        assert_eq!(found, expected);
    }
}
