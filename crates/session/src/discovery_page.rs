//! A discovery as a page.

use crate::{Circumstances, Subject};
use augsim_data::Unit;
use augsim_discovery::{Bin, Candidate, Discovery, Estimate, Example, ExampleChannel, Rmse, Verdict};
use augsim_physics::model::{ModelFile, Parameter};
use augsim_physics::system::TopView;
use augsim_report::discovery as page;
use augsim_report::page::{Method, Provenance};
use augsim_report::{DiscoveryReport, discovery};
use std::collections::BTreeMap;

/// Percentiles that a discovery lists, as quantiles of a normal law: 1, 5, 25, 50, 75, 95, 99 %.
const NORMAL_QUANTILES: [f64; 7] = [-2.326_348, -1.644_854, -0.674_490, 0.0, 0.674_490, 1.644_854, 2.326_348];

/// A declared parameter: name, value, and whether it is frozen.
type Declared = (String, f64, bool);

/// The declared model, as far as the page shows it.
#[derive(Debug)]
struct Shown {
    /// The kind of system.
    scenario: String,
    /// The quantity that is forecast.
    quantity: String,
    /// The declared parameters.
    declared: Vec<Declared>,
    /// The declared standard deviation of the sensor.
    sd: Option<f64>,
}

impl From<&Subject> for Shown {
    fn from(subject: &Subject) -> Self {
        match subject {
            Subject::BuiltIn(model) => Shown::from(&**model),
            Subject::Written(model) => Shown::from(&**model),
        }
    }
}

impl From<&ModelFile> for Shown {
    fn from(model: &ModelFile) -> Self {
        let (scenario, quantity, parameters, sd): (&str, &str, &[Parameter], Option<f64>) = match model {
            ModelFile::Ball(m) => ("ball", "forecast after the first flight", &m.parameters, m.position_sd_m),
            ModelFile::Push(m) => (
                "push",
                "position of the object, open loop from a measured pose",
                &m.parameters,
                m.position_sd_m,
            ),
        };
        let declared = parameters.iter().map(|p| (p.name.clone(), p.nominal, p.frozen)).collect();
        Self { scenario: scenario.into(), quantity: quantity.into(), declared, sd }
    }
}

impl From<&augsim_written::Model> for Shown {
    fn from(model: &augsim_written::Model) -> Self {
        let declared = model.parameters.iter().map(|p| (p.name.clone(), p.nominal, p.frozen)).collect();
        let output = model.outputs.first().map_or("", |o| &o.name);
        Self {
            scenario: model.name.clone(),
            quantity: format!("free run of {output} from its first samples"),
            declared,
            sd: None,
        }
    }
}

