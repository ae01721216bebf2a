//! A discovery report with made-up but plausible content.

use augsim_report::DiscoveryReport;
use augsim_report::discovery::{
    Anatomy, Bins, CalibratedParameter, Candidate, ContactError, Correlations, ErrorSummary, Example,
    FoundEffect, Lead, Noise, NoiseFinding, NullRecords, Parameter, Profile, ResidualAutocorrelation,
    ResidualQuantiles, Rmse, Verdict,
};
use augsim_report::page::Method;

use super::training::{Noise as Random, ball, provenance};

fn rmse(rmse: f64, low: f64, high: f64) -> Option<Rmse> {
    Some(Rmse { rmse, ci95: Some([low, high]) })
}

fn parameter(name: &str, value: f64, half: f64, unit: &str) -> Parameter {
    Parameter { name: name.into(), value, ci95: Some([value - half, value + half]), unit: unit.into() }
}

fn profile(
    against: &str,
    unit: &str,
    from: f64,
    to: f64,
    shape: impl Fn(f64) -> f64,
    random: &mut Random,
) -> Profile {
    let mut bins = |scale: f64| {
        let mut b = Bins::default();
        for i in 0..16 {
            let x = from + (to - from) * (f64::from(i) + 0.5) / 16.0;
            let mean = scale * shape(x) + 0.25 * random.normal();
            b.x.push(x);
            b.mean.push(mean);
            b.lower95.push(mean - 0.55 - 0.06 * f64::from(i));
            b.upper95.push(mean + 0.55 + 0.06 * f64::from(i));
        }
        b
    };
    Profile {
        against: against.into(),
        against_unit: unit.into(),
        residual: "height residual".into(),
        unit: "mm".into(),
        before: bins(1.0),
        after: bins(0.0),
    }
}

fn anatomy() -> Anatomy {
    let mut random = Random::new(11);
    let normal: Vec<f64> = (0..41).map(|i| -2.5 + f64::from(i) * 0.125).collect();
    let lag: Vec<f64> = (1..=25).map(f64::from).collect();
    Anatomy {
        profiles: vec![
            profile(
                "time since release",
                "s",
                0.0,
                2.5,
                |t| 9.0 * t * t / (1.0 + t) - 6.0 * (t * 3.2).sin(),
                &mut random,
            ),
            profile("speed", "m/s", 0.0, 5.2, |v| 0.75 * v * v - 4.0, &mut random),
            profile("height", "m", 0.0, 1.4, |h| 9.0 - 12.0 * h, &mut random),
        ],
        contact: vec![
            ContactError {
                label: "first fall".into(),
                before: rmse(4.2, 3.9, 4.6),
                after: rmse(2.05, 1.98, 2.12),
            },
            ContactError {
                label: "after impact 1".into(),
                before: rmse(9.6, 8.9, 10.4),
                after: rmse(2.11, 2.0, 2.2),
            },
            ContactError {
                label: "after impact 2".into(),
                before: rmse(14.9, 13.7, 16.0),
                after: rmse(2.2, 2.05, 2.36),
            },
            ContactError {
                label: "after impact 3 and later".into(),
                before: rmse(19.2, 17.1, 21.5),
                after: rmse(2.4, 2.2, 2.7),
            },
        ],
        contact_unit: "mm".into(),
        autocorrelation: Some(ResidualAutocorrelation {
            before: lag.iter().map(|l| 0.92 * (-l / 11.0).exp() + 0.02 * random.normal()).collect(),
            after: lag.iter().map(|_| 0.016 * random.normal()).collect(),
            lag,
            lag_unit: "samples".into(),
            white95: Some(0.031),
        }),
        quantiles: Some(ResidualQuantiles {
            before: normal.iter().map(|z| 2.6 * z + 0.28 * z * z * z + 1.1).collect(),
            after: normal.iter().map(|z| z + 0.03 * random.normal()).collect(),
            normal,
        }),
    }
}

