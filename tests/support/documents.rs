//! The Markdown documents of the repository, for the tests that read them; included by path.

use std::path::{Path, PathBuf};

/// Path of the root folder of the workspace.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).expect("a crate two folders below the root").to_owned()
}

/// Path and text of every Markdown file for users: in the root, `docs`, `benches`, and each crate.
#[allow(dead_code, reason = "not every test file that includes this reads all documents")]
pub fn every_document() -> Vec<(PathBuf, String)> {
    let root = root();
    let mut folders = ["", "docs", "docs/recipes", "benches"].map(|f| root.join(f)).to_vec();
    let crates = std::fs::read_dir(root.join("crates")).expect("the crates").flatten();
    folders.extend(crates.map(|e| e.path()).filter(|p| p.is_dir()));
    let mut paths: Vec<PathBuf> = Vec::new();
    for folder in folders {
        let entries =
            std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())).flatten();
        paths.extend(entries.map(|e| e.path()).filter(|p| p.extension().is_some_and(|e| e == "md")));
    }
    paths.sort();
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        (path, text)
    };
    paths.into_iter().map(read).collect()
}

/// Replaces each run of white space by one space.
pub fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
