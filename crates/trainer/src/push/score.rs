//! Errors of forecasts of pushes.
//!
//! All errors are of poses in the frame of the data (that of the robot's base); Euclidean and angular errors are
//! the same in every frame, the published percentages are not: they divide by the position in the robot's frame.

use crate::score::{PAPER_SAMPLES, crps_of, quantile};
use crate::{Forecaster, SAMPLES, Samples, Sequence, Sequences, Task, TrainerError};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Parts of a push for [`PushScore::over_push`].
pub const PARTS: usize = 10;

/// Errors of one point estimate: means over the samples after the first of each push, then over the pushes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PushError {
    /// Sum of position errors over sum of distances from the origin of the data's frame, per cent (the published
    /// measure where this is the robot's base).
    pub trans_percent: f64,
    /// Sum of position errors over sum of distances from the first position, over all pushes, per cent.
    pub moved_percent: f64,
    /// Euclidean error of the position, mm.
    pub pos_mm: f64,
    /// Absolute error of the angle, degrees.
    pub rot_deg: f64,
    /// Euclidean error of the last position, mm.
    pub end_pos_mm: f64,
    /// Absolute error of the last angle, degrees.
    pub end_rot_deg: f64,
}

/// Scores of one or many pushes.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PushScore {
    /// Pushes.
    pub pushes: usize,
    /// Mean of all samples.
    pub mean: PushError,
    /// Mean of the first ten: the paper's estimate.
    pub mean_of_10: PushError,
    /// Continuous ranked probability score, mean of x and y, mm.
    pub crps_mm: f64,
    /// The same of the angle, degrees.
    pub crps_deg: f64,
    /// Share of x, y and angles in the central 50 % band; absent for a deterministic forecast.
    pub coverage50: Option<f64>,
    /// Share in the central 90 % band.
    pub coverage90: Option<f64>,
    /// Position error, mm, in [`PARTS`] equal parts of the duration.
    pub over_push: Vec<f64>,
}

/// Scores the forecasts of `model` on pushes that it has not seen; it sees the first poses and the rod's paths.
///
/// # Errors
/// [`TrainerError`] if the model cannot be run, or nothing to score.
pub fn evaluate_pushes(model: &dyn Forecaster, test: &Sequences) -> Result<PushScore, TrainerError> {
    if test.items.is_empty() {
        return Err(TrainerError::NoTrajectories { what: "the test set" });
    }
    let scores = (test.items.par_iter().enumerate())
        .map(|(i, q)| {
            let task = Task { start: q.state(0), actions: &q.actions, time: q.time, index: i as u64 };
            Ok(score(&model.forecast(task, SAMPLES)?, q))
        })
        .collect::<Result<Vec<_>, TrainerError>>()?;
    Ok(average(&scores))
}

/// Sums that [`average`] turns into ratios.
#[derive(Debug, Clone)]
struct One {
    score: PushScore,
    errors_m: [f64; 2],
    moved_m: f64,
}

fn score(samples: &Samples, truth: &Sequence) -> One {
    let (count, time) = (samples.count, truth.time);
    let row = |t: usize, j: usize| &samples.values[(t * 3 + j) * count..][..count];
    let mut out = One {
        score: PushScore { pushes: 1, over_push: vec![0.0; PARTS], ..PushScore::default() },
        errors_m: [0.0; 2],
        moved_m: 0.0,
    };
    let rows = (time - 1) as f64;
    let s = &mut out.score;
    let mut parts = [0.0; PARTS];
    let mut size = 0.0;
    let mut inside = [0.0; 2];
    let mut sorted = vec![0.0_f32; count];
    let start = truth.state(0);
    for t in 1..time {
        let y = truth.state(t);
        size += y[0].hypot(y[1]);
        out.moved_m += (y[0] - start[0]).hypot(y[1] - start[1]);
        for (k, (point, n)) in
            [(&mut s.mean, count), (&mut s.mean_of_10, count.min(PAPER_SAMPLES))].into_iter().enumerate()
        {
            let mean = |j: usize| row(t, j)[..n].iter().map(|v| f64::from(*v)).sum::<f64>() / n as f64;
            let position = (mean(0) - y[0]).hypot(mean(1) - y[1]);
            let angle = (mean(2) - y[2]).abs().to_degrees();
            out.errors_m[k] += position;
            point.pos_mm += 1e3 * position / rows;
            point.rot_deg += angle / rows;
            if t + 1 == time {
                (point.end_pos_mm, point.end_rot_deg) = (1e3 * position, angle);
            }
            if k == 0 {
                let part = (t - 1) * PARTS / (time - 1);
                s.over_push[part] += 1e3 * position;
                parts[part] += 1.0;
            }
        }
        for (j, &y) in y.iter().enumerate() {
            sorted.copy_from_slice(row(t, j));
            sorted.sort_unstable_by(f32::total_cmp);
            let value = crps_of(&sorted, y) / rows;
            if j < 2 {
                s.crps_mm += 0.5e3 * value;
            } else {
                s.crps_deg += value.to_degrees();
            }
            for (inside, level) in inside.iter_mut().zip([0.5, 0.9]) {
                let ends = [0.5 - level / 2.0, 0.5 + level / 2.0].map(|q| quantile(&sorted, q));
                *inside += f64::from(u8::from((ends[0]..=ends[1]).contains(&y)));
            }
        }
    }
    for (point, error) in [&mut s.mean, &mut s.mean_of_10].into_iter().zip(out.errors_m) {
        point.trans_percent = 100.0 * error / size;
    }
    // A push with fewer samples than parts has empty parts.
    s.over_push.iter_mut().zip(parts).for_each(|(v, n)| *v = if n > 0.0 { *v / n } else { f64::NAN });
    if count > 1 {
        let [half, most] = inside.map(|n| n / (3.0 * rows));
        (s.coverage50, s.coverage90) = (Some(half), Some(most));
    }
    out
}

