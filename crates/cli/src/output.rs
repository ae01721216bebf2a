//! Results on standard output, notes on standard error.

use augsim_data::checks::Warning;
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
    /// From the global options.
    pub fn new(json: bool, quiet: bool, verbose: bool) -> Self {
        Output { json, quiet, verbose }
    }

    /// Whether progress may be shown (on a terminal).
    pub fn shows_progress(&self) -> bool {
        !self.quiet
    }

    /// Prints a result: the text for people, or `value` as JSON for programs.
    pub fn result(&self, value: &impl Serialize, text: impl FnOnce() -> String) -> anyhow::Result<()> {
        let out = if self.json { serde_json::to_string_pretty(value)? } else { text() };
        match writeln!(std::io::stdout(), "{}", out.trim_end()) {
            // The reader (`head`, say) has had enough.
            Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
            other => Ok(other?),
        }
    }

    /// A note for people.
    pub fn note(&self, text: impl AsRef<str>) {
        if !self.quiet {
            // Nothing can be done when standard error is closed.
            let _ = writeln!(std::io::stderr(), "{}", text.as_ref());
        }
    }

    /// What is suspicious in the data; shown to whoever is quiet, too.
    pub fn warn(&self, warnings: &[Warning]) {
        for warning in warnings {
            // Nothing can be done when standard error is closed.
            let _ = writeln!(std::io::stderr(), "augsim: warning ({}): {}", warning.check, warning.text);
        }
    }

    /// A note that only `--verbose` shows.
    pub fn detail(&self, text: impl AsRef<str>) {
        if self.verbose {
            self.note(text);
        }
    }
}
