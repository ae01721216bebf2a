//! A training report with invented, plausible content.

use augsim_report::BenchmarkReport;
use augsim_report::benchmark::{
    ErrorCurve, Forecast, LearningCurve, LossPart, Protocol, ResultRow, Results, TrainingRun,
};
use augsim_report::page::{Best, Column, DataSource, Method, Provenance};

/// A deterministic pseudo-random number generator (xorshift).
pub struct Noise(u64);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    /// Random number, uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Random number, approximately standard normal: the sum of twelve uniform numbers, minus 6.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Height, m, and velocity, m/s, at time `t`, s, of a ball dropped from `h0` with restitution `e`.
pub fn ball(h0: f64, e: f64, t: f64) -> (f64, f64) {
    let g = 9.81;
    let first = (2.0 * h0 / g).sqrt();
    if t < first {
        return (h0 - g * t * t / 2.0, -g * t);
    }
    let (mut start, mut v) = (first, e * g * first);
    while v > 0.05 {
        let end = start + 2.0 * v / g;
        if t < end {
            let s = t - start;
            return (v * s - g * s * s / 2.0, v - g * s);
        }
        (start, v) = (end, v * e);
    }
    (0.0, 0.0)
}

fn quantile(sorted: &[f64], q: f64) -> f64 {
    sorted[(q * (sorted.len() - 1) as f64).round() as usize]
}

fn forecasts() -> Vec<Forecast> {
    let t: Vec<f64> = (0..400).map(|i| f64::from(i) / 60.0).collect();
    let mut noise = Noise::new(7);
    let mut out = Vec::new();
    for (number, h0, e) in [(17, 4.62, 0.48), (233, 4.11, 0.66), (808, 4.9, 0.35)] {
        for (model, mean, sd) in [("Neural", 0.47, 0.13), ("Hybrid", 0.5, 0.1)] {
            let draws: Vec<f64> = (0..200).map(|_| (mean + sd * noise.normal()).clamp(0.05, 0.95)).collect();
            for (channel, unit) in [("height", "m"), ("velocity", "m/s")] {
                let pick = |s: (f64, f64)| if channel == "height" { s.0 } else { s.1 };
                let mut bands: [Vec<f64>; 5] = Default::default();
                for t in &t {
                    let mut at: Vec<f64> = draws.iter().map(|e| pick(ball(h0, *e, *t))).collect();
                    at.sort_by(f64::total_cmp);
                    for (band, q) in bands.iter_mut().zip([0.05, 0.25, 0.5, 0.75, 0.95]) {
                        band.push(quantile(&at, q));
                    }
                }
                let [lower90, lower50, median, upper50, upper90] = bands;
                out.push(Forecast {
                    model: model.into(),
                    trajectory: format!("trajectory {number}"),
                    channel: channel.into(),
                    unit: unit.into(),
                    truth: t.iter().map(|t| pick(ball(h0, e, *t))).collect(),
                    t_s: t.clone(),
                    median,
                    lower50,
                    upper50,
                    lower90,
                    upper90,
                });
            }
        }
    }
    out
}

fn errors() -> Vec<ErrorCurve> {
    let t: Vec<f64> = (0..400).map(|i| f64::from(i) / 60.0).collect();
    let mut out = Vec::new();
    for (model, protocol, scale) in [
        ("Zero", Protocol::Forecast, 1.0),
        ("Physics", Protocol::Forecast, 0.30),
        ("Neural", Protocol::Forecast, 0.26),
        ("Hybrid", Protocol::Forecast, 0.22),
        ("conditional median", Protocol::Floor, 0.185),
        ("Hybrid", Protocol::Reconstruction, 0.02),
    ] {
        for (channel, unit, size) in [("height", "m", 1.0), ("velocity", "m/s", 2.6)] {
            let error = (t.iter())
                .map(|t| {
                    let level = if model == "Zero" {
                        1.6 * (-t / 1.6).exp()
                    } else {
                        1.4 * (1.0 - (-(t - 0.9).max(0.0) * 2.5).exp()) * (-t / 2.6).exp()
                    };
                    size * scale * level * (1.0 + 0.22 * (t * 7.0).sin())
                })
                .collect();
            out.push(ErrorCurve {
                model: model.into(),
                protocol,
                channel: channel.into(),
                unit: unit.into(),
                t_s: t.clone(),
                error,
            });
        }
    }
    out
}

fn learning() -> Vec<LearningCurve> {
    let mut noise = Noise::new(3);
    [("Neural", 1.3, 9.0), ("Hybrid", 0.9, 4.0)]
        .map(|(model, floor, size)| {
            let iteration: Vec<f64> = (0..10_000).map(f64::from).collect();
            let mut part = |floor: f64, size: f64, rate: f64| -> Vec<f64> {
                iteration
                    .iter()
                    .map(|i| (floor + size * (-i / rate).exp()) * (0.12 * noise.normal()).exp())
                    .collect()
            };
            let parts = vec![
                LossPart {
                    name: "KL divergence".into(),
                    unit: "nats per step".into(),
                    values: part(0.05 * floor, size, 600.0),
                },
                LossPart {
                    name: "reconstruction".into(),
                    unit: "nats per step".into(),
                    values: part(floor, 6.0 * size, 1500.0),
                },
            ];
            LearningCurve { model: model.into(), iteration, parts }
        })
        .to_vec()
}

