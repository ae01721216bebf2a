//! The `augsim` binary: parse, resolve, run, exit code.
fn main() {}
