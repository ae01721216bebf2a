//! What poses cannot tell apart, and the experiment that would.
//!
//! Source: signatures of all pairs of effects on simulated pushes, compared by the angle between them.

/// Causes that poses cannot tell from a kind, whatever is pushed.
pub(crate) fn stands_for(kind: &str) -> &'static [&'static str] {
    match kind {
        "superelliptic-surface" => &["exact surface under uniform pressure", "pressure concentration"],
        "exact-surface" => &["superelliptic surface"],
        "table-anisotropy" => &["non-associated anisotropy (friction tensor)"],
        "speed-dependent-friction" => &["viscous friction"],
        "c_m per group" => {
            &["pressure that differs between groups", "scale of a frame that differs between groups"]
        }
        "contact_friction per group" => &["surfaces of rod or object that differ between groups"],
        _ => &[],
    }
}

/// Pairs whose signatures nearly coincide, with the experiment that separates them.
const PAIRS: [(&str, &str, &str); 14] = [
    (
        "exact-surface",
        "superelliptic-surface",
        "push at two contact offsets (10 and 35 mm from the middle) at equal angle: the bend of the turning rate differs",
    ),
    (
        "table-anisotropy",
        "object-anisotropy",
        "push from several start orientations: friction of the table stays in the world, friction of the object turns with it",
    ),
    (
        "pressure-offset",
        "friction-gradient",
        "push from several start orientations and places: a centre of pressure turns with the object, a gradient does not",
    ),
    (
        "pressure-offset",
        "table-tilt",
        "push from several start orientations, then on a surface of other friction: tilt acts as 1/friction",
    ),
    (
        "pressure-offset",
        "pose-offset",
        "turn the object at rest and look at the traced circle: only an offset of the tracked frame shows",
    ),
    (
        "friction-gradient",
        "table-tilt",
        "repeat at another place and on a surface of other friction: tilt acts as 1/friction",
    ),
    (
        "contact-friction-slip",
        "speed-dependent-friction",
        "push at 30 and 70 degrees and at two speeds: slip speed and sliding speed then differ",
    ),
    (
        "rod-compliance",
        "pose-latency",
        "push at several speeds and record the stop: a delay grows with the speed and vanishes at rest, a bend does not",
    ),
    (
        "frame-registration",
        "pose-latency",
        "follow the same path at two speeds: an error of the frame stays with the place, a delay grows with the speed",
    ),
    (
        "frame-registration",
        "pose-offset",
        "push at places far from each other: an error of scale grows with the distance, an offset of the tracked frame does not",
    ),
    (
        "inertia",
        "pose-latency",
        "record the stop and push at several speeds: an object with inertia runs ahead and goes on, a late sensor lags",
    ),
    (
        "push-height",
        "exact-surface",
        "move the rod to another height: the pressure under the leading edge changes in proportion",
    ),
    (
        "push-height",
        "superelliptic-surface",
        "move the rod to another height: the pressure under the leading edge changes in proportion",
    ),
    (
        "tip-offset",
        "rod-compliance",
        "push in several directions with and without load: an offset stays in the world, a bend follows the force",
    ),
];

/// The experiment for two explanations.
pub(crate) fn separate(a: &[&str], b: &[String]) -> String {
    let only_a: Vec<&str> = a.iter().copied().filter(|k| !b.iter().any(|o| o == k)).collect();
    let only_b: Vec<&str> = b.iter().map(String::as_str).filter(|k| !a.contains(k)).collect();
    for x in &only_a {
        for y in &only_b {
            let pair = PAIRS.iter().find(|(p, q, _)| (p, q) == (x, y) || (p, q) == (y, x));
            if let Some((_, _, text)) = pair {
                return (*text).into();
            }
        }
    }
    let names: Vec<&str> = only_a.into_iter().chain(only_b).collect();
    format!(
        "vary start orientation, contact offset, push angle and speed one at a time, in random order: {} then separate",
        names.join(" and ")
    )
}

/// The experiment for an answer without rivals.
pub(crate) fn confirm(kinds: &[&str]) -> String {
    let text = match kinds.first().copied() {
        None => {
            "none needed for these data; other start orientations, speeds and contact offsets would narrow the limits on small effects"
        }
        Some("table-anisotropy") => {
            "turn the sheet by 90 degrees: the sign of the deviation flips; forces tell an elliptic law from a friction tensor"
        }
        Some("object-anisotropy" | "pressure-offset") => {
            "turn the object by 90 degrees under the same push: the deviation turns with it"
        }
        Some("superelliptic-surface" | "exact-surface") => {
            "put a sheet of paper under the object: its pressure becomes even; then push at two contact offsets"
        }
        Some("inertia" | "pose-latency" | "speed-dependent-friction") => {
            "repeat the same contact at 10, 50 and 200 mm/s: quasi-static motion is the same at every speed"
        }
        Some("frame-registration" | "tip-offset") => {
            "bring the rod to marks all over the table and compare them with the tracker: no push is needed"
        }
        Some(kind) if kind.ends_with("per group") => {
            "repeat one push of each group in the same hour, in random order: what still differs belongs to the set-up"
        }
        Some("contact-friction-slip") => {
            "read the ratio of tangential to normal force while the rod slides: it is the friction itself"
        }
        _ => {
            "repeat on another surface and from other start orientations to see whether the added effect carries over"
        }
    };
    text.into()
}