/// Fills the page's input.
pub fn page(of: &Circumstances, subject: &Subject, d: &Discovery) -> DiscoveryReport {
    let Shown { scenario, quantity, declared, sd } = &Shown::from(subject);
    let name = &of.name;
    DiscoveryReport {
        title: format!("{name}: what the model lacks"),
        scenario: scenario.clone(),
        verdict: match d.verdict {
            Verdict::NothingToAdd => page::Verdict::NothingToAdd,
            Verdict::Explained => page::Verdict::Explained,
            Verdict::PartlyExplained => page::Verdict::PartlyExplained,
            Verdict::Unknown => page::Verdict::Unknown,
            Verdict::NotThisSystem => page::Verdict::NotThisSystem,
        },
        sentence: d.sentence.clone(),
        warnings: d.warnings.iter().map(|w| w.text.clone()).collect(),
        error: page::ErrorSummary {
            quantity: quantity.clone(),
            unit: told_in(&d.error.unit).0.to_owned(),
            heldout_trajectories: d.error.heldout_trajectories as u64,
            declared: Some(rmse(d, d.error.declared)),
            calibrated: Some(rmse(d, d.error.calibrated)),
            augmented: d.adds().then(|| rmse(d, d.error.augmented)),
            noise_floor: Some(rmse(d, d.error.noise_floor)),
            reduction: (!d.effects.is_empty()).then(|| rmse(d, d.error.reduction)),
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
                        None => {
                            let unit = Unit::of_column_name(name).map_or(String::new(), |u| u.symbol());
                            page::Parameter {
                                name: name.clone(),
                                value: *nominal,
                                unit,
                                ..Default::default()
                            }
                        }
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
                removed: e.removed.map(|r| told_in(&d.error.unit).1 * r),
                inclusion: e.inclusion,
                q_value: e.q_value,
                folds: e.folds.map(|f| f.map(|n| n as u64)),
            })
            .collect(),
        leads: d
            .leads
            .iter()
            .map(|lead| page::Lead {
                kind: lead.kind.clone(),
                inclusion: lead.inclusion,
                chance: lead.chance,
                why: lead.why.clone(),
                next: lead.next.clone(),
            })
            .collect(),
        null_records: d.null_records.map(|n| page::NullRecords { named: n.named as u64, of: n.of as u64 }),
        anatomy: anatomy(d),
        laws: of.pictures.laws.clone(),
        examples: if of.pictures.examples.is_empty() { examples(d) } else { of.pictures.examples.clone() },
        examples_fitted: d.heldout.is_empty(),
        examples_note: if of.pictures.examples.is_empty() { "" } else { "Data that the models were fitted to in windows, over a stretch in which every turn can be seen: each model runs on from \
                        the first 20 samples, calibrated (before) and with the effects added (after)." }
            .to_owned(),
        candidates: candidates(d)
            .into_iter()
            .map(|c| page::Candidate {
                kinds: c.kinds.clone(),
                parameters: parameters(&c.parameters),
                score: Some(c.gain - c.penalty),
                chosen: c.chosen,
                why: c.why.clone(),
            })
            .collect(),
        score_unit: "nats".to_owned(),
        correlations: page::Correlations {
            names: d.correlations.0.clone(),
            values: d.correlations.1.iter().map(|row| row.iter().copied().map(Some).collect()).collect(),
        },
        noise: page::Noise {
            sd: Some(d.noise.sd),
            declared_sd: *sd,
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
            target: u.target.clone(),
            term: u.term.clone(),
        }),
        next_experiment: Some(d.next_experiment.clone()).filter(|t| !t.is_empty()),
        model_toml: d.model_toml.clone(),
        reproduce: Some(of.reproduce.clone()).filter(|command| !command.is_empty()).into_iter().collect(),
        methods: methods(d),
        notes: notes(d),
        provenance: Provenance {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: Some(of.seed),
            data: of.sources.clone(),
            ..Provenance::default()
        },
    }
}

/// The unit in which a page tells an error, and how many of it are in one unit of the result: sentences have mm as well.
fn told_in(unit: &str) -> (&str, f64) {
    if unit == "m" { ("mm", 1e3) } else { (unit, 1.0) }
}

fn rmse(d: &Discovery, r: Rmse) -> page::Rmse {
    let scale = told_in(&d.error.unit).1;
    page::Rmse { rmse: scale * r.rmse, ci95: Some(r.ci95.map(|v| scale * v)) }
}

/// The examples: each in the channel in which the declared model misses most, the same for all; pushes from above.
fn examples(d: &Discovery) -> Vec<page::Example> {
    let gap = |a: Option<f64>, b: Option<f64>| a.zip(b).map_or(0.0, |(a, b)| (a - b).powi(2));
    let misfit = |c: usize| -> f64 {
        let each = d.examples.iter().filter_map(|e| e.channels.get(c));
        each.flat_map(|c| c.measured.iter().zip(&c.declared)).map(|(m, f)| gap(*m, *f)).sum()
    };
    let count = d.examples.first().map_or(0, |e| e.channels.len());
    let most = (0..count).max_by(|&a, &b| misfit(a).total_cmp(&misfit(b))).unwrap_or(0);
    d.examples.iter().filter_map(|e| Some(example(e, e.channels.get(most)?, !d.effects.is_empty()))).collect()
}