fn results() -> Results {
    let lowest =
        |title: &str, unit: &str, decimals| Column::number(title, unit).decimals(decimals).best(Best::Lowest);
    Results {
        caption: "Error on test_1000: 1000 trajectories of 400 steps at 60 Hz".into(),
        columns: vec![
            lowest("translation", "%", 2),
            lowest("position", "m", 3),
            lowest("velocity", "m/s", 3),
            lowest("CRPS position", "m", 3),
            lowest("CRPS velocity", "m/s", 3),
            Column::number("50 % band holds", "%").decimals(1).best(Best::Nearest(50.0)),
            Column::number("90 % band holds", "%").decimals(1).best(Best::Nearest(90.0)),
        ],
        rows: rows(),
        footnotes: vec!["Bold and underlined: best of its protocol.".into()],
    }
}

fn rows() -> Vec<ResultRow> {
    let row = |model: &str, protocol, estimator: &str, v: [f64; 5], cover: Option<[f64; 2]>| ResultRow {
        model: model.into(),
        protocol,
        estimator: estimator.into(),
        values: (v.into_iter().map(Some))
            .chain([0, 1].map(|i| cover.map(|c: [f64; 2]| 100.0 * c[i])))
            .collect(),
    };
    use Protocol::{Floor, Forecast, Reconstruction};
    vec![
        row("Zero", Forecast, "", [100.0, 0.636, 1.421, 0.636, 1.421], None),
        row("Physics", Forecast, "", [27.3, 0.168, 1.026, 0.168, 1.026], None),
        row("Neural", Forecast, "mean of 10", [22.61, 0.149, 0.655, 0.104, 0.472], Some([0.441, 0.853])),
        row("Neural", Forecast, "median of 100", [19.30, 0.133, 0.601, 0.104, 0.472], Some([0.441, 0.853])),
        row("Hybrid", Forecast, "mean of 10", [18.92, 0.129, 0.571, 0.083, 0.392], Some([0.492, 0.894])),
        row("Hybrid", Forecast, "median of 100", [15.71, 0.110, 0.521, 0.083, 0.392], Some([0.492, 0.894])),
        row("Hybrid", Reconstruction, "mean of 10", [1.93, 0.013, 0.118, 0.009, 0.081], Some([0.52, 0.93])),
        row("Neural", Reconstruction, "mean of 10", [6.12, 0.041, 0.312, 0.029, 0.214], Some([0.48, 0.88])),
        row("conditional median", Floor, "", [15.07, 0.107, 0.505, 0.079, 0.371], Some([0.5, 0.9])),
    ]
}

/// Invented content of a training report.
pub fn sample() -> BenchmarkReport {
    BenchmarkReport {
        kind: "training report · ball".into(),
        title: "Bouncing ball: forecasts from the initial state".into(),
        summary: "Hybrid forecasts the height to 0.129 m from the initial state alone, ahead of Neural (0.149 m) and Physics (0.168 m), and 3 % above what ten exact samples of the true law would give.".into(),
        subject: "Hybrid".into(),
        results: vec![results()],
        learning: learning(),
        forecasts: forecasts(),
        errors: errors(),
        training: vec![
            TrainingRun { model: "Neural".into(), recipe: "paper: Adam, halved every 2500 iterations, batch 40".into(), parameters: Some(8_420), iterations: Some(10_000) },
            TrainingRun { model: "Hybrid".into(), recipe: "the same, on the residual of Physics".into(), parameters: Some(8_612), iterations: Some(10_000) },
        ],
        notes: vec!["The restitution is drawn per trajectory and cannot be seen at t = 0. The paper's Hybrid row (2.42 %) lies below the floor of every forecast; it can only be a reconstruction or another set-up.".into()],
        reproduce: vec![
            "cargo run --release -- reproduce ball --data ../shared/data/pybullet-ball --out out/ball".into(),
            "cargo run --release -- report out/ball".into(),
        ],
        methods: vec![
            Method { name: "Variational recurrent network".into(), purpose: "stochastic residual dynamics.".into(), reference: "Chung et al., A recurrent latent variable model for sequential data, NeurIPS 2015.".into() },
            Method { name: "CRPS".into(), purpose: "proper score of sampled forecasts.".into(), reference: "Gneiting and Raftery, Strictly proper scoring rules, JASA 102, 2007.".into() },
        ],
        provenance: provenance("pybullet-ball/test_1000.csv.gz"),
        ..BenchmarkReport::default()
    }
}

pub fn provenance(path: &str) -> Provenance {
    Provenance {
        version: "0.1.0".into(),
        seed: Some(1),
        data: vec![DataSource { path: path.into(), hash: "sha256:6f1c0d9a4be27d0c5d0c8d6d2b6c7a9e".into() }],
        machine: Some("2 cores, AVX-512, 2 threads".into()),
        date: Some("2026-01-31".into()),
        more: Vec::new(),
    }
}
