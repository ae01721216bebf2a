//! Contract: `docs/thresholds.md` lists every numeric constant of discovery and calibration with its value in
//! the source. A new constant, a changed value and a row without a constant make the test fail.
//! `AUGSIM_RENEW=1` updates values and adds rows for new constants, with their doc comment in the column
//! "guards"; the other columns are written by hand.
//!
//! ```sh
//! AUGSIM_RENEW=1 cargo test --release -p augsim-tests --test it thresholds
//! ```

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Folders whose numeric constants must be in the document; test modules and the linear toy are excluded.
const FOLDERS: [&str; 2] = ["crates/discovery/src", "crates/fit/src"];
const NO_THRESHOLDS: &str = "linear_toy.rs";
const HEAD: &str = "| constant | value | file | guards | the number that led to it | noticed when doubled or halved by |\n|---|---|---|---|---|---|\n";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// `(file below crates, name)` of a constant.
type Key = (String, String);

/// Value and doc comment of a constant in the source.
#[derive(Debug, PartialEq)]
struct Constant {
    value: String,
    guards: String,
}

/// Name and value of a numeric constant in a line `const NAME: f64 = VALUE;`; `None` for other lines.
fn constant(line: &str) -> Option<(&str, &str)> {
    let (visibility, rest) = line.trim_start().split_once("const ")?;
    if !visibility.is_empty() && !visibility.starts_with("pub") {
        return None;
    }
    let (name, rest) = rest.split_once(": ")?;
    let (kind, value) = rest.split_once(" = ")?;
    let value = value.strip_suffix(';')?;
    matches!(kind, "f64" | "usize" | "u64" | "u32").then_some((name, value))
}

/// Numeric constants of a source file before its tests, with their doc comments.
fn constants(text: &str) -> Vec<(String, Constant)> {
    let code = text.split("#[cfg(test)]").next().unwrap_or_default();
    let (mut doc, mut out) = (String::new(), Vec::new());
    for line in code.lines() {
        if let Some((name, value)) = constant(line) {
            out.push((name.to_owned(), Constant { value: value.to_owned(), guards: doc.trim().to_owned() }));
        }
        match line.trim_start().strip_prefix("///") {
            Some(more) => doc = format!("{doc} {}", more.trim()),
            None => doc.clear(),
        }
    }
    out
}

fn of_sources() -> BTreeMap<Key, Constant> {
    fn visit(folder: &Path, prefix: &str, out: &mut BTreeMap<Key, Constant>) {
        for entry in std::fs::read_dir(folder).expect("a folder of sources").flatten() {
            let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
            if path.is_dir() {
                visit(&path, &format!("{prefix}/{name}"), out);
            } else if name.ends_with(".rs") && name != NO_THRESHOLDS {
                let text = std::fs::read_to_string(&path).expect("a source file");
                let file = format!("{prefix}/{name}");
                out.extend(constants(&text).into_iter().map(|(name, c)| ((file.clone(), name), c)));
            }
        }
    }
    let mut out = BTreeMap::new();
    FOLDERS
        .iter()
        .for_each(|folder| visit(&root().join(folder), folder.trim_start_matches("crates/"), &mut out));
    out
}

/// Text of the document before the table, and the cells of each row of the table, by constant.
fn of_document(text: &str) -> (String, BTreeMap<Key, Vec<String>>) {
    let (before, table) = text.split_once(HEAD).expect("the table");
    let rows = table.lines().map_while(|line| line.strip_prefix("| `")).map(|line| {
        let cells: Vec<String> = line.trim_end_matches(" |").split(" | ").map(str::to_owned).collect();
        assert_eq!(cells.len(), 6, "a row has six cells: {line}");
        ((cells[2].trim_matches('`').to_owned(), cells[0].trim_end_matches('`').to_owned()), cells)
    });
    (before.to_owned(), rows.collect())
}

#[test]
fn the_table_has_every_constant_with_its_value() {
    let path = root().join("docs/thresholds.md");
    let text = std::fs::read_to_string(&path).expect("the table");
    let (source, (before, rows)) = (of_sources(), of_document(&text));
    if std::env::var_os("AUGSIM_RENEW").is_some() {
        let mut page = before + HEAD;
        for ((file, name), constant) in &source {
            let row = rows.get(&(file.clone(), name.clone()));
            let cell = |i: usize, without: &str| row.map_or_else(|| without.to_owned(), |r| r[i].clone());
            let guards = cell(3, &constant.guards.replace('|', "\\|"));
            let (led, noticed) = (cell(4, "not recorded"), cell(5, "not tried"));
            // Writing to a string cannot fail.
            let _ =
                writeln!(page, "| `{name}` | {} | `{file}` | {guards} | {led} | {noticed} |", constant.value);
        }
        return std::fs::write(&path, page).expect("the table");
    }
    let mut complaints = Vec::new();
    for (key, constant) in &source {
        match rows.get(key) {
            None => complaints.push(format!("{} of {} has no row", key.1, key.0)),
            Some(row) if row[1] != constant.value => {
                complaints
                    .push(format!("{} of {} is {}, the table says {}", key.1, key.0, constant.value, row[1]));
            }
            Some(_) => {}
        }
    }
    complaints.extend(
        rows.keys().filter(|k| !source.contains_key(*k)).map(|k| format!("{} of {} is gone", k.1, k.0)),
    );
    let renew = "AUGSIM_RENEW=1 cargo test --release -p augsim-tests --test it thresholds";
    assert!(
        complaints.is_empty(),
        "docs/thresholds.md is stale; renew it by `{renew}`\n{}",
        complaints.join("\n")
    );
}

#[test]
fn constants_are_read_with_their_reason_and_tests_have_none() {
    let text = "/// Probability of a\n/// false step.\npub(crate) const ALPHA: f64 = 0.01;\nconst NAMES: [&str; 1] = [\"x\"];\n\
                #[cfg(test)]\nmod tests {\n    const BETA: f64 = 1.0;\n}\n";
    let expected = Constant { value: "0.01".into(), guards: "Probability of a false step.".into() };
    assert_eq!(constants(text), [("ALPHA".to_owned(), expected)]);
}
