//! Contract (issue 20): every crate can be published. Files that its source includes are inside the crate,
//! because `cargo package` takes no others; its manifest has the fields that the registry requires; each
//! dependency has a version. That all crates build from their packages is tested by hand: `cargo package
//! --workspace --exclude augsim-tests --exclude augsim-faults --exclude augsim-fuzz --exclude
//! augsim-benches`.

use std::path::{Path, PathBuf};
use toml::Table;

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Folders of the crates that are published: all but the Python extension, which is a wheel.
fn crates() -> Vec<PathBuf> {
    let folders = std::fs::read_dir(workspace().join("crates")).expect("the crates").flatten();
    folders.map(|entry| entry.path()).filter(|path| path.is_dir() && !path.ends_with("python")).collect()
}

fn manifest(path: &Path) -> Table {
    std::fs::read_to_string(path).expect("a manifest").parse().expect("TOML")
}

/// Paths of all source files below `folder`.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder of sources").flatten().map(|e| e.path());
    entries.flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] }).collect()
}

/// Paths in the `include!` macros of a source text, as they are written.
fn included(text: &str) -> Vec<&str> {
    ["include_str!(\"", "include_bytes!(\"", "include!(\""]
        .iter()
        .flat_map(|call| {
            text.split(call).skip(1).filter_map(|rest| rest.split_once('"')).map(|(path, _)| path)
        })
        .collect()
}

#[test]
fn included_files_lie_in_their_crate() {
    let (mut seen, mut outside) = (0, Vec::new());
    for room in crates() {
        let room = room.canonicalize().expect("a crate");
        for source in sources(&room.join("src")) {
            let text = std::fs::read_to_string(&source).unwrap_or_default();
            for path in included(&text) {
                let file = source.parent().expect("a folder").join(path);
                let file =
                    file.canonicalize().unwrap_or_else(|e| panic!("{}: {path}: {e}", source.display()));
                seen += 1;
                if !file.starts_with(&room) {
                    outside.push(format!("{}: {path} lies outside the crate", source.display()));
                }
            }
        }
    }
    assert!(outside.is_empty(), "{}", outside.join("\n"));
    assert!(seen > 20, "{seen} files are included; are they written in another way now?");
}

#[test]
fn manifests_say_what_the_registry_asks_for() {
    let root = manifest(&workspace().join("Cargo.toml"));
    let shared = root["workspace"]["dependencies"].as_table().expect("a table");
    for room in crates() {
        let (name, manifest) = (room.display(), manifest(&room.join("Cargo.toml")));
        let package = manifest["package"].as_table().expect("a package");
        for key in ["description", "license", "readme", "keywords", "categories"] {
            assert!(package.contains_key(key), "{name}: the package has no `{key}`");
        }
        for (dependency, of) in manifest.get("dependencies").and_then(|d| d.as_table()).into_iter().flatten()
        {
            let is_shared = of.get("workspace").is_some_and(|v| v.as_bool() == Some(true));
            let asked = if is_shared { &shared[dependency] } else { of };
            let version = asked.as_str().or_else(|| asked.get("version").and_then(|v| v.as_str()));
            assert!(version.is_some(), "{name}: {dependency} has a path and no version");
        }
    }
}

#[test]
fn demo_shows_the_sealed_set() {
    let pair = |a: &str, b: &str| {
        let [a, b] = [a, b].map(|path| std::fs::read(workspace().join(path)).expect("a file"));
        assert!(a == b);
    };
    pair("crates/cli/demo/bounces.csv", "fixtures/sealed/bounces.csv");
    pair("crates/cli/demo/declared.toml", "fixtures/sealed/model.toml");
}

#[test]
fn every_way_to_include_is_seen() {
    let text = "const A: &str = include_str!(\"../a.toml\");\nconst B: &[u8] = include_bytes!(\"b.csv\");\n";
    assert_eq!(included(text), ["../a.toml", "b.csv"]);
}
