//! Measurement noise of trap sets (see [`super`]).

use super::kinds::Noise;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal, StudentT};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Draws independent standard normal errors of one recording: one per row and output.
pub fn white(rng: &mut Xoshiro256PlusPlus, samples: usize) -> Vec<[f64; 2]> {
    (0..samples).map(|_| [StandardNormal.sample(rng), StandardNormal.sample(rng)]).collect()
}

/// Noisy measurements of one sensor over one recording.
///
/// `normal` are standard normal errors, `sd` is the sensor's standard deviation, and proportional errors are
/// counted from the value `zero`.
pub fn readings(
    noise: Noise,
    (values, normal): (&[f64], &[f64]),
    (sd, zero): (f64, f64),
    rng: &mut Xoshiro256PlusPlus,
) -> Vec<f64> {
    let unit = match noise {
        Noise::Correlated(rho) => autocorrelated(normal, rho),
        Noise::Quantised(_) => scaled(normal, |_| 0.3),
        Noise::PerRecording => {
            let factor = 10f64.powf(rng.random_range(-0.523..0.477));
            scaled(normal, |_| factor)
        }
        Noise::Growing => scaled(normal, |share| 0.3 * 10f64.powf(share)),
        Noise::Tiny => scaled(normal, |_| 1e-3),
        Noise::Laplace => normal.iter().map(|_| laplace(rng)).collect(),
        Noise::Student => normal.iter().map(|_| student(rng)).collect(),
        Noise::Outliers => normal.iter().map(|e| e + outlier(rng)).collect(),
        Noise::Hum => {
            let phase = rng.random_range(0.0..std::f64::consts::TAU);
            let wave = |k: usize| 0.5 * (std::f64::consts::TAU * 0.37 * k as f64 + phase).sin();
            normal.iter().enumerate().map(|(k, e)| e + wave(k)).collect()
        }
        Noise::White | Noise::Multiplicative => normal.to_vec(),
    };
    let read = |(value, error): (&f64, f64)| match noise {
        Noise::Quantised(steps) => ((value + sd * error) / (steps * sd)).round() * steps * sd,
        Noise::Multiplicative => {
            let factor: f64 = StandardNormal.sample(rng);
            value + sd * error + 0.02 * factor * (value - zero)
        }
        _ => value + sd * error,
    };
    values.iter().zip(unit).map(read).collect()
}

/// Multiplies errors by `factor`, a function of the elapsed fraction of the recording.
fn scaled(normal: &[f64], factor: impl Fn(f64) -> f64) -> Vec<f64> {
    let last = (normal.len().max(2) - 1) as f64;
    normal.iter().enumerate().map(|(k, e)| e * factor(k as f64 / last)).collect()
}

/// Turns independent normal errors into stationary AR(1) errors of unit variance and correlation `rho`.
fn autocorrelated(normal: &[f64], rho: f64) -> Vec<f64> {
    let mut last: Option<f64> = None;
    let step = |e: &f64| {
        let now = last.map_or(*e, |last| rho * last + (1.0 - rho * rho).sqrt() * e);
        last = Some(now);
        now
    };
    normal.iter().map(step).collect()
}

/// Draws a Laplace error of unit variance, by inversion of the distribution; its scale is 1 / sqrt(2).
fn laplace(rng: &mut Xoshiro256PlusPlus) -> f64 {
    let u: f64 = rng.random_range(-0.5..0.5);
    -u.signum() * (1.0 - 2.0 * u.abs()).max(1e-300).ln() / std::f64::consts::SQRT_2
}

/// Draws a Student t error with three degrees of freedom, divided by its standard deviation sqrt(3).
fn student(rng: &mut Xoshiro256PlusPlus) -> f64 {
    let t = StudentT::new(3.0).expect("three degrees of freedom are valid");
    t.sample(rng) / 3f64.sqrt()
}

/// Draws an error of 15 to 40 standard deviations with probability 0.01, and 0 otherwise.
fn outlier(rng: &mut Xoshiro256PlusPlus) -> f64 {
    if !rng.random_bool(0.01) {
        return 0.0;
    }
    let size = rng.random_range(15.0..40.0);
    if rng.random_bool(0.5) { size } else { -size }
}

#[cfg(test)]
mod tests {
    //! Contract: each kind of noise has the variance, correlation and quantisation step that it states.
    use super::*;
    use augsim_data::random_stream;

    /// Number of samples of the test.
    const N: usize = 20_000;

    /// Measurement errors of a sensor with unit standard deviation at a constant value of 10.
    fn errors(noise: Noise) -> Vec<f64> {
        let mut rng = random_stream(5, "trap noise test", 0);
        let normal: Vec<f64> = white(&mut rng, N).iter().map(|e| e[0]).collect();
        let read = readings(noise, (&[10.0; N], &normal), (1.0, 0.0), &mut rng);
        read.iter().map(|y| y - 10.0).collect()
    }

    fn mean(values: impl Iterator<Item = f64>) -> f64 {
        values.sum::<f64>() / N as f64
    }

    fn variance(errors: &[f64]) -> f64 {
        mean(errors.iter().map(|e| e * e))
    }

    #[test]
    fn correlated_noise_has_its_correlation() {
        for rho in [0.5, 0.9, 0.95] {
            let e = errors(Noise::Correlated(rho));
            let lagged = mean(e.windows(2).map(|pair| pair[0] * pair[1])) / variance(&e);
            assert!((lagged - rho).abs() < 0.02, "{rho}: {lagged}");
            assert!((variance(&e) - 1.0).abs() < 0.15, "{rho}: {}", variance(&e));
        }
    }

    #[test]
    fn noise_has_its_variance() {
        // 2 % of 10 is 0.2, with variance 0.04; a sine with amplitude 0.5 has variance 0.125.
        let kinds = [
            (Noise::White, 1.0, 0.05),
            (Noise::Laplace, 1.0, 0.1),
            (Noise::Student, 1.0, 0.4),
            (Noise::Multiplicative, 1.04, 0.05),
            (Noise::Hum, 1.125, 0.05),
            (Noise::Tiny, 1e-6, 1e-7),
        ];
        for (noise, expected, tolerance) in kinds {
            let v = variance(&errors(noise));
            assert!((v - expected).abs() < tolerance, "{noise:?}: {v}");
        }
    }

    #[test]
    fn noise_grows_tenfold() {
        let e = errors(Noise::Growing);
        let rms = |part: &[f64]| (part.iter().map(|e| e * e).sum::<f64>() / part.len() as f64).sqrt();
        let (first, last) = (rms(&e[..N / 20]), rms(&e[N - N / 20..]));
        assert!((7.0..11.0).contains(&(last / first)), "{first} {last}");
    }

    #[test]
    fn quantised_values_are_multiples_of_the_step() {
        let e = errors(Noise::Quantised(4.0));
        assert!(e.iter().all(|e| ((e + 10.0) / 4.0).fract() == 0.0));
    }

    #[test]
    fn one_sample_in_a_hundred_is_an_outlier() {
        let far = errors(Noise::Outliers).iter().filter(|e| e.abs() > 8.0).count();
        assert!((150..250).contains(&far), "{far}");
    }
}
