//! Tests of the crate's public interface.

mod arms;
mod dynamics;
mod energy;
mod golden;
mod length;
#[path = "../../../../tests/support/shared_data.rs"]
mod shared_data;
mod tree;
mod urdf;

/// Text of a file in `fixtures/robots`.
fn fixture(name: &str) -> String {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/robots").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}
