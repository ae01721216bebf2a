//! Test of the event offsets for a period on the session clock, by periodograms.

use crate::evaluate::Lanes;
use crate::fit::{ChosenRecords, Fit};
use augsim_system::ScatterPer;
use rayon::prelude::*;

/// Number of slow frequencies that are tested: multiples of 1/(2 T) for events within a time span T.
const SLOW_FREQUENCIES: u32 = 2_000;
/// Fast frequencies that are tested, evenly spaced: first and last, Hz, and their number.
const FAST_FREQUENCIES: (f64, f64, u32) = (0.05, 30.0, 20_000);
/// Minimum number of event offsets (deviations of the events' parameter) for the test of a period.
const MIN_OFFSETS: usize = 16;

/// Deviation (offset) of the events' parameter at one event from its common value, with the time of the event
/// on the session clock.
struct Point {
    time: f64,
    /// The offset, and the offset times the strength of the event. A periodic motion of the surroundings
    /// would act in proportion to the strength.
    y: [f64; 2],
}

/// p-value of a period in the event offsets: deviations of the events' parameter from its common value.
///
/// It is the smallest p-value of least-squares periodograms (Lomb 1976; Zechmeister and Kürster 2009, with a
/// mean) of the offsets, and of the offsets times the strength of their events. Slow frequencies (multiples of
/// 1/(2 T) over a time span T) count as n independent tests for n offsets (Horne and Baliunas 1986); fast ones
/// (0.05 to 30 Hz) count singly.
pub(crate) fn p_value(sample: &ChosenRecords<'_>, fit: &Fit) -> f64 {
    let points = points(sample, fit);
    if points.len() < MIN_OFFSETS {
        return 1.0;
    }
    let (first, last) = points.iter().fold((f64::MAX, f64::MIN), |a, p| (a.0.min(p.time), a.1.max(p.time)));
    let slow = 0.5 / (last - first).max(1e-9);
    let n = points.len() as f64;
    let best = |frequencies: Vec<f64>| {
        frequencies.into_par_iter().map(|f| explained_share(&points, f)).reduce(|| 0.0, f64::max)
    };
    // Under white noise the explained share has a beta distribution.
    let tail = |share: f64| (1.0 - share).max(0.0).powf(0.5 * (n - 3.0));
    let step = (FAST_FREQUENCIES.1 - FAST_FREQUENCIES.0) / f64::from(FAST_FREQUENCIES.2);
    let p = [
        n * tail(best((1..=SLOW_FREQUENCIES).map(|k| slow * f64::from(k)).collect())),
        f64::from(FAST_FREQUENCIES.2)
            * tail(best((0..FAST_FREQUENCIES.2).map(|k| FAST_FREQUENCIES.0 + step * f64::from(k)).collect())),
    ];
    // Bonferroni correction for two frequency ranges and two forms.
    (4.0 * p[0].min(p[1])).min(1.0)
}

/// Collects the event offsets of a fit with their times on the session clock.
fn points(sample: &ChosenRecords<'_>, fit: &Fit) -> Vec<Point> {
    let shared = fit.hypothesis.scatter.is_some_and(|s| s.per == ScatterPer::Record);
    let schema = fit.hypothesis.system.schema();
    let strength = schema.event.as_ref().and_then(|e| e.periodic_scale_feature);
    let mut points = Vec::new();
    for (i, window) in sample.windows().into_iter().enumerate() {
        let record = window.record;
        let lanes = Lanes::new(&fit.hypothesis, window, &[]);
        let offsets = &fit.nuisance[i][lanes.state_nuisances()..];
        // An offset that all events of a record share counts once.
        let events = fit.events[i].iter().take(if shared { 1 } else { usize::MAX });
        let clock_s = schema.clock.and_then(|c| record.data.covariate(c)).unwrap_or(0.0);
        points.extend(offsets.iter().zip(events).map(|(&x, event)| Point {
            time: event.time_s + clock_s,
            y: [x, x * strength.map_or(1.0, |s| event.feature(s))],
        }));
    }
    points
}

/// Share of the variance that a sine of `frequency` Hz with a mean explains; the larger one of both forms in
/// [`Point`].
fn explained_share(points: &[Point], frequency: f64) -> f64 {
    let w = 2.0 * std::f64::consts::PI * frequency;
    let n = points.len() as f64;
    // Sums of cos, sin, cos², cos sin, sin²; then of y, y², y cos, y sin for each form.
    let mut basis = [0.0; 5];
    let mut data = [[0.0; 4]; 2];
    for p in points {
        let (sin, cos) = (w * p.time).sin_cos();
        for (sum, x) in basis.iter_mut().zip([cos, sin, cos * cos, cos * sin, sin * sin]) {
            *sum += x;
        }
        for (sums, y) in data.iter_mut().zip(p.y) {
            for (sum, x) in sums.iter_mut().zip([y, y * y, y * cos, y * sin]) {
                *sum += x;
            }
        }
    }
    let [c, s, cc, cs, ss] = basis;
    let (cc, cs, ss) = (cc - c * c / n, cs - c * s / n, ss - s * s / n);
    let determinant = cc * ss - cs * cs;
    if determinant <= 1e-6 * n * n {
        return 0.0;
    }
    let share = data.map(|[y, yy, yc, ys]| {
        let (yy, yc, ys) = (yy - y * y / n, yc - y * c / n, ys - y * s / n);
        (yc * yc * ss - 2.0 * yc * ys * cs + ys * ys * cc) / determinant / yy.max(1e-300)
    });
    share[0].max(share[1])
}
