//! A discovery as a page.

use crate::args::Discover;
use crate::command_line::quoted;
use crate::record::{fingerprint, shown};
use augsim_discovery::{Bin, Discovery, Estimate, Rmse, Verdict};
use augsim_physics::model::{ModelFile, Parameter};
use augsim_report::discovery as page;
use augsim_report::page::{DataSource, Method, Provenance};
use augsim_report::{DiscoveryReport, discovery};
use std::collections::BTreeMap;
use std::path::Path;

/// Percentiles that a discovery lists, as quantiles of a normal law: 1, 5, 25, 50, 75, 95, 99 %.
const NORMAL_QUANTILES: [f64; 7] = [-2.326_348, -1.644_854, -0.674_490, 0.0, 0.674_490, 1.644_854, 2.326_348];

/// A declared parameter: name, value, and whether it is frozen.
pub type Declared = (String, f64, bool);

/// The declared model, as far as the page shows it.
#[derive(Debug)]
pub struct Subject {
    /// The kind of system.
    pub scenario: String,
    /// What is forecast.
    pub quantity: String,
    /// The declared parameters.
    pub declared: Vec<Declared>,
}

impl From<&ModelFile> for Subject {
    fn from(model: &ModelFile) -> Self {
        let (scenario, quantity, parameters): (&str, &str, &[Parameter]) = match model {
            ModelFile::Ball(m) => ("ball", "forecast after the first flight", &m.parameters),
            ModelFile::Push(m) => {
                ("push", "position of the object, open loop from a measured pose", &m.parameters)
            }
        };
        let declared = parameters.iter().map(|p| (p.name.clone(), p.nominal, p.frozen)).collect();
        Self { scenario: scenario.into(), quantity: quantity.into(), declared }
    }
}

impl From<&augsim_written::Model> for Subject {
    fn from(model: &augsim_written::Model) -> Self {
        let declared = model.parameters.iter().map(|p| (p.name.clone(), p.nominal, p.frozen)).collect();
        let output = model.outputs.first().map_or("", |o| &o.name);
        Self {
            scenario: model.name.clone(),
            quantity: format!("free run of {output} from its first samples"),
            declared,
        }
    }
}

/// Fills the page's input.
pub fn page(args: &Discover, seed: u64, subject: &Subject, d: &Discovery) -> DiscoveryReport {
    let Subject { scenario, quantity, declared } = subject;
    let name = args.data.file_stem().unwrap_or_default().to_string_lossy();
    DiscoveryReport {
        title: format!("{name}: what the model lacks"),
        scenario: scenario.clone(),
        verdict: match d.verdict {
            Verdict::NothingToAdd => page::Verdict::NothingToAdd,
            Verdict::Explained => page::Verdict::Explained,
            Verdict::PartlyExplained => page::Verdict::PartlyExplained,
            Verdict::Unknown => page::Verdict::Unknown,
        },
        sentence: d.sentence.clone(),
        warnings: d.warnings.iter().map(|w| w.text.clone()).collect(),
        error: page::ErrorSummary {
            quantity: quantity.clone(),
            unit: d.error.unit.clone(),
            heldout_trajectories: d.error.heldout_trajectories as u64,
            declared: Some(rmse(d.error.declared)),
            calibrated: Some(rmse(d.error.calibrated)),
            augmented: Some(rmse(d.error.augmented)),
            noise_floor: Some(rmse(d.error.noise_floor)),
            reduction: (!d.effects.is_empty()).then(|| rmse(d.error.reduction)),
            folds: d.error.folds.map(|n| n as u64),
            explained_share: d.error.explained_share,
        },
        calibrated: declared
            .iter()
            .filter_map(|(name, nominal, frozen)| {
                let fitted = d.parameters.get(name);
                (fitted.is_some() || *frozen).then(|| page::CalibratedParameter {
                    parameter: match fitted {
                        Some(e) => parameter(name, e),
                        None => page::Parameter { name: name.clone(), value: *nominal, ..Default::default() },
                    },
                    declared: *nominal,
                    frozen: *frozen,
                })
            })
            .collect(),
        effects: d
            .effects
            .iter()
            .map(|e| page::FoundEffect {
                kind: e.kind.clone(),
                stands_for: e.stands_for.join(", "),
                parameters: parameters(&e.parameters),
                share: Some(e.share),
                folds: e.folds.map(|f| f.map(|n| n as u64)),
            })
            .collect(),
        anatomy: anatomy(d),
        candidates: d
            .candidates
            .iter()
            .map(|c| page::Candidate {
                kinds: c.kinds.clone(),
                parameters: parameters(&c.parameters),
                score: Some(c.gain - c.penalty),
                chosen: c.chosen,
                why: c.why.clone(),
            })
            .collect(),
        score_unit: "gain in -2 ln likelihood less its penalty".to_owned(),
        correlations: page::Correlations {
            names: d.correlations.0.clone(),
            values: d.correlations.1.iter().map(|row| row.iter().copied().map(Some).collect()).collect(),
        },
        noise: page::Noise {
            sd: Some(d.noise.sd),
            unit: d.noise.unit.clone(),
            findings: d
                .noise
                .findings
                .iter()
                .map(|kind| page::NoiseFinding { kind: kind.clone(), text: noise_text(kind, d) })
                .collect(),
            ..Default::default()
        },
        alternatives: d.alternatives.clone(),
        unexplained: d.unexplained.as_ref().map(|u| page::Unexplained {
            r#where: u.place.clone(),
            against: u.against.clone(),
            term: format!("{}: {}", u.target, u.term),
        }),
        next_experiment: Some(d.next_experiment.clone()).filter(|t| !t.is_empty()),
        model_toml: d.model_toml.clone(),
        reproduce: vec![repeat(args, seed)],
        methods: methods(d),
        notes: notes(d),
        provenance: Provenance {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: Some(seed),
            data: vec![source(&args.model, &args.out), source(&args.data, &args.out)],
            ..Provenance::default()
        },
        ..DiscoveryReport::default()
    }
}

