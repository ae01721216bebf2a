//! Where a trajectory hits the ground, found without a mechanical model.
//!
//! An impact is a jump of the vertical velocity: a large positive second difference of the height. The threshold is set by
//! the noise; weak bounces below it end the trajectory's use, because an arc with a hidden bounce in it imitates coloured
//! noise.

use crate::system::{MEMORY, Record, SeenEvent, Window, typical_step};

/// Lag of the second difference, s.
const LAG: f64 = 0.030;
/// Smallest jump that counts, m.
const SMALLEST_JUMP: f64 = 0.025;
/// Length of the fits on both sides of an impact, s.
const SIDE: f64 = 0.120;
/// Distance from impacts below which samples are not used for arcs, s.
const MARGIN: f64 = 0.015;
/// Shortest arc that is used: duration (s) and samples.
const SHORTEST_ARC: (f64, usize) = (0.16, 9);
/// Fewest measured heights of an arc.
const FEWEST_HEIGHTS: usize = 5;
/// Most impacts of one trajectory that are used: later ones carry little and cost derivatives.
const MOST_IMPACTS: usize = 10;

/// Indices of the samples of a channel that were measured.
fn measured(y: &[f64]) -> Vec<usize> {
    (0..y.len()).filter(|&k| y[k].is_finite()).collect()
}

/// Values at the samples `chosen`.
fn at(chosen: &[usize], values: &[f64]) -> Vec<f64> {
    chosen.iter().map(|&k| values[k]).collect()
}

/// Height and slope at `t0` of the least-squares parabola of curvature `-g` through samples `range`; `None` if too few.
pub(super) fn ballistic(
    times: &[f64],
    y: &[f64],
    range: impl Iterator<Item = usize>,
    t0: f64,
    g: f64,
) -> Option<(f64, f64)> {
    let (mut n, mut st, mut stt, mut sy, mut sty) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for k in range {
        let t = times[k] - t0;
        let v = y[k] + 0.5 * g * t * t;
        if v.is_finite() {
            n += 1.0;
            st += t;
            stt += t * t;
            sy += v;
            sty += t * v;
        }
    }
    let det = n * stt - st * st;
    (n >= 3.0 && det > 0.0).then(|| ((stt * sy - st * sty) / det, (n * sty - st * sy) / det))
}

