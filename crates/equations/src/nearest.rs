//! Finds the known words that are spelt most like an unknown one, for "did you mean" in messages.

/// Finds the known word with the fewest edits to `name`; `None` if all need too many.
///
/// At most a third of the letters of `name` may differ, and at least 1 edit is allowed: with 2, `log` would be
/// a misspelt `cos`.
pub(crate) fn nearest<'k>(name: &str, known: impl Iterator<Item = &'k str>) -> Option<String> {
    nearest_words(name, known).first().map(|word| (*word).to_owned())
}

/// Lists the known words within the number of edits that [`nearest`] allows, the nearest first.
pub(crate) fn nearest_words<'k>(name: &str, known: impl Iterator<Item = &'k str>) -> Vec<&'k str> {
    // Such long names are not misspelt ones, and the cost grows with the product of the lengths.
    if name.len() > 64 {
        return Vec::new();
    }
    let allowed = (name.chars().count() / 3).max(1);
    let near = |(edits, word): &(usize, &str)| *edits <= allowed && *edits < word.chars().count();
    let mut found: Vec<(usize, &str)> = known.map(|word| (edits(name, word), word)).filter(near).collect();
    found.sort_by_key(|(edits, _)| *edits);
    found.into_iter().map(|(_, word)| word).collect()
}

/// Damerau-Levenshtein distance of two words: number of insertions, deletions, changes and swaps of neighbours.
///
/// `lenght` is one edit from `length`.
fn edits(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut before: Vec<usize> = Vec::new();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for i in 0..a.len() {
        let mut next = vec![i + 1];
        for j in 0..b.len() {
            let change = row[j] + usize::from(a[i] != b[j]);
            let mut best = change.min(row[j + 1] + 1).min(next[j] + 1);
            if i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j] {
                best = best.min(before[j - 1] + 1);
            }
            next.push(best);
        }
        before = std::mem::replace(&mut row, next);
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    //! Contract: misspellings by one or two letters are found; a word that only shares letters is not
    //! proposed.
    use super::*;

    #[test]
    fn misspellings_are_found_and_unrelated_words_are_not() {
        let known = ["length_m", "mass_kg", "stiffness_N_per_m"];
        assert_eq!(nearest("lenght_m", known.into_iter()).as_deref(), Some("length_m"));
        assert_eq!(nearest("mas_kg", known.into_iter()).as_deref(), Some("mass_kg"));
        assert_eq!(nearest("voltage_V", known.into_iter()), None);
        // A single edit is allowed in short words, two are not.
        assert_eq!(nearest("sen", ["sin", "cos"].into_iter()).as_deref(), Some("sin"));
        assert_eq!(nearest("log", ["sin", "cos"].into_iter()), None);
        assert_eq!(nearest("x", ["t"].into_iter()), None);
        assert_eq!(edits("lenght", "length"), 1);
    }
}
