//! Which measurement would help most.

use crate::addition::kinds;
use crate::answer::Parts;
use crate::result::{Unexplained, Verdict};
use crate::search::Judged;
use crate::separate::separation;
use augsim_physics::effects::{Location, spec_of};

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
        let differ: Vec<&str> = mine
            .iter()
            .chain(other)
            .filter(|k| mine.contains(k) != other.contains(k))
            .map(String::as_str)
            .collect();
        let rule = separate(&differ);
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
    let classes: Vec<&str> = parts
        .best
        .additions()
        .iter()
        .filter(|a| spec_of(a.kind()).is_some_and(|s| !s.stands_for.is_empty()))
        .map(|a| a.kind())
        .collect();
    match (parts.verdict, classes.first()) {
        (_, Some(&"vertical-acceleration")) => {
            "measure a known time and a known length in view (a blinking LED, a ruler), and drop a heavy and a light ball of equal size: buoyancy changes with the mass, clock and scale do not".into()
        }
        (_, Some(&"horizontal-acceleration")) => {
            "turn the apparatus by 180 degrees about the vertical: a force of the room changes sign, an apparatus out of level does not".into()
        }
        (_, Some(&"latency")) => "record the release itself with a second instrument (a light gate or a microphone): a late clock and a late release then differ".into(),
        (Verdict::NothingToAdd, _) => "none needed for these data; a wider range of heights would narrow the limits on small effects".into(),
        _ => "repeat under other conditions (heights, speeds) to see whether the added effect carries over".into(),
    }
}

fn separate(kinds: &[&str]) -> String {
    let has = |k: &str| kinds.contains(&k);
    let speed_law = kinds.iter().any(|k| k.starts_with("restitution-speed"));
    let at = |l: Location| kinds.iter().any(|k| spec_of(k).is_some_and(|s| s.location == l));
    if has("restitution-speed-linear") && has("restitution-speed-power") {
        "drop from very low (1 to 5 cm) and very high (5 m): a line and a power differ most at the ends of the speed range".into()
    } else if has("coulomb-friction") && has("grip-friction") {
        "throw with fast spin at a shallow angle: gripping takes a share of the slip, sliding friction takes a fixed amount".into()
    } else if has("quadratic-drag") && has("linear-drag") {
        "drop from 0.3 m and from 5 m: the two drags differ most over a wide range of speeds".into()
    } else if speed_law && at(Location::Flight) {
        "record flights without a bounce (catch the ball): what remains there is not restitution".into()
    } else if has("ground-tilt") || has("horizontal-acceleration") || has("camera-roll") {
        "turn the camera by 90 degrees, then the ground by 180 degrees: camera, ground and force change sign separately".into()
    } else if has("contact-duration") || has("height-offset") || has("latency") {
        "record the impacts with a microphone beside the camera: their times settle delay and contact without the heights".into()
    } else if has("restitution-drift") || has("restitution-position") {
        "repeat the same throw at marked places, in random order over the session".into()
    } else {
        format!(
            "repeat over a wider range of heights, speeds and spins, in random order: {} then separate",
            kinds.join(" and ")
        )
    }
}