fn example(e: &Example, c: &ExampleChannel, added: bool) -> page::Example {
    let (unit, scale) = told_in(if e.scene.is_some() { "m" } else { &c.unit });
    let plain = |list: &[Option<f64>]| -> Vec<f64> { list.iter().map(|v| v.unwrap_or(f64::NAN)).collect() };
    let error = scale * e.rmse[1];
    let trajectory = format!("{}: {}, error {error:.3} {unit}", e.rank, e.id);
    let (channel, _) = feature(&c.column);
    let base = page::Example {
        trajectory,
        channel: channel.trim_end_matches("_m").to_owned(),
        unit: c.unit.clone(),
        t_s: e.times_s.clone(),
        measured: plain(&c.measured),
        before: plain(&c.declared),
        after: if added { plain(&c.augmented) } else { Vec::new() },
        known_until_s: e.times_s.get(e.known).copied().filter(|_| e.known > 1),
        top_view: None,
    };
    match &e.scene {
        None => base,
        Some(scene) => pushed(base, e, scene, added),
    }
}

/// A push: its view from above, and the distance of each forecast from the measured position instead of a channel.
fn pushed(base: page::Example, e: &Example, scene: &TopView, added: bool) -> page::Example {
    let value = |c: usize, k: usize, of: fn(&ExampleChannel) -> &Vec<Option<f64>>| {
        of(&e.channels[c])[k].unwrap_or(f64::NAN)
    };
    let outline = |k: usize, of: fn(&ExampleChannel) -> &Vec<Option<f64>>| -> Vec<[f64; 2]> {
        let [x, y, angle] = [0, 1, 2].map(|c| value(c, k, of));
        let (sin, cos) = angle.sin_cos();
        scene.outline_m.iter().map(|[a, b]| [x + cos * a - sin * b, y + sin * a + cos * b]).collect()
    };
    let distance = |of: fn(&ExampleChannel) -> &Vec<Option<f64>>| -> Vec<f64> {
        let off = |c: usize, k: usize| value(c, k, |c| &c.measured) - value(c, k, of);
        // Measured less predicted: a distance is shown as an error of none.
        (0..e.times_s.len()).map(|k| -off(0, k).hypot(off(1, k))).collect()
    };
    let last = e.times_s.len().saturating_sub(1);
    let rod = |at: Option<&[f64; 2]>| -> Vec<[f64; 2]> {
        let corner = |i: usize, [x, y]: [f64; 2]| {
            let turn = std::f64::consts::TAU * i as f64 / 24.0;
            [x + scene.rod_radius_m * turn.cos(), y + scene.rod_radius_m * turn.sin()]
        };
        at.map_or_else(Vec::new, |at| (0..24).map(|i| corner(i, *at)).collect())
    };
    page::Example {
        unit: "m".to_owned(),
        measured: vec![0.0; e.times_s.len()],
        before: distance(|c| &c.declared),
        after: if added { distance(|c| &c.augmented) } else { Vec::new() },
        top_view: Some(page::TopView {
            start: outline(0, |c| &c.measured),
            ends: [
                outline(last, |c| &c.measured),
                outline(last, |c| &c.declared),
                if added { outline(last, |c| &c.augmented) } else { Vec::new() },
            ],
            rod: scene.rod_m.clone(),
            rod_outlines: [rod(scene.rod_m.first()), rod(scene.rod_m.last())],
        }),
        ..base
    }
}

fn parameter(name: &str, e: &Estimate) -> page::Parameter {
    page::Parameter { name: name.to_owned(), value: e.value, ci95: Some(e.ci95), unit: e.unit.clone() }
}

fn parameters(all: &BTreeMap<String, Estimate>) -> Vec<page::Parameter> {
    let each = |(name, e): (&String, &Estimate)| {
        let groups = e.groups.iter().map(|(group, of)| parameter(&format!("{name} of {group}"), of));
        let own = if e.groups.is_empty() { name.clone() } else { format!("{name}, mean over groups") };
        [parameter(&own, e)].into_iter().chain(groups).collect::<Vec<_>>()
    };
    all.iter().flat_map(each).collect()
}

