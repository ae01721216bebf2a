//! Which measurement would help most.

use crate::addition::{Addition, kinds};
use crate::answer::AnswerParts;
use crate::judged::Judged;
use crate::result::{Unexplained, Verdict};
use crate::separate::separation;
use augsim_physics::model::Per;
use augsim_physics::system::{Effect, Schema, known_separation};

/// Records beyond which an experiment is no proposal.
const MOST_RECORDS: f64 = 300.0;

/// The next experiment in words, from what could not be told apart or explained.
pub(crate) fn next_experiment(
    parts: &AnswerParts<'_>,
    alternative: Option<&(&Judged, Vec<String>)>,
    unexplained: &Option<Unexplained>,
) -> String {
    let schema = parts.search.train.data.system.schema();
    let mine = kinds(parts.best.additions());
    if let Some((judged, other)) = alternative {
        let rule = separate(schema, parts.best.additions(), judged.additions());
        let scattered = [parts.best, judged].iter().any(|j| j.fit.hypothesis.scatter.is_some());
        let by_design = separation(&parts.search.train, &parts.noise.sd, &parts.best.fit, &judged.fit);
        return match by_design {
            // A scatter is told from a law by many repeats, not by one record.
            _ if scattered => rule,
            s if s.records <= MOST_RECORDS => format!(
                "{}; records needed with this camera to tell {} from {} with odds of 1000 to 1: {:.0}. In general: {rule}",
                s.design,
                mine.join(" + "),
                other.join(" + "),
                s.records.ceil()
            ),
            s if s.among.is_empty() => rule,
            s => format!(
                "no {} tells {} from {} in fewer than {MOST_RECORDS:.0} records with this camera; {rule}",
                s.among,
                mine.join(" + "),
                other.join(" + ")
            ),
        };
    }
    if let Some(u) = unexplained {
        return format!(
            "vary {} alone, over a wider range than in these data and in random order, with at least five repeats at each value",
            u.against
        );
    }
    if let Some(Addition::Split(_)) = parts.best.additions().first() {
        return format!(
            "repeat one {} of each group in the same hour, in random order: what still differs belongs to the set-up",
            schema.record[0]
        );
    }
    let drawn = parts.scattered.filter(|s| !s.declared).and(schema.drawn.as_ref());
    if let (Some(drawn), true) = (drawn, parts.best.additions().is_empty())
        && let Some(text) = &drawn.scatter.confirmed_by
    {
        return text.clone();
    }
    let mut found = parts.best.additions().iter().filter_map(|a| a.listed());
    let conditions = |most: usize| schema.conditions.iter().take(most).cloned().collect::<Vec<_>>();
    match (parts.verdict, found.find_map(|effect| effect.confirmed_by.clone())) {
        (_, Some(text)) => text,
        (Verdict::NothingToAdd, _) => format!(
            "none needed for these data; a wider range of {} would narrow the limits on small effects",
            words(&conditions(1))
        ),
        _ => format!(
            "repeat under other conditions ({}) to see whether the added effect carries over",
            conditions(2).join(", ")
        ),
    }
}

/// A list in words: `starts, speeds and loads`.
fn words(list: &[String]) -> String {
    match list {
        [] => "starts and inputs".into(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// The experiment for two explanations, by the kinds in which they differ.
fn separate(schema: &Schema, mine: &[Addition], other: &[Addition]) -> String {
    let (mine, other) = (only(mine, other), only(other, mine));
    match known_separation(&listed(&mine), &listed(&other)) {
        Some(text) => text.into(),
        None => {
            let names: Vec<String> = mine.into_iter().chain(other).map(|(name, _)| name).collect();
            format!(
                "repeat over a wider range of {}, in random order: {} then separate",
                words(&schema.conditions),
                names.join(" and ")
            )
        }
    }
}

/// The additions of `a` whose kind `b` does not have, by name.
fn only<'a>(a: &'a [Addition], b: &[Addition]) -> Vec<(String, &'a Addition)> {
    let theirs = kinds(b);
    let named = a.iter().map(|x| (kinds(std::slice::from_ref(x)).concat(), x));
    let mut out: Vec<_> = named.filter(|(name, _)| !theirs.contains(name)).collect();
    out.sort_by(|x, y| x.0.cmp(&y.0));
    out
}

/// Their descriptions. What has one value a group is another explanation than its kind, and no experiment is known for it.
fn listed<'a>(set: &[(String, &'a Addition)]) -> Vec<&'a Effect> {
    let single = set.iter().filter(|(_, a)| !matches!(a, Addition::Effect(_, Per::Group)));
    single.filter_map(|(_, a)| a.listed()).collect()
}
