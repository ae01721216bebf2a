//! A state that stops where the sensor that reads it ends.
//!
//! Readings that stand still at the end of a declared range say that the value is there or beyond. A state that stops there explains
//! them as well, and leaves at once where one that went on beyond is late. Over short windows, each of which begins where the data
//! are, that hardly shows; free runs tell the two apart.

use crate::Progress;
use crate::addition::Addition;
use crate::candidates::{Family, may_join};
use crate::decide::{Decided, settle};
use crate::fit::{Reach, fit_nuisance};
use crate::long_search::back;
use crate::longer::fit_joined;
use crate::prepare::Prepared;
use crate::scan::with_one_more;
use crate::search::Search;
use augsim_data::Dataset;
use augsim_physics::model::Per;
use augsim_physics::system::System;

/// Readings at the end of a sensor from which on it is a plateau, and no lone sample.
const PLATEAU: usize = 5;

/// The answer `decided` with every stop of a state at the end of its sensor under which free runs are better. A stop takes the place
/// of that end and is no further law: it joins however many there are.
pub(crate) fn with_stops(
    prepared: &Prepared,
    readings: &Dataset,
    decided: Decided,
    family: Family,
    progress: &mut dyn FnMut(Progress),
) -> Decided {
    let search = Search::on(prepared, family);
    let mut decided = decided;
    for (stop, end) in stops(search.system(), readings) {
        if !may_join(&stop, &decided.best.fit.hypothesis) {
            continue;
        }
        let mut set = match search.over_longer_windows(&decided.best) {
            None => search.plus(Reach::ANY, &decided.best.fit, &[(stop, vec![end])]),
            Some((longer, joined)) => {
                let (h, theta) = with_one_more(&search.train, &longer.fit, &stop, &[end]);
                let begun = fit_nuisance(&search.train, &h, &theta, &[]);
                back(&search, &search.judge(fit_joined(&search.train, &begun, joined)), joined)
            }
        };
        if set.is_finite() && search.runs_worse(&decided.best, &set) {
            set.heldout_ll = Some(search.heldout(&set).ll);
            let Decided { mut found, base, .. } = decided;
            found.pool.push(set.clone());
            decided = settle(&search, found, base, set, false, progress);
        }
    }
    decided
}

/// Effects that stop a state where the sensor that reads it ends and several readings stand, each with that value.
fn stops(system: &dyn System, readings: &Dataset) -> Vec<(Addition, f64)> {
    let of = |index: usize| {
        let end = system.end_of_sensor(index)?;
        let all = readings.series(&system.schema().channels[end.channel].column).ok()?;
        let standing = all.flatten().filter(|reading| end.is_at(**reading)).count();
        let stop = Addition::effect(system, index, Per::All)?;
        (standing >= PLATEAU).then_some((stop, end.value))
    };
    (0..system.library().len()).filter_map(of).collect()
}
