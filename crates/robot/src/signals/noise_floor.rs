//! Noise floor of the spectrum of a position or a torque, without an assumption on its colour.
//!
//! Noise of a sensor has a flat spectrum, or one that falls slowly: the error of a coarse encoder is a sawtooth, and its spectrum falls
//! as `f^-2`. Twice differentiated, such noise *rises* with frequency, as `f^4` or `f^2`. The acceleration of a motion falls. The
//! floor therefore begins at the highest frequency at which the spectrum of the acceleration stops to rise.
//!
//! The sawtooth of a slow motion has a crest at the rate at which the motion passes the steps of the encoder. Its power is known, so
//! that the crest is not mistaken for a motion.

/// Ratio of the limits of one frequency band: half an octave.
const BAND_RATIO: f64 = std::f64::consts::SQRT_2;

/// Least number of spectral lines in a band: the mean of 8 lines has a standard deviation of 35 %, while a flat spectrum makes
/// the acceleration's rise by a factor of 4 from one band to the next.
const MIN_LINES: usize = 8;

/// Noise floor of a spectrum.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseFloor {
    /// Density of the noise at each spectral line, unit^2/Hz.
    pub density: Vec<f64>,
    /// Index of the first spectral line that is noise alone.
    pub begin: usize,
}

/// Estimates the floor of a one-sided power spectral density.
///
/// The floor begins where the density times the frequency to the power `slope` stops to rise: 4 for a position, as above.
///
/// `density[k]` belongs to the frequency `(k + 1)` times the spacing of the lines; the last one is the Nyquist frequency. Within the
/// noise the floor is the mean density of each half octave; below it the floor continues at the level of the lowest half octave.
/// The lines at the top whose densities sum to less than `least_sum` are noise in any case. There are at least [`MIN_LINES`] lines.
pub fn noise_floor(density: &[f64], slope: i32, least_sum: f64) -> NoiseFloor {
    let mut end = density.len();
    let mut floor = vec![0.0; end];
    // Level of the band above, and that level times the power of the frequency.
    let mut above: Option<(f64, f64)> = None;
    let mut sum = 0.0;
    loop {
        let begin = (end as f64 / BAND_RATIO) as usize;
        if end - begin < MIN_LINES && above.is_some() {
            break;
        }
        let band = density[begin..end].iter().sum::<f64>();
        let level = band / (end - begin) as f64;
        let middle = (begin + end + 1) as f64 / 2.0;
        let weighted = level * middle.powi(slope);
        if sum > least_sum && above.is_some_and(|(_, higher)| weighted >= higher) {
            break;
        }
        sum += band;
        floor[begin..end].fill(level);
        above = Some((level, weighted));
        end = begin;
    }
    if let Some((level, _)) = above {
        floor[..end].fill(level);
    }
    NoiseFloor { density: floor, begin: end }
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
