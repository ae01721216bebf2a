//! From fits to the result: estimates, candidates with reasons, alternatives, tables.

use crate::DiscoveryError;
use crate::addition::{Addition, kinds, labels};
use crate::answer::AnswerParts;
use crate::closed_term::unexplained;
use crate::error_table::deciding_measure;
use crate::experiment::{confirming_experiment, next_experiment};
use crate::finite::all_finite;
use crate::fit::{Fit, fit_nuisance};
use crate::forecast;
use crate::group_distribution::GroupDistribution;
use crate::hypothesis::Hypothesis;
use crate::judge::{Lead as SearchResult, Shortcoming, record_name};
use crate::residual_structure::anatomy;
use crate::residuals::outlying_windows;
use crate::result::*;
use crate::score::Scored;
use crate::search::{ALPHA, without};
use crate::sentence::{order, sentence};
use augsim_system::{Addition as Added, Augmentation, Per, ScatterPer};
use std::collections::BTreeMap;

/// Name and unit of each free parameter of a hypothesis. Names of added parameters do not contain the kind of
/// the effect.
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

/// Estimates of the free parameters of one addition by name, or of the declared model if `addition` is
/// `None`.
fn estimates(parts: &AnswerParts<'_>, set: &Scored, addition: Option<usize>) -> BTreeMap<String, Estimate> {
    let (fit, h) = (&set.fit, &set.fit.hypothesis);
    let (ci, names_and_units, intervals) = (set.ci95(), names(h), set.intervals());
    let fills_bounds = set.fills_bounds(&ci);
    let axis = axis(h, &parts.prepared.data.groups);
    let mut out = BTreeMap::new();
    // The parameters of groupwise values are declared ones.
    let split = addition.and_then(|n| match &h.additions[n] {
        Addition::Split(split) => Some(split.index),
        _ => None,
    });
    for ((f, range), name_and_unit) in h.entries().zip(&names_and_units) {
        let (next, width) = (range.start, range.len());
        let is_same = split.map_or(f.addition == addition, |index| f.index == index);
        if is_same && width > 0 {
            let (name, unit) = name_and_unit.clone();
            let mut e = Estimate { value: fit.theta[next], ci95: ci[next], unit, ..Estimate::default() };
            if f.per == Per::Group {
                let values = &fit.theta[range.clone()];
                let n = width as f64;
                let mean = values.iter().sum::<f64>() / n;
                let share = |i| if range.contains(&i) { 1.0 / n } else { 0.0 };
                let half = intervals.half_width(&(0..fit.theta.len()).map(share).collect::<Vec<_>>());
                e.value = mean;
                e.ci95 = [mean - half, mean + half];
                let names = parts.prepared.data.groups.iter();
                let each = range.clone().map(|i| {
                    let unit = e.unit.clone();
                    Estimate { value: fit.theta[i], ci95: ci[i], unit, ..Estimate::default() }
                });
                e.groups = names.cloned().zip(each).collect();
                let found = e.groups.iter().map(|(name, e)| (name.clone(), e.value, e.ci95));
                e.distribution = GroupDistribution::of_estimates(&found.collect::<Vec<_>>(), ALPHA);
            } else if fills_bounds[next] {
                e.set_not_identified(&inseparable(set, &fills_bounds, next, &axis));
            }
            out.insert(name, e);
        }
    }
    if let (Some(number), Some(scatter)) = (addition, h.scatter)
        && matches!(h.additions[number], Addition::Scatter(_))
    {
        let (value, ci95) = (scatter.sd, set.scatter_ci95().unwrap_or([scatter.sd; 2]));
        out.insert("sd".into(), Estimate { value, ci95, ..Estimate::default() });
    }
    out
}

