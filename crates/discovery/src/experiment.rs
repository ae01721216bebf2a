//! Recommendation of the next experiment.

use crate::addition::{Addition, kinds};
use crate::answer::AnswerParts;
use crate::distinguish::separation;
use crate::result::{Unexplained, Verdict};
use crate::score::Scored;
use augsim_system::{Effect, Per, Schema, known_distinguishing_experiment};

/// Number of records beyond which an experiment is not recommended.
const MAX_RECORDS: f64 = 300.0;

/// Text that recommends the next experiment, from what the data do not distinguish or the model does not
/// explain.
pub(crate) fn next_experiment(parts: &AnswerParts<'_>, unexplained: &Option<Unexplained>) -> String {
    let schema = parts.prepared.data.system.schema();
    let findings = &parts.judged.findings;
    if let Some(other) = findings.alternatives.first() {
        return distinguishing_experiment(parts, &parts.found.sets[*other]);
    }
    let best = parts.best.additions();
    let can_be_set =
        |name: &str| schema.inputs.iter().any(|i| i.columns.iter().any(|c| c == name)) || name == "t";
    if let Some(u) = unexplained.as_ref().filter(|u| can_be_set(&u.feature)) {
        return format!(
            "vary {} alone, over a wider range than in these data and in random order, with at least five repeats at each value",
            u.feature
        );
    }
    if let Some(Addition::Split(_)) = best.first() {
        return format!(
            "repeat one {} of each group in the same hour, in random order: remaining differences are due to the set-up",
            schema.record[0]
        );
    }
    let random_effect = parts
        .judged
        .random_effect
        .as_ref()
        .filter(|s| !s.is_declared)
        .and(schema.record_random_effect.as_ref());
    if let (Some(drawn), true) = (random_effect, best.is_empty())
        && let Some(text) = &drawn.scatter.confirmed_by
    {
        return text.clone();
    }
    let mut found = best.iter().filter_map(|a| a.listed());
    let conditions = |most: usize| schema.conditions.iter().take(most).cloned().collect::<Vec<_>>();
    match (parts.judged.verdict, found.find_map(|effect| effect.confirmed_by.clone())) {
        (_, Some(text)) => text,
        (Verdict::NothingToAdd, _) => format!(
            "none needed for these data; a wider range of {} would narrow the limits on small effects",
            join_words(&conditions(1))
        ),
        _ => format!(
            "repeat under other conditions ({}) to test whether the added effect still holds",
            conditions(2).join(", ")
        ),
    }
}

/// Text on the experiment that distinguishes the named set of effects from an equivalent set.
fn distinguishing_experiment(parts: &AnswerParts<'_>, other: &Scored) -> String {
    let schema = parts.prepared.data.system.schema();
    let named = &parts.found.sets[parts.judged.findings.named];
    let [ours, theirs] = [named, other].map(|s| kinds(s.additions()).join(" + "));
    let rule = general_experiment(schema, named.additions(), other.additions());
    let scattered = [named, other].iter().any(|s| s.fit.hypothesis.scatter.is_some());
    let sample = parts.search.sample();
    match separation(&sample, &parts.prepared.noise.sd, &named.fit, &other.fit) {
        // A random effect and a systematic effect are distinguished by many repeats, not by one record.
        _ if scattered => rule,
        s if s.records <= MAX_RECORDS => format!(
            "{}; {:.0} such records distinguish {ours} from {theirs} with odds of 1000 to 1. In general: {rule}",
            s.design,
            s.records.ceil()
        ),
        s if s.among.is_empty() => rule,
        s => format!(
            "no {} distinguishes {ours} from {theirs} in fewer than {MAX_RECORDS:.0} records; {rule}",
            s.among
        ),
    }
}

/// Text on the experiment that would confirm or refute a lead, an effect that is not established.
pub(crate) fn confirming_experiment(parts: &AnswerParts<'_>, addition: &Addition) -> String {
    let schema = parts.prepared.data.system.schema();
    let confirmed = addition.listed().and_then(|effect| effect.confirmed_by.clone());
    confirmed.unwrap_or_else(|| {
        format!(
            "more {} like these, over a wider range of {}",
            schema.record[1],
            join_words(&schema.conditions)
        )
    })
}

/// Joins words to a list with `and`: `starts, speeds and loads`.
fn join_words(list: &[String]) -> String {
    match list {
        [] => "starts and inputs".into(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Text on the experiment that generally distinguishes two sets of effects, by the kinds in which they
/// differ.
fn general_experiment(schema: &Schema, ours: &[Addition], other: &[Addition]) -> String {
    let (ours, other) = (additions_not_in(ours, other), additions_not_in(other, ours));
    match known_distinguishing_experiment(&descriptions(&ours), &descriptions(&other)) {
        Some(text) => text.into(),
        None => {
            let names: Vec<String> = ours.into_iter().chain(other).map(|(name, _)| name).collect();
            format!(
                "repeat over a wider range of {}, in random order: this distinguishes {}",
                join_words(&schema.conditions),
                names.join(" and ")
            )
        }
    }
}

/// The additions of `a` whose kind is not in `b`, with their names, sorted by name.
fn additions_not_in<'a>(a: &'a [Addition], b: &[Addition]) -> Vec<(String, &'a Addition)> {
    let theirs = kinds(b);
    let named = a.iter().map(|x| (kinds(std::slice::from_ref(x)).concat(), x));
    let mut out: Vec<_> = named.filter(|(name, _)| !theirs.contains(name)).collect();
    out.sort_by(|x, y| x.0.cmp(&y.0));
    out
}

/// Library descriptions of the effects in `set` that have one value for all groups. No experiment is known
/// for groupwise values.
fn descriptions<'a>(set: &[(String, &'a Addition)]) -> Vec<&'a Effect> {
    let single = set.iter().filter(|(_, a)| !matches!(a, Addition::Effect(_, Per::Group)));
    single.filter_map(|(_, a)| a.listed()).collect()
}
