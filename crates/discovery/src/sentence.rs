//! The sentence of a result: effects in the order of the prediction error that they remove, small ones in a
//! second sentence.

use crate::addition::kinds;
use crate::answer::AnswerParts;
use crate::estimate::with_three_digits;
use crate::judge::record_name;
use crate::result::{ErrorTable, FoundEffect, Unexplained, Verdict};
use crate::search::ALPHA;
use augsim_data::digits;

/// Increase of the error without an effect, relative to the calibrated model's error, above which predictions
/// count as diverged. The number then has no meaning.
const DIVERGED_RATIO: f64 = 10.0;
/// Share of the log-likelihood gain, or of the removed error, below which an effect is small. Small effects
/// are named in the second sentence.
pub(crate) const SMALL_SHARE: f64 = 0.03;

/// Removed error up to which an effect is negligible, if all effects together removed the error `reduction`.
fn negligible_error(reduction: f64) -> f64 {
    (SMALL_SHARE * reduction).max(0.0)
}

/// Sorts the effects of a result, which together removed the error `reduction`, for its sentence. First come
/// those that remove more than a negligible error, by the error removed. Then come those that do not change
/// predictions (random effects) and an effect that is the only one. Last come those that remove no error,
/// because the others compensate or because held-out predictions do not confirm them. The last two are sorted
/// by their share of the log-likelihood gain.
pub(crate) fn order(effects: &mut [FoundEffect], reduction: f64) {
    let negligible_error = negligible_error(reduction);
    let rank = |e: &FoundEffect| match e.removed {
        Some(removed) if removed > negligible_error => 0,
        None => 1,
        Some(_) => 2,
    };
    let removed = |e: &FoundEffect| e.removed.filter(|r| *r > negligible_error).unwrap_or(0.0);
    effects.sort_by(|a, b| {
        let by_size = removed(b).total_cmp(&removed(a)).then(b.share.total_cmp(&a.share));
        rank(a).cmp(&rank(b)).then(by_size)
    });
}

/// Splits sorted effects into those of the first sentence and the small ones. An effect that held-out predictions do not confirm is small whatever its
/// share. The first effect is never small, unless there is a table beside the effects (`has_table`) that can explain the improvement.
fn by_size(effects: &[FoundEffect], reduction: f64, has_table: bool) -> [Vec<&FoundEffect>; 2] {
    let negligible_error = negligible_error(reduction);
    let is_small =
        |e: &FoundEffect| e.share < SMALL_SHARE || e.removed.is_some_and(|r| r <= negligible_error);
    let (mut large, mut small) = (Vec::new(), Vec::new());
    for (place, effect) in effects.iter().enumerate() {
        let may_be_small = place > 0 || has_table;
        if may_be_small && is_small(effect) { small.push(effect) } else { large.push(effect) }
    }
    [large, small]
}

/// Maximum number of decimals for printed errors; if more are needed, each error is printed with three
/// digits.
const MAX_DECIMALS: usize = 6;

/// Prints an error with `decimals` decimals, or with three digits if that would be too many decimals.
fn format_error(error: f64, decimals: usize) -> String {
    if decimals <= MAX_DECIMALS { format!("{error:.decimals$}") } else { with_three_digits(error) }
}

/// Text on an effect: its parameters and the error that it removes. `calibrated` is the error of the
/// calibrated model.
fn describe_effect(effect: &FoundEffect, calibrated: f64, error_text: &dyn Fn(f64) -> String) -> String {
    let mut details: Vec<String> = effect.parameters.iter().map(|(name, value)| value.phrase(name)).collect();
    details.extend(effect.removed.map(|removed| match removed {
        r if r > DIVERGED_RATIO * calibrated => "predictions diverge without it".to_owned(),
        r if r > 0.0 => format!("removes {} of the error", error_text(r)),
        _ => "removes none of the error on its own".to_owned(),
    }));
    let details = details.join(", ");
    let per = effect.per.as_ref().map_or_else(String::new, |per| format!(" per {per}"));
    match &effect.formula {
        None if details.is_empty() => format!("{}{per}", effect.kind),
        None => format!("{}{per} ({details})", effect.kind),
        Some(f) => {
            let [low, high] = f.range;
            let range = format!("observed for {} from {} to {} {}", f.of, digits(low), digits(high), f.unit);
            format!("a term of the fitted form {} ({details}; {})", f.text, range.trim_end())
        }
    }
}

