//! The answer as `result.json` has it.

use super::decide::Decided;
use super::experiment::{confirm, separate, stands_for};
use super::fit::{Fit, Sample};
use super::numbers::Numbers;
use crate::DiscoveryError;
use crate::accept::all_finite;
use crate::folds::again;
use crate::result::{
    Anatomy, Discovery, ErrorTable, Estimate, FoundEffect, Models, NoiseFound, PushFound, PushHorizon,
    SCHEMA, Tests, Verdict,
};
use augsim_physics::effects::EffectSpec;
use augsim_physics::model::{EffectBlock, ModelFile, Parameter, Per, PushModel};
use augsim_physics::push::effects::{SCATTER_KIND, SCATTER_SPEC, spec_of};
use augsim_physics::system::ScatterPer;
use std::collections::BTreeMap;

/// What the answer is made of.
pub(crate) struct Parts<'a> {
    pub model: &'a PushModel,
    pub decided: &'a Decided<'a>,
    pub everything: &'a Sample<'a>,
    /// The best set fitted to all windows.
    pub full: &'a Fit,
    /// Size of the scatter from push to push, where there is one.
    pub sd_m: Option<Estimate>,
    pub tests: Tests,
    pub verdict: Verdict,
    pub error: ErrorTable,
    pub rotation: ErrorTable,
    pub horizons: Vec<PushHorizon>,
    /// Kinds that each fold found, where the loop was repeated on folds.
    pub folds: Vec<Vec<String>>,
    pub anatomy: Anatomy,
}

/// The scatter, if it was found, and its share of the gain in likelihood.
fn scattered(parts: &Parts<'_>) -> Option<(FoundEffect, f64)> {
    let (scatter, sd_m) = parts.decided.scatter.as_ref().zip(parts.sd_m.clone())?;
    let search = &parts.decided.search;
    let best = &search.tried[parts.decided.best];
    let laws = (search.base().fit.cost(&search.train) - best.fit.cost(&search.train)) / best.unit;
    let share = scatter.gain / (scatter.gain + laws.max(0.0));
    let effect = FoundEffect {
        kind: SCATTER_KIND.into(),
        stands_for: SCATTER_SPEC.stands_for.iter().map(|s| s.to_string()).collect(),
        parameters: BTreeMap::from([(SCATTER_SPEC.parameters[0].name.to_string(), sd_m)]),
        share,
        removed: None,
        folds: None,
        formula: None,
        per: Some("push".into()),
    };
    (!scatter.declared).then_some((effect, share))
}

fn effects(parts: &Parts<'_>, numbers: &Numbers<'_>) -> Vec<FoundEffect> {
    let scattered = scattered(parts);
    let rest = 1.0 - scattered.as_ref().map_or(0.0, |(_, share)| *share);
    let mut found: Vec<FoundEffect> = parts
        .decided
        .ranking
        .shares
        .iter()
        .map(|&(kind, share)| {
            let mut also: Vec<String> = Vec::new();
            for name in spec_of(kind).map_or(&[][..], |s| s.stands_for).iter().chain(stands_for(kind)) {
                if !also.iter().any(|known| known == name) {
                    also.push(name.to_string());
                }
            }
            FoundEffect {
                folds: (!parts.folds.is_empty()).then(|| [again(&parts.folds, kind), parts.folds.len()]),
                kind: kind.to_string(),
                stands_for: also,
                parameters: numbers.estimates(Some(kind)),
                removed: None,
                share: share * rest,
                formula: None,
                per: None,
            }
        })
        .collect();
    found.extend(scattered.map(|(effect, _)| effect));
    found.sort_by(|a, b| b.share.total_cmp(&a.share));
    found
}