/// The candidates: the chosen one, then the others by gain less penalty.
fn candidates(d: &Discovery) -> Vec<&Candidate> {
    let mut all: Vec<&Candidate> = d.candidates.iter().collect();
    let place = |c: &Candidate| (!c.chosen, !c.fitted, -(c.gain - c.penalty));
    all.sort_by(|a, b| place(a).partial_cmp(&place(b)).unwrap_or(std::cmp::Ordering::Equal));
    all
}

/// Unit and words of a feature that residuals are binned by.
fn feature(name: &str) -> (String, String) {
    let (words, unit) = match name {
        "time_s" => ("time", "s"),
        "height_m" | "z_m" => ("height", "m"),
        "x_m" => ("x", "m"),
        "y_m" => ("y", "m"),
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
            let scatter = n.jitter_s.map(|s| format!("time stamps scatter by {:.2} ms", 1e3 * s));
            let frames = n
                .frame_s
                .map(|s| format!(" about frames of {:.3} ms, on which the samples were put", 1e3 * s));
            scatter.unwrap_or_default() + &frames.unwrap_or_default()
        }
        "outliers" => n
            .outliers
            .map_or(String::new(), |count| format!("{count} samples lie too far off and were left out")),
        "noise-scale" => format!("the sensor scatters by {:.4} {}, not as declared", n.sd, n.unit),
        _ => String::new(),
    }
}

/// Notes below the tables of a page: windows, independent residuals, further measures and horizons.
fn notes(d: &Discovery) -> Vec<String> {
    let mut notes = Vec::new();
    if let Some(windows) = &d.windows {
        let ([train, test], [a, b]) = (windows.fitted, windows.left_out);
        let rule = &windows.rule;
        notes.push(format!(
            "{train} windows were fitted and {test} predicted; {a} and {b} of them were {rule}."
        ));
    }
    notes.extend(d.independent.map(|share| {
        format!(
            "Residuals of the answer are autocorrelated as if {:.0} % of them were independent: gains count so many.",
            100.0 * share
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
            "Block cross-validation in one Gauss-Newton step",
            "how well a set of effects predicts what it was not fitted to",
            "Beirami, Razaviyayn, Shahrampour, Tarokh: On Optimal Generalizability in Parametric Learning, 2017",
        ),
        method(
            "Block jackknife",
            "whether an effect is away from none, whatever the correlation of the residuals",
            "Kuensch: The Jackknife and the Bootstrap for General Stationary Observations, 1989",
        ),
        method(
            "Effective sample size",
            "autocorrelated residuals count less in a gain",
            "Bartlett: On the Theoretical Specification and Sampling Properties of Autocorrelated Time-Series, 1946",
        ),
        method(
            "Bayesian bootstrap over blocks",
            "share of the resamples in which a finding comes back",
            "Rubin: The Bayesian Bootstrap, 1981",
        ),
        method(
            "q-values under dependence",
            "share of false findings among those that are as significant",
            "Benjamini, Yekutieli: The Control of the False Discovery Rate in Multiple Testing under Dependency, 2001",
        ),
    ];
    if d.tests.periodicity.is_some() {
        all.push(method(
            "Laplace approximation, evidence fixed point",
            "a parameter of the events that scatters",
            "MacKay: Bayesian Interpolation, Neural Computation 1992",
        ));
    }
    if d.null_records.is_some() {
        all.push(method(
            "Wild cluster bootstrap",
            "how often records like these name an effect where none is missing",
            "Cameron, Gelbach, Miller: Bootstrap-Based Improvements for Inference with Clustered Errors, 2008",
        ));
    }
    if d.error.folds.is_some() {
        all.push(method(
            "Nested cross-validation",
            "errors on data that neither a fit nor the choice of the model has seen",
            "Varma, Simon: Bias in Error Estimation When Using Cross-Validation for Model Selection, 2006",
        ));
    }
    all.extend([
        method(
            "Sandwich covariance",
            "intervals of the parameters",
            "White: Maximum Likelihood Estimation of Misspecified Models, 1982",
        ),
        method(
            "Bootstrap over records",
            "intervals of the errors on data that no fit has seen",
            "Efron, Tibshirani: An Introduction to the Bootstrap, 1993",
        ),
    ]);
    all
}