fn examples() -> Vec<Example> {
    let mut random = Random::new(5);
    [(31, 1.31, 0.72), (44, 0.94, 0.70), (52, 1.12, 0.71)]
        .map(|(number, h0, e)| {
            let t: Vec<f64> = (0..150).map(|i| f64::from(i) / 60.0).collect();
            Example {
                trajectory: format!("trajectory {number}"),
                channel: "height".into(),
                unit: "m".into(),
                measured: t.iter().map(|t| ball(h0, e, *t).0 + 0.004 * random.normal()).collect(),
                before: t.iter().map(|t| ball(h0, e + 0.045, *t).0).collect(),
                after: t.iter().map(|t| ball(h0, e + 0.002, *t).0).collect(),
                t_s: t,
                known_until_s: Some(0.4),
                ..Example::default()
            }
        })
        .to_vec()
}

fn candidates() -> Vec<Candidate> {
    let candidate =
        |kinds: &[&str], parameters: Vec<Parameter>, score: f64, chosen: bool, why: &str| Candidate {
            kinds: kinds.iter().map(|k| (*k).to_owned()).collect(),
            parameters,
            score: Some(score),
            chosen,
            why: why.into(),
        };
    vec![
        candidate(
            &["quadratic-drag", "restitution-speed-linear"],
            vec![parameter("k_per_m", 0.1318, 0.0011, "1/m"), parameter("b_s_per_m", 0.0143, 0.0016, "s/m")],
            4182.6,
            true,
            "chosen: every effect is significant and comes back over resamples",
        ),
        candidate(
            &["quadratic-drag"],
            vec![parameter("k_per_m", 0.1402, 0.0013, "1/m")],
            4031.2,
            false,
            "leaves structure at impacts (p = 3·10⁻¹⁹)",
        ),
        candidate(
            &["linear-drag"],
            vec![parameter("c_per_s", 0.322, 0.004, "1/s")],
            3608.9,
            false,
            "wrong shape against speed: underestimates fast flight",
        ),
        candidate(
            &["vertical-acceleration"],
            vec![parameter("a_m_s2", 0.412, 0.009, "m/s²")],
            2210.4,
            false,
            "same sign up and down; the residual changes sign",
        ),
        candidate(
            &["restitution-speed-power"],
            vec![parameter("p", 0.118, 0.006, "")],
            1877.0,
            false,
            "explains impacts, not the flight before the first one",
        ),
        candidate(
            &["latency"],
            vec![parameter("delay_s", 0.0021, 0.0002, "s")],
            402.3,
            false,
            "loses 95 % of the gain on left-out drops",
        ),
        candidate(&[], vec![], 0.0, false, "structure above the noise (p < 10⁻³⁰⁰)"),
    ]
}