/// An effect at its null.
fn block(spec: &EffectSpec, scatter: Option<ScatterPer>) -> EffectBlock {
    let parameters = spec
        .parameters
        .iter()
        .map(|p| Parameter {
            name: p.name.into(),
            nominal: p.null,
            min: p.min,
            max: p.max,
            frozen: false,
            per: Per::All,
            ci95: None,
            groups: Vec::new(),
        })
        .collect();
    EffectBlock { kind: spec.kind.to_string(), scatter, table: None, parameters }
}

/// A model with the numbers of a fit in it.
fn with_values(model: &PushModel, fit: &Fit, numbers: &Numbers<'_>) -> PushModel {
    let declared = model.parameters.len();
    let mut model = model.clone();
    let h = &fit.hypothesis;
    for kind in &h.kinds {
        model.effects.extend(spec_of(kind).map(|spec| block(spec, None)));
    }
    let mut slots: Vec<&mut Parameter> = model.parameters.iter_mut().collect();
    for block in &mut model.effects {
        if augsim_physics::push::effects::index_of(&block.kind).is_some() {
            slots.extend(block.parameters.iter_mut());
        }
    }
    for (i, f) in h.free.iter().enumerate().filter(|(_, f)| f.group.is_none()) {
        if let Some(p) = slots.get_mut(f.index) {
            let e = numbers.estimate(i);
            // Rounding must not carry the mean of groups at a bound beyond it.
            p.nominal = e.value.clamp(p.min, p.max);
            p.ci95 = Some(e.ci95);
            if !e.groups.is_empty() {
                p.per = Per::Group;
                p.groups = e.groups.into_iter().map(|(name, e)| (name, e.value)).collect();
            } else if p.per == Per::Group {
                // One group in the data: its value is the only one.
                p.groups = numbers.groups().iter().map(|name| (name.clone(), p.nominal)).collect();
            }
        }
    }
    for p in model.parameters.iter().take(declared) {
        if p.ci95.is_some() && !model.declared.contains(&p.name) {
            model.declared.push(p.name.clone());
        }
    }
    model
}

/// The answer: the model with everything that was found in it.
fn augmented(parts: &Parts<'_>, numbers: &Numbers<'_>) -> PushModel {
    let mut model = with_values(parts.model, parts.full, numbers);
    if let Some(sd_m) = &parts.sd_m {
        if !model.effects.iter().any(|b| b.kind == SCATTER_KIND) {
            model.effects.push(block(&SCATTER_SPEC, Some(ScatterPer::Record)));
        }
        let blocks = model.effects.iter_mut().filter(|b| b.kind == SCATTER_KIND);
        for p in blocks.flat_map(|b| &mut b.parameters).filter(|p| !p.frozen) {
            (p.nominal, p.ci95) = (sd_m.value, Some(sd_m.ci95));
        }
    }
    model
}

fn sentence(parts: &Parts<'_>, effects: &[FoundEffect], alternatives: &[Vec<String>]) -> String {
    let words: Vec<String> = effects
        .iter()
        .map(|e| {
            let p: Vec<String> = e.parameters.iter().map(|(n, v)| v.phrase(n)).collect();
            let mut told = if p.is_empty() { Vec::new() } else { vec![p.join(", ")] };
            // What the folds did not find again is named with that said.
            if let Some([again, folds]) = e.folds.filter(|[again, folds]| 2 * again < *folds) {
                told.push(format!("found again in only {again} of {folds} folds"));
            }
            if e.kind == SCATTER_KIND {
                told.push("drawn anew for each push, so that no forecast is nearer for it".into());
            }
            if told.is_empty() { e.kind.clone() } else { format!("{} ({})", e.kind, told.join("; ")) }
        })
        .collect();
    let list = words.join(" and ");
    let (e, r) = (&parts.error, &parts.rotation);
    let gain = format!(
        "error on held-out pushes {:.2} mm and {:.2} degrees after calibration, {:.2} mm and {:.2} degrees with it, noise floor {:.2} mm",
        1e3 * e.calibrated.rmse,
        r.calibrated.rmse,
        1e3 * e.augmented.rmse,
        r.augmented.rmse,
        1e3 * e.noise_floor.rmse
    );
    let rest = "structure above the noise that no effect of the library explains";
    match parts.verdict {
        // Nothing judges pushes in this way yet.
        Verdict::NotThisSystem | Verdict::NothingToAdd => {
            "Nothing to add: the calibrated model leaves only noise.".into()
        }
        Verdict::Explained if !alternatives.is_empty() => format!(
            "The model lacks {list}, or as well {}: these data cannot tell them apart; {gain}.",
            alternatives.iter().map(|a| a.join(" + ")).collect::<Vec<_>>().join(", or ")
        ),
        Verdict::Explained => format!("The model lacks {list}; {gain}."),
        Verdict::PartlyExplained => format!("The model lacks {list}, and there is {rest}; {gain}."),
        Verdict::Unknown => format!("Something unknown: {rest}; {gain}."),
    }
}

