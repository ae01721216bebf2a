//! When the library is not enough: laws of one feature as tables, added one by one.

use crate::addition::Addition;
use crate::candidates::{laws, may_join};
use crate::fit::Reach;
use crate::judged::Judged;
use crate::score::scores;
use crate::search::Search;
use rayon::prelude::*;

/// Most tables in one explanation.
const MOST_LAWS: usize = 3;
/// A further gain below this share of the gain so far is only the resolution of the knots.
const POLISH: f64 = 0.01;

/// The best explanation that may use tables, from several starts.
pub(crate) fn unlisted(search: &Search<'_>, base: &Judged, starts: &[Judged]) -> Option<Judged> {
    let found: Vec<Judged> = starts.par_iter().filter_map(|s| additive(search, base, s)).collect();
    found.into_iter().min_by(|a, b| a.criterion.total_cmp(&b.criterion))
}

fn additive(search: &Search<'_>, base: &Judged, start: &Judged) -> Option<Judged> {
    let mut now = start.clone();
    let mut added = false;
    for _ in 0..MOST_LAWS {
        let mut candidates = laws(search.train.data, &now.fit.events);
        if candidates.is_empty() {
            break;
        }
        candidates.extend(search.library.iter().cloned());
        candidates.retain(|a| may_join(a, &now.fit.hypothesis));
        let mut list = scores(&search.train, &now.fit, &candidates);
        list.sort_by(|a, b| (b.statistic - b.rank).total_cmp(&(a.statistic - a.rank)));
        // A table that gains too little is left off as soon as that is seen.
        let least = if added { POLISH * (base.criterion - now.criterion) } else { 0.0 };
        let reach = Reach(now.fit.cost - least.max(0.0));
        // The score is a quadratic forecast: the best two are fitted and compared.
        let trials: Vec<Judged> = list
            .into_iter()
            .filter(|s| s.statistic - s.rank > 6.0)
            .take(2)
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|s| {
                let mut additions = now.additions().to_vec();
                additions.push(s.addition.clone());
                // Directions that the data do not see have no estimate: start flat.
                let start = (s.addition.clone(), vec![0.0; s.estimate.len()]);
                search.refit_within(reach, &now.fit, &additions, &[start])
            })
            .collect();
        let Some(next) = trials.into_iter().min_by(|a, b| a.criterion.total_cmp(&b.criterion)) else {
            break;
        };
        let (gain, so_far) = (now.criterion - next.criterion, base.criterion - now.criterion);
        if gain <= 0.0 || (added && gain < POLISH * so_far) {
            break;
        }
        now = next;
        added = true;
    }
    if !now.additions().iter().any(|a| matches!(a, Addition::Table(_))) {
        return None;
    }
    // Drop what is no longer needed.
    loop {
        let n = now.additions().len();
        let dropped: Vec<Judged> = (0..n)
            .into_par_iter()
            .filter_map(|i| {
                let mut rest = now.additions().to_vec();
                let gone = rest.remove(i);
                let orphan = rest.iter().any(|a| a.acts_through(&gone));
                let is_scatter = matches!(gone, Addition::Scatter(_));
                let most = now.fit.cost + search.penalty(&gone);
                let reach = if is_scatter { Reach::ANY } else { Reach(most) };
                (!orphan && !rest.is_empty()).then(|| search.refit_within(reach, &now.fit, &rest, &[]))
            })
            .collect();
        match dropped.into_iter().min_by(|a, b| a.criterion.total_cmp(&b.criterion)) {
            Some(d) if d.criterion < now.criterion => now = d,
            _ => break,
        }
    }
    now.additions().iter().any(|a| matches!(a, Addition::Table(_))).then_some(now)
}
