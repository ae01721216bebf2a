//! Terms that noise of the motion explains as well.
//!
//! Over windows every misfit counts as one of the sensor. Where the motion is shaken, misfits grow and drift along a window, and a
//! ripple or a slow swing follows them better than none does, however little it is there. A filter under which the motion may be
//! shaken foretells each reading from those before it: what it foretells no better with a term than without is no work of that term.

use crate::addition::Addition;
use crate::decide::{Decided, settle};
use crate::explore::place_of;
use crate::forecast::first_rmse;
use crate::free_runs::whole;
use crate::grammar::has_grammar;
use crate::judged::Judged;
use crate::options::Progress;
use crate::record::Measured;
use crate::search::{CLEARLY, Search};
use crate::supported::without;
use augsim_calibrate::{Cause, ln_likelihood_if_shaken, smooth};
use augsim_physics::system::Record as Seen;
use rayon::prelude::*;

/// Samples that are filtered: so many tell a law from noise.
const MOST_SAMPLES: usize = 4_000;

/// The beginnings of recordings, to be filtered.
struct Readings {
    records: Vec<Seen>,
    declared: Vec<Option<f64>>,
}

/// The answer without the terms that readings do not speak for where the motion may be shaken, the least supported first. A term
/// stays where held-out windows are forecast clearly worse without it: it is slow, and a shaken motion takes its place from reading to
/// reading. Where
/// the best set leaves nothing but noise of the sensor, and where nothing can be filtered, it stays as it is.
pub(crate) fn without_what_noise_explains(
    search: &Search<'_>,
    decided: Decided,
    progress: &mut dyn FnMut(Progress),
) -> Decided {
    let Some(readings) = Readings::of(search.train.data) else { return decided };
    if decided.best.additions().is_empty() || !readings.are_shaken(&decided.best) {
        return decided;
    }
    let Decided { mut found, base, mut best, .. } = decided;
    while !best.additions().is_empty() {
        let rests: Vec<Vec<Addition>> =
            (0..best.additions().len()).map(|number| without(best.additions(), number)).collect();
        let less: Vec<Judged> = rests
            .iter()
            .map(|rest| match rest.is_empty() {
                true => base.clone(),
                false => place_of(search, &mut found, &best, rest),
            })
            .collect();
        let Some(full) = readings.ln_likelihood(&best) else { break };
        let gone = |less: &Judged| {
            let size = |judged: &Judged| judged.additions().iter().map(|a| search.size(a)).sum::<f64>();
            let needed = 0.5 * search.quantile(size(&best) - size(less));
            Some(full - readings.ln_likelihood(less)? - needed)
        };
        let margins: Vec<Option<f64>> = less.par_iter().map(gone).collect();
        let mut list: Vec<(Judged, f64)> =
            less.into_iter().zip(margins).filter_map(|(less, margin)| Some((less, margin?))).collect();
        list.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut untold = list.into_iter().take_while(|(_, margin)| *margin < 0.0);
        match untold.find(|(less, _)| !forecasts_clearly_worse(search, less, &best)) {
            Some((less, _)) => best = less,
            None => break,
        }
    }
    settle(search, found, base, best, !has_grammar(search.system()), progress)
}

/// Whether a part of a set forecasts the held-out part clearly worse than the set does.
fn forecasts_clearly_worse(search: &Search<'_>, part: &Judged, set: &Judged) -> bool {
    let [part, set] = [part, set].map(|judged| first_rmse(&search.test, &judged.fit));
    set < CLEARLY * part
}

impl Readings {
    /// The first samples of the recordings of data; nothing where fits see no recording in several windows, or where values differ
    /// from group to group.
    fn of(data: &Measured) -> Option<Self> {
        let mut left = MOST_SAMPLES;
        let mut records = Vec::new();
        for index in 0..data.recordings.len() {
            let whole = whole(data, index, |_| true);
            let mut seen = whole.seen;
            let samples = seen.times.len().min(left);
            if samples < 2 {
                break;
            }
            left -= samples;
            for (values, weights) in seen.values.iter_mut().zip(&whole.weight) {
                values.iter_mut().zip(weights).filter(|(_, w)| **w == 0.0).for_each(|(v, _)| *v = f64::NAN);
                values.truncate(samples);
            }
            seen.times.truncate(samples);
            seen.windows.iter_mut().for_each(|window| window.samples = 0..samples);
            records.push(seen);
        }
        let declared = data.system.schema().channels.iter().map(|c| c.sd).collect();
        (!records.is_empty() && data.groups.len() == 1).then_some(Self { records, declared })
    }

    /// Whether readings differ from runs of a set by more than noise of the sensor.
    fn are_shaken(&self, judged: &Judged) -> bool {
        let fit = &judged.fit;
        let values = fit.hypothesis.values_at(&fit.theta, 0);
        let Some((shown, pushed)) = fit.hypothesis.system.with_states_shown() else { return false };
        let found = smooth(&*shown, self.declared.len(), &self.records, &values, &pushed, &self.declared);
        found.is_ok_and(|found| found.cause == Cause::Motion)
    }

    /// Ln likelihood of the readings where the motion of a set is shaken; nothing where that cannot be said.
    fn ln_likelihood(&self, judged: &Judged) -> Option<f64> {
        let fit = &judged.fit;
        let values = fit.hypothesis.values_at(&fit.theta, 0);
        let (shown, pushed) = fit.hypothesis.system.with_states_shown()?;
        let outputs = self.declared.len();
        let found =
            ln_likelihood_if_shaken(&*shown, outputs, &self.records, &values, &pushed, &self.declared)
                .ok()?;
        found.is_finite().then_some(found)
    }
}