/// Absolute correlation of two estimates above which the data do not distinguish them.
///
/// Above it, one estimate explains more than half of the variance of the other.
const INSEPARABLE_CORRELATION: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Names of the parameters from which an entry of theta (the shared parameters), whose interval fills its
/// bounds, is not distinguishable.
fn inseparable(set: &Scored, fills_bounds: &[bool], entry: usize, axis: &[String]) -> Vec<String> {
    let correlations = set.correlations();
    let is_inseparable = |j: &usize| {
        *j != entry && (fills_bounds[*j] || correlations.at(entry, *j).abs() > INSEPARABLE_CORRELATION)
    };
    (0..axis.len()).filter(is_inseparable).map(|j| axis[j].clone()).collect()
}

/// Loss of gain minus penalty, nats, from which on a fitted set is no rival of the chosen one: odds of 1000 to 1.
const MAX_RIVAL_LOSS: f64 = 6.9;
/// Maximum number of rivals whose models the result has.
const MAX_RIVALS: usize = 4;

/// Last displayed digit of the gains in the list of candidates, nats. A smaller difference is shown as 0.0.
const SHOWN_STEP: f64 = 0.1;

/// Fitted sets of effects, each once, with the reason why each is chosen or not. They are sorted by their
/// gain over the chosen set.
fn candidates(parts: &AnswerParts<'_>) -> Vec<Candidate> {
    let (found, best) = (parts.found, parts.best);
    let mut known_keys: Vec<Vec<String>> = Vec::new();
    let mut out: Vec<Candidate> = Vec::new();
    // A subset of the best set may have failed to fit; it was compared with nothing.
    for set in found.sets.iter().chain([best]).filter(|s| !s.additions().is_empty() && s.is_finite()) {
        let key = set.key();
        if known_keys.contains(&key) {
            continue;
        }
        let chosen = key == best.key();
        let gain = set.gain_over(parts.base, set.evidence.independence.share);
        let penalty = found.penalty.of_set(set.additions());
        let over_chosen = if chosen { 0.0 } else { found.margin(set, best) };
        known_keys.push(key);
        let why = if chosen && parts.judged.findings.inclusion.is_empty() {
            "the best set when the run was stopped; not tested".to_owned()
        } else if chosen {
            "chosen: every effect is significant and selected in at least 90 % of the resamples".to_owned()
        } else if gain < penalty {
            format!("its gain of {gain:.1} nats is below its penalty of {penalty:.1} nats")
        } else if !found.is_significant(parts.search, set) {
            "contains an effect that is not significant among this many candidates".to_owned()
        } else if over_chosen > 0.0 {
            "its advantage over the chosen set is within the scatter over blocks, and it is larger or less stable".to_owned()
        } else if over_chosen > -0.5 * SHOWN_STEP {
            "predicts as well as the chosen set".to_owned()
        } else {
            format!("predicts worse than the chosen set by {:.1} nats", -over_chosen)
        };
        let mut parameters = BTreeMap::new();
        for (n, a) in set.additions().iter().enumerate() {
            for (name, e) in estimates(parts, set, Some(n)) {
                parameters.insert(format!("{}.{name}", a.kind()), e);
            }
        }
        out.push(Candidate {
            kinds: labels(set.additions()),
            parameters,
            gain,
            penalty,
            over_chosen,
            fitted: true,
            chosen,
            why,
        });
    }
    let by = |c: &Candidate| (c.chosen, c.over_chosen);
    out.sort_by(|a, b| by(b).partial_cmp(&by(a)).unwrap_or(std::cmp::Ordering::Equal));
    out
}

/// The set of effects without one of its additions; it is fitted now if it was not fitted before.
fn set_without(parts: &AnswerParts<'_>, set: &Scored, number: usize) -> Scored {
    let remaining = without(set.additions(), number);
    match parts.found.with_key(&labels(&remaining)) {
        Some(known) => known.clone(),
        None => parts.search.refit(&set.fit, &remaining, &Vec::new()),
    }
}

