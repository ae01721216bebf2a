//! Truth of a generated data set: its effects, its noise, and how it was recorded.

use rand::{Rng, RngExt};
use rand_xoshiro::Xoshiro256PlusPlus;

/// True effect that is in the effect library, with its parameter; an answer must give [`Kind::name`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    QuadraticDrag(f64),
    LinearDrag(f64),
    VerticalAcceleration(f64),
    HorizontalAcceleration(f64),
    Magnus(f64),
    SpeedLinear(f64),
    SpeedPower(f64),
    Drift(f64),
    Position(f64),
    ScatterImpact(f64),
    ScatterTrajectory(f64),
    Coulomb(f64),
    Grip(f64),
    Tilt(f64),
    Contact(f64),
    HeightOffset(f64),
    Latency(f64),
    Roll(f64),
}

/// True effect that is not in the effect library, with its parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unlisted {
    /// Change of the restitution at x = 1 m.
    FloorStep(f64),
    /// Amplitude of a sinusoidal variation of the restitution with time since the session began; period 300 s.
    FloorSine(f64),
    /// Drag coefficient of a drag that acts only above 2.5 m/s.
    DragCrisis(f64),
    /// Stiffness per mass of a spring force towards 1 m height, 1/s².
    Tether(f64),
    /// Decrease of restitution per absolute spin, s/rad.
    SpinLoss(f64),
    /// Coefficient of a cubic lens distortion of the height about 0.7 m, 1/m².
    Lens(f64),
    /// Amplitude of a horizontal acceleration that is a sine of time since release, m/s²; 1.5 Hz.
    Gust(f64),
    /// Decrease of the coefficient of restitution at every bounce.
    Fatigue(f64),
}

/// True effects and noise of a generated data set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    pub effects: Vec<Kind>,
    pub unlisted: Option<Unlisted>,
    /// Correlation of the measurement noise between neighbouring samples.
    pub correlation: f64,
    /// Standard deviation of the errors of time stamps, s.
    pub jitter_s: f64,
    /// Share of samples that are outliers; their standard deviation is 12 times that of the noise.
    pub outliers: f64,
    /// Amplitude of a smooth residual that differs in each record, in standard deviations of the noise.
    ///
    /// No effect explains it, and trajectories do not share it.
    pub wobble: f64,
    /// True standard deviation of the measurement noise divided by the one that the model declares.
    pub declared_ratio: f64,
}

/// Recording conditions of a data set: geometry, release, number of trajectories, sampling rate and noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scene {
    pub plane: bool,
    pub at_rest: bool,
    pub trajectories: usize,
    pub rate_hz: f64,
    pub noise_m: f64,
    pub restitution: f64,
    pub irregular: bool,
}

impl Scene {
    /// Recording conditions of thirty drops along a vertical line.
    pub const DROPS: Scene = Scene {
        plane: false,
        at_rest: true,
        trajectories: 30,
        rate_hz: 100.0,
        noise_m: 0.002,
        restitution: 0.75,
        irregular: false,
    };
}

impl Kind {
    /// Kind of the effect, as an answer names it.
    pub fn name(&self) -> &'static str {
        match self {
            Kind::QuadraticDrag(_) => "quadratic-drag",
            Kind::LinearDrag(_) => "linear-drag",
            Kind::VerticalAcceleration(_) => "vertical-acceleration",
            Kind::HorizontalAcceleration(_) => "horizontal-acceleration",
            Kind::Magnus(_) => "magnus",
            Kind::SpeedLinear(_) => "restitution-speed-linear",
            Kind::SpeedPower(_) => "restitution-speed-power",
            Kind::Drift(_) => "restitution-drift",
            Kind::Position(_) => "restitution-position",
            Kind::ScatterImpact(_) | Kind::ScatterTrajectory(_) => "restitution-scatter",
            Kind::Coulomb(_) => "coulomb-friction",
            Kind::Grip(_) => "grip-friction",
            Kind::Tilt(_) => "ground-tilt",
            Kind::Contact(_) => "contact-duration",
            Kind::HeightOffset(_) => "height-offset",
            Kind::Latency(_) => "latency",
            Kind::Roll(_) => "camera-roll",
        }
    }

    /// Value of the parameter of the effect.
    pub fn value(&self) -> f64 {
        match *self {
            Kind::QuadraticDrag(v)
            | Kind::LinearDrag(v)
            | Kind::VerticalAcceleration(v)
            | Kind::HorizontalAcceleration(v)
            | Kind::Magnus(v)
            | Kind::SpeedLinear(v)
            | Kind::SpeedPower(v)
            | Kind::Drift(v)
            | Kind::Position(v)
            | Kind::ScatterImpact(v)
            | Kind::ScatterTrajectory(v)
            | Kind::Coulomb(v)
            | Kind::Grip(v)
            | Kind::Tilt(v)
            | Kind::Contact(v)
            | Kind::HeightOffset(v)
            | Kind::Latency(v)
            | Kind::Roll(v) => v,
        }
    }

    /// Draws an effect that is possible in `scene`, with its parameter.
    fn draw(rng: &mut Xoshiro256PlusPlus, scene: &Scene) -> Self {
        let (kind_count, plane_only) = (18, [3, 4, 8, 11, 12, 13, 17]);
        loop {
            let which = rng.random_range(0..kind_count);
            if plane_only.contains(&which) && !scene.plane || which == 16 && !scene.at_rest {
                continue;
            }
            let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            // Sizes begin at an eighth of `low`: the weakest are not visible in the smallest sets.
            let mut size = |low: f64, high: f64| low / 8.0 * (8.0 * high / low).powf(rng.random::<f64>());
            return match which {
                0 => Kind::QuadraticDrag(size(0.002, 0.15)),
                1 => Kind::LinearDrag(size(0.008, 0.3)),
                2 => Kind::VerticalAcceleration(sign * size(0.01, 1.0)),
                3 => Kind::HorizontalAcceleration(sign * size(0.005, 0.8)),
                4 => Kind::Magnus(sign * size(0.0002, 0.02)),
                5 => Kind::SpeedLinear(sign * size(0.001, 0.04)),
                6 => Kind::SpeedPower(sign * size(0.004, 0.15)),
                7 => Kind::Drift(sign * size(2e-6, 1.5e-4)),
                8 => Kind::Position(sign * size(0.001, 0.05)),
                9 => Kind::ScatterImpact(size(0.002, 0.06)),
                10 => Kind::ScatterTrajectory(size(0.002, 0.06)),
                11 => Kind::Coulomb(size(0.002, 0.3)),
                12 => Kind::Grip(size(0.002, 0.28)),
                13 => Kind::Tilt(sign * size(0.0004, 0.05)),
                14 => Kind::Contact(size(3e-4, 0.012)),
                15 => Kind::HeightOffset(sign * size(3e-4, 0.02)),
                16 => Kind::Latency(sign.abs() * size(2e-4, 0.02)),
                _ => Kind::Roll(sign * size(3e-4, 0.03)),
            };
        }
    }
}

