//! From fits to the result: estimates, candidates with reasons, alternatives, sentences.

use crate::DiscoveryError;
use crate::accept::all_finite;
use crate::addition::{Addition, kinds, labels};
use crate::answer::AnswerParts;
use crate::decide::may_answer;
use crate::error_table::measured_in;
use crate::experiment::next_experiment;
use crate::fit::Fit;
use crate::folds::folds_that_found;
use crate::forecast;
use crate::hypothesis::Hypothesis;
use crate::judged::{Judged, is_as_good};
use crate::longer::fit_up_to;
use crate::remainder::unexplained;
use crate::result::*;
use crate::sentence::{order, sentence};
use augsim_physics::model::Per;
use augsim_physics::system::{Addition as Added, Augmentation, ScatterPer};
use std::collections::BTreeMap;

/// Odds of 10:1 on the training part alone, below which an alternative is as good that the held-out part by itself does not
/// refute by odds of 100:1.
const AMBIGUOUS_TRAIN: f64 = 4.6;

/// Name and unit of each free parameter; those of additions without their kind.
fn names(h: &Hypothesis) -> Vec<(String, String)> {
    h.free
        .iter()
        .map(|f| {
            let Some((number, addition)) = f.addition.map(|n| (n, &h.additions[n])) else {
                let quantity = h.system.quantity(f.index);
                return (quantity.name, quantity.unit);
            };
            let first = h.free.iter().position(|g| g.addition == Some(number)).unwrap_or(0);
            let k = f.index - h.free[first].index;
            match (addition, addition.parameters().get(k)) {
                (Addition::Table(t), _) => (format!("knot{k}"), t.target.quantity.unit.clone()),
                (_, Some(p)) => (p.name.clone(), p.unit.clone()),
                _ => (String::new(), String::new()),
            }
        })
        .collect()
}

/// Estimates of the free parameters of one addition, or of the declared model.
fn estimates(parts: &AnswerParts<'_>, fit: &Fit, addition: Option<usize>) -> BTreeMap<String, Estimate> {
    let h = &fit.hypothesis;
    let (ci, all, intervals) = (fit.ci95(), names(h), fit.intervals());
    let mut out = BTreeMap::new();
    let mut at = 0;
    // Values by group are those of a declared parameter.
    let split = addition.and_then(|n| match &h.additions[n] {
        Addition::Split(split) => Some(split.index),
        _ => None,
    });
    for (f, name_and_unit) in h.free.iter().zip(&all) {
        let width = h.width(f);
        let wanted = split.map_or(f.addition == addition, |index| f.index == index);
        if wanted && width > 0 {
            let (name, unit) = name_and_unit.clone();
            let mut e = Estimate { value: fit.theta[at], ci95: ci[at], unit, groups: BTreeMap::new() };
            if f.per == Per::Group {
                let values = &fit.theta[at..at + width];
                let n = width as f64;
                let mean = values.iter().sum::<f64>() / n;
                let own = |i| if (at..at + width).contains(&i) { 1.0 / n } else { 0.0 };
                let half = intervals.half_width(&(0..fit.theta.len()).map(own).collect::<Vec<_>>());
                e.value = mean;
                e.ci95 = [mean - half, mean + half];
                let names = parts.search.train.data.groups.iter();
                let each = (at..at + width).map(|i| {
                    let (unit, groups) = (e.unit.clone(), BTreeMap::new());
                    Estimate { value: fit.theta[i], ci95: ci[i], unit, groups }
                });
                e.groups = names.cloned().zip(each).collect();
            }
            out.insert(name, e);
        }
        at += width;
    }
    if let (Some(number), Some(scatter)) = (addition, h.scatter)
        && matches!(h.additions[number], Addition::Scatter(_))
    {
        let (value, ci95) = (scatter.sd, fit.scatter_ci95().unwrap_or([scatter.sd; 2]));
        out.insert("sd".into(), Estimate { value, ci95, unit: String::new(), groups: BTreeMap::new() });
    }
    out
}

/// Other sets that explain the data as well, best first, with their kinds: the held-out part confirms each of them, too.
fn alternatives<'p>(parts: &AnswerParts<'p>) -> Vec<(&'p Judged, Vec<String>)> {
    let tabulated = parts.best.additions().iter().any(|a| matches!(a, Addition::Table(_)));
    if parts.best.additions().is_empty() || tabulated {
        return Vec::new();
    }
    let [base, best] = parts.searched;
    let mine = kinds(best.additions());
    let mut out: Vec<(&Judged, Vec<String>)> = Vec::new();
    for j in &parts.found.pool {
        let theirs = kinds(j.additions());
        let superset = mine.iter().all(|k| theirs.contains(k));
        let heldout = best.heldout_ll.zip(j.heldout_ll).map_or(f64::INFINITY, |(a, b)| 2.0 * (a - b));
        let close = is_as_good(j.total() - best.total(), best.unit)
            || j.criterion - best.criterion < AMBIGUOUS_TRAIN * best.unit && is_as_good(heldout, best.unit);
        if close
            && may_answer(parts.search, j, base)
            && !superset
            && theirs.len() <= mine.len() + 1
            && !theirs.is_empty()
            && !out.iter().any(|(_, k)| *k == theirs)
        {
            out.push((j, theirs));
        }
    }
    out
}