fn rmse(r: Rmse) -> page::Rmse {
    page::Rmse { rmse: r.rmse, ci95: Some(r.ci95) }
}

fn parameter(name: &str, e: &Estimate) -> page::Parameter {
    page::Parameter { name: name.to_owned(), value: e.value, ci95: Some(e.ci95), unit: e.unit.clone() }
}

fn parameters(all: &BTreeMap<String, Estimate>) -> Vec<page::Parameter> {
    let each = |(name, e): (&String, &Estimate)| {
        let groups = e.groups.iter().map(|(group, of)| parameter(&format!("{name} of {group}"), of));
        [parameter(name, e)].into_iter().chain(groups).collect::<Vec<_>>()
    };
    all.iter().flat_map(each).collect()
}

/// Unit and words of a feature that residuals are binned by.
fn feature(name: &str) -> (String, String) {
    let (words, unit) = match name {
        "time_s" => ("time", "s"),
        "height_m" => ("height", "m"),
        "speed_m_s" => ("speed", "m/s"),
        "heading_rad" => ("heading of the rod", "rad"),
        other => (other, ""),
    };
    (words.to_owned(), unit.to_owned())
}

fn anatomy(d: &Discovery) -> page::Anatomy {
    let a = &d.anatomy;
    let empty = Vec::new();
    page::Anatomy {
        profiles: a
            .before
            .iter()
            .map(|(name, before)| {
                let (against, against_unit) = feature(name);
                discovery::Profile {
                    against,
                    against_unit,
                    residual: "mean residual".to_owned(),
                    unit: "noise sd".to_owned(),
                    before: bins(before),
                    after: bins(a.after.get(name).unwrap_or(&empty)),
                }
            })
            .collect(),
        autocorrelation: Some(page::ResidualAutocorrelation {
            lag: (0..a.autocorrelation_before.len()).map(|l| l as f64).collect(),
            lag_unit: "samples".to_owned(),
            before: a.autocorrelation_before.clone(),
            after: a.autocorrelation_after.clone(),
            white95: None,
        }),
        quantiles: Some(page::ResidualQuantiles {
            normal: NORMAL_QUANTILES.to_vec(),
            before: a.quantiles_before.clone(),
            after: a.quantiles_after.clone(),
        }),
        ..Default::default()
    }
}

/// Means with 95 % intervals.
fn bins(all: &[Bin]) -> page::Bins {
    let half =
        |b: &Bin| 1.96 * (b.rms * b.rms - b.mean * b.mean).max(0.0).sqrt() / (b.count.max(1) as f64).sqrt();
    page::Bins {
        x: all.iter().map(|b| b.x).collect(),
        mean: all.iter().map(|b| b.mean).collect(),
        lower95: all.iter().map(|b| b.mean - half(b)).collect(),
        upper95: all.iter().map(|b| b.mean + half(b)).collect(),
    }
}

fn noise_text(kind: &str, d: &Discovery) -> String {
    let n = &d.noise;
    match kind {
        "noise-autocorrelated" => {
            n.correlation.map_or(String::new(), |r| format!("neighbouring samples correlate with {r:.2}"))
        }
        "timing-jitter" => {
            n.jitter_s.map_or(String::new(), |s| format!("time stamps scatter by {:.2} ms", 1e3 * s))
        }
        "outliers" => n
            .outliers
            .map_or(String::new(), |count| format!("{count} samples lie too far off and were left out")),
        "noise-scale" => format!("the sensor scatters by {:.4} {}, not as declared", n.sd, n.unit),
        _ => String::new(),
    }
}

