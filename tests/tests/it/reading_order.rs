//! Contract: the README of a crate lists all files of its `src` in reading order. The table under "Files in
//! reading order" names files and folders below `src` in backticks. The test fails for a file that no row
//! names, and for a row that names no file. Each file of integration tests is declared as a module of one
//! binary.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

const HEADING: &str = "## Files in reading order\n";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Folders of the workspace that have a `src` and a README: every crate, and `benches`.
fn rooms() -> Vec<PathBuf> {
    let crates = std::fs::read_dir(root().join("crates")).expect("the crates").flatten().map(|e| e.path());
    crates.filter(|path| path.is_dir()).chain([root().join("benches")]).collect()
}

/// Files and folders that the first column of the README's reading order names.
fn named(readme: &str) -> Vec<&str> {
    let (_, rest) = readme.split_once(HEADING).expect("a section \"Files in reading order\"");
    let section = rest.split("\n## ").next().unwrap_or(rest);
    let cells = section.lines().filter(|l| l.starts_with("| `")).filter_map(|l| l.split('|').nth(1));
    cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).collect()
}

/// Adds the source files below `folder` to `out`, by their paths from `src`.
fn sources(folder: &Path, prefix: &str, out: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(folder).expect("a folder of sources").flatten() {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        if path.is_dir() {
            sources(&path, &format!("{prefix}{name}/"), out);
        } else if name.ends_with(".rs") {
            out.insert(format!("{prefix}{name}"));
        }
    }
}

fn leads_to(entry: &str, file: &str) -> bool {
    entry == file || (entry.ends_with('/') && file.starts_with(entry))
}

#[test]
fn every_file_is_reached_by_the_reading_order_of_its_crate() {
    let mut complaints = Vec::new();
    for room in rooms() {
        let page = room.join("README.md");
        let readme = std::fs::read_to_string(&page).unwrap_or_else(|e| panic!("{}: {e}", page.display()));
        let (entries, mut files) = (named(&readme), BTreeSet::new());
        sources(&room.join("src"), "", &mut files);
        for file in files.iter().filter(|file| !entries.iter().any(|entry| leads_to(entry, file))) {
            complaints.push(format!("{}: no row leads to src/{file}", page.display()));
        }
        for entry in entries.iter().filter(|entry| !files.iter().any(|file| leads_to(entry, file))) {
            complaints.push(format!("{}: {entry} names no file of src", page.display()));
        }
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

#[test]
fn the_readme_is_the_documentation_of_its_crate() {
    for room in rooms() {
        let face = ["lib.rs", "main.rs"].map(|name| room.join("src").join(name));
        let text = face.iter().find_map(|path| std::fs::read_to_string(path).ok()).expect("a root file");
        let included = text.starts_with("#![doc = include_str!(\"../README.md\")]\n");
        assert!(included, "{}: the root file does not begin with the README", room.display());
    }
}

/// Files of `tests/it` that `main.rs` (its text) does not declare, so that cargo would never compile them.
fn undeclared<'f>(main: &str, files: &'f [String]) -> Vec<&'f String> {
    files.iter().filter(|file| !main.lines().any(|line| line == format!("mod {file};"))).collect()
}

#[test]
fn every_file_of_integration_tests_is_a_module() {
    let crates = std::fs::read_dir(root().join("crates")).expect("the crates").flatten().map(|e| e.path());
    let (mut complaints, mut count) = (Vec::new(), 0);
    for folder in crates.chain([root().join("tests")]).map(|room| room.join("tests/it")) {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        let names = entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned());
        let files: Vec<String> = names
            .filter_map(|name| name.strip_suffix(".rs").map(str::to_owned))
            .filter(|name| name != "main")
            .collect();
        count += files.len();
        let main = std::fs::read_to_string(folder.join("main.rs")).expect("a main.rs");
        complaints.extend(undeclared(&main, &files).iter().map(|f| format!("{}: {f}", folder.display())));
    }
    assert!(complaints.is_empty(), "not declared in main.rs, so never run:\n{}", complaints.join("\n"));
    assert!(count > 80, "{count} files of integration tests; have they moved?");
}

#[test]
fn a_test_file_that_is_not_declared_is_seen() {
    let files = ["bounds", "events"].map(str::to_owned);
    assert_eq!(undeclared("mod events;\n// mod bounds;\n", &files), ["bounds"]);
}

#[test]
fn a_file_without_a_row_and_a_row_without_a_file_are_seen() {
    let readme = "# x\n\n## Files in reading order\n\n| file | holds |\n|---|---|\n| `a.rs`, `ops/` | both, see `b.rs` |\n\n## Next\n| `c.rs` |\n";
    assert_eq!(named(readme), ["a.rs", "ops/"]);
    assert!(
        leads_to("ops/", "ops/add.rs") && !leads_to("ops/", "operations.rs") && !leads_to("a.rs", "b/a.rs")
    );
}
