//! `augsim reference` (hidden): prints all commands and options as Markdown, generated from the parser.

use crate::args::Args;
use augsim_terminal::Outcome;
use augsim_terminal::output::Output;
use clap::{Arg, Command, CommandFactory};
use std::fmt::Write;

const HEAD: &str = "\
# Commands

This page is generated from the command line parser. `AUGSIM_RENEW=1 cargo test --release -p augsim --test it documents`
updates it. Exit codes: 0 success, 1 success but the requested criterion is not met, 2 usage error, 3 bad data, 4 numerical
failure, 130 interrupted (143 by SIGTERM, 129 by SIGHUP). Rules that hold for all commands are in
[the README of the program](../crates/cli/README.md).
";

/// Runs `augsim reference`: prints all commands and options as Markdown.
pub fn run(output: &Output) -> anyhow::Result<Outcome> {
    let mut root = Args::command();
    root.build();
    let mut page = HEAD.to_owned();
    section(&mut page, "Options of every command", "", root.get_arguments().filter(|arg| is_shown(arg)));
    for command in root.get_subcommands() {
        describe(&mut page, command);
    }
    output.result(&page, || page.clone())?;
    Ok(Outcome::Done)
}

/// Appends the description of a command and of its subcommands to the Markdown page.
fn describe(page: &mut String, command: &Command) {
    if command.is_hide_set() || command.get_name() == "help" {
        return;
    }
    let about = command.get_long_about().or(command.get_about()).map(ToString::to_string).unwrap_or_default();
    let name = command.get_bin_name().unwrap_or(command.get_name());
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage:").split_whitespace().collect::<Vec<_>>().join(" ");
    let intro = format!("{about}\n\n```text\n{usage}\n```\n");
    let arguments = command.get_arguments().filter(|arg| is_shown(arg) && !arg.is_global_set());
    section(page, &format!("`{name}`"), &intro, arguments);
    if let Some(examples) = command.get_after_help() {
        // Writing to a string cannot fail.
        let _ = write!(page, "\n```text\n{}\n```\n", examples.to_string().trim_end());
    }
    for subcommand in command.get_subcommands() {
        describe(page, subcommand);
    }
}

fn is_shown(arg: &Arg) -> bool {
    !arg.is_hide_set() && !matches!(arg.get_id().as_str(), "help" | "version")
}

/// Appends a section to the Markdown page: heading, introduction and, if there are any, a table of arguments.
fn section<'a>(page: &mut String, heading: &str, intro: &str, arguments: impl Iterator<Item = &'a Arg>) {
    // Writing to a string cannot fail.
    let _ = write!(page, "\n## {heading}\n");
    if !intro.is_empty() {
        let _ = write!(page, "\n{intro}");
    }
    let rows: Vec<String> = arguments.map(row).collect();
    if !rows.is_empty() {
        let _ = write!(page, "\n| argument | meaning |\n|---|---|\n{}\n", rows.join("\n"));
    }
}

/// Formats a command-line argument as a table row: names and value, help text, possible values and default.
fn row(arg: &Arg) -> String {
    let values: Vec<&str> =
        arg.get_value_names().unwrap_or(&[]).iter().map(clap::builder::Str::as_str).collect();
    let takes_value = arg.get_action().takes_values();
    let names = match (arg.get_short(), arg.get_long()) {
        (Some(short), Some(long)) => format!("-{short}, --{long}"),
        (None, Some(long)) => format!("--{long}"),
        (Some(short), None) => format!("-{short}"),
        (None, None) => String::new(),
    };
    let value = if takes_value {
        values.iter().map(|v| format!("<{v}>")).collect::<Vec<_>>().join(" ")
    } else {
        String::new()
    };
    let help = arg.get_long_help().or(arg.get_help()).map(ToString::to_string).unwrap_or_default();
    let mut meaning = help.split_whitespace().collect::<Vec<_>>().join(" ");
    if !meaning.ends_with(['.', '?']) {
        meaning.push('.');
    }
    let possible = arg.get_possible_values();
    if takes_value && !possible.is_empty() {
        let named = |v: &clap::builder::PossibleValue| match v.get_help() {
            Some(help) => format!("`{}` ({})", v.get_name(), help.to_string().trim_end_matches('.')),
            None => format!("`{}`", v.get_name()),
        };
        let list: Vec<String> = possible.iter().filter(|v| !v.is_hide_set()).map(named).collect();
        let _ = write!(meaning, " One of {}.", list.join(", "));
    }
    let default: Vec<_> = arg.get_default_values().iter().map(|v| v.to_string_lossy()).collect();
    if takes_value && !default.is_empty() {
        let _ = write!(meaning, " Default: `{}`.", default.join(" "));
    }
    format!("| `{}` | {} |", format!("{names} {value}").trim(), meaning.replace('|', "\\|"))
}