/// The effects of the result with their estimates, in the order of its sentence.
fn effects(parts: &AnswerParts<'_>, error: &ErrorTable) -> Vec<FoundEffect> {
    let (best, findings) = (parts.best, &parts.judged.findings);
    let named = &parts.found.sets[findings.named];
    let independent = best.evidence.independence.share;
    let whole = best.gain_over(parts.base, independent);
    let drawn = random_effect(parts, whole);
    let several = best.additions().len() + usize::from(drawn.is_some()) > 1;
    let rmse = |fit: &Fit| forecast::rmse_by_measure(parts.example_records, fit);
    let own_errors = several.then(|| rmse(&best.fit));
    let mut out: Vec<FoundEffect> = Vec::new();
    for (n, a) in best.additions().iter().enumerate() {
        let Some(place) = named.additions().iter().position(|other| other == a) else { continue };
        let remaining = set_without(parts, best, n);
        let lawful = matches!(a, Addition::Effect(..) | Addition::Split(_));
        // Differences of the errors without and with the effect, for each measure.
        let removed: Option<Vec<f64>> = own_errors
            .as_ref()
            .filter(|_| lawful)
            .map(|own| rmse(&remaining.fit).iter().zip(own).map(|(without, own)| without - own).collect());
        let share = best.gain_over(&remaining, independent) / whole;
        let folds = &parts.errors.folds;
        let label = kinds(std::slice::from_ref(a));
        out.push(FoundEffect {
            kind: a.kind().into(),
            stands_for: a.listed().map_or(Vec::new(), |effect| effect.equivalent_causes.clone()),
            parameters: estimates(parts, parts.full, Some(n)),
            inclusion: findings.inclusion.get(place).copied(),
            q_value: findings.q_values.get(place).copied(),
            folds: (!folds.is_empty())
                .then(|| [folds.iter().filter(|f| f.contains(&label[0])).count(), folds.len()]),
            share: if share.is_finite() { share.clamp(0.0, 1.0) } else { 1.0 },
            formula: a.listed().and_then(|effect| {
                let grammar = effect.formula_domain.as_ref()?;
                let (quantity, unit) = (grammar.variable.name.clone(), grammar.variable.unit.clone());
                Some(FoundFormula { text: effect.formula.clone(), of: quantity, unit, range: grammar.range })
            }),
            removed_by_measure: removed.as_deref().map_or_else(BTreeMap::new, |list| by_measure(parts, list)),
            removed: removed.and_then(|list| list.first().copied()).filter(|x| x.is_finite()),
            per: match a {
                Addition::Scatter(s) => Some(s.draw_unit.clone()),
                Addition::Effect(_, Per::Group) => Some("group".to_owned()),
                _ => None,
            },
        });
    }
    if let Some((effect, share)) = drawn {
        out.iter_mut().for_each(|e| e.share *= 1.0 - share);
        out.push(effect);
    }
    order(&mut out, error.calibrated.rmse - error.augmented.rmse);
    out
}

/// Values of each measure by its name, in the unit of its error table; empty if there is only one measure.
fn by_measure(parts: &AnswerParts<'_>, values: &[f64]) -> BTreeMap<String, f64> {
    let measures = &parts.prepared.data.system.schema().error_figures;
    if measures.len() < 2 {
        return BTreeMap::new();
    }
    let named = measures.iter().zip(values).enumerate().map(|(i, (measure, value))| {
        // The table of the first measure has the unit of its channels.
        let scale = if i == 0 { 1.0 } else { measure.unit.1 };
        (measure.name.clone(), scale * value)
    });
    named.filter(|(_, value)| value.is_finite()).collect()
}

