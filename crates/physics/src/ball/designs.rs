//! Candidate throws from which experiment design chooses the next experiment.

use super::covariates::{has_spin, with_spin};
use augsim_system::{Design, Designs, Record, Window};

/// Duration of a candidate throw's record, s.
const DURATION_S: f64 = 2.5;
/// Number of impacts after which a candidate record ends.
const MAX_IMPACTS: usize = 6;
/// Drop heights of the candidate throws, as fractions of the highest initial height in the data.
const HEIGHT_FRACTIONS: [f64; 5] = [0.05, 0.2, 0.5, 1.0, 2.0];

/// Text that describes a candidate throw by height, m, speed, m/s, and spin, rad/s.
fn describe(height_m: f64, speed_m_s: f64, spin_rad_s: f64) -> String {
    let from = format!("from {height_m:.2} m");
    let throw = match speed_m_s {
        0.0 => format!("drop {from}"),
        speed => format!("throw {from} at {speed} m/s along x"),
    };
    if spin_rad_s == 0.0 { throw } else { format!("{throw} with a spin of {spin_rad_s} rad/s") }
}

/// Candidate throws over a grid of heights, speeds and spins.
///
/// Speeds are varied if there is a horizontal channel and the ball is not released at rest, spins if the data
/// have any.
pub(super) fn designs(
    channels: usize,
    floor_m: f64,
    released_at_rest: bool,
    records: &[&Record],
    step_s: f64,
) -> Designs {
    let words = "throw from 5 % to 200 % of the largest height in these data".to_string();
    let Some(first) = records.first() else { return Designs { noun_phrase: words, list: Vec::new() } };
    let vertical = channels - 1;
    let can_throw = channels > 1 && !released_at_rest;
    let speeds: &[f64] = if can_throw { &[0.0, 2.0, 5.0] } else { &[0.0] };
    let spins: &[f64] = if can_throw && has_spin(records) { &[0.0, -100.0, 100.0] } else { &[0.0] };
    let heights = records.iter().filter_map(|r| Some(r.windows.first()?.start.get(vertical)? - floor_m));
    let highest = heights.fold(0.1, f64::max);
    // Rounded to two digits for the description.
    let unit = 10f64.powf(highest.log10().floor() - 1.0);
    let highest = (highest / unit).round() * unit;
    let samples = (DURATION_S / step_s).floor().clamp(8.0, 2_000.0) as usize;
    let mut list = Vec::new();
    for height_m in HEIGHT_FRACTIONS.into_iter().map(|fraction| fraction * highest) {
        for &speed_m_s in speeds {
            for &spin_rad_s in spins {
                let mut start = vec![0.0; 2 * channels];
                start[vertical] = height_m + floor_m;
                if channels > 1 {
                    start[channels] = speed_m_s;
                }
                let record = Record {
                    times: (0..samples).map(|k| k as f64 * step_s).collect(),
                    covariates: with_spin(first, spin_rad_s),
                    group: first.group,
                    windows: vec![Window { samples: 0..samples, start }],
                    noise_correlation_s: f64::INFINITY,
                    ..Record::default()
                };
                list.push(Design {
                    text: describe(height_m, speed_m_s, spin_rad_s),
                    record,
                    max_events: MAX_IMPACTS,
                });
            }
        }
    }
    Designs { noun_phrase: words, list }
}
