//! Results on standard output, notes on standard error.

use anyhow::Context;
use augsim_data::checks::Warning;
use augsim_data::printable;
use serde::Serialize;
use std::io::Write;

/// Where and how a command prints.
#[derive(Debug, Clone, Copy)]
pub struct Output {
    json: bool,
    quiet: bool,
    verbose: bool,
}

impl Output {
    /// Makes the output that the global options ask for.
    pub fn new(json: bool, quiet: bool, verbose: bool) -> Self {
        Output { json, quiet, verbose }
    }

    /// Whether progress may be shown (on a terminal).
    pub fn shows_progress(&self) -> bool {
        !self.quiet
    }

    /// Prints a result: the text for people, or `value` as JSON for programs.
    pub fn result(&self, value: &impl Serialize, text: impl FnOnce() -> String) -> anyhow::Result<()> {
        let out = if self.json { json(value)? } else { printable(&text()) };
        match writeln!(std::io::stdout(), "{}", out.trim_end()) {
            // The reader (`head`, say) has had enough.
            Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
            other => other.context("standard output: cannot write the result"),
        }
    }

    /// A note for people.
    pub fn note(&self, text: impl AsRef<str>) {
        if !self.quiet {
            // Nothing can be done when standard error is closed.
            let _ = writeln!(std::io::stderr(), "{}", printable(text.as_ref()));
        }
    }

    /// A sentence that must not be missed: `--quiet` shows it too.
    pub fn notice(&self, text: impl AsRef<str>) {
        // Nothing can be done when standard error is closed.
        let _ = writeln!(std::io::stderr(), "{}", text.as_ref());
    }

    /// Tells suspicions about the data, even with `--quiet`.
    pub fn warn(&self, warnings: &[Warning]) {
        for warning in warnings {
            self.notice(printable(&format!("augsim: warning ({}): {}", warning.check, warning.text)));
        }
    }

    /// A note that only `--verbose` shows.
    pub fn detail(&self, text: impl AsRef<str>) {
        if self.verbose {
            self.note(text);
        }
    }
}

/// JSON in which everything that a terminal could obey is written as `\u001b` is; JSON itself asks for that of the
/// first 32 characters only. Such a character can stand in a string alone, so that what is read back is the same.
fn json(value: &impl Serialize) -> anyhow::Result<String> {
    let text = serde_json::to_string_pretty(value)?;
    if printable(&text) == text {
        return Ok(text);
    }
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match printable(c.encode_utf8(&mut [0; 4])) == c.to_string() {
            true => out.push(c),
            false => out.push_str(&format!("\\u{:04x}", u32::from(c))),
        }
    }
    Ok(out)
}
