//! Effects of the library by their names, and what an unknown name may have meant.

use super::{Candidate, generic};
use crate::model::Model;
use crate::nearest::nearest_words;

/// Names that are offered for an unknown one.
const OFFERED: usize = 3;

/// Whether a row of the library, or a candidate of the model, has this kind, with or without a place in the model.
pub fn is_a_kind(kind: &str, model: &Model) -> bool {
    let listed = generic().unwrap_or_default();
    model.candidates.iter().chain(&listed).any(|row| row.kind == kind)
}

/// Kinds among candidates that `kind` may have meant: those that have it as a word, or else those that are spelt most like it.
pub fn kinds_like(kind: &str, all: &[Candidate]) -> Vec<String> {
    let mut known: Vec<&str> = Vec::new();
    for candidate in all.iter().filter(|c| c.shape.is_none()) {
        if !known.contains(&candidate.kind.as_str()) {
            known.push(&candidate.kind);
        }
    }
    let has_it = |known: &&str| known.split('-').any(|word| word == kind);
    let mut found: Vec<&str> = known.iter().copied().filter(has_it).collect();
    if found.is_empty() {
        found = nearest_words(kind, known.into_iter());
    }
    found.truncate(OFFERED);
    found.into_iter().map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    //! Contract: a slip of the pen and a single word of a name are understood, a stranger is offered nothing, and a kind without a
    //! place is known all the same.
    use super::*;

    #[test]
    fn slips_and_words_are_understood() {
        let (_, text) =
            crate::example::EXAMPLES.iter().find(|(name, _)| *name == "servo").expect("an example");
        let model = crate::model::parse(text, "servo.toml").expect("an example");
        let all = super::super::candidates(&model).expect("candidates");
        assert_eq!(kinds_like("coulom", &all), ["coulomb"]);
        assert_eq!(kinds_like("delay", &all), ["input-delay", "sensor-delay"]);
        assert_eq!(kinds_like("colour of the box", &all), Vec::<String>::new());
        assert!(is_a_kind("overflow", &model) && !is_a_kind("coulom", &model));
    }
}