/// The sentence that states a result, followed by a second sentence for small effects.
pub(crate) fn sentence(
    parts: &AnswerParts<'_>,
    error: &ErrorTable,
    effects: &[FoundEffect],
    unexplained: &Option<Unexplained>,
    alternatives: &[Vec<String>],
) -> String {
    let schema = parts.prepared.data.system.schema();
    let (unit, scale) = schema.primary_unit();
    let rows = [error.calibrated, error.augmented, error.noise_floor].map(|row| scale * row.rmse);
    // Two decimals, or three digits of the smallest error where it is below 0.1.
    let least = rows.into_iter().filter(|x| *x > 0.0).fold(1.0, f64::min);
    let decimals = if least < 0.1 { (2.0 - least.log10().floor()) as usize } else { 2 };
    let error_text =
        |error: f64| format!("{} {unit}", format_error(scale * error, decimals)).trim_end().to_owned();
    let describe = |effect: &&FoundEffect| describe_effect(effect, error.calibrated.rmse, &error_text);
    let list = |effects: &[&FoundEffect]| effects.iter().map(describe).collect::<Vec<_>>().join(" and ");
    let [large, small] =
        by_size(effects, error.calibrated.rmse - error.augmented.rmse, unexplained.is_some());
    let second = match &small[..] {
        [] => String::new(),
        small => format!(" Smaller effects: {}.", list(small)),
    };
    let [before, after, _] = rows.map(|error| format_error(error, decimals));
    let floor = error.noise_floor.interval_text(|bound| format_error(scale * bound, decimals));
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    let gain = format!(
        "error on held-out {}{}: {before}{unit} for the calibrated model, {after}{unit} for the augmented model, noise floor estimated at {floor}{unit}",
        schema.record[1],
        if error.measure.is_empty() { String::new() } else { format!(" (`{}`)", error.measure) }
    );
    let rest = unexplained_structure(parts, unexplained);
    match parts.judged.verdict {
        Verdict::NothingToAdd => {
            "Nothing to add: the residuals of the calibrated model are only noise.".into()
        }
        Verdict::Explained if !alternatives.is_empty() => format!(
            "The model lacks {} or, equally well supported, {}: these data do not distinguish them; {gain}.{second}",
            list(&large),
            alternatives.iter().map(|a| a.join(" + ")).collect::<Vec<_>>().join(" or ")
        ),
        Verdict::Explained => format!("The model lacks {}; {gain}.{second}", list(&large)),
        Verdict::PartlyExplained if large.is_empty() => {
            format!(
                "The effects of the library explain only a small part of the data: {rest}; {gain}.{second}"
            )
        }
        Verdict::PartlyExplained => {
            format!(
                "The model lacks {}, which explains only part of the data: {rest}; {gain}.{second}",
                list(&large)
            )
        }
        Verdict::Unknown => format!("The library does not explain the data: {rest}; {gain}."),
        Verdict::NotThisSystem => format!(
            "Not this system: {}.",
            parts.judged.withdrawal_reason.as_deref().unwrap_or("the data do not fit the declared model")
        ),
    }
}