pub(crate) fn report(parts: Parts<'_>) -> Result<Discovery, DiscoveryError> {
    let numbers = Numbers::of(parts.everything, parts.full);
    let found = effects(&parts, &numbers);
    let rivals = parts.decided.ranking.alternatives.clone();
    let kinds: Vec<&str> = found.iter().map(|e| e.kind.as_str()).collect();
    let next_experiment = rivals.first().map_or_else(|| confirm(&kinds), |r| separate(&kinds, r));
    let names = numbers.names();
    let covariance = &numbers.covariance;
    let n = names.len();
    let sd = |i: usize| covariance.at(i, i).max(1e-300).sqrt();
    let matrix = (0..n).map(|i| (0..n).map(|j| covariance.at(i, j) / (sd(i) * sd(j))).collect()).collect();
    let noise = &parts.decided.search.train.data.noise;
    let model_toml = ModelFile::Push(augmented(&parts, &numbers)).readable()?;
    let search = &parts.decided.search;
    let (base, data) = (&search.base().fit, search.train.data);
    let models = Models {
        declared_toml: parts.model.to_toml(),
        calibrated_toml: with_values(parts.model, base, &Numbers::of(&search.train, base)).to_toml(),
    };
    let found = Discovery {
        schema: SCHEMA.into(),
        verdict: parts.verdict,
        sentence: sentence(&parts, &found, &rivals),
        warnings: Vec::new(),
        notes: Vec::new(),
        calibrated: Numbers::of(&search.train, &search.base().fit).estimates(None),
        parameters: numbers.estimates(None),
        noise: NoiseFound {
            sd: noise.white.unwrap_or(noise.sd)[0],
            unit: "m".into(),
            by_channel: noise.white.unwrap_or(noise.sd).to_vec(),
            correlation: None,
            jitter_s: None,
            outliers: None,
            findings: noise.findings.clone(),
        },
        candidates: parts.decided.ranking.candidates.clone(),
        effects: found,
        alternatives: rivals,
        unexplained: None,
        errors: BTreeMap::new(),
        horizons: Vec::new(),
        windows: None,
        dispersion: None,
        next_experiment,
        anatomy: parts.anatomy.clone(),
        tests: parts.tests,
        correlations: (names, matrix),
        push: Some(PushFound {
            windows: [search.train.windows.len(), search.test.windows.len()],
            outlier_windows: parts.decided.outliers,
            outlier_rule: format!(
                "left out where both the calibrated and the augmented model miss by more than {:.2} noise standard deviations (root mean square): three times the typical misfit",
                search.train.bend.sqrt()
            ),
            dispersion: parts.full.dispersion(parts.everything).factor,
            rotation: parts.rotation.clone(),
            horizons: parts.horizons.clone(),
        }),
        model_toml,
        models,
        heldout: data.test.iter().map(|&i| data.records[i].id.clone()).collect(),
        examples: Vec::new(),
        cut_after_s: None,
        error: parts.error,
        work: search.train.data.tally.work(),
    };
    all_finite(found, &search.train.data.name)
}
