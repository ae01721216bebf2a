//! Results of the stages of the loop.

use crate::columns::Family;
use crate::judge::{Judgement, Remainder};
use crate::prepare::Prepared;
use crate::records::View;
use crate::result::Verdict;
use crate::scattered::Scattered;
use crate::score::Scored;
use crate::search::{Found, Search, run};

/// Result of a search, with its data.
pub(crate) struct Searched {
    pub view: View,
    pub families: Vec<Family>,
    pub found: Found,
}

impl Searched {
    pub fn search(&self, prepared: &Prepared) -> Search<'_> {
        Search::new(&self.view, &self.families, &prepared.clock)
    }
}

/// Findings of the search, and the remainder.
pub(crate) struct Judged {
    pub judgement: Judgement,
    /// Number of the named set with laws of one quantity, where there are some.
    pub best: usize,
    pub scattered: Option<Scattered>,
    pub left: Remainder,
    pub verdict: Verdict,
    /// Why the data are not those of the declared system.
    pub doubt: Option<String>,
}

/// A search on data in these windows, from the calibrated model and known sets.
pub(crate) fn searched_on(
    prepared: &Prepared,
    view: View,
    families: &[Family],
    base: Scored,
    known: Vec<Scored>,
    told: &mut dyn FnMut(f64),
) -> Searched {
    let found = run(&Search::new(&view, families, &prepared.clock), base, known, told);
    Searched { view, families: families.to_vec(), found }
}
