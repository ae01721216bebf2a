//! How the best classes gain from more training data.

use super::rows::{Row, Scored};
use super::runs::Runs;
use crate::experiment::data::part;
use augsim_trainer::{Recipe, Sequences};

/// Classes whose gain from data is shown.
const BEST: usize = 5;

/// Training sets of growing size.
#[derive(Debug)]
pub struct Sizes<'a> {
    /// The trajectories that each set is the first of.
    pub pool: &'a Sequences,
    /// How many each set has, rising.
    pub counts: &'static [usize],
    /// Seeds of every class at each size.
    pub seeds: u64,
}

impl Sizes<'_> {
    /// Rows on the first test set of the classes that are best there by the deciding score, one a class and size, with the settings that were
    /// chosen for the table; `None` if the user stopped it. The table's own row stands where its size is one of them.
    pub fn rows(&self, runs: &Runs<'_>, table: &[Scored]) -> anyhow::Result<Option<Vec<Row>>> {
        let mut out = Vec::new();
        for (recipe, own) in best(table) {
            let factors = own.row.factors();
            for &count in self.counts {
                let row = if own.row.trained_on == Some(count) {
                    Some(own.row.clone())
                } else {
                    runs.at_size(recipe, factors, &part(self.pool, 0, count), self.seeds)?
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

/// The best recipes on the first test set of a table, best first, with their rows there.
fn best(table: &[Scored]) -> Vec<(Recipe, &Scored)> {
    let first = table.first().map(|s| s.row.set.as_str());
    let here = table.iter().filter(|s| Some(s.row.set.as_str()) == first);
    let mut all: Vec<(Recipe, &Scored)> = here.filter_map(|s| Some((s.recipe?, s))).collect();
    all.sort_by(|(_, a), (_, b)| a.mean_crps().total_cmp(&b.mean_crps()));
    all.truncate(BEST);
    all
}

#[cfg(test)]
mod tests {
    //! Contract: the best are those of the first set with a recipe, by the deciding score and not by their order in the table.
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
    fn five_trained_classes_of_the_first_set_are_best() {
        let recipes: Vec<Recipe> = Recipe::all().take(6).collect();
        let mut table = vec![scored("Physics", "test", None, 0.1)];
        for (k, recipe) in recipes.iter().enumerate() {
            table.push(scored(recipe.label(), "test", Some(*recipe), 6.0 - k as f64));
            table.push(scored(recipe.label(), "rect1 on pu", Some(*recipe), 0.01));
        }
        let found: Vec<Recipe> = best(&table).into_iter().map(|(recipe, _)| recipe).collect();
        let wanted: Vec<Recipe> = recipes.into_iter().rev().take(5).collect();
        assert_eq!(found, wanted);
    }
}
