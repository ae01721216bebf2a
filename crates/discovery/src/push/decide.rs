//! From pushes for training and pushes held out to an answer.

use super::evaluate::Piece;
use super::fit::{Fit, Sample, fit, fit_starts};
use super::measured::Measured;
use super::ranking::Ranking;
use super::scatter::{Scatter, kept, scatter};
use super::search::{Judged, Search};
use augsim_physics::model::PushModel;

/// Pushes of a first search, at least.
const FEW: usize = 30;

/// What a search came to, refitted without the windows that neither the calibrated nor the best model follows.
pub(crate) struct Decided<'a> {
    pub search: Search<'a>,
    /// Place of the answer in what was tried.
    pub best: usize,
    pub ranking: Ranking,
    /// Kinds that were fitted beside the answer and did not pay.
    pub rejected: Vec<&'static str>,
    /// Windows left out: training, held out.
    pub outliers: [usize; 2],
    /// How the pushes differ from each other.
    pub scatter: Option<Scatter>,
}

impl Decided<'_> {
    /// The calibrated and the best model as fitted to the training part.
    pub fn fits(&self) -> [&Fit; 2] {
        [&self.search.tried[0].fit, &self.search.tried[self.best].fit]
    }

    /// Gain in ln likelihood on the held-out part.
    pub fn heldout_gain(&self) -> f64 {
        self.search.heldout_gain(&self.search.tried[self.best]).unwrap_or(0.0)
    }
}

impl<'a> Decided<'a> {
    /// The windows of both parts.
    pub fn everything(&self) -> Sample<'a> {
        let s = &self.search;
        Sample { windows: [&s.train.windows[..], &s.test.windows[..]].concat(), ..s.train.clone() }
    }

    /// The calibrated and the best model, fitted to `everything`.
    pub fn refitted(&self, everything: &Sample<'_>) -> [Fit; 2] {
        self.fits().map(|f| fit(everything, &f.hypothesis, &f.theta, &[]))
    }
}

/// Windows of some pushes.
pub(crate) fn sample<'a>(measured: &'a Measured, chosen: &[usize]) -> Sample<'a> {
    let windows = chosen.iter().flat_map(|&i| measured.records[i].windows(i)).collect();
    Sample { data: measured, windows, bend: f64::INFINITY, by_push: false }
}

/// A finished search on the pushes `train`, judged on `test`.
pub(crate) fn searched<'a>(
    model: &'a PushModel,
    measured: &'a Measured,
    train: &[usize],
    test: &[usize],
    told: &mut dyn FnMut() -> bool,
) -> Search<'a> {
    let few = few(model, measured, train, told);
    let mut search = Search::new(model, sample(measured, train), sample(measured, test), few.as_ref());
    search.run(told);
    if let Some(kept) = kept(&search, search.best()) {
        search.by_push(&kept);
    }
    search
}

/// The answer at `best` of what a search tried.
pub(crate) fn settled(mut search: Search<'_>, best: usize) -> Decided<'_> {
    let ranking = Ranking::of(&search, best);
    let rejected = search.rejected(best);
    let mut scatter = scatter(&search, best);
    let mut out = [
        outliers(&search.train, [&search.base().fit, &search.tried[best].fit]),
        outliers(
            &search.test,
            [&search.tried[0], &search.tried[best]].map(|j| j.held.as_ref().unwrap_or(&j.fit)),
        ),
    ];
    if let Some(found) = &mut scatter {
        // A push that is far from the others is not left out for that.
        let beyond = |p: &Piece| p.q > search.train.bend * p.m as f64;
        for (out, pieces) in out.iter_mut().zip(&mut found.pieces) {
            out.iter_mut().zip(&*pieces).for_each(|(out, piece)| *out &= beyond(piece));
            let mut of = out.iter();
            pieces.retain(|_| of.next() == Some(&false));
        }
    }
    search.train = without(&search.train, &out[0]);
    search.test = without(&search.test, &out[1]);
    for i in [0, best] {
        let old = &search.tried[i].fit;
        let again = fit(&search.train, &old.hypothesis, &old.theta, &[]);
        let held = fit_starts(&search.test, &again.hypothesis, &again.theta);
        search.tried[i] = Judged { held: Some(held), ..search.judged(again) };
    }
    let outliers = out.map(|o| o.iter().filter(|x| **x).count());
    Decided { search, best, ranking, rejected, outliers, scatter }
}

/// A search on a part of the pushes for training, which finds what is large; none where there are not many.
fn few<'a>(
    model: &'a PushModel,
    measured: &'a Measured,
    train: &[usize],
    told: &mut dyn FnMut() -> bool,
) -> Option<Search<'a>> {
    let stride = train.len() / FEW;
    if stride < 2 {
        return None;
    }
    let chosen: Vec<usize> = train.iter().copied().step_by(stride).collect();
    let mut search = Search::new(model, sample(measured, &chosen), sample(measured, &[]), None);
    search.explore(told);
    Some(search)
}

/// A sample without the windows marked.
pub(crate) fn without<'a>(sample: &Sample<'a>, out: &[bool]) -> Sample<'a> {
    let windows = sample.windows.iter().zip(out).filter(|(_, o)| !**o).map(|(w, _)| *w).collect();
    Sample { windows, ..sample.clone() }
}

/// Windows that both fits leave beyond the bend.
pub(crate) fn outliers(sample: &Sample<'_>, fits: [&Fit; 2]) -> Vec<bool> {
    let beyond = |f: &Fit, i: usize| f.pieces[i].q > sample.bend * f.pieces[i].m as f64;
    (0..sample.windows.len()).map(|i| fits.iter().all(|f| beyond(f, i))).collect()
}
