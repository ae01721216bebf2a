//! The experiment that tells two explanations of pushes apart, or confirms one.

use augsim_physics::push::effects::spec_of;
use augsim_physics::system::{Effect, known_separation};

/// Causes that poses cannot tell from a declared parameter that differs between groups.
pub(crate) fn stands_for(kind: &str) -> &'static [&'static str] {
    match kind {
        "c_m per group" => {
            &["pressure that differs between groups", "scale of a frame that differs between groups"]
        }
        "contact_friction per group" => &["surfaces of rod or object that differ between groups"],
        _ => &[],
    }
}

/// The experiment for two explanations.
pub(crate) fn separate(a: &[&str], b: &[String]) -> String {
    let only_a: Vec<&str> = a.iter().copied().filter(|k| !b.iter().any(|o| o == k)).collect();
    let only_b: Vec<&str> = b.iter().map(String::as_str).filter(|k| !a.contains(k)).collect();
    let specs = |kinds: &[&str]| -> Vec<Effect> {
        kinds.iter().filter_map(|k| spec_of(k)).map(Effect::from).collect()
    };
    let (mine, theirs) = (specs(&only_a), specs(&only_b));
    let (mine, theirs): (Vec<_>, Vec<_>) = (mine.iter().collect(), theirs.iter().collect());
    if let Some(text) = known_separation(&mine, &theirs) {
        return text.into();
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
        Some(kind) if kind.ends_with("per group") => {
            "repeat one push of each group in the same hour, in random order: what still differs belongs to the set-up"
        }
        Some(kind) => spec_of(kind).and_then(|s| s.confirmed_by).unwrap_or(
            "repeat on another surface and from other start orientations to see whether the added effect carries over",
        ),
    };
    text.into()
}
