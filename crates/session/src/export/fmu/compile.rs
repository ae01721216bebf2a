//! Compiles the source code of a Functional Mock-up Unit with the C compiler of this machine.

use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

/// Folder of the libraries of this platform in a unit, and the ending of their names.
pub(super) const PLATFORM: (&str, &str) = if cfg!(target_os = "windows") {
    ("win64", "dll")
} else if cfg!(target_os = "macos") {
    ("darwin64", "dylib")
} else {
    ("linux64", "so")
};

/// Compiles `source` in `folder` to the shared library `library` in it.
///
/// The compiler is the one that the environment variable `CC` names, else `cc`.
///
/// # Errors
/// A sentence on why there is no library: the compiler cannot be run, or it failed.
pub(super) fn compile(folder: &Path, source: &str, library: &str) -> Result<(), String> {
    let compiler =
        std::env::var_os("CC").filter(|name| !name.is_empty()).unwrap_or_else(|| OsString::from("cc"));
    let name = compiler.to_string_lossy();
    let position = if cfg!(target_os = "windows") { &[][..] } else { &["-fPIC"][..] };
    let out = Command::new(&compiler)
        .args(["-std=c99", "-O2", "-shared", "-fvisibility=hidden"])
        .args(position)
        .args(["-o", library, source, "-lm"])
        .current_dir(folder)
        .output()
        .map_err(|e| format!("the C compiler `{name}` cannot be run ({e})"))?;
    match out.status.success() {
        true => Ok(()),
        false => {
            let text = String::from_utf8_lossy(&out.stderr);
            Err(format!(
                "the C compiler `{name}` failed: {}",
                text.lines().next().unwrap_or("without a message")
            ))
        }
    }
}