/// Finds impacts (if the model knows of any) and arcs of a record, cuts what follows the last usable arc, and sets the rough start.
pub(super) fn segment(record: &mut Record, g: f64, sigma: f64, bounces: bool) {
    // Impacts are sought among the samples whose height was measured, as if the others had not been recorded; arcs and the
    // end of the record are ranges of all samples, because other channels may have been measured there.
    let vertical = record.values.len() - 1;
    let rows = record.times.clone();
    let chosen = measured(&record.values[vertical]);
    let times = at(&chosen, &rows);
    let z = without_spikes(&at(&chosen, &record.values[vertical]), sigma);
    let n = times.len();
    let heights = |arc: &std::ops::Range<usize>| chosen.iter().filter(|k| arc.contains(k)).count();
    let dt = typical_step(&times);
    let m = ((LAG / dt).round() as usize).max(1);
    let threshold = (4.5 * 6f64.sqrt() * sigma).max(SMALLEST_JUMP);
    let lag = m as f64 * dt;
    let jump = |k: usize| {
        let (before, after) = (times[k] - times[k - m], times[k + m] - times[k]);
        ((z[k + m] - z[k]) / after - (z[k] - z[k - m]) / before) * lag
    };
    let mut peaks: Vec<usize> = Vec::new();
    let mut k = m;
    while bounces && k + m < n {
        if jump(k) > threshold {
            let mut best = k;
            while k + m < n && jump(k) > threshold {
                if jump(k) > jump(best) {
                    best = k;
                }
                k += 1;
            }
            peaks.push(best);
        }
        k += 1;
    }
    let side = SIDE.max(4.5 * dt);
    let near = dt.max(MARGIN);
    let mut end = rows.len();
    let mut out_speed = None;
    let mut arc_start = 0;
    for (i, &p) in peaks.iter().enumerate() {
        let t0 = times[p];
        let before = peaks.get(i.wrapping_sub(1)).map_or(f64::NEG_INFINITY, |&q| times[q]);
        let after = peaks.get(i + 1).map_or(f64::INFINITY, |&q| times[q]);
        let left = (0..p).filter(|&k| times[k] > (t0 - side).max(before + near) && times[k] < t0 - near);
        let right = (p..n).filter(|&k| times[k] < (t0 + side).min(after - near) && times[k] > t0 + near);
        let lines = ballistic(&times, &z, left, t0, g).zip(ballistic(&times, &z, right, t0, g));
        let Some(((zl, vl), (zr, vr))) = lines else {
            end = arc_end(&rows, t0, near);
            break;
        };
        // The jump is largest at a sample beside the impact; where samples are missing there, the impact can be farther away.
        let (back, on) = ((t0 - times[p - 1]).max(lag), (times[p + 1] - t0).max(lag));
        let s = ((zl - zr) / (vr - vl)).clamp(-back, on);
        let (time, v_in, v_out) = (t0 + s, g * s - vl, vr - g * s);
        let arc = arc_start..arc_end(&rows, time, near);
        let begins = rows.get(arc_start).copied().unwrap_or(time);
        let late = out_speed.is_some_and(|v: f64| time - begins > 2.0 * v / g * 1.15 + 0.05);
        let short = heights(&arc) < SHORTEST_ARC.1 || time - begins < SHORTEST_ARC.0;
        // The first arc may be short: the release can be low. A later short or overlong arc ends the record.
        if i > 0 && (short || late) || i >= MOST_IMPACTS || v_in <= 0.0 {
            end = if late && out_speed.is_some() {
                end_of_hop(&rows, begins, out_speed, g, near)
            } else {
                arc_start
            };
            if i > 0 && short && !late {
                // The impact before the short arc is only seen from one side: it goes as well.
                end = record.events.last().map_or(end, |e| arc_end(&rows, e.time, near));
                record.events.pop();
                record.pieces.retain(|a| a.end <= end);
            }
            break;
        }
        record.pieces.push(arc);
        record.events.push(SeenEvent { time, value: (v_out / v_in).clamp(0.02, 1.1) });
        out_speed = Some(v_out);
        arc_start = (0..rows.len()).find(|&k| rows[k] > time + near).unwrap_or(rows.len());
        end = rows.len();
    }
    if end == rows.len() && arc_start < rows.len() {
        // The last arc has no impact at its end: it must not be longer than its hop.
        let begins = rows[arc_start];
        if !record.events.is_empty() {
            end = end_of_hop(&rows, begins, out_speed, g, near);
        }
        if heights(&(arc_start..end)) >= FEWEST_HEIGHTS {
            record.pieces.push(arc_start..end);
        } else if !record.events.is_empty() {
            end = record.events.last().map_or(end, |e| arc_end(&rows, e.time, near));
            record.events.pop();
        }
    }
    record.pieces.retain(|a| heights(a) >= FEWEST_HEIGHTS && a.end <= end);
    record.times.truncate(end);
    record.values.iter_mut().for_each(|c| c.truncate(end));
    record.memory_s = MEMORY * typical_step(&rows);
    rough_start(record, vertical, g);
    record.known = match (record.events.first(), record.pieces.first()) {
        (Some(_), Some(arc)) => arc.end,
        // The first part of a flight without impacts.
        _ => (record.times.len() * 2 / 5).max(6).min(record.times.len()),
    };
}

/// The heights with isolated wrong samples replaced by the mean of their neighbours, for the detection only. A wrong
/// sample makes second differences of alternating sign; an impact makes none of negative sign.
fn without_spikes(y: &[f64], sigma: f64) -> Vec<f64> {
    let mut z = y.to_vec();
    let limit = (7.0 * 6f64.sqrt() * sigma).max(1e-3);
    let second = |z: &[f64], k: usize| z[k + 1] - 2.0 * z[k] + z[k - 1];
    for k in 2..z.len().saturating_sub(2) {
        let (d, left, right) = (second(&z, k), second(&z, k - 1), second(&z, k + 1));
        let opposite = |e: f64| e * d < 0.0 && e.abs() > 0.3 * d.abs();
        if d.abs() > limit && opposite(left) && opposite(right) {
            z[k] = 0.5 * (z[k - 1] + z[k + 1]);
        }
    }
    z
}

fn arc_end(times: &[f64], impact: f64, near: f64) -> usize {
    times.iter().position(|&t| t >= impact - near).unwrap_or(times.len())
}

fn end_of_hop(times: &[f64], begins: f64, out_speed: Option<f64>, g: f64, near: f64) -> usize {
    let duration = out_speed.map_or(f64::INFINITY, |v| 2.0 * v / g);
    arc_end(times, begins + 0.93 * duration, near)
}

/// One window, from the first sample, with the state that the first arc has there.
fn rough_start(record: &mut Record, vertical: usize, g: f64) {
    let channels = record.values.len();
    let mut start = vec![0.0; 2 * channels];
    if let (Some(first), Some(&t0)) = (record.pieces.first(), record.times.first()) {
        for (channel, values) in record.values.iter().enumerate() {
            let pull = if channel == vertical { g } else { 0.0 };
            if let Some((p, v)) = ballistic(&record.times, values, first.clone(), t0, pull) {
                (start[channel], start[channels + channel]) = (p, v);
            }
        }
    }
    record.windows = vec![Window { samples: 0..record.times.len(), start }];
}
