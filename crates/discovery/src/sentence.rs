//! The answer in words: effects in the order of the error that they remove, small ones in a second sentence.

use crate::answer::AnswerParts;
use crate::judge::record_name;
use crate::result::{ErrorTable, FoundEffect, Unexplained, Verdict};
use crate::search::ALPHA;

/// Growth of the error without an effect, in the error of the calibrated model, from which on forecasts run away: the number says
/// only where they ended.
const AWAY: f64 = 10.0;
/// Share of the gain in likelihood, or of the error removed, below which an effect is small: it is named in a sentence of its
/// own.
const SMALL: f64 = 0.03;

/// Error below which an effect of those that together removed `reduction` of it has removed next to none.
fn little(reduction: f64) -> f64 {
    (SMALL * reduction).max(0.0)
}

/// Puts effects that together removed `reduction` of the error in order: by the error that each removes; then those that change no
/// forecast (a scatter) and the only one there is; last those without which the forecast is as good, because the others make up
/// for them or because no held-out forecast confirms them. The last two by their shares of the gain in likelihood.
pub(crate) fn order(effects: &mut [FoundEffect], reduction: f64) {
    let little = little(reduction);
    let place = |e: &FoundEffect| match e.removed {
        Some(removed) if removed > little => 0,
        None => 1,
        Some(_) => 2,
    };
    let removed = |e: &FoundEffect| e.removed.filter(|r| *r > little).unwrap_or(0.0);
    effects.sort_by(|a, b| {
        let by_size = removed(b).total_cmp(&removed(a)).then(b.share.total_cmp(&a.share));
        place(a).cmp(&place(b)).then(by_size)
    });
}

/// The effects that lead the sentence and the small ones, of those that together removed `reduction` of the error. The first is
/// never small. What no forecast confirms is small whatever its share.
fn by_size(effects: &[FoundEffect], reduction: f64) -> [Vec<&FoundEffect>; 2] {
    let little = little(reduction);
    let is_small = |e: &FoundEffect| e.share < SMALL || e.removed.is_some_and(|r| r <= little);
    let (mut large, mut small) = (Vec::new(), Vec::new());
    for (place, effect) in effects.iter().enumerate() {
        if place > 0 && is_small(effect) { small.push(effect) } else { large.push(effect) }
    }
    [large, small]
}

/// Decimals up to which errors are told with the same number of them; beyond, each has three digits of its own.
const MOST_DECIMALS: usize = 6;

/// An error with so many decimals, or with three digits where these would be too many to read.
fn told(error: f64, decimals: usize) -> String {
    if decimals <= MOST_DECIMALS { format!("{error:.decimals$}") } else { three_digits(error) }
}

/// A number with three digits, with a power of ten where it is small or large.
pub(crate) fn three_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = value.abs().log10().floor();
    if (-3.0..6.0).contains(&exponent) {
        format!("{value:.*}", (2.0 - exponent).max(0.0) as usize)
    } else {
        format!("{value:.2e}")
    }
}

/// The answer in one sentence, and a second one for what is small.
pub(crate) fn sentence(
    parts: &AnswerParts<'_>,
    error: &ErrorTable,
    effects: &[FoundEffect],
    unexplained: &Option<Unexplained>,
    alternatives: &[Vec<String>],
) -> String {
    let schema = parts.prepared.data.system.schema();
    let (unit, scale) = schema.decides();
    let rows = [error.calibrated, error.augmented, error.noise_floor].map(|row| scale * row.rmse);
    // Two decimals, or three digits of the smallest where it is less.
    let least = rows.into_iter().filter(|x| *x > 0.0).fold(1.0, f64::min);
    let d = if least < 0.1 { (2.0 - least.log10().floor()) as usize } else { 2 };
    let list = |e: &[&FoundEffect]| {
        let words: Vec<String> = e
            .iter()
            .map(|e| {
                let mut p: Vec<String> = e.parameters.iter().map(|(n, v)| v.phrase(n)).collect();
                p.extend(e.removed.map(|r| match r {
                    r if r > AWAY * error.calibrated.rmse => "forecasts run away without it".to_owned(),
                    r if r > 0.0 => format!("{} {unit} of the error", told(scale * r, d)),
                    _ => "none of the error by itself".to_owned(),
                }));
                let values = p.join(", ");
                let per = e.per.as_ref().map_or_else(String::new, |per| format!(" per {per}"));
                match &e.formula {
                    None if values.is_empty() => format!("{}{per}", e.kind),
                    None => format!("{}{per} ({values})", e.kind),
                    Some(f) => {
                        let [low, high] = f.range;
                        let of = format!("{} from {low:.3} to {high:.3} {}", f.of, f.unit);
                        format!("a term that fits as {} ({values}; {})", f.text, of.trim_end())
                    }
                }
            })
            .collect();
        words.join(" and ")
    };
    let [large, small] = by_size(effects, error.calibrated.rmse - error.augmented.rmse);
    let beside = match &small[..] {
        [] => String::new(),
        small => format!(" Small beside that: {}.", list(small)),
    };
    let [before, after, floor] = rows.map(|error| told(error, d));
    let gain = format!(
        "error on held-out {} {before} {unit} after calibration, {after} {unit} with it, noise floor {floor} {unit}",
        schema.record[1]
    );
    let law = what_is_left(parts, unexplained);
    match parts.judged.verdict {
        Verdict::NothingToAdd => "Nothing to add: the calibrated model leaves only noise.".into(),
        Verdict::Explained if !alternatives.is_empty() => format!(
            "The model lacks {}, or as well {}: these data cannot tell them apart; {gain}.{beside}",
            list(&large),
            alternatives.iter().map(|a| a.join(" + ")).collect::<Vec<_>>().join(", or ")
        ),
        Verdict::Explained => format!("The model lacks {}; {gain}.{beside}", list(&large)),
        Verdict::PartlyExplained => {
            format!("The model lacks {}, and something else: {law}; {gain}.{beside}", list(&large))
        }
        Verdict::Unknown => format!("Something unknown: {law}; {gain}."),
        Verdict::NotThisSystem => {
            format!(
                "Not this system: {}.",
                parts.judged.doubt.as_deref().unwrap_or("the data are of another one")
            )
        }
    }
}

