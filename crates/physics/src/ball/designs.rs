//! Throws that could be recorded.

use super::covariates::{has_spin, with_spin};
use crate::system::{Design, Designs, Record, Window};

/// Longest record of a throw, s.
const LONGEST_S: f64 = 2.5;
/// Impacts after which a record ends.
const MOST_IMPACTS: usize = 6;
/// Heights that are tried, as shares of the highest start in the data.
const HEIGHTS: [f64; 5] = [0.05, 0.2, 0.5, 1.0, 2.0];

/// A throw in words.
fn text(height_m: f64, speed_m_s: f64, spin_rad_s: f64) -> String {
    let from = format!("from {height_m:.2} m");
    let way = match speed_m_s {
        0.0 => format!("drop {from}"),
        speed => format!("throw {from} at {speed} m/s along x"),
    };
    if spin_rad_s == 0.0 { way } else { format!("{way} with a spin of {spin_rad_s} rad/s") }
}

/// Throws over heights, and over speeds and spins if balls can be thrown: where there are horizontal channels and the ball
/// is not `held`.
pub(super) fn designs(
    channels: usize,
    floor_m: f64,
    held: bool,
    records: &[&Record],
    step_s: f64,
) -> Designs {
    let words = "throw from a twentieth to twice the heights of these data".to_string();
    let Some(first) = records.first() else { return Designs { words, list: Vec::new() } };
    let vertical = channels - 1;
    let thrown = channels > 1 && !held;
    let speeds: &[f64] = if thrown { &[0.0, 2.0, 5.0] } else { &[0.0] };
    let spins: &[f64] = if thrown && has_spin(records) { &[0.0, -100.0, 100.0] } else { &[0.0] };
    let heights = records.iter().filter_map(|r| Some(r.windows.first()?.start.get(vertical)? - floor_m));
    let highest = heights.fold(0.1, f64::max);
    // Two digits are enough for a plan.
    let unit = 10f64.powf(highest.log10().floor() - 1.0);
    let highest = (highest / unit).round() * unit;
    let samples = (LONGEST_S / step_s).floor().clamp(8.0, 2_000.0) as usize;
    let mut list = Vec::new();
    for height_m in HEIGHTS.into_iter().map(|share| share * highest) {
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
                    memory_s: f64::INFINITY,
                    ..Record::default()
                };
                list.push(Design {
                    text: text(height_m, speed_m_s, spin_rad_s),
                    record,
                    most_events: MOST_IMPACTS,
                });
            }
        }
    }
    Designs { words, list }
}