fn candidates(parts: &AnswerParts<'_>) -> Vec<Candidate> {
    let [base, best] = parts.searched;
    let records = &parts.search.train.data.system.schema().record[1];
    let mut out: Vec<Candidate> = Vec::new();
    let mut list: Vec<&Judged> = parts.found.tried.iter().filter(|j| !j.additions().is_empty()).collect();
    if !list.iter().any(|j| j.additions() == best.additions()) && !best.additions().is_empty() {
        list.insert(0, best);
    }
    let is_first = !parts.found.pool.iter().any(|j| j.total() < best.total());
    let them = if best.additions().is_empty() { "the calibrated model" } else { "the chosen set" };
    let mut seen: Vec<Vec<String>> = Vec::new();
    for j in list {
        let key = labels(j.additions());
        if seen.contains(&key) {
            continue;
        }
        seen.push(key);
        let pooled =
            parts.found.pool.iter().find(|p| labels(p.additions()) == labels(j.additions())).unwrap_or(j);
        let gain = 2.0 * (j.fit.ll - base.fit.ll);
        // Gains in units of the dispersion.
        let (gain, penalty) = (gain / j.unit, j.penalty / j.unit);
        // A model that cannot be simulated over the held-out part has no gain there.
        let heldout_gain = pooled.heldout_ll.zip(base.heldout_ll).map(|(a, b)| (a - b) / j.unit);
        let heldout_gain = heldout_gain.filter(|gain| gain.is_finite());
        let chosen = labels(j.additions()) == labels(best.additions());
        let worse = (j.criterion - best.criterion) / best.unit;
        let why = if chosen && is_first {
            format!("chosen: best on training and held-out {records} together")
        } else if chosen {
            "chosen: others fit better, but free runs or intervals speak against them".into()
        } else if gain < penalty {
            format!("gain {gain:.1} does not pay for its penalty {penalty:.1}")
        } else if heldout_gain.is_some_and(|g| g <= 0.0) {
            format!("gains on the training {records} only")
        } else if worse > 0.0 {
            format!("fits worse than {them} by {worse:.1}")
        } else if pooled.heldout_ll.is_some() && pooled.total() > best.total() {
            format!("worse than {them} on held-out {records}")
        } else {
            format!("fits better than {them}, but free runs or intervals speak against it")
        };
        let mut parameters = BTreeMap::new();
        for (n, a) in j.additions().iter().enumerate() {
            for (name, e) in estimates(parts, &j.fit, Some(n)) {
                parameters.insert(format!("{}.{name}", a.kind()), e);
            }
        }
        out.push(Candidate {
            kinds: kinds(j.additions()),
            parameters,
            gain,
            penalty,
            heldout_gain,
            fitted: true,
            chosen,
            why,
        });
    }
    out.sort_by(|a, b| {
        (b.chosen, b.gain - b.penalty)
            .partial_cmp(&(a.chosen, a.gain - a.penalty))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    for s in &parts.found.base_scores {
        let label = vec![s.addition.kind().to_string()];
        if out.iter().any(|c| c.kinds == label) {
            continue;
        }
        let parameters = s
            .addition
            .parameters()
            .iter()
            .zip(s.estimate.iter().zip(&s.sd))
            .filter(|(_, (_, sd))| s.rank > 0.0 && sd.is_finite())
            .map(|(p, (v, sd))| {
                let e = Estimate {
                    value: *v,
                    ci95: [v - 1.96 * sd, v + 1.96 * sd],
                    unit: p.unit.clone(),
                    groups: BTreeMap::new(),
                };
                (format!("{}.{}", s.addition.kind(), p.name), e)
            })
            .collect();
        let gain = s.dispersion.map_or(s.statistic, |d| s.statistic / d.factor);
        let penalty = parts.search.penalty(&s.addition);
        out.push(Candidate {
            kinds: label,
            parameters,
            gain,
            penalty,
            heldout_gain: None,
            fitted: false,
            chosen: false,
            why: if s.rank == 0.0 {
                "cannot be seen in these data".into()
            } else {
                format!("its test gives {gain:.1}: no sign of it")
            },
        });
    }
    out
}

fn effects(parts: &AnswerParts<'_>) -> Vec<FoundEffect> {
    let [base, best] = parts.searched;
    let whole = 2.0 * (best.fit.ll - base.fit.ll);
    let additions = best.additions();
    let drawn = drawn(parts, whole);
    let several = additions.len() + usize::from(drawn.is_some()) > 1;
    let is_table = |a: &Addition| matches!(a, Addition::Table(_));
    let fitted =
        |set: &[Addition]| match parts.found.tried.iter().find(|j| labels(j.additions()) == labels(set)) {
            Some(j) => j.fit.clone(),
            None => parts.search.refit(&best.fit, set, &[]).fit,
        };
    // A table takes the place of any law: what an effect does is told beside the other effects alone, where they can do without
    // the table.
    let laws: Vec<Addition> = additions.iter().filter(|a| !is_table(a)).cloned().collect();
    let alone = (laws.len() < additions.len()).then(|| fitted(&laws)).filter(|fit| fit.ll.is_finite());
    let error = |fit: &Fit| forecast::first_rmse(&parts.search.test, fit);
    let over_longer = |fit: Fit| fit_up_to(&parts.search.train, fit, parts.joined.unwrap_or(1));
    let (others, beside, longer) = match alone {
        Some(fit) => (laws, fit.ll, several.then(|| over_longer(fit))),
        None => (additions.to_vec(), best.fit.ll, several.then(|| parts.best.fit.clone())),
    };
    let error_beside = longer.map(|fit| error(&fit));
    let mut out: Vec<FoundEffect> = Vec::new();
    for (n, a) in additions.iter().enumerate().filter(|(_, a)| !is_table(a)) {
        let rest: Vec<Addition> = others.iter().filter(|other| *other != a).cloned().collect();
        let without = fitted(&rest);
        let lawful = matches!(a, Addition::Effect(..) | Addition::Split(_));
        let share = share_of_gain(beside, without.ll, whole);
        let removed = error_beside.filter(|_| lawful).map(|beside| error(&over_longer(without)) - beside);
        out.push(FoundEffect {
            kind: a.kind().into(),
            stands_for: a.listed().map_or(Vec::new(), |effect| effect.stands_for.clone()),
            parameters: estimates(parts, parts.full, Some(n)),
            folds: (!parts.folds.is_empty()).then(|| {
                let label = kinds(std::slice::from_ref(a));
                [folds_that_found(&parts.folds, &label[0]), parts.folds.len()]
            }),
            share,
            formula: a.listed().and_then(|effect| {
                let grammar = effect.grammar.as_ref()?;
                let (of, unit) = (grammar.of.name.clone(), grammar.of.unit.clone());
                Some(FoundFormula { text: effect.formula.clone(), of, unit, range: grammar.range })
            }),
            removed: removed.filter(|x| x.is_finite()),
            per: match a {
                Addition::Scatter(s) => Some(s.word.clone()),
                _ => None,
            },
        });
    }
    if let Some((effect, share)) = drawn {
        out.iter_mut().for_each(|e| e.share *= 1.0 - share);
        out.push(effect);
    }
    order(&mut out, parts.error.calibrated.rmse - parts.error.augmented.rmse);
    out
}

/// An effect's share of the `whole` gain, by the ln likelihoods of the model with it and without it: all of it where without it
/// nothing can be simulated.
fn share_of_gain(with: f64, without: f64, whole: f64) -> f64 {
    if without.is_finite() { (2.0 * (with - without) / whole).clamp(0.0, 1.0) } else { 1.0 }
}

/// Parameters that are drawn anew for each record, if they were found, and their share of the gain; `laws` is the gain of
/// what was added.
fn drawn(parts: &AnswerParts<'_>, laws: f64) -> Option<(FoundEffect, f64)> {
    let (scattered, sd) = parts.scattered.filter(|s| !s.declared).zip(parts.drawn_sd.clone())?;
    let schema = parts.search.train.data.system.schema();
    let effect = &schema.drawn.as_ref()?.scatter;
    let share = scattered.gain / (scattered.gain + (laws / parts.best.unit).max(0.0));
    let name = effect.parameters.first().map_or("sd", |p| &p.name);
    let found = FoundEffect {
        kind: effect.kind.clone(),
        stands_for: effect.stands_for.clone(),
        parameters: BTreeMap::from([(name.to_string(), sd)]),
        share,
        folds: None,
        formula: None,
        removed: None,
        per: Some(schema.record[0].clone()),
    };
    Some((found, share))
}

pub(crate) fn report(parts: AnswerParts<'_>) -> Result<Discovery, DiscoveryError> {
    let found_effects = effects(&parts);
    let unexplained = unexplained(&parts);
    let others = alternatives(&parts);
    let next_experiment = next_experiment(&parts, others.first(), &unexplained);
    let alternatives: Vec<Vec<String>> = others.into_iter().map(|(_, kinds)| kinds).collect();
    let sentence = sentence(&parts, &found_effects, &unexplained, &alternatives);
    let fit = parts.full;
    let h = &fit.hypothesis;
    let data = parts.search.train.data;
    let covariance = fit.covariance();
    let mut axis: Vec<String> = Vec::new();
    for (f, (name, _)) in h.free.iter().zip(names(h)) {
        let of = f.addition.map_or(String::new(), |n| format!("{}.", h.additions[n].kind()));
        axis.extend((0..h.width(f)).map(|g| {
            if h.width(f) > 1 { format!("{of}{name}[{}]", data.groups[g]) } else { format!("{of}{name}") }
        }));
    }
    let n = axis.len();
    let sd = |i: usize| covariance.at(i, i).max(1e-300).sqrt();
    let matrix = (0..n).map(|i| (0..n).map(|j| covariance.at(i, j) / (sd(i) * sd(j))).collect()).collect();
    let noise = parts.noise;
    let schema = data.system.schema();
    let (unit, decides) = measured_in(schema);
    let decisive: Vec<f64> = decides.iter().map(|&c| noise.white[c]).collect();
    // Noise between neighbours alone says nothing of colour and time stamps.
    let estimated = |value: f64| (!data.is_idealised()).then_some(value);
    let mut augmentation = h.augmentation(data, &fit.theta, &fit.ci95());
    augmentation.scatter_ci95 = fit.scatter_ci95();
    if let Some(sd) = &parts.drawn_sd {
        let is_declared = parts.scattered.is_some_and(|s| s.declared);
        (augmentation.scatter_sd, augmentation.scatter_ci95) = (Some(sd.value), Some(sd.ci95));
        augmentation.additions.extend((!is_declared).then_some(Added::Scatter(ScatterPer::Record, sd.value)));
    }
    let model_toml = parts.model.augmented(&augmentation)?;
    let base = &parts.base.fit;
    let mut calibrated = base.hypothesis.augmentation(data, &base.theta, &base.ci95());
    calibrated.scatter_ci95 = base.scatter_ci95();
    let models = Models {
        declared_toml: parts.model.augmented(&Augmentation::default())?,
        calibrated_toml: parts.model.augmented(&calibrated)?,
    };
    let found = Discovery {
        schema: SCHEMA.into(),
        verdict: parts.verdict,
        sentence,
        warnings: Vec::new(),
        notes: Vec::new(),
        noise_cause: None,
        effects: found_effects,
        calibrated: estimates(&parts, &parts.base.fit, None),
        parameters: estimates(&parts, fit, None),
        noise: NoiseFound {
            sd: (decisive.iter().map(|s| s * s).sum::<f64>() / decisive.len() as f64).sqrt(),
            unit,
            by_channel: noise.white.clone(),
            correlation: estimated(noise.correlation),
            jitter_s: estimated(noise.jitter_s),
            frame_s: noise.frame_s,
            outliers: (!data.is_idealised()).then_some(noise.outliers),
            findings: noise.findings.iter().map(|f| f.to_string()).collect(),
        },
        alternatives,
        unexplained,
        next_experiment,
        candidates: candidates(&parts),
        anatomy: parts.anatomy.clone(),
        tests: parts.tests.tests(),
        correlations: (axis, matrix),
        errors: parts.errors.clone(),
        horizons: parts.horizons.clone(),
        windows: parts.windows.clone(),
        dispersion: data.is_idealised().then(|| fit.dispersion(0..0, data.white_share).factor),
        model_toml,
        models,
        heldout: parts.search.test.records().map(|r| r.seen.id.clone()).collect(),
        examples: Vec::new(),
        cut_after_s: None,
        error: parts.error,
        work: data.tally.work(),
    };
    all_finite(found, &data.name)
}

#[cfg(test)]
mod tests {
    //! Contract: shares of the gain are between 0 and 1, also where a model cannot do without an effect.
    use super::*;

    #[test]
    fn an_effect_without_which_nothing_can_be_simulated_has_the_whole_gain() {
        assert_eq!(share_of_gain(-10.0, -60.0, 200.0), 0.5);
        assert_eq!(share_of_gain(-10.0, f64::NEG_INFINITY, 200.0), 1.0);
        assert_eq!(share_of_gain(-60.0, -10.0, 200.0), 0.0);
    }
}
