//! Runs `augsim discover` on a generated set as a user does: binary, model file, table.

use std::io;
use std::path::Path;
use std::process::{Command, Output};
use std::time::Instant;

/// Runs `augsim discover --json` in `folder`, which gets `model.toml` and `data.csv`; returns its output and its run time, s.
///
/// `options` are added to the command line.
///
/// # Errors
/// The binary cannot be run, or a file cannot be written.
pub fn discover_in(
    folder: &Path,
    augsim: &Path,
    (model, csv): (&str, &str),
    options: &[&str],
) -> io::Result<(Output, f64)> {
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join("model.toml"), model)?;
    std::fs::write(folder.join("data.csv"), csv)?;
    let started = Instant::now();
    let arguments = ["discover", "model.toml", "data.csv", "--out", "found", "--force", "--json"];
    let out = Command::new(augsim).current_dir(folder).args(arguments).args(options).output()?;
    Ok((out, started.elapsed().as_secs_f64()))
}
