//! Scoring of discoveries on generated ball data whose truth is read only after the verdict ("sealed" sets).

use crate::gaps::Gaps;
use crate::sealed::{Kind, Scene, Sealed, Truth, draw, seal};
use augsim_data::random_stream;
use augsim_discovery::{Discovery, Options, Unexplained, Verdict, assess, discover};
use augsim_physics::model::Model;
use augsim_system::ScatterPer;
use std::fmt;
use std::time::Instant;

/// A family of generated ball data sets, named by what is true of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Battery {
    /// No effect: the declared model is complete.
    Null,
    /// One effect of the effect library is missing from the model.
    Single,
    /// Two effects of the effect library are missing from the model.
    Pair,
    /// An effect that is not in the effect library is missing from the model.
    Unlisted,
    /// Unusual noise (correlation, jitter, outliers or wrong scale) and no effect.
    Noise,
    /// One effect of the effect library is missing, and a smooth residual differs in each record.
    Misfit,
    /// A smooth residual that differs in each record, and no effect.
    MisfitNull,
}

/// Amplitude of the smooth residual of `Misfit` and `MisfitNull` sets, in standard deviations of the noise.
const SMOOTH_RESIDUAL_SD: f64 = 2.0;

/// Outcome of the discovery on one generated set.
pub struct Row {
    /// Truth, answer and score in one line, for the terminal.
    pub line: String,
    /// Whether the answer is right, or the effect is not visible and nothing was claimed.
    pub right: bool,
}

/// Counts over all generated sets of one run.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Number of generated sets.
    pub sets: usize,
    /// Number of sets in which a fit of the true effects has a better penalised likelihood (visible effects).
    pub visible: usize,
    /// Number of sets with visible effects whose answer names exactly the true effects.
    pub exact: usize,
    /// Number of sets with visible effects in which these are one of the answer's alternatives.
    pub ambiguous: usize,
    /// Number of sets with a wrongly claimed effect: none is true or visible, or another one is.
    pub false_alarms: usize,
    /// Number of sets in which an unlisted effect is reported as explained.
    pub wrongly_explained: usize,
    /// `(covered, all)` for the 95 % intervals of parameters of found true effects, except random effects.
    pub covered: (usize, usize),
    /// `(covered, all)` for the 95 % intervals of standard deviations of random effects.
    ///
    /// They are counted apart because a smooth residual that differs between records looks like a random
    /// effect to any likelihood that does not model its form.
    pub scatter_covered: (usize, usize),
    /// For each set with visible effects: RMSE of the augmented model divided by that of a fit of the true effects.
    pub ratios: Vec<f64>,
    /// Run time of each discovery, s.
    pub seconds: Vec<f64>,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut s = self.seconds.clone();
        s.sort_by(f64::total_cmp);
        let mut r = self.ratios.clone();
        r.sort_by(f64::total_cmp);
        let median = |v: &[f64]| v.get(v.len() / 2).copied().unwrap_or(f64::NAN);
        let within = r.iter().filter(|r| **r <= 1.02).count();
        write!(
            f,
            "{} sets, {} visible, {} exact, {} ambiguous, {} false alarms, {} wrongly explained, intervals {}/{}, of scatter {}/{}, error within 2 % of the oracle {}/{} (worst {:.3}), seconds median {:.2} worst {:.2}",
            self.sets,
            self.visible,
            self.exact,
            self.ambiguous,
            self.false_alarms,
            self.wrongly_explained,
            self.covered.0,
            self.covered.1,
            self.scatter_covered.0,
            self.scatter_covered.1,
            within,
            r.len(),
            r.last().copied().unwrap_or(f64::NAN),
            median(&s),
            s.last().copied().unwrap_or(f64::NAN)
        )
    }
}

/// Sorted kinds of the true effects, as an answer names them.
fn truth_kinds(truth: &Truth) -> Vec<String> {
    let mut k: Vec<String> = truth.effects.iter().map(|e| e.name().to_string()).collect();
    k.sort();
    k
}

/// Sorted kinds of the effects that the discovery found.
fn found_kinds(d: &Discovery) -> Vec<String> {
    let mut k: Vec<String> = d.effects.iter().map(|e| e.kind.clone()).collect();
    k.sort();
    k
}

/// The 95 % interval of the first parameter of an effect; `None` if the discovery did not find the effect.
fn interval(d: &Discovery, effect: &Kind) -> Option<[f64; 2]> {
    let found = d.effects.iter().find(|f| f.kind == effect.name())?;
    Some(found.parameters.values().next()?.ci95)
}

/// Counts the intervals of true effects that were found, and those that contain the true value.
fn count_covered(d: &Discovery, truth: &Truth, summary: &mut Summary) {
    for e in &truth.effects {
        if let Some([low, high]) = interval(d, e) {
            let inside = low <= e.value() && e.value() <= high;
            let is_scatter = matches!(e, Kind::ScatterTrajectory(_) | Kind::ScatterImpact(_));
            let covered = if is_scatter { &mut summary.scatter_covered } else { &mut summary.covered };
            covered.0 += usize::from(inside);
            covered.1 += 1;
        }
    }
}

