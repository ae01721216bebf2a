//! Command lines that pages show, to be copied into a shell.

/// The words, in quotes where a shell needs them.
pub fn quoted(words: &[String]) -> String {
    let join = shlex::try_join(words.iter().map(String::as_str));
    // Only a zero byte cannot be quoted, and no argument holds one.
    join.unwrap_or_else(|_| words.join(" "))
}