/// The command that repeats the discovery; the folder of the results does not decide them.
fn repeat(args: &Discover, seed: u64) -> String {
    let mut words = vec!["augsim".to_owned(), "discover".to_owned()];
    words.extend([&args.model, &args.data].map(|path| shown(path, &args.out)));
    words.extend(["--train-share".to_owned(), args.train_share.to_string()]);
    words.extend(args.group.iter().flat_map(|group| ["--group".to_owned(), group.clone()]));
    words.extend(args.accept.accept.iter().flat_map(|check| ["--accept".to_owned(), check.to_string()]));
    words.extend(["--seed".to_owned(), seed.to_string(), "--out".to_owned(), "DIR".to_owned()]);
    quoted(&words)
}

fn source(path: &Path, out: &Path) -> DataSource {
    DataSource { path: shown(path, out), hash: fingerprint(path) }
}

/// What the page says beside its tables: windows, dispersion, further measures and horizons.
fn notes(d: &Discovery) -> Vec<String> {
    let mut notes = Vec::new();
    if let Some(rule) = &d.windows.rule {
        let ([train, test], [a, b]) = (d.windows.fitted, d.windows.left_out);
        notes.push(format!(
            "{train} windows were fitted and {test} held out; {a} and {b} of them were {rule}."
        ));
    }
    notes.extend(d.dispersion.map(|dispersion| {
        format!(
            "Gradients scatter {dispersion:.1} times as much as white noise would make them: gains in likelihood are in units of it."
        )
    }));
    notes.extend(d.errors.iter().map(|(measure, e)| {
        let (declared, calibrated) = (e.declared.rmse, e.calibrated.rmse);
        let (augmented, floor) = (e.augmented.rmse, e.noise_floor.rmse);
        format!(
            "Error of {measure} on the same forecasts, {}: declared {declared:.3}, calibrated {calibrated:.3}, augmented {augmented:.3}, noise floor {floor:.3}.",
            e.unit
        )
    }));
    notes.extend(d.horizons.iter().flat_map(|h| {
        h.errors.iter().map(|(measure, e)| {
            let gain = e.reduction;
            format!(
                "After {} s from a measured state ({} forecasts), {measure}, {}: declared {:.3}, calibrated {:.3}, augmented {:.3}; gain over calibration {:.3}, 95 % interval {:.3} to {:.3}.",
                h.horizon_s, h.forecasts, e.unit, e.declared.rmse, e.calibrated.rmse, e.augmented.rmse, gain.rmse,
                gain.ci95[0], gain.ci95[1]
            )
        })
    }));
    notes
}

/// The methods that an answer was found by.
fn methods(d: &Discovery) -> Vec<Method> {
    let method = |name: &str, purpose: &str, reference: &str| Method {
        name: name.to_owned(),
        purpose: purpose.to_owned(),
        reference: reference.to_owned(),
    };
    let mut all = vec![
        method(
            "Variable projection",
            "initial states are eliminated from every fit",
            "Golub, Pereyra: The Differentiation of Pseudo-Inverses and Nonlinear Least Squares, 1973",
        ),
        method(
            "Levenberg-Marquardt with exact sensitivities",
            "fits through events and contact, by dual numbers with the derivative of the event time",
            "Marquardt: An Algorithm for Least-Squares Estimation of Nonlinear Parameters, 1963",
        ),
        method(
            "Score test",
            "which effect the residual asks for",
            "Rao: Large sample tests of statistical hypotheses, 1948",
        ),
    ];
    if d.tests.periodicity.is_some() {
        all.push(method(
            "Laplace approximation, evidence fixed point",
            "a parameter of the events that scatters",
            "MacKay: Bayesian Interpolation, Neural Computation 1992",
        ));
    }
    if d.dispersion.is_some() {
        all.extend([
            method(
                "Multiple shooting",
                "records are cut into windows, whose starts are eliminated from every fit",
                "Bock, Plitt: A Multiple Shooting Algorithm for Direct Solution of Optimal Control Problems, 1984",
            ),
            method(
                "Dispersion of gradients",
                "likelihood ratios where residuals are not white",
                "Rotnitzky, Jewell: Hypothesis Testing of Regression Parameters in Semiparametric GLMs for Cluster Correlated Data, 1990",
            ),
        ]);
    }
    all.extend([
        method(
            "Sandwich covariance",
            "intervals of the parameters",
            "White: Maximum Likelihood Estimation of Misspecified Models, 1982",
        ),
        method(
            "Bootstrap over records",
            "intervals of the held-out error",
            "Efron, Tibshirani: An Introduction to the Bootstrap, 1993",
        ),
    ]);
    all
}
