//! Looks up effects by name, and proposes similar names for an unknown one.

use super::{Candidate, generic};
use crate::model::Model;
use crate::nearest::nearest_words;

/// Maximum number of similar names that are proposed for an unknown one.
const MAX_PROPOSALS: usize = 3;

/// Whether the library or the model's candidates have an effect of this kind, even if it has no place in the model.
pub fn is_a_kind(kind: &str, model: &Model) -> bool {
    let listed = generic().unwrap_or_default();
    model.candidates.iter().chain(&listed).any(|row| row.kind == kind)
}

/// Finds the kinds among candidate effects that a user may mean by `kind`.
///
/// These are the kinds that contain it as a word, or else those with the most similar spelling.
pub fn similar_kinds(kind: &str, all: &[Candidate]) -> Vec<String> {
    let mut known: Vec<&str> = Vec::new();
    for candidate in all.iter().filter(|c| c.shape.is_none()) {
        if !known.contains(&candidate.kind.as_str()) {
            known.push(&candidate.kind);
        }
    }
    let contains_word = |known: &&str| known.split('-').any(|word| word == kind);
    let mut found: Vec<&str> = known.iter().copied().filter(contains_word).collect();
    if found.is_empty() {
        found = nearest_words(kind, known.into_iter());
    }
    found.truncate(MAX_PROPOSALS);
    found.into_iter().map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    //! Contract: a misspelling and a single word of a name are recognised, nothing is proposed for an
    //! unrelated text, and a kind without a place in the model is known all the same.
    use super::*;

    #[test]
    fn misspellings_and_single_words_are_recognised() {
        let (_, text) =
            crate::example::EXAMPLES.iter().find(|(name, _)| *name == "servo").expect("an example");
        let model = crate::model::parse(text, "servo.toml").expect("an example");
        let all = super::super::candidates(&model).expect("candidates");
        assert_eq!(similar_kinds("coulom", &all), ["coulomb"]);
        assert_eq!(similar_kinds("delay", &all), ["input-delay", "sensor-delay"]);
        assert_eq!(similar_kinds("colour of the box", &all), Vec::<String>::new());
        assert!(is_a_kind("overflow", &model) && !is_a_kind("coulom", &model));
    }
}
