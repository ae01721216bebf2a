//! `augsim completions` and `augsim man`: shell completions and manual pages, generated from the parser.

use crate::args::Args;
use anyhow::Context;
use augsim_session::folders;
use augsim_terminal::Outcome;
use augsim_terminal::output::Output;
use clap::CommandFactory;
use clap_complete::Shell;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

const NAME: &str = "augsim";

/// Runs `augsim completions`: prints the completion script of a shell.
pub fn completions(shell: Shell) -> anyhow::Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Args::command(), NAME, &mut script);
    match std::io::stdout().write_all(&script) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(e).context("standard output: cannot write the completions")
        }
        _ => Ok(Outcome::Done),
    }
}

#[derive(Serialize)]
struct Pages {
    folder: PathBuf,
}

/// Runs `augsim man`: writes one manual page per command into a folder.
pub fn man(folder: &Path, output: &Output) -> anyhow::Result<Outcome> {
    folders::make(folder)?;
    let written = || format!("{}: cannot write the manual pages", folder.display());
    clap_mangen::generate_to(Args::command(), folder).with_context(written)?;
    let pages = Pages { folder: folder.to_owned() };
    output.result(&pages, || {
        format!("manual pages, one per command: man {}", folder.join("augsim.1").display())
    })?;
    Ok(Outcome::Done)
}