/// The random effect per record, if one was found, and its share of the total gain. `laws` is the gain of the
/// other effects, nats.
fn random_effect(parts: &AnswerParts<'_>, laws: f64) -> Option<(FoundEffect, f64)> {
    let scattered = parts
        .judged
        .random_effect
        .as_ref()
        .filter(|s| !s.is_declared && parts.judged.withdrawal_reason.is_none());
    let (scattered, sd) = scattered.zip(parts.random_effect_sd.clone())?;
    let schema = parts.prepared.data.system.schema();
    let effect = &schema.record_random_effect.as_ref()?.scatter;
    let share = scattered.gain / (scattered.gain + laws.max(0.0));
    let name = effect.parameters.first().map_or("sd", |p| &p.name);
    let found = FoundEffect {
        kind: effect.kind.clone(),
        stands_for: effect.equivalent_causes.clone(),
        parameters: BTreeMap::from([(name.to_string(), sd)]),
        share,
        per: Some(schema.record[0].clone()),
        ..FoundEffect::default()
    };
    Some((found, share))
}

/// The leads (effects that are not established), each with the reason and the experiment that would confirm
/// it.
fn leads(parts: &AnswerParts<'_>) -> Vec<Lead> {
    let lead = |lead: &SearchResult| Lead {
        kind: kinds(std::slice::from_ref(&lead.addition))[0].clone(),
        inclusion: lead.inclusion,
        chance: lead.chance.filter(|p| p.is_finite()),
        why: match lead.short {
            Shortcoming::NotSignificant => "not significant among this many candidates",
            Shortcoming::NotStable => "selected in fewer than 90 % of the resamples of the data",
            Shortcoming::StandsForMemory => "not significant beside a dependence on the past",
            Shortcoming::WithinScatter => "within the scatter between recordings with the same inputs",
            Shortcoming::BesideRandomEffect => "not significant beside differences between recordings",
            Shortcoming::DoesNotPay => "its gain in predictions of left-out blocks is below its penalty",
        }
        .into(),
        next: confirming_experiment(parts, &lead.addition),
    };
    parts.judged.findings.leads.iter().map(lead).collect()
}

/// Names of the entries of theta (the shared parameters), with the group in brackets.
fn axis(h: &Hypothesis, groups: &[String]) -> Vec<String> {
    let mut axis: Vec<String> = Vec::new();
    for (f, (name, _)) in h.free.iter().zip(names(h)) {
        let prefix = f.addition.map_or(String::new(), |n| format!("{}.", h.additions[n].kind()));
        axis.extend((0..h.width(f)).map(|g| {
            if h.width(f) > 1 { format!("{prefix}{name}[{}]", groups[g]) } else { format!("{prefix}{name}") }
        }));
    }
    axis
}