/// Formats, for each true effect that was found, its true value and its 95 % interval.
fn intervals(d: &Discovery, truth: &Truth) -> String {
    let text = |e: &Kind| {
        let [low, high] = interval(d, e)?;
        Some(format!("{} {:.4e} in [{low:.4e}, {high:.4e}]", e.name(), e.value()))
    };
    truth.effects.iter().filter_map(text).collect::<Vec<_>>().join(", ")
}

/// Generates and scores the sets with seeds `first .. first + count`; passes each outcome to `on_row`.
pub fn run(battery: Battery, first: u64, count: u64, on_row: &mut dyn FnMut(&Row)) -> Summary {
    run_each(first, count, on_row, |seed, summary| run_set(battery, None, seed, summary))
}

/// Like [`run`], with empty cells whose share and pattern depend on the seed ([`Gaps::of_seed`]).
pub fn run_with_gaps(battery: Battery, first: u64, count: u64, on_row: &mut dyn FnMut(&Row)) -> Summary {
    run_each(first, count, on_row, |seed, summary| run_set(battery, Some(Gaps::of_seed(seed)), seed, summary))
}

/// Calls `run_set` for each seed from `first` on and returns the counts.
fn run_each(
    first: u64,
    count: u64,
    on_row: &mut dyn FnMut(&Row),
    run_set: impl Fn(u64, &mut Summary) -> Row,
) -> Summary {
    let mut summary = Summary::default();
    for seed in first..first + count {
        let row = run_set(seed, &mut summary);
        on_row(&row);
    }
    summary
}

/// A generated data set with its truth, its model file and the result of a discovery on it.
struct Trial {
    battery: Battery,
    scene: Scene,
    sealed: Sealed,
    model: Model,
    options: Options,
    found: Discovery,
    seconds: f64,
}

/// Whether the answer on one set is right, with a note for the terminal.
struct Score {
    right: bool,
    note: String,
}

/// Generates one set, runs a discovery on it, and scores the answer.
fn run_set(battery: Battery, gaps: Option<Gaps>, seed: u64, summary: &mut Summary) -> Row {
    let row = run_trial(battery, gaps, seed, summary).and_then(|trial| {
        let score = score(&trial, summary)?;
        Ok(Row { line: trial.line(seed, gaps, &score), right: score.right })
    });
    row.unwrap_or_else(|text| Row { line: format!("seed {seed}: {text}"), right: false })
}

/// Generates a set and runs a discovery on it; the error says why that failed.
fn run_trial(
    battery: Battery,
    gaps: Option<Gaps>,
    seed: u64,
    summary: &mut Summary,
) -> Result<Trial, String> {
    let mut rng = random_stream(seed, &format!("sealed {battery:?}"), 0);
    let effects = match battery {
        Battery::Null | Battery::Noise | Battery::MisfitNull => Some(0),
        Battery::Single | Battery::Misfit => Some(1),
        Battery::Pair => Some(2),
        Battery::Unlisted => None,
    };
    let (scene, mut truth) = draw(&mut rng, effects, battery == Battery::Noise);
    if matches!(battery, Battery::Misfit | Battery::MisfitNull) {
        truth.wobble = SMOOTH_RESIDUAL_SD;
    }
    let mut sealed = seal(&scene, truth, &mut rng).map_err(|e| e.to_string())?;
    if let Some(gaps) = gaps {
        let cut = gaps.cut(&sealed.data, &mut random_stream(seed, "gaps", 0));
        sealed.data = cut.map_err(|e| e.to_string())?;
    }
    let model = Model::parse(&sealed.model, "sealed.toml").map_err(|e| e.to_string())?;
    let options = Options::default();
    let started = Instant::now();
    summary.sets += 1;
    let found = discover(&model, &sealed.data, &options, &mut |_| {}).map_err(|e| e.to_string())?;
    let seconds = started.elapsed().as_secs_f64();
    summary.seconds.push(seconds);
    Ok(Trial { battery, scene, sealed, model, options, found, seconds })
}

/// Compares the answer with the truth, which is read only now, after the verdict.
fn score(trial: &Trial, summary: &mut Summary) -> Result<Score, String> {
    let (d, truth) = (&trial.found, trial.sealed.truth());
    let claims = d.verdict != Verdict::NothingToAdd;
    Ok(match trial.battery {
        Battery::Null | Battery::MisfitNull => {
            summary.false_alarms += usize::from(claims);
            Score { right: !claims, note: String::new() }
        }
        Battery::Noise => score_noise(d, truth, summary),
        Battery::Single | Battery::Pair => score_effects(trial, summary)?,
        Battery::Misfit => {
            let (found, expected) = (found_kinds(d), truth_kinds(truth));
            // The smooth residual is real, so a partial explanation is right, but naming another effect is
            // not.
            let right = found.iter().all(|k| expected.contains(k));
            summary.visible += 1;
            summary.exact += usize::from(found == expected);
            summary.false_alarms += usize::from(!right);
            count_covered(d, truth, summary);
            Score { right, note: intervals(d, truth) }
        }
        Battery::Unlisted => {
            let right = matches!(d.verdict, Verdict::Unknown | Verdict::PartlyExplained);
            summary.visible += usize::from(claims);
            summary.exact += usize::from(right);
            summary.wrongly_explained += usize::from(d.verdict == Verdict::Explained);
            match claims {
                true => Score { right, note: String::new() },
                false => Score { right: true, note: "nothing claimed".into() },
            }
        }
    })
}