/// Draws recording conditions and a truth: `effects` library effects, or one unlisted effect for `None`.
pub fn draw(rng: &mut Xoshiro256PlusPlus, effects: Option<usize>, noisy: bool) -> (Scene, Truth) {
    let scene = Scene {
        plane: rng.random_bool(0.6),
        at_rest: rng.random_bool(0.5),
        trajectories: rng.random_range(30..=100),
        rate_hz: [60.0, 100.0, 120.0, 200.0, 240.0][rng.random_range(0..5)],
        noise_m: 0.001 * 5f64.powf(rng.random::<f64>()),
        restitution: rng.random_range(0.6..0.88),
        irregular: rng.random_bool(0.2),
    };
    let mut scene = scene;
    scene.at_rest &= !scene.plane;
    let mut truth = Truth { declared_ratio: 1.0, ..Truth::default() };
    match effects {
        Some(n) => {
            while truth.effects.len() < n {
                let kind = Kind::draw(rng, &scene);
                let equivalent_kinds = [
                    ["restitution-speed-linear", "restitution-speed-power"],
                    ["coulomb-friction", "grip-friction"],
                ];
                let is_equivalent = |a: &Kind| {
                    a.name() == kind.name()
                        || equivalent_kinds.iter().any(|t| t.contains(&a.name()) && t.contains(&kind.name()))
                };
                if !truth.effects.iter().any(is_equivalent) {
                    truth.effects.push(kind);
                }
            }
        }
        None => {
            let mut size = |low: f64, high: f64| low * (high / low).powf(rng.random::<f64>());
            let amounts = [
                size(0.015, 0.1),
                size(0.01, 0.06),
                size(0.03, 0.2),
                size(0.05, 0.6),
                size(3e-4, 2e-3),
                size(0.003, 0.03),
                size(0.1, 1.0),
                size(0.01, 0.06),
            ];
            let which = rng.random_range(0..8);
            if [0, 4, 6].contains(&which) {
                scene.plane = true;
                scene.at_rest = false;
            }
            let a = amounts[which];
            truth.unlisted = Some(match which {
                0 => Unlisted::FloorStep(-a),
                1 => Unlisted::FloorSine(a),
                2 => Unlisted::DragCrisis(a),
                3 => Unlisted::Tether(a),
                4 => Unlisted::SpinLoss(a),
                5 => Unlisted::Lens(a),
                6 => Unlisted::Gust(a),
                _ => Unlisted::Fatigue(a),
            });
        }
    }
    if noisy {
        match rng.random_range(0..4) {
            0 => truth.correlation = rng.random_range(0.2..0.8),
            1 => truth.jitter_s = rng.random_range(0.7e-3..3e-3),
            2 => truth.outliers = rng.random_range(0.002..0.02),
            _ => truth.declared_ratio = [0.5, 0.7, 1.5, 2.0][rng.random_range(0..4)],
        }
    }
    // Keeps the position of the random stream, on which existing seeds depend.
    let _ = rng.next_u32();
    (scene, truth)
}
