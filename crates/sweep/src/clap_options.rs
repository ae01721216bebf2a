//! Options of a command as its parser knows them, and the check of a task's command line by that parser.

use super::fault::{OptionFault, SweepFault};
use super::file::Value;
use augsim_terminal::Usage;
use clap::builder::ValueParser;
use clap::{Arg, ArgAction, ArgMatches, Command};
use std::any::TypeId;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Commands whose results can be put together: each writes into one folder, or prints one result.
const COMMANDS: [&str; 4] = ["train", "discover", "evaluate", "reproduce"];
/// Options that the sweep itself gives to a task, or that do not change its result.
const NOT_IN_A_SWEEP: [&str; 9] =
    ["out", "resume", "force", "json", "verbose", "quiet", "threads", "help", "version"];

/// The program whose commands a sweep repeats.
#[derive(Debug, Clone, Copy)]
pub struct Program {
    /// Parser of its command lines.
    pub parser: fn() -> Command,
    /// Checks of a parsed command line that the parser does not make.
    pub check: fn(&ArgMatches) -> Result<(), Usage>,
}

/// How an option is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The option is given by its name alone.
    Flag,
    /// The option is given by its name and a value.
    Valued,
    /// The value is given by its place, without a name.
    Placed,
}

/// An option that a sweep may set.
#[derive(Debug, Clone)]
pub struct CommandOption {
    /// How it is given.
    pub kind: Kind,
    /// Whether its value is the path of an input.
    pub is_input: bool,
}

/// A command and its options.
#[derive(Debug, Clone)]
pub struct SweptCommand {
    /// The command and the words beside it, such as `reproduce` and `push`.
    pub words: Vec<String>,
    parser: Command,
    check: fn(&ArgMatches) -> Result<(), Usage>,
    options: BTreeMap<String, CommandOption>,
    /// Names of the options that are given by their place, in order; the first of them may be among `words`.
    placed: Vec<String>,
    takes_out: bool,
    takes_resume: bool,
}

impl SweptCommand {
    /// The command of these words.
    ///
    /// # Errors
    /// No sweep can be made of it.
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
        let (mut placed, mut takes_out, mut takes_resume) = (Vec::new(), false, false);
        for arg in command.get_arguments() {
            let name = name_of(arg);
            takes_out |= name == "out";
            takes_resume |= name == "resume";
            if NOT_IN_A_SWEEP.contains(&name.as_str()) {
                continue;
            }
            let kind = match arg.get_action() {
                _ if arg.is_positional() => Kind::Placed,
                ArgAction::SetTrue => Kind::Flag,
                _ => Kind::Valued,
            };
            if kind == Kind::Placed {
                placed.push(name.clone());
            }
            options.insert(name, CommandOption { kind, is_input: is_path(arg.get_value_parser()) });
        }
        // `reproduce push` says by its second word what `scenario` is.
        for spoken in placed.iter().take(words.len() - 1) {
            options.remove(spoken);
        }
        Ok(SweptCommand { words, parser, check: program.check, options, placed, takes_out, takes_resume })
    }

    /// An option by its name.
    ///
    /// # Errors
    /// The command has none of this name, or a sweep must not set it.
    pub fn option(&self, name: &str) -> Result<&CommandOption, OptionFault> {
        if NOT_IN_A_SWEEP.contains(&name) {
            return Err(OptionFault::NotForSweeps { name: name.to_owned() });
        }
        self.options.get(name).ok_or_else(|| OptionFault::Unknown {
            name: name.to_owned(),
            command: self.words.join(" "),
            known: self.options.keys().cloned().collect(),
        })
    }

    /// Arguments of a task after the program's name, in the order of the options' names; with `resume` it goes on with what
    /// is in its folder.
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
        let mut places: BTreeMap<&str, Vec<String>> = BTreeMap::new();
        let set = settings.iter().map(|(name, value)| (name, value.words()));
        let read = inputs.iter().map(|(name, path)| (name, vec![path.clone()]));
        for (name, words) in set.chain(read) {
            match self.options.get(name).map(|option| option.kind) {
                Some(Kind::Flag) if words == ["false"] => {}
                Some(Kind::Flag) if words == ["true"] => line.push(format!("--{name}")),
                Some(Kind::Placed) => {
                    places.insert(name, words);
                }
                // A value that begins with a hyphen is no option.
                _ => line.extend(words.iter().map(|word| format!("--{name}={word}"))),
            }
        }
        line.push(format!("--seed={seed}"));
        if self.takes_out {
            line.push(format!("--out={out}"));
        }
        line.push("--".to_owned());
        line.extend(self.words[1..].iter().cloned());
        line.extend(self.placed.iter().filter_map(|name| places.remove(name.as_str())).flatten());
        line
    }

    /// Refuses a command line as the command itself would before it reads a file.
    ///
    /// # Errors
    /// The command's sentence.
    pub fn check(&mut self, arguments: &[String]) -> Result<(), SweepFault> {
        let line = std::iter::once("augsim").chain(arguments.iter().map(String::as_str));
        let parsed = self.parser.try_get_matches_from_mut(line);
        Ok((self.check)(&parsed.map_err(|cause| SweepFault::CommandLine { cause })?)?)
    }
}

/// Whether an option holds a path.
fn is_path(parser: &ValueParser) -> bool {
    parser.type_id() == TypeId::of::<PathBuf>()
}
