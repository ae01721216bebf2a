//! "Did you mean": the known word that is spelt most like an unknown one.

/// The word of `known` with the fewest edits to `name`, if these are at most a third of its letters (two at least).
pub(crate) fn nearest<'k>(name: &str, known: impl Iterator<Item = &'k str>) -> Option<String> {
    nearest_words(name, known).first().map(|word| (*word).to_owned())
}

/// The words of `known` with at most that many edits, the nearest first.
pub(crate) fn nearest_words<'k>(name: &str, known: impl Iterator<Item = &'k str>) -> Vec<&'k str> {
    // Longer names are no slips of the pen, and the comparison costs the product of the lengths.
    if name.len() > 64 {
        return Vec::new();
    }
    let allowed = (name.chars().count() / 3).max(2);
    let near = |(edits, word): &(usize, &str)| *edits <= allowed && *edits < word.chars().count();
    let mut found: Vec<(usize, &str)> = known.map(|word| (edits(name, word), word)).filter(near).collect();
    found.sort_by_key(|(edits, _)| *edits);
    found.into_iter().map(|(_, word)| word).collect()
}

/// Damerau's distance (insert, delete, change, swap of neighbours) by rows: `lenght` is one edit from `length`.
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
    //! Contract: slips of one or two letters are found; a word that only shares letters is not offered.
    use super::*;

    #[test]
    fn slips_are_found_and_strangers_are_not() {
        let known = ["length_m", "mass_kg", "stiffness_N_per_m"];
        assert_eq!(nearest("lenght_m", known.into_iter()).as_deref(), Some("length_m"));
        assert_eq!(nearest("mas_kg", known.into_iter()).as_deref(), Some("mass_kg"));
        assert_eq!(nearest("voltage_V", known.into_iter()), None);
        assert_eq!(edits("lenght", "length"), 1);
    }
}
