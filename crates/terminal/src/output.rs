//! Prints results on standard output and notes on standard error.

use anyhow::Context;
use augsim_data::checks::Warning;
use augsim_data::escape_control_characters;
use serde::Serialize;
use std::io::Write;

/// Where and how a command prints: results as text or JSON, notes unless quiet, details if verbose.
#[derive(Debug, Clone, Copy)]
pub struct Output {
    json: bool,
    quiet: bool,
    verbose: bool,
}

impl Output {
    /// Output of a command by the options `--json`, `--quiet` and `--verbose`.
    pub fn new(json: bool, quiet: bool, verbose: bool) -> Self {
        Output { json, quiet, verbose }
    }

    /// Whether progress may be shown, that is, unless `--quiet` is set.
    pub fn shows_progress(&self) -> bool {
        !self.quiet
    }

    /// Prints a result on standard output: the text for people, or `value` as JSON for programs.
    pub fn result(&self, value: &impl Serialize, text: impl FnOnce() -> String) -> anyhow::Result<()> {
        let out = if self.json { json(value)? } else { escape_control_characters(&text()) };
        match writeln!(std::io::stdout(), "{}", out.trim_end()) {
            // A closed pipe is no error: a reader such as `head` stops early.
            Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
            other => other.context("standard output: cannot write the result"),
        }
    }

    /// Prints a note on standard error unless `--quiet` is set.
    pub fn note(&self, text: impl AsRef<str>) {
        if !self.quiet {
            // Nothing can be done when standard error is closed.
            let _ = writeln!(std::io::stderr(), "{}", escape_control_characters(text.as_ref()));
        }
    }

    /// Prints a message on standard error, even with `--quiet`.
    pub fn notice(&self, text: impl AsRef<str>) {
        // Nothing can be done when standard error is closed.
        let _ = writeln!(std::io::stderr(), "{}", text.as_ref());
    }

    /// Prints warnings about the data on standard error, even with `--quiet`.
    pub fn warn(&self, warnings: &[Warning]) {
        for warning in warnings {
            self.notice(escape_control_characters(&format!(
                "augsim: warning ({}): {}",
                warning.check, warning.text
            )));
        }
    }

    /// Prints a note on standard error if `--verbose` is set.
    pub fn detail(&self, text: impl AsRef<str>) {
        if self.verbose {
            self.note(text);
        }
    }
}

/// Serialises a value as JSON and escapes all characters that a terminal could interpret.
///
/// JSON itself requires this for the first 32 characters only. Such characters occur in strings only, so the
/// escaped text parses to the same value.
fn json(value: &impl Serialize) -> anyhow::Result<String> {
    let text = serde_json::to_string_pretty(value)?;
    if escape_control_characters(&text) == text {
        return Ok(text);
    }
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match escape_control_characters(c.encode_utf8(&mut [0; 4])) == c.to_string() {
            true => out.push(c),
            false => out.push_str(&format!("\\u{:04x}", u32::from(c))),
        }
    }
    Ok(out)
}