impl AnswerParts<'_> {
    /// Gain of the result over the calibrated model in the log predictive density of left-out blocks, nats.
    pub fn gain(&self) -> f64 {
        let gain = self.best.gain_over(self.base, self.best.evidence.independence.share);
        if gain.is_finite() { gain } else { 0.0 }
    }

    /// Error table of the deciding measure, the first of the schema.
    pub fn table(&self) -> ErrorTable {
        let data = &self.prepared.data;
        let folds = Some(self.errors.folds.len()).filter(|n| *n > 0);
        let table = self.errors.lists.first(data.system.schema(), self.seed, self.gain());
        let free_run = self.errors.free_run.and_then(|[calibrated, augmented]| {
            FreeRun::from_errors(&*data.system, Some(calibrated), Some(augmented))
        });
        ErrorTable { folds, free_run, ..table }
    }

    /// Error tables of all measures but the deciding one, by name.
    fn other_tables(&self) -> BTreeMap<String, ErrorTable> {
        let schema = self.prepared.data.system.schema();
        let folds = Some(self.errors.folds.len()).filter(|n| *n > 0);
        let all = self.errors.lists.other_figures(schema, self.seed, self.gain());
        all.into_iter().map(|(name, table)| (name, ErrorTable { folds, ..table })).collect()
    }

    /// Tests of the residuals that the augmented model leaves, in the format of the result.
    fn tests(&self) -> Tests {
        let tests = &self.judged.residual_tests;
        let schema = self.prepared.data.system.schema();
        let differs = tests.records < ALPHA;
        let outlying = tests.outlying.filter(|_| differs).and_then(|n| record_name(self.search, n));
        Tests {
            memory: MemoryFound {
                p_value: tests.memory.p_value,
                depends_on_past: tests.memory.is_significant(),
                like: tests.memory.best.as_ref().map(|a| kinds(std::slice::from_ref(a)).concat()),
            },
            library: tests.library,
            tables: tests.has_tables.then_some(tests.tables),
            heterogeneity: tests.records,
            outlying: outlying.map(str::to_owned),
            periodicity: schema.event.is_some().then_some(tests.periodicity),
            pass: tests.none_is_significant(),
        }
    }

    /// Noise estimate, in the format of the result.
    fn noise(&self) -> NoiseFound {
        let (noise, data) = (&self.prepared.noise, &self.prepared.data);
        let (unit, decides) = deciding_measure(data.system.schema());
        let deciding_sd: Vec<f64> = decides.iter().map(|&c| noise.white[c]).collect();
        // The noise between neighbouring samples gives neither autocorrelation nor jitter.
        let estimated = |value: f64| (!data.is_idealised()).then_some(value);
        NoiseFound {
            sd: (deciding_sd.iter().map(|s| s * s).sum::<f64>() / deciding_sd.len() as f64).sqrt(),
            unit,
            by_channel: noise.white.clone(),
            correlation: estimated(noise.correlation),
            jitter_s: estimated(noise.jitter_s),
            frame_s: noise.frame_s,
            outliers: (!data.is_idealised()).then_some(noise.outliers),
            findings: noise.findings.iter().map(|f| f.to_string()).collect(),
        }
    }

    /// Numbers of fitted and excluded windows; `None` where no window can be excluded.
    fn windows(&self) -> Option<Windows> {
        if !self.limit.is_finite() {
            return None;
        }
        let with_nuisances =
            |set: &Scored| fit_nuisance(self.example_records, &set.fit.hypothesis, &set.fit.theta, &[]);
        let sides = [
            [self.base.fit.clone(), self.best.fit.clone()],
            [with_nuisances(self.base), with_nuisances(self.best)],
        ];
        let count = |[base, best]: &[Fit; 2]| {
            outlying_windows(self.limit, [base, best]).into_iter().filter(|out| *out).count()
        };
        Some(Windows {
            fitted: sides.each_ref().map(|[base, _]| base.residual_norms.len()),
            excluded: sides.each_ref().map(count),
            rule: format!(
                "a window is excluded if the residuals of both the calibrated and the augmented model exceed {:.2} noise standard \
                 deviations (root mean square), three times the typical residual",
                self.limit.sqrt()
            ),
        })
    }

    /// Text of the augmented model file.
    fn model_toml(&self) -> Result<String, DiscoveryError> {
        let (full, data) = (self.full, &self.prepared.data);
        let h = &full.fit.hypothesis;
        let mut augmentation =
            h.augmentation(data, &full.fit.theta, &full.identified_ci95(), &full.covariance());
        augmentation.scatter_ci95 = full.scatter_ci95();
        if let Some(sd) = self.random_effect_sd.as_ref().filter(|_| self.judged.withdrawal_reason.is_none()) {
            let is_declared = self.judged.random_effect.as_ref().is_some_and(|s| s.is_declared);
            (augmentation.scatter_sd, augmentation.scatter_ci95) = (Some(sd.value), Some(sd.ci95));
            let drawn = Added::Scatter(ScatterPer::Record, sd.value);
            augmentation.additions.extend((!is_declared).then_some(drawn));
        }
        Ok(self.model.augmented(&augmentation)?)
    }

    /// Texts of the declared and the calibrated model file.
    fn models(&self) -> Result<Models, DiscoveryError> {
        let (base, data) = (self.base, &self.prepared.data);
        let mut calibrated = base.fit.hypothesis.augmentation(
            data,
            &base.fit.theta,
            &base.identified_ci95(),
            &base.covariance(),
        );
        calibrated.scatter_ci95 = base.scatter_ci95();
        Ok(Models {
            declared_toml: self.model.augmented(&Augmentation::default())?,
            calibrated_toml: self.model.augmented(&calibrated)?,
            rivals: self.rivals(),
        })
    }

    /// The fitted sets that the data do not reject beside the named one, best first.
    ///
    /// Sets with values by group or with random effects are left out: they are no single model of a new record.
    fn rivals(&self) -> Vec<Rival> {
        let is_plain = |s: &&Scored| {
            let h = &s.fit.hypothesis;
            s.is_finite()
                && h.scatter.is_none()
                && h.entries().all(|(f, _)| f.per != Per::Group)
                && s.key() != self.best.key()
        };
        let mut alive: Vec<(f64, &Scored)> = (self.found.sets.iter().filter(is_plain))
            .map(|set| (self.found.margin(set, self.best), set))
            .filter(|(margin, _)| *margin > -MAX_RIVAL_LOSS)
            .collect();
        alive.sort_by(|a, b| b.0.total_cmp(&a.0));
        alive.dedup_by(|a, b| a.1.key() == b.1.key());
        alive.truncate(MAX_RIVALS);
        let rival = |(margin, set): (f64, &Scored)| {
            let (h, theta) = (&set.fit.hypothesis, &set.fit.theta);
            let found = h.augmentation(&self.prepared.data, theta, &set.identified_ci95(), &set.covariance());
            // A set that no model file can state, such as two forms of one effect, is no explanation.
            let model_toml = self.model.augmented(&found).ok()?;
            Some(Rival { kinds: kinds(set.additions()), over_chosen: margin, model_toml })
        };
        alive.into_iter().filter_map(rival).collect()
    }
}

