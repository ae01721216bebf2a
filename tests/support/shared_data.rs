//! Location of test data that is not committed; included by path into the tests of every crate.

use std::path::{Path, PathBuf};

/// Path of the root folder of the workspace.
pub fn workspace() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = here.ancestors().find(|folder| folder.join("Cargo.lock").exists());
    root.expect("a crate inside the workspace").to_owned()
}

/// Path of `relative` below `AUGSIM_DATA`, or below `../shared/data` next to the workspace.
///
/// If the file is missing, returns `None` and prints that the test is skipped; with `AUGSIM_REQUIRE_DATA=1`
/// the test fails.
#[allow(dead_code, reason = "not every test file that includes this needs shared data")]
#[expect(clippy::print_stderr, reason = "a skipped test must be seen")]
pub fn shared_data(relative: &str) -> Option<PathBuf> {
    let root =
        std::env::var_os("AUGSIM_DATA").map_or_else(|| workspace().join("../shared/data"), PathBuf::from);
    let path = root.join(relative);
    if path.exists() {
        return Some(path);
    }
    let required = std::env::var("AUGSIM_REQUIRE_DATA").is_ok_and(|value| value == "1");
    assert!(!required, "AUGSIM_REQUIRE_DATA=1, but {} is missing", path.display());
    eprintln!("SKIPPED: {} is missing; set AUGSIM_DATA to the folder of data", path.display());
    None
}