fn average(all: &[One]) -> PushScore {
    let n = all.len() as f64;
    let mean = |f: &dyn Fn(&PushScore) -> f64| all.iter().map(|o| f(&o.score)).sum::<f64>() / n;
    let moved: f64 = all.iter().map(|o| o.moved_m).sum();
    let point = |k: usize, of: &dyn Fn(&PushScore) -> PushError| PushError {
        trans_percent: mean(&|s| of(s).trans_percent),
        moved_percent: 100.0 * all.iter().map(|o| o.errors_m[k]).sum::<f64>() / moved,
        pos_mm: mean(&|s| of(s).pos_mm),
        rot_deg: mean(&|s| of(s).rot_deg),
        end_pos_mm: mean(&|s| of(s).end_pos_mm),
        end_rot_deg: mean(&|s| of(s).end_rot_deg),
    };
    let share = |f: &dyn Fn(&PushScore) -> Option<f64>| -> Option<f64> {
        all.iter().map(|o| f(&o.score)).sum::<Option<f64>>().map(|total| total / n)
    };
    let part = |i: usize| {
        let values = all.iter().map(|o| o.score.over_push[i]).filter(|v| v.is_finite());
        let (sum, count) = values.fold((0.0, 0.0), |(s, c), v| (s + v, c + 1.0));
        if count > 0.0 { sum / count } else { 0.0 }
    };
    PushScore {
        pushes: all.len(),
        mean: point(0, &|s| s.mean),
        mean_of_10: point(1, &|s| s.mean_of_10),
        crps_mm: mean(&|s| s.crps_mm),
        crps_deg: mean(&|s| s.crps_deg),
        coverage50: share(&|s| s.coverage50),
        coverage90: share(&|s| s.coverage90),
        over_push: (0..PARTS).map(part).collect(),
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the measures by hand on a push of three samples.
    use super::*;

    #[test]
    fn errors_by_hand() {
        let states = vec![3.0, 4.0, 0.0, 3.0, 4.0, 0.1, 6.0, 8.0, 0.2];
        let truth = Sequence { id: "a".into(), time: 3, states, actions: vec![0.0; 9] };
        // Predicts the start for ever: errors 0 and 5 m, 0.1 and 0.2 rad.
        let values = [3.0, 4.0, 0.0].repeat(3);
        let all = [score(&Samples { count: 1, values }, &truth)];
        let s = average(&all);
        assert!((s.mean.pos_mm - 2500.0).abs() < 1e-3);
        assert!((s.mean.rot_deg - 0.15_f64.to_degrees()).abs() < 1e-5);
        assert!((s.mean.trans_percent - 100.0 * 5.0 / 15.0).abs() < 1e-6);
        assert!((s.mean.moved_percent - 100.0).abs() < 1e-6);
        assert!((s.mean.end_pos_mm - 5000.0).abs() < 1e-3);
        assert_eq!((s.coverage50, s.mean), (None, s.mean_of_10));
    }
}
