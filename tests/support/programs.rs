//! Programs of other languages that tests of exports run; included by path into the tests of several crates.

use std::ffi::OsStr;
use std::fmt::Debug;
use std::io::Write;
use std::path::Path;
use std::process::Command;

/// Returns what a program prints in the folder `dir`.
///
/// If the program (an interpreter or a compiler) is missing, this is printed and `None` is returned; where data are
/// required (`AUGSIM_REQUIRE_DATA`) the test fails.
pub fn printed(program: &str, args: &[impl AsRef<OsStr> + Debug], dir: &Path) -> Option<String> {
    let out = match Command::new(program).args(args).current_dir(dir).output() {
        Ok(out) => out,
        Err(e) => {
            // Nothing can be done when standard error is closed.
            let _ = writeln!(std::io::stderr(), "NOT TESTED: {program} cannot be run ({e})");
            assert!(std::env::var_os("AUGSIM_REQUIRE_DATA").is_none(), "{program} is required: {e}");
            return None;
        }
    };
    assert!(out.status.success(), "{program} {args:?}: {}", String::from_utf8_lossy(&out.stderr));
    Some(String::from_utf8(out.stdout).expect("text"))
}
