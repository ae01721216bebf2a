//! Tests of the crate's public items, in one program.

mod arms;
mod conversion;
mod dynamics;
mod energy;
mod golden;
mod length;
mod mjcf;
mod mutation;
#[path = "../../../../tests/support/shared_data.rs"]
mod shared_data;
mod tree;
mod urdf;
mod write_back;

use augsim_robot::description::Inertia;

/// Text of a file in `fixtures/robots`.
fn fixture(name: &str) -> String {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/robots").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Names of the files in `fixtures/robots`.
const FIXTURES: [&str; 8] = [
    "two-link-planar.urdf",
    "six-axis-arm.urdf",
    "gantry.urdf",
    "torso.urdf",
    "gripper.urdf",
    "pendulum.xml",
    "slide-arm.xml",
    "two-hinges.xml",
];

/// Asserts that two inertias are the same but for rounding.
fn assert_close(inertia: Option<&Inertia>, expected: Option<&Inertia>) {
    let numbers = |inertia: Option<&Inertia>| {
        inertia
            .map(|i| [i.mass_kg].into_iter().chain(i.centre_m).chain(i.inertia_kg_m2).collect::<Vec<f64>>())
    };
    let (numbers, expected) = (numbers(inertia), numbers(expected));
    assert_eq!(numbers.is_some(), expected.is_some());
    for (number, expected) in numbers.iter().flatten().zip(expected.iter().flatten()) {
        assert!((number - expected).abs() < 1e-12 * (1.0 + expected.abs()), "{number} instead of {expected}");
    }
}
