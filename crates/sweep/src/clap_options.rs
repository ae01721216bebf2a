//! Reads the options of a swept command from its clap parser, and checks the command lines of tasks.

use super::fault::{OptionFault, SweepFault};
use super::file::Value;
use augsim_terminal::Usage;
use clap::builder::ValueParser;
use clap::{Arg, ArgAction, ArgMatches, Command};
use std::any::TypeId;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Commands that can be swept: each writes into one folder or prints one result.
const COMMANDS: [&str; 4] = ["train", "discover", "evaluate", "reproduce"];
/// Options that no sweep file may set: the sweep sets them itself, or they do not change results.
const RESERVED_OPTIONS: [&str; 9] =
    ["out", "resume", "force", "json", "verbose", "quiet", "threads", "help", "version"];

/// Parser and checks of the program whose commands a sweep runs.
#[derive(Debug, Clone, Copy)]
pub struct Program {
    /// Function that makes the parser of command lines.
    pub parser: fn() -> Command,
    /// Function that checks a parsed command line beyond the parser.
    pub check: fn(&ArgMatches) -> Result<(), Usage>,
}

/// Form of an option on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The option is a flag without a value.
    Flag,
    /// The option takes a value.
    Valued,
    /// The option is a positional argument.
    Positional,
}

/// An option of a command that a sweep may set.
#[derive(Debug, Clone)]
pub struct CommandOption {
    /// Form of the option on the command line.
    pub kind: Kind,
    /// Whether the option's value is the path of an input.
    pub is_input: bool,
}

/// A command that a sweep runs, with its options.
#[derive(Debug, Clone)]
pub struct SweptCommand {
    /// Command and its positional words, such as `reproduce` and `push`.
    pub words: Vec<String>,
    parser: Command,
    check: fn(&ArgMatches) -> Result<(), Usage>,
    options: BTreeMap<String, CommandOption>,
    /// Names of the command's positional arguments in order. The first may be fixed by `words`.
    positional: Vec<String>,
    takes_out: bool,
    takes_resume: bool,
}

impl SweptCommand {
    /// Finds the command and its options from a command line such as `reproduce push`.
    ///
    /// # Errors
    /// The command cannot be swept.
    pub fn named(line: &str, program: Program) -> Result<Self, SweepFault> {
        let words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        let name = words.first().map_or("", String::as_str);
        let mut parser = (program.parser)();
        parser.build();
        let known = COMMANDS.contains(&name).then(|| parser.find_subcommand(name)).flatten();
        let Some(command) = known else {
            return Err(SweepFault::UnknownCommand { line: line.to_owned(), known: &COMMANDS });
        };
        let name_of = |arg: &Arg| match arg.get_long() {
            Some(long) => long.to_owned(),
            None => arg.get_id().as_str().replace('_', "-"),
        };
        let mut options = BTreeMap::new();
        let (mut positional, mut takes_out, mut takes_resume) = (Vec::new(), false, false);
        for arg in command.get_arguments() {
            let name = name_of(arg);
            takes_out |= name == "out";
            takes_resume |= name == "resume";
            if RESERVED_OPTIONS.contains(&name.as_str()) {
                continue;
            }
            let kind = match arg.get_action() {
                _ if arg.is_positional() => Kind::Positional,
                ArgAction::SetTrue => Kind::Flag,
                _ => Kind::Valued,
            };
            if kind == Kind::Positional {
                positional.push(name.clone());
            }
            options.insert(name, CommandOption { kind, is_input: is_path(arg.get_value_parser()) });
        }
        // The second word of `reproduce push` is the value of `scenario`, which is no longer an option.
        for fixed in positional.iter().take(words.len() - 1) {
            options.remove(fixed);
        }
        Ok(SweptCommand { words, parser, check: program.check, options, positional, takes_out, takes_resume })
    }

    /// Returns the option of the command with this name.
    ///
    /// # Errors
    /// The command has no such option, or a sweep must not set it.
    pub fn option(&self, name: &str) -> Result<&CommandOption, OptionFault> {
        if RESERVED_OPTIONS.contains(&name) {
            return Err(OptionFault::NotForSweeps { name: name.to_owned() });
        }
        self.options.get(name).ok_or_else(|| OptionFault::Unknown {
            name: name.to_owned(),
            command: self.words.join(" "),
            known: self.options.keys().cloned().collect(),
        })
    }

    /// Returns the command line arguments of a task, in the order of option names.
    ///
    /// `resume` adds the option that continues an existing run.
    pub fn arguments(
        &self,
        settings: &BTreeMap<String, Value>,
        inputs: &BTreeMap<String, String>,
        seed: u64,
        out: &str,
        resume: bool,
    ) -> Vec<String> {
        let mut line = vec![self.words[0].clone()];
        if resume && self.takes_resume {
            line.push("--resume".to_owned());
        }
        let mut positional_values: BTreeMap<&str, Vec<String>> = BTreeMap::new();
        let set = settings.iter().map(|(name, value)| (name, value.command_line_words()));
        let read = inputs.iter().map(|(name, path)| (name, vec![path.clone()]));
        for (name, words) in set.chain(read) {
            match self.options.get(name).map(|option| option.kind) {
                Some(Kind::Flag) if words == ["false"] => {}
                Some(Kind::Flag) if words == ["true"] => line.push(format!("--{name}")),
                Some(Kind::Positional) => {
                    positional_values.insert(name, words);
                }
                // `--name=value` keeps values that begin with a hyphen from being read as options.
                _ => line.extend(words.iter().map(|word| format!("--{name}={word}"))),
            }
        }
        line.push(format!("--seed={seed}"));
        if self.takes_out {
            line.push(format!("--out={out}"));
        }
        line.push("--".to_owned());
        line.extend(self.words[1..].iter().cloned());
        line.extend(
            self.positional.iter().filter_map(|name| positional_values.remove(name.as_str())).flatten(),
        );
        line
    }

    /// Checks the command line of a task with the parser and the checks of the command.
    ///
    /// # Errors
    /// The command rejects the options.
    pub fn check(&mut self, arguments: &[String]) -> Result<(), SweepFault> {
        let line = std::iter::once("augsim").chain(arguments.iter().map(String::as_str));
        let parsed = self.parser.try_get_matches_from_mut(line);
        Ok((self.check)(&parsed.map_err(|cause| SweepFault::CommandLine { cause })?)?)
    }
}

/// Whether the values of an option are paths, by its clap value parser.
fn is_path(parser: &ValueParser) -> bool {
    parser.type_id() == TypeId::of::<PathBuf>()
}