/// Assembles the result of a discovery. Fails if a number is not finite or the model file cannot be written.
pub(crate) fn report(parts: &AnswerParts<'_>) -> Result<Discovery, DiscoveryError> {
    let (data, findings) = (&parts.prepared.data, &parts.judged.findings);
    let error = parts.table();
    let found_effects = effects(parts, &error);
    let unexplained = unexplained(parts);
    let alternatives: Vec<Vec<String>> =
        findings.alternatives.iter().map(|n| kinds(parts.found.sets[*n].additions())).collect();
    let (full, schema) = (parts.full, data.system.schema());
    let correlations = full.correlations();
    let n = correlations.n;
    let matrix = (0..n).map(|i| (0..n).map(|j| correlations.at(i, j)).collect()).collect();
    let false_positives = findings.false_positives;
    let view = parts.all_records.sample();
    let found = Discovery {
        schema: SCHEMA.into(),
        verdict: parts.judged.verdict,
        sentence: sentence(parts, &error, &found_effects, &unexplained, &alternatives),
        warnings: Vec::new(),
        notes: Vec::new(),
        noise_cause: None,
        repeats: Vec::new(),
        next_experiment: next_experiment(parts, &unexplained),
        effects: found_effects,
        leads: leads(parts),
        null_records: (false_positives.runs > 0)
            .then_some(NullRecords { named: false_positives.named, of: false_positives.runs }),
        calibrated: estimates(parts, parts.base, None),
        parameters: estimates(parts, full, None),
        noise: parts.noise(),
        alternatives,
        unexplained,
        candidates: candidates(parts),
        anatomy: anatomy(&view, &parts.calibrated.fit, &full.fit),
        tests: parts.tests(),
        correlations: (axis(&full.fit.hypothesis, &data.groups), matrix),
        error,
        errors: parts.other_tables(),
        horizons: parts.errors.lists.horizons(schema, parts.seed),
        windows: parts.windows(),
        independent: Some(full.evidence.independence.share),
        model_toml: parts.model_toml()?,
        models: parts.models()?,
        heldout: parts.prepared.held_out.iter().map(|&j| data.records[j].data.id.clone()).collect(),
        examples: Vec::new(),
        fold_example: parts.errors.example.clone(),
        cut_after_s: None,
        work: data.work.totals(),
    };
    all_finite(found, &data.name)
}
