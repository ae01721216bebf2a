//! Stretches of a record within which the motion is smooth, where the system does not name them.

use crate::noise::smooth_misfit;
use crate::record::Measured;

/// Lengths that are tried, samples.
const LENGTHS: [usize; 5] = [12, 24, 48, 96, 192];
/// Ratio of the misfit of polynomials to that over the shortest stretches from which on the motion is no longer smooth.
const SMOOTH: f64 = 1.3;

/// Cuts records whose system names no pieces into stretches over which polynomials follow every channel as well as over the
/// shortest. Gives whether polynomials follow the motion at all: samples may be too few for that, and then
/// what they leave is no noise of the sensor.
pub(crate) fn find(data: &mut Measured) -> bool {
    if data.records.iter().any(|r| !r.seen.pieces.is_empty()) {
        return true;
    }
    let mut best = LENGTHS[0];
    let mut shortest: Option<Vec<f64>> = None;
    for length in LENGTHS {
        let misfit = smooth_misfit(data, length);
        match &shortest {
            None => shortest = Some(misfit),
            Some(first) => {
                let rough = misfit.iter().zip(first).any(|(m, f)| *m > SMOOTH * f || !m.is_finite());
                if rough {
                    break;
                }
                best = length;
            }
        }
    }
    let is_smooth = best > LENGTHS[0];
    // No stretch is longer than a record: records of 60 samples would else be shorter than half of 192, and have none.
    let longest = data.records.iter().map(|r| r.seen.times.len()).max().unwrap_or(best);
    best = best.min(longest);
    for record in &mut data.records {
        let samples = record.seen.times.len();
        let cuts = (0..samples).step_by(best).map(|a| a..(a + best).min(samples));
        record.seen.pieces = cuts.filter(|piece| piece.len() * 2 >= best).collect();
    }
    is_smooth
}
