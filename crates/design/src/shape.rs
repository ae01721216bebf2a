//! Families of input signals, each with a few coordinates between 0 and 1.

use rand::{Rng, RngExt};
use std::f64::consts::TAU;

/// Number of coordinates of a shape.
pub const COORDINATES: usize = 10;
/// Largest frequency of periodic signals, in multiples of the sampling rate.
const MAX_FREQUENCY_RATIO: f64 = 0.1;
/// Number of frequencies of a multisine.
const TONES: usize = 4;
/// Number of knots of ramps, and largest number of steps.
const KNOTS: usize = 9;

/// A family of input signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Steps to levels that are held for equal times.
    Steps,
    /// Ramps between levels at equal times.
    Ramps,
    /// Chirp: a sine whose frequency changes linearly.
    Chirp,
    /// Sum of sines with chosen phases.
    Multisine,
    /// Sine whose amplitude grows or decays linearly.
    Swell,
    /// Level, pulse to another level, and a third level to the end, as in a release.
    Pulse,
}

/// All families.
pub const FAMILIES: [Family; 6] =
    [Family::Steps, Family::Ramps, Family::Chirp, Family::Multisine, Family::Swell, Family::Pulse];

impl Family {
    /// Name of the family for a table of designs.
    pub fn word(self) -> &'static str {
        match self {
            Family::Steps => "steps",
            Family::Ramps => "ramps",
            Family::Chirp => "chirp",
            Family::Multisine => "multisine",
            Family::Swell => "sine of changing amplitude",
            Family::Pulse => "pulse",
        }
    }
}

/// An input signal of a family, as coordinates between 0 and 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Family of the signal.
    pub family: Family,
    /// Coordinates of the signal, whose meaning depends on the family.
    pub q: [f64; COORDINATES],
}

impl Shape {
    /// Draws a signal: a family and its coordinates, all equally likely.
    pub fn random(rng: &mut impl Rng) -> Self {
        let family = FAMILIES[rng.random_range(0..FAMILIES.len())];
        Self { family, q: std::array::from_fn(|_| rng.random::<f64>()) }
    }

    /// Values of the signal at `times` within `[low, high]`.
    pub fn values(&self, times: &[f64], [low, high]: [f64; 2]) -> Vec<f64> {
        let duration = times.last().copied().unwrap_or(0.0).max(1e-12);
        let step = duration / times.len().saturating_sub(1).max(1) as f64;
        let signal = Signal {
            q: &self.q,
            duration,
            frequencies: [1.0 / duration, (MAX_FREQUENCY_RATIO / step).max(1.0 / duration)],
        };
        // Share of the range from 0 to 1.
        let share = |t: &f64| match self.family {
            Family::Steps => signal.steps(*t),
            Family::Ramps => signal.ramps(*t),
            Family::Chirp => signal.chirp(*t),
            Family::Multisine => signal.multisine(*t),
            Family::Swell => signal.swell(*t),
            Family::Pulse => signal.pulse(*t),
        };
        times.iter().map(|t| low + (high - low) * share(t).clamp(0.0, 1.0)).collect()
    }
}

/// A signal with its time scales: duration, s, lowest and highest frequency, Hz.
struct Signal<'a> {
    q: &'a [f64; COORDINATES],
    duration: f64,
    frequencies: [f64; 2],
}

impl Signal<'_> {
    /// Frequency at share `q` of the logarithmic range, Hz.
    fn frequency(&self, q: f64) -> f64 {
        let [low, high] = self.frequencies;
        low * (high / low).powf(q)
    }

    /// Sine of amplitude `q` (share of the largest) about a level `level` (share of the remaining room).
    fn about(amplitude: f64, level: f64, sine: f64) -> f64 {
        let half = 0.5 * amplitude;
        half + (1.0 - amplitude) * level + half * sine
    }

    fn steps(&self, t: f64) -> f64 {
        let count = 2 + ((KNOTS - 2) as f64 * self.q[0]).round() as usize;
        let place = (t / self.duration * count as f64).floor() as usize;
        self.q[1 + place.min(count - 1).min(KNOTS - 1)]
    }

    fn ramps(&self, t: f64) -> f64 {
        let x = (t / self.duration * KNOTS as f64).min(KNOTS as f64 * (1.0 - 1e-12));
        let (k, part) = (x.floor() as usize, x.fract());
        self.q[k] + part * (self.q[k + 1] - self.q[k])
    }

    fn chirp(&self, t: f64) -> f64 {
        let [f0, f1] = [self.frequency(self.q[0]), self.frequency(self.q[1])];
        let phase = f0 * t + 0.5 * (f1 - f0) * t * t / self.duration + self.q[4];
        Self::about(self.q[2], self.q[3], (TAU * phase).sin())
    }

    fn multisine(&self, t: f64) -> f64 {
        let tone = |k: usize| {
            let frequency = self.frequency((self.q[0] + self.q[1] * k as f64 / TONES as f64).min(1.0));
            (TAU * (frequency * t + self.q[4 + k])).sin()
        };
        let sum: f64 = (0..TONES).map(tone).sum();
        // Peaks of four sines of random phases rarely exceed 2.5; the range clips them.
        Self::about(self.q[2], self.q[3], sum / 2.5)
    }

    fn swell(&self, t: f64) -> f64 {
        let amplitude = self.q[1] + (self.q[2] - self.q[1]) * t / self.duration;
        let sine = (TAU * (self.frequency(self.q[0]) * t + self.q[4])).sin();
        Self::about(
            self.q[1].max(self.q[2]),
            self.q[3],
            sine * amplitude / self.q[1].max(self.q[2]).max(1e-12),
        )
    }

    fn pulse(&self, t: f64) -> f64 {
        let (from, to) = (self.q[3].min(self.q[4]), self.q[3].max(self.q[4]));
        let x = t / self.duration;
        if x < from {
            self.q[0]
        } else if x < to {
            self.q[1]
        } else {
            self.q[2]
        }
    }
}
