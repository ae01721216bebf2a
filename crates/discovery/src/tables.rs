//! Tables where formulas end.

use crate::Progress;
use crate::adequacy::adequacy;
use crate::candidates::Family;
use crate::decide::{Decided, verdict_on_tables, widen};
use crate::prepare::{Prepared, misfit};
use crate::search::Search;

/// Ratio of misfits over held-out windows up to which a formula is as good as a table: a law that can be written down comes first.
const AS_GOOD_AS_A_TABLE: f64 = 1.1;

/// The answer with a table in the place of formulas, or beside them, where none of these comes near what a table does.
pub(crate) fn beyond_formulas(
    prepared: &Prepared,
    decided: Decided,
    family: Family,
    progress: &mut dyn FnMut(Progress),
) -> Decided {
    progress(Progress::Unlisted);
    let mut search = Search::on(prepared, family);
    // Effects and formulas had their turn.
    let library = std::mem::take(&mut search.library);
    let Some(wider) = widen(&search, &decided.base, &decided.best) else { return decided };
    search.library = library;
    let [left, was] = [&wider, &decided.best].map(|j| misfit(&search.test, search.heldout(j)));
    if is_as_good_as_a_table(&was, &left) || search.runs_worse(&wider, &decided.best) {
        return decided;
    }
    let tests = adequacy(&search, &wider, &decided.found.tried, None);
    Decided { tests, verdict: verdict_on_tables(&wider), best: wider, severe: false, ..decided }
}

/// Whether misfits of channels are no more than a little larger than those of a table: their root mean square ratio.
fn is_as_good_as_a_table(misfits: &[f64], of_table: &[f64]) -> bool {
    let squares = misfits.iter().zip(of_table).map(|(a, b)| (a / b).powi(2)).sum::<f64>();
    squares <= AS_GOOD_AS_A_TABLE * AS_GOOD_AS_A_TABLE * misfits.len() as f64
}

#[cfg(test)]
mod tests {
    //! Contract: a formula that misses by a tenth more than a table is kept, one that misses by more gives way.
    use super::*;

    #[test]
    fn a_formula_that_comes_near_is_kept() {
        assert!(is_as_good_as_a_table(&[1.09, 2.18], &[1.0, 2.0]));
        assert!(!is_as_good_as_a_table(&[1.12, 2.24], &[1.0, 2.0]));
        assert!(!is_as_good_as_a_table(&[f64::NAN], &[1.0]));
    }
}