pub fn sample() -> DiscoveryReport {
    let names = ["restitution", "k_per_m", "b_s_per_m", "height_sd_m"];
    DiscoveryReport {
        title: "Table-tennis drops: what the ball model lacks".into(),
        scenario: "ball".into(),
        verdict: Verdict::Explained,
        sentence: "Two effects are missing: air drag that grows with the square of the speed (`quadratic-drag`, 0.132 per metre), and a restitution that falls with impact speed; with both, nothing but sensor noise is left.".into(),
        warnings: Vec::new(),
        error: ErrorSummary {
            quantity: "height".into(),
            unit: "mm".into(),
            heldout_trajectories: 18,
            declared: rmse(38.4, 33.9, 43.1),
            calibrated: rmse(14.2, 12.9, 15.6),
            augmented: rmse(2.14, 2.05, 2.24),
            noise_floor: rmse(2.06, 2.0, 2.12),
            reduction: rmse(12.1, 10.7, 13.5),
            folds: None,
            explained_share: Some(0.998),
        },
        calibrated: vec![
            CalibratedParameter { parameter: parameter("restitution", 0.8914, 0.0031, ""), declared: 0.75, frozen: false },
            CalibratedParameter { parameter: Parameter { name: "gravity_m_s2".into(), value: 9.81, ci95: None, unit: "m/s²".into() }, declared: 9.81, frozen: true },
        ],
        effects: vec![
            FoundEffect { kind: "quadratic-drag".into(), stands_for: "air resistance of a ball; the textbook value for a table-tennis ball is 0.13 1/m".into(), parameters: vec![parameter("k_per_m", 0.1318, 0.0011, "1/m")], share: Some(0.551), removed: Some(12.6), inclusion: Some(1.0), q_value: Some(1.2e-9), folds: None },
            FoundEffect { kind: "restitution-speed-linear".into(), stands_for: "losses in the shell that grow with impact speed".into(), parameters: vec![parameter("b_s_per_m", 0.0143, 0.0016, "s/m")], share: Some(0.036), removed: Some(0.4), inclusion: Some(0.965), q_value: Some(0.0041), folds: None },
        ],
        leads: vec![Lead {
            kind: "latency".into(),
            inclusion: 0.42,
            chance: Some(0.0031),
            why: "not significant among so many candidates".into(),
            next: "more drops like these, over a wider range of heights".into(),
        }],
        null_records: Some(NullRecords { named: 1, of: 19 }),
        anatomy: anatomy(),
        examples_fitted: false,
        examples_note: String::new(),
        laws: Vec::new(),
        examples: examples(),
        candidates: candidates(),
        score_unit: "nats".into(),
        correlations: Correlations {
            names: names.map(str::to_owned).to_vec(),
            values: vec![
                vec![Some(1.0), None, None, None],
                vec![Some(0.62), Some(1.0), None, None],
                vec![Some(0.88), Some(0.31), Some(1.0), None],
                vec![Some(-0.02), Some(0.04), None, Some(1.0)],
            ],
        },
        noise: Noise {
            sd: Some(2.06),
            ci95: Some([2.01, 2.11]),
            declared_sd: Some(2.0),
            unit: "mm".into(),
            findings: vec![NoiseFinding { kind: "timing-jitter".into(), text: "The clock jitters by 0.6 ms (95 %: 0.4 to 0.8 ms): the noise grows with speed.".into() }],
        },
        alternatives: vec![
            vec!["quadratic-drag".into(), "restitution-speed-linear".into()],
            vec!["quadratic-drag".into(), "restitution-speed-power".into()],
        ],
        unexplained: None,
        next_experiment: Some("Drop ten balls from 2.5 m: there the two restitution laws differ by 9 mm after the second impact, more than four times the noise.".into()),
        model_toml: "scenario = \"ball\"\n\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\nrestitution  = { nominal = 0.8914, min = 0.0, max = 1.0, ci95 = [0.8883, 0.8945] }\n\n[sensor]\nheight_sd_m = 0.00206\n\n[[effect]]\nkind = \"quadratic-drag\"\nk_per_m = { nominal = 0.1318, ci95 = [0.1307, 0.1329] }\n\n[[effect]]\nkind = \"restitution-speed-linear\"\nb_s_per_m = { nominal = 0.0143, ci95 = [0.0127, 0.0159] }\n".into(),
        notes: Vec::new(),
        reproduce: vec!["augsim discover models/table-tennis.toml data/drops.csv --seed 1 --out out/drops".into()],
        methods: vec![
            Method { name: "Levenberg–Marquardt".into(), purpose: "calibration through the simulator.".into(), reference: "Marquardt, An algorithm for least-squares estimation of nonlinear parameters, SIAM J. 11, 1963.".into() },
            Method { name: "Block jackknife".into(), purpose: "whether an effect is away from none, whatever the correlation of the residuals.".into(), reference: "Künsch, The jackknife and the bootstrap for general stationary observations, Ann. Stat. 17, 1989.".into() },
            Method { name: "Bootstrap".into(), purpose: "intervals of the errors, over trajectories.".into(), reference: "Efron, Bootstrap methods: another look at the jackknife, Ann. Stat. 7, 1979.".into() },
        ],
        provenance: provenance("data/drops.csv"),
    }
}
