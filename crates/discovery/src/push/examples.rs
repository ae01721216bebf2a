//! Held-out pushes with the forecasts of the declared and of the augmented model, to be looked at.

use super::error_table::Lists;
use super::evaluate::plain;
use super::fit::Fit;
use super::hypothesis::Hypothesis;
use super::measured::{Measured, Record, Window};
use super::scene::PushScene;
use crate::examples::{finite, ranked, stride};
use crate::result::{Example, ExampleChannel};
use augsim_physics::model::PushModel;
use augsim_physics::push::ROD_RADIUS;

/// Corners of a drawn outline that is no polygon.
const SIDES: usize = 48;
/// Channels of a pose: columns and units.
const CHANNELS: [(&str, &str); 3] = [("x_m", "m"), ("y_m", "m"), ("theta_rad", "rad")];

/// The rod's centre at a time, m: linear between its samples, at rest outside them.
fn rod_at(r: &Record, t: f64) -> [f64; 2] {
    let last = r.rod_time.len() - 1;
    let k = r.rod_time.partition_point(|&s| s <= t).clamp(1, last.max(1)) - 1;
    let next = (k + 1).min(last);
    let span = r.rod_time[next] - r.rod_time[k];
    let u = if span > 0.0 { ((t - r.rod_time[k]) / span).clamp(0.0, 1.0) } else { 0.0 };
    [&r.rod_x, &r.rod_y].map(|z| z[k] + u * (z[next] - z[k]))
}

/// The best, the median and the worst held-out forecast of a table of errors; the fits are the calibrated and the best model.
pub(crate) fn examples(
    model: &PushModel,
    data: &Measured,
    lists: &Lists,
    [_, best]: [&Fit; 2],
) -> Vec<Example> {
    let declared = Hypothesis::new(model, &data.groups, &[]);
    let nominal = declared.start();
    let (windows, errors) = lists.by_window();
    let one = |(place, rank): (usize, &str)| {
        let w: &Window = &windows[place];
        let r = &data.records[w.record];
        let seen = &r.pose[w.first..=w.last];
        let before = plain(&declared, &nominal, seen[0], r, w);
        let after = plain(&best.hypothesis, &best.theta, seen[0], r, w);
        let step = stride(seen.len());
        let shown = |poses: &[[f64; 3]], c: usize| poses.iter().step_by(step).map(|p| finite(p[c])).collect();
        let channels = CHANNELS.iter().enumerate().map(|(c, (column, unit))| ExampleChannel {
            column: (*column).into(),
            unit: (*unit).into(),
            measured: shown(seen, c),
            declared: shown(&before, c),
            augmented: shown(&after, c),
        });
        let times_s: Vec<f64> = r.time[w.first..=w.last].iter().step_by(step).copied().collect();
        let values = best.hypothesis.filled(&best.theta, r.group);
        let rod_m = times_s.iter().map(|&t| rod_at(r, t)).collect();
        Example {
            id: r.name(w),
            rank: rank.into(),
            rmse: errors[place],
            known: 1,
            channels: channels.collect(),
            scene: Some(PushScene {
                outline_m: best.hypothesis.world.object().outline.polygon(SIDES).vertices().to_vec(),
                rod_m,
                rod_radius_m: values[ROD_RADIUS],
            }),
            times_s,
        }
    };
    ranked(&errors).into_iter().map(one).collect()
}
