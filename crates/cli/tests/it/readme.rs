//! Contract (issue 13, item 13; issue 21): commands in documents print what the documents say. In the
//! README, in `docs` and in the READMEs of crates, every `sh` block after a line `<!-- tested -->` is
//! run line by line, with `out/` in a folder of the document. Besides augsim the lines may run `cc`, `python3` and
//! programs in `out/`. The `text` block that follows directly, if
//! any, must be in the output, with any line breaks. A block after `<!-- file: out/NAME -->` is written
//! to that file first, so that documents can be followed from top to bottom. Links point to existing
//! files, and the README is short.

use crate::documents_on_disk::{every_document, root, words};
use std::path::Path;
use std::process::Command;

/// Step of a document that the test follows: writing a file or running commands.
enum Step<'t> {
    /// Writes a file below `out/`.
    Write { name: &'t str, text: &'t str },
    /// Runs commands; their output must contain `expected`.
    Run { commands: &'t str, expected: Option<&'t str> },
}

/// Returns the content and language of the fenced block at the start of `text`, and the text after it.
fn block(text: &str) -> Option<(&str, &str, &str)> {
    let (language, rest) = text.trim_start_matches('\n').strip_prefix("```")?.split_once('\n')?;
    let (content, rest) = rest.split_once("\n```")?;
    Some((language, content, rest))
}

/// Returns the steps of a document in order.
fn steps(document: &str) -> Vec<Step<'_>> {
    const TESTED: &str = "tested -->\n";
    let mut out = Vec::new();
    for mark in document.split("<!-- ").skip(1) {
        if let Some(rest) = mark.strip_prefix(TESTED) {
            let (language, commands, rest) = block(rest).expect("a block after `<!-- tested -->`");
            assert_eq!(language, "sh", "`<!-- tested -->` stands above a block of commands");
            let expected = block(rest).filter(|(language, ..)| *language == "text").map(|(_, text, _)| text);
            out.push(Step::Run { commands, expected });
        } else if let Some((name, rest)) =
            mark.strip_prefix("file: out/").and_then(|m| m.split_once(" -->\n"))
        {
            let (_, text, _) = block(rest).expect("a block after `<!-- file: … -->`");
            out.push(Step::Write { name, text });
        }
    }
    out
}

/// Runs one line of a block, with `out/` in `folder`; returns what it prints.
fn run(line: &str, folder: &Path) -> String {
    let typed = line.split(" #").next().unwrap_or(line).trim();
    let command = typed.strip_prefix("cargo run --release -- ").or(typed.strip_prefix("augsim "));
    let is_other = ["cc ", "python3 ", "out/"].iter().any(|start| typed.starts_with(start));
    let command = command.or(is_other.then_some(typed));
    let words = command.unwrap_or_else(|| panic!("`{typed}` is no command of augsim")).split_whitespace();
    let mut words = words.map(|a| match a.strip_prefix("out/") {
        Some(rest) => folder.join(rest).display().to_string(),
        None => a.to_owned(),
    });
    let augsim = || env!("CARGO_BIN_EXE_augsim").to_owned();
    let program = if is_other { words.next().unwrap_or_default() } else { augsim() };
    let run = Command::new(program).args(words).current_dir(root()).output();
    let run = run.expect("the binary runs");
    let printed = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(run.status.success(), "`{typed}` fails:\n{printed}{}", String::from_utf8_lossy(&run.stderr));
    printed
}

/// Follows a document from top to bottom; returns the number of commands.
fn follow(document: &str) -> usize {
    let folder = tempfile::tempdir().expect("a temporary directory");
    let mut count = 0;
    for step in steps(document) {
        match step {
            Step::Write { name, text } => {
                let path = folder.path().join(name);
                std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
                std::fs::write(path, format!("{text}\n")).expect("a file");
            }
            Step::Run { commands, expected } => {
                let lines = commands.lines().filter(|l| !l.trim().is_empty());
                let printed: Vec<String> = lines.map(|line| run(line, folder.path())).collect();
                count += printed.len();
                let (printed, expected) = (printed.concat(), expected.unwrap_or_default());
                assert!(
                    words(&printed).contains(&words(expected)),
                    "a document says that\n{commands}\nprints\n{expected}\nbut it prints\n{printed}"
                );
            }
        }
    }
    count
}

#[test]
fn marked_commands_print_the_documented_output() {
    for (path, text) in every_document() {
        let count = follow(&text);
        if path.ends_with("README.md") && path.parent() == Some(&root()) {
            assert!(count >= 2, "README.md marks its commands as tested");
        }
    }
}

#[test]
fn the_readme_is_short() {
    let size = std::fs::metadata(root().join("README.md")).expect("a README").len();
    assert!(
        size <= 9_000,
        "README.md has {size} bytes: at most 9,000; results belong to the README of a crate"
    );
}

#[test]
fn links_between_documents_point_to_files() {
    let mut broken = Vec::new();
    for (path, text) in every_document() {
        let folder = path.parent().expect("a folder");
        let links = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        let files =
            links.filter(|link| !link.contains("://") && !link.starts_with('#') && !link.contains(' '));
        for link in files {
            if !folder.join(link.split('#').next().unwrap_or(link)).exists() {
                broken.push(format!("{}: {link}", path.display()));
            }
        }
    }
    assert!(broken.is_empty(), "links to nothing:\n{}", broken.join("\n"));
}

#[test]
#[should_panic(expected = "but it prints")]
fn detects_outdated_output() {
    follow(
        "<!-- tested -->\n```sh\naugsim model new pendulum --out out/m.toml\n```\n\n```text\na lie\n```\n",
    );
}