/// Text on the structure that remains unexplained: the unlisted effect, the records that differ, or a period.
fn unexplained_structure(parts: &AnswerParts<'_>, unexplained: &Option<Unexplained>) -> String {
    let tests = &parts.judged.residual_tests;
    if let Some(like) = tests.memory.best.as_ref().filter(|_| tests.memory.is_significant()) {
        return format!(
            "the residuals depend on the past, and not only on the present values of states and inputs, most like `{}`: the model lacks a \
             hidden state or a delay",
            kinds(std::slice::from_ref(like)).concat()
        );
    }
    if let Some(u) = unexplained {
        return format!(
            "{} depends on {} in a way that no effect of the library describes",
            u.target, u.feature
        );
    }
    let schema = parts.prepared.data.system.schema();
    let level = ALPHA;
    if tests.records < level {
        let name = tests.outlying.and_then(|n| record_name(parts.search, n));
        let most = name.map_or_else(String::new, |name| format!(", `{name}` most"));
        return format!(
            "the {} differ from each other{most}: a quantity that the model treats as constant varies between them, or the model lacks \
             something that acts differently in each",
            schema.record[1]
        );
    }
    if tests.periodicity < level {
        return "the differences between events are periodic in time".into();
    }
    if tests.library < level {
        return "effects of the library are significant in the residuals, but no set of them predicts left-out blocks better by more \
                than the scatter over blocks"
            .into();
    }
    "the effects that were found predict no better than the calibrated model".into()
}

#[cfg(test)]
mod tests {
    //! Contract: effects are ordered by the error that they remove; one that removes a negligible error
    //! never precedes another and is in the second sentence, whatever its share of the log-likelihood gain.
    use super::*;

    fn effect(kind: &str, share: f64, removed: Option<f64>) -> FoundEffect {
        FoundEffect { kind: kind.into(), share, removed, ..FoundEffect::default() }
    }

    fn named(effects: Vec<FoundEffect>, reduction: f64) -> [Vec<String>; 2] {
        named_beside(effects, reduction, false)
    }

    fn named_beside(mut effects: Vec<FoundEffect>, reduction: f64, has_table: bool) -> [Vec<String>; 2] {
        order(&mut effects, reduction);
        by_size(&effects, reduction, has_table).map(|list| list.iter().map(|e| e.kind.clone()).collect())
    }

    #[test]
    fn errors_are_written_with_readable_decimals() {
        assert_eq!([format_error(0.0123, 4), format_error(0.5, 2)], ["0.0123", "0.50"]);
        let many = [8.425407e-3, 2.58e-7, 0.9996, 0.0].map(|error| format_error(error, 9));
        assert_eq!(many, ["0.00843", "2.58e-7", "1.000", "0"]);
    }

    #[test]
    fn effects_are_ordered_by_the_error_that_they_remove() {
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
    fn small_effects_are_in_the_second_sentence() {
        // A share of 0.14 % of the gain; a hundredth of the error; and no larger effect.
        let effects = vec![
            effect("much", 0.69, Some(3e-3)),
            effect("rare", 0.0014, Some(1e-3)),
            effect("slight", 0.2, Some(3e-5)),
        ];
        assert_eq!(named(effects, 3e-3), [vec!["much"], vec!["rare", "slight"]]);
        assert_eq!(named(vec![effect("lone", 1.0, None)], 0.0)[0], ["lone"]);
        let none = vec![effect("a", 0.2, Some(-1e-4)), effect("b", 0.7, Some(0.0))];
        assert_eq!(named(none.clone(), -1e-4), [vec!["b"], vec!["a"]]);
        // Beside a table, effects that remove nothing are not in the headline.
        assert_eq!(named_beside(none, -1e-4, true), [vec![], vec!["b", "a"]]);
    }

    #[test]
    fn without_single_improvements_the_likelihood_decides() {
        // Marbles on paper: the other effects compensate for each one that is left out.
        let effects = vec![effect("slight", 0.03, Some(5e-5)), effect("law", 1.0, Some(-5e-4))];
        assert_eq!(named(effects, 2e-3), [vec!["law"], vec!["slight"]]);
    }

    #[test]
    fn below_three_per_cent_of_the_gain_or_of_the_error_an_effect_is_small() {
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
