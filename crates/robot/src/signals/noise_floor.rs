//! Noise floor of the spectrum of a position or a torque, without an assumption on its colour.
//!
//! Noise of a sensor has a flat spectrum, or one that falls slowly: the error of a coarse encoder is a sawtooth, and its
//! spectrum falls as `f^-2`. Twice differentiated, such noise *rises* with frequency, as `f^4` or `f^2`. The acceleration of a
//! motion falls. The floor therefore begins at the highest frequency at which the spectrum of the acceleration stops to rise.
//!
//! The sawtooth of a slow motion has a crest at the rate at which the motion passes the steps of the encoder. Its power is
//! known, so that the crest is not mistaken for a motion.

/// Ratio of the limits of one frequency band: half an octave.
const BAND_RATIO: f64 = std::f64::consts::SQRT_2;

/// Least number of spectral lines in a band.
///
/// The mean of 8 lines has a standard deviation of 35 %, while a flat spectrum makes the acceleration's rise by a factor of 4
/// from one band to the next.
const MIN_LINES: usize = 8;

/// Noise floor of a spectrum.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseFloor {
    /// Density of the noise at each spectral line, unit^2/Hz.
    pub density: Vec<f64>,
    /// Index of the first spectral line that is noise alone.
    pub begin: usize,
}

/// A band of lines.
struct Band {
    begin: usize,
    end: usize,
    /// Mean density.
    level: f64,
    /// Mean density times the power of the frequency.
    weighted: f64,
    /// Sum of the densities of this band and of those above.
    sum: f64,
}

/// Estimates the floor of a one-sided power spectral density.
///
/// The floor begins where the density times the frequency to the power `slope` stops to rise: 4 for a position, as above. A
/// crest ends the floor unless the spectrum falls below its level again beneath the crest, and the densities down to there sum
/// to at most `rounding_sum`, that of the encoder's rounding.
///
/// `density[k]` belongs to the frequency `(k + 1)` times the spacing of the lines; the last one is the Nyquist frequency. Within the
/// noise the floor is the mean density of each half octave; below it the floor continues at the level of the lowest half
/// octave. There are at least [`MIN_LINES`] lines.
pub fn noise_floor(density: &[f64], slope: i32, rounding_sum: f64) -> NoiseFloor {
    let bands = bands(density, slope);
    let mut last = 0;
    let continues = |last: usize, k: usize| {
        bands[k].weighted < bands[last].weighted && (k == last + 1 || bands[k].sum <= rounding_sum)
    };
    while let Some(next) = (last + 1..bands.len()).find(|k| continues(last, *k)) {
        last = next;
    }
    let mut floor = vec![bands[last].level; density.len()];
    for band in &bands[..last] {
        floor[band.begin..band.end].fill(band.level);
    }
    NoiseFloor { density: floor, begin: bands[last].begin }
}

/// Half octaves from the highest to the lowest that has enough lines; the highest in any case.
fn bands(density: &[f64], slope: i32) -> Vec<Band> {
    let mut bands: Vec<Band> = Vec::new();
    let mut end = density.len();
    loop {
        let begin = (end as f64 / BAND_RATIO) as usize;
        if end - begin < MIN_LINES && !bands.is_empty() {
            return bands;
        }
        let power = density[begin..end].iter().sum::<f64>();
        let level = power / (end - begin) as f64;
        let middle = (begin + end + 1) as f64 / 2.0;
        let sum = bands.last().map_or(0.0, |band| band.sum) + power;
        bands.push(Band { begin, end, level, weighted: level * middle.powi(slope), sum });
        end = begin;
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the floor follows flat and slowly falling noise, and ends where a motion rises above it.
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_floor_follows_falling_noise_down_to_the_motion() {
        // Noise that falls as f^-2, and a motion that falls as f^-10: equal at line 100.
        let noise = |k: usize| 1.0 / (k as f64).powi(2);
        let density: Vec<f64> = (1..=4096).map(|k| noise(k) + 1e-4 * (k as f64 / 100.0).powi(-10)).collect();
        let floor = noise_floor(&density, 4, 0.0);
        assert!((80..=160).contains(&floor.begin), "{}", floor.begin);
        for k in [250, 1000, 4000] {
            assert_relative_eq!(floor.density[k - 1], noise(k), max_relative = 0.4);
        }
        assert_relative_eq!(floor.density[0], floor.density[floor.begin], epsilon = 0.0);
    }

    #[test]
    fn a_crest_of_less_than_the_known_power_is_noise() {
        let crest = |k: usize| if (1000..2000).contains(&k) { 30.0 } else { 1.0 };
        let density: Vec<f64> = (1..=4096).map(|k| crest(k) + 1e4 * (k as f64 / 100.0).powi(-10)).collect();
        assert!(noise_floor(&density, 4, 0.0).begin > 900);
        assert!(noise_floor(&density, 4, 25_000.0).begin > 900);
        assert!(noise_floor(&density, 4, 35_000.0).begin < 400);
    }

    #[test]
    fn a_spectrum_without_noise_has_its_floor_at_the_top() {
        let density: Vec<f64> = (1..=4096).map(|k| (k as f64).powi(-8)).collect();
        let floor = noise_floor(&density, 4, 0.0);
        assert!(floor.begin > 2500);
        assert!(floor.density[0] < 1e-26);
    }
}