/// Remainder that the tests show, in words: the law that was found, the records that differ, or a rhythm.
fn what_is_left(parts: &AnswerParts<'_>, unexplained: &Option<Unexplained>) -> String {
    if let Some(u) = unexplained {
        return format!("{} depends on {} in a way that the library does not know", u.target, u.against);
    }
    let left = &parts.judged.left;
    let schema = parts.prepared.data.system.schema();
    let level = ALPHA;
    if left.records < level {
        let name = left.outlying.and_then(|n| record_name(parts.search, n));
        let most = name.map_or_else(String::new, |name| format!(", `{name}` most"));
        return format!(
            "the {} differ from each other{most}: something that the model holds constant is not",
            schema.record[1]
        );
    }
    if left.periodicity < level {
        return "what differs between events has a period on the clock".into();
    }
    if left.library < level {
        return "what is left follows effects of the library by more than chance, and no set of them predicts left-out blocks better \
                by more than they differ"
            .into();
    }
    "what was found predicts no better than the calibrated model".into()
}

#[cfg(test)]
mod tests {
    //! Contract: effects are named by the error that they remove; one that removes none, or next to none, never leads another and
    //! stands in the second sentence, whatever its share of the gain in likelihood.
    use super::*;
    use std::collections::BTreeMap;

    fn effect(kind: &str, share: f64, removed: Option<f64>) -> FoundEffect {
        FoundEffect {
            kind: kind.into(),
            stands_for: Vec::new(),
            parameters: BTreeMap::new(),
            share,
            removed,
            inclusion: None,
            q_value: None,
            folds: None,
            formula: None,
            per: None,
        }
    }

    fn named(mut effects: Vec<FoundEffect>, reduction: f64) -> [Vec<String>; 2] {
        order(&mut effects, reduction);
        by_size(&effects, reduction).map(|list| list.iter().map(|e| e.kind.clone()).collect())
    }

    #[test]
    fn errors_are_told_in_decimals_that_can_be_read() {
        assert_eq!([told(0.0123, 4), told(0.5, 2)], ["0.0123", "0.50"]);
        assert_eq!(
            [told(8.425407e-3, 9), told(2.58e-7, 9), told(0.9996, 9), told(0.0, 9)],
            ["0.00843", "2.58e-7", "1.000", "0"]
        );
    }

    #[test]
    fn effects_are_named_by_the_error_that_they_remove() {
        let effects = vec![
            effect("none", 0.6, Some(-1e-5)),
            effect("random", 0.1, None),
            effect("much", 0.1, Some(2e-4)),
            effect("most", 0.3, Some(3e-4)),
        ];
        let [large, small] = named(effects, 3.5e-4);
        assert_eq!(large, ["most", "much", "random"]);
        assert_eq!(small, ["none"]);
    }

    #[test]
    fn small_effects_stand_in_a_second_sentence() {
        // A share of 0.14 % of the gain; a hundredth of the error; and nothing that could lead instead.
        let effects = vec![
            effect("much", 0.69, Some(3e-3)),
            effect("rare", 0.0014, Some(1e-3)),
            effect("slight", 0.2, Some(3e-5)),
        ];
        assert_eq!(named(effects, 3e-3), [vec!["much"], vec!["rare", "slight"]]);
        assert_eq!(named(vec![effect("lone", 1.0, None)], 0.0)[0], ["lone"]);
        let none = vec![effect("a", 0.2, Some(-1e-4)), effect("b", 0.7, Some(0.0))];
        assert_eq!(named(none, -1e-4), [vec!["b"], vec!["a"]]);
    }

    #[test]
    fn where_each_alone_removes_next_to_nothing_the_likelihood_decides() {
        // Marbles on paper: the others make up for each law that is left out.
        let effects = vec![effect("slight", 0.03, Some(5e-5)), effect("law", 1.0, Some(-5e-4))];
        assert_eq!(named(effects, 2e-3), [vec!["law"], vec!["slight"]]);
    }

    #[test]
    fn three_per_cent_of_the_gain_or_of_the_error_is_small() {
        let shares =
            vec![effect("much", 0.9, None), effect("some", 0.04, None), effect("little", 0.02, None)];
        assert_eq!(named(shares, 0.0), [vec!["much", "some"], vec!["little"]]);
        let of_error = |removed: f64| Some(removed * 1e-3);
        let errors = vec![
            effect("much", 0.5, of_error(0.9)),
            effect("some", 0.25, of_error(0.04)),
            effect("little", 0.25, of_error(0.02)),
        ];
        assert_eq!(named(errors, 1e-3), [vec!["much", "some"], vec!["little"]]);
    }
}
