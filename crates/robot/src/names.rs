//! The known name that is closest to an unknown one, for error messages.

/// Number of names that a message lists.
const MAX_LISTED: usize = 20;

/// The end of a message about an unknown name: the closest known name, or a list if none is close.
pub(crate) fn suggestion<'a>(name: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    let closest = known.clone().map(|k| (edit_distance(name, k), k)).min();
    match closest {
        Some((distance, k)) if distance <= name.chars().count().max(3) / 2 => {
            format!("; did you mean `{k}`?")
        }
        Some(_) => {
            let count = known.clone().count();
            let listed = known.take(MAX_LISTED).map(|k| format!("`{k}`")).collect::<Vec<_>>().join(", ");
            let more = count.saturating_sub(MAX_LISTED);
            if more > 0 { format!("; it has {listed} and {more} more") } else { format!("; it has {listed}") }
        }
        None => "; it has none".to_owned(),
    }
}

/// Number of characters to insert, delete or replace to turn one text into the other; case is ignored.
fn edit_distance(a: &str, b: &str) -> usize {
    let lower = |text: &str| text.to_lowercase().chars().collect::<Vec<char>>();
    let (a, b) = (lower(a), lower(b));
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    //! Contract: a misspelt name is answered with the right one, a strange one with the list.

    use super::*;

    #[test]
    fn a_close_name_is_suggested_and_a_strange_one_gets_the_list() {
        let known = ["shoulder", "elbow", "wrist"];
        assert_eq!(suggestion("Elbows", known.into_iter()), "; did you mean `elbow`?");
        assert_eq!(suggestion("q1", known.into_iter()), "; it has `shoulder`, `elbow`, `wrist`");
        assert_eq!(suggestion("q1", std::iter::empty()), "; it has none");
        let many: Vec<String> = (10..99).map(|k| format!("joint{k}")).collect();
        let listed = suggestion("q1", many.iter().map(String::as_str));
        assert!(listed.ends_with("`joint28`, `joint29` and 69 more"), "{listed}");
    }
}
