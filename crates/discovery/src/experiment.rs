//! Which measurement would help most.

use crate::addition::kinds;
use crate::answer::Parts;
use crate::result::{Unexplained, Verdict};
use crate::search::Judged;
use crate::separate::separation;
use augsim_physics::effects::{EffectSpec, known_separation, spec_of};

/// Records beyond which an experiment is no proposal.
const MOST_TRAJECTORIES: f64 = 300.0;

/// The next experiment in words, from what could not be told apart or explained.
pub(crate) fn next_experiment(
    parts: &Parts<'_>,
    alternative: Option<&(&Judged, Vec<String>)>,
    unexplained: &Option<Unexplained>,
) -> String {
    let mine = kinds(parts.best.additions());
    if let Some((judged, other)) = alternative {
        let rule = separate(&mine, other);
        let scattered = [parts.best, judged].iter().any(|j| j.fit.hypothesis.scatter.is_some());
        let by_design = separation(&parts.search.train, &parts.noise.sd_m, &parts.best.fit, &judged.fit);
        return match by_design {
            // A scatter is told from a law by many repeats, not by one throw.
            _ if scattered => rule,
            s if s.trajectories <= MOST_TRAJECTORIES => format!(
                "{}; records needed with this camera to tell {} from {} with odds of 1000 to 1: {:.0}. In general: {rule}",
                s.design,
                mine.join(" + "),
                other.join(" + "),
                s.trajectories.ceil()
            ),
            _ => format!(
                "no throw from a twentieth to twice the heights of these data tells {} from {} in fewer than {MOST_TRAJECTORIES:.0} records with this camera; {rule}",
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
    let mut kinds = parts.best.additions().iter().map(|a| a.kind());
    match (parts.verdict, kinds.find_map(|kind| spec_of(kind)?.confirmed_by)) {
        (_, Some(text)) => text.into(),
        (Verdict::NothingToAdd, _) => {
            "none needed for these data; a wider range of heights would narrow the limits on small effects"
                .into()
        }
        _ => "repeat under other conditions (heights, speeds) to see whether the added effect carries over"
            .into(),
    }
}

/// The experiment for two explanations, by the kinds in which they differ.
fn separate(mine: &[String], other: &[String]) -> String {
    let only = |a: &[String], b: &[String]| -> Vec<String> {
        a.iter().filter(|k| !b.contains(k)).cloned().collect()
    };
    let (mine, other) = (only(mine, other), only(other, mine));
    let specs = |kinds: &[String]| -> Vec<&EffectSpec> { kinds.iter().filter_map(|k| spec_of(k)).collect() };
    match known_separation(&specs(&mine), &specs(&other)) {
        Some(text) => text.into(),
        None => format!(
            "repeat over a wider range of heights, speeds and spins, in random order: {} then separate",
            [mine, other].concat().join(" and ")
        ),
    }
}
