//! Contract: what the README says that a command prints, it prints (issue 13, item 13). Every `sh` block under a line
//! `<!-- tested -->` is run, with `out/` in a folder of its own, and the `text` block after it must stand in what it prints;
//! lines may be broken elsewhere.

use std::path::Path;
use std::process::Command;

/// The marked pairs of command and output.
fn transcripts(readme: &str) -> Vec<(&str, &str)> {
    // The text between the first `open` and the next fence, and what follows.
    fn block<'t>(text: &'t str, open: &str) -> (&'t str, &'t str) {
        let (_, rest) = text.split_once(open).expect("a block after the mark");
        rest.split_once("```").expect("a block that ends")
    }
    let marked = readme.split("<!-- tested -->\n").skip(1);
    marked
        .map(|rest| {
            let (command, rest) = block(rest, "```sh\n");
            (command, block(rest, "```text\n").0)
        })
        .collect()
}

fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn marked_commands_of_the_readme_print_what_it_says() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let readme = std::fs::read_to_string(root.join("README.md")).expect("a README");
    let dir = tempfile::tempdir().expect("a temporary directory");
    let out = format!("{}/", dir.path().display());
    let all = transcripts(&readme);
    assert!(!all.is_empty(), "README.md marks a command as tested");
    for (command, expected) in all {
        let arguments = command.trim().strip_prefix("cargo run --release -- ").expect("a command of augsim");
        let arguments = arguments.split_whitespace().map(|a| match a.strip_prefix("out/") {
            Some(rest) => out.clone() + rest,
            None => a.to_owned(),
        });
        let run = Command::new(env!("CARGO_BIN_EXE_augsim")).args(arguments).current_dir(&root).output();
        let run = run.expect("the binary runs");
        let printed = String::from_utf8_lossy(&run.stdout).into_owned();
        assert!(
            run.status.success() && words(&printed).contains(&words(expected)),
            "README.md says that `{}` prints\n{expected}\nbut it prints\n{printed}{}",
            command.trim(),
            String::from_utf8_lossy(&run.stderr)
        );
    }
}
