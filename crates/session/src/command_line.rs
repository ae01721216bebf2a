//! Command lines that pages show, ready to be copied into a shell.

/// Joins words into a command line, quoted where a shell needs it.
pub fn quoted(words: &[String]) -> String {
    let join = shlex::try_join(words.iter().map(String::as_str));
    // Only a zero byte cannot be quoted, and no argument holds one.
    join.unwrap_or_else(|_| words.join(" "))
}