/// Scores a set with unusual noise: right if the noise is described and no effect is claimed.
fn score_noise(d: &Discovery, truth: &Truth, summary: &mut Summary) -> Score {
    let expected = if truth.correlation > 0.0 {
        "noise-autocorrelated"
    } else if truth.jitter_s > 0.0 {
        "timing-jitter"
    } else if truth.outliers > 0.0 {
        "outliers"
    } else {
        "noise-scale"
    };
    let is_named = d.noise.findings.iter().any(|f| f == expected);
    let claims = d.verdict != Verdict::NothingToAdd;
    summary.visible += 1;
    summary.exact += usize::from(is_named);
    summary.false_alarms += usize::from(claims);
    let note = format!("expected {expected}, findings {:?}", d.noise.findings);
    Score { right: is_named && !claims, note }
}

/// Scores a set with effects: right if the true effects are named.
///
/// If a fit of the true effects shows that they are invisible, naming none or only true ones is right too.
fn score_effects(trial: &Trial, summary: &mut Summary) -> Result<Score, String> {
    let (d, truth) = (&trial.found, trial.sealed.truth());
    let (found, expected) = (found_kinds(d), truth_kinds(truth));
    let names: Vec<&str> = truth.effects.iter().map(|e| e.name()).collect();
    let shared = truth.effects.iter().any(|e| matches!(e, Kind::ScatterTrajectory(_)));
    let per = if shared { ScatterPer::Record } else { ScatterPer::Event };
    let assess_effects =
        |names: &[&str]| assess(&trial.model, &trial.sealed.data, names, per, &trial.options);
    let oracle = assess_effects(&names).map_err(|e| e.to_string())?;
    let mut visible = oracle.is_visible();
    // With two effects, each must be visible in the presence of the other.
    if names.len() > 1 {
        for n in &names {
            let others: Vec<&str> = names.iter().copied().filter(|m| m != n).collect();
            let gain = assess_effects(&others).map_or(0.0, |o| oracle.gain - o.gain);
            visible &= gain > oracle.penalty / names.len() as f64;
        }
    }
    let claims = d.verdict != Verdict::NothingToAdd;
    let exact = found == expected && d.verdict == Verdict::Explained;
    let ambiguous = !exact && d.alternatives.contains(&expected);
    let right = exact || ambiguous || !visible && (!claims || found.iter().all(|k| expected.contains(k)));
    if !visible {
        summary.false_alarms += usize::from(!right);
        return Ok(Score { right, note: format!("invisible {:.1}/{:.1}", oracle.gain, oracle.penalty) });
    }
    summary.visible += 1;
    summary.exact += usize::from(exact);
    summary.ambiguous += usize::from(ambiguous);
    let ratio = d.error.augmented.rmse / oracle.rmse;
    summary.ratios.push(ratio);
    if exact {
        count_covered(d, truth, summary);
    }
    let note = format!("gain {:.1}/{:.1} ratio {ratio:.3}", oracle.gain, oracle.penalty);
    Ok(Score { right, note })
}

impl Trial {
    /// Formats truth, answer and score of the set in one line, for the terminal.
    fn line(&self, seed: u64, gaps: Option<Gaps>, score: &Score) -> String {
        let (d, truth, scene) = (&self.found, self.sealed.truth(), &self.scene);
        let truth_text = format!(
            "{:?} {:?} rho {} jitter {} outliers {}",
            truth.effects, truth.unlisted, truth.correlation, truth.jitter_s, truth.outliers
        );
        let gaps_text = gaps.map_or(String::new(), |g| {
            format!(" {} % empty {},", 100.0 * g.share, if g.runs { "in runs" } else { "at random" })
        });
        let describe = |u: &Unexplained| format!(" [{} of {}: {}]", u.target, u.feature, u.term);
        let unexplained = d.unexplained.as_ref().map_or(String::new(), describe);
        format!(
            "seed {seed}{gaps_text} {} {}x{} Hz {:.1} mm {}: truth {truth_text} -> {:?} {:?} alt {:?}{unexplained} {} tests lib {:.1e} laws {:.1e} het {:.1e} per {:.1e}; {:.2} s",
            if scene.plane { "2-D" } else { "1-D" },
            scene.trajectories,
            scene.rate_hz,
            1e3 * scene.noise_m,
            if score.right { "ok" } else { "WRONG" },
            d.verdict,
            found_kinds(d),
            d.alternatives,
            score.note,
            d.tests.library,
            d.tests.tables.unwrap_or(1.0),
            d.tests.heterogeneity,
            d.tests.periodicity.unwrap_or(1.0),
            self.seconds,
        )
    }
}
