//! Prints times per sample of the dynamics of a seven-axis arm, with single numbers and with samples in lanes.
//!
//! Everything runs on one thread, and the shortest of many calls counts.
//!
//! `cargo run --release -p augsim-benches --bin robot_speed`
#![expect(clippy::print_stdout, reason = "it prints a table")]

use std::collections::BTreeMap;
use std::hint::black_box;

use augsim_benches::clock::shortest_time;
use augsim_benches::ok;
use augsim_robot::{
    Algebra, Lanes, Numbers, Tree, forward_dynamics, inverse_dynamics, inverse_dynamics_derivatives, read,
    regressor,
};

/// Calls per measurement, so that the clock's resolution does not count.
const CALLS: usize = 200;

fn main() {
    let path =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/robots/seven-axis-arm.urdf");
    let text = ok(std::fs::read_to_string(&path));
    let robot = ok(read(&text, "seven-axis-arm.urdf"));
    let joints: Vec<String> = (1..=7).map(|axis| format!("joint{axis}")).collect();
    let tree = ok(Tree::new(&robot, &joints, &BTreeMap::new()));
    let parameters = tree.body_parameters(&mut Numbers, &tree.link_parameters(&robot));
    println!(
        "{:<16} {:>9} {:>16} {:>9} {:>10}",
        "us per sample", "inverse", "and derivatives", "forward", "regressor"
    );
    measure("single numbers", &mut Numbers, 1, &tree, &parameters);
    measure("lanes of 2", &mut Lanes::<2>, 2, &tree, &parameters);
    measure("lanes of 4", &mut Lanes::<4>, 4, &tree, &parameters);
    measure("lanes of 8", &mut Lanes::<8>, 8, &tree, &parameters);
}

/// Prints the times of one kind of arithmetic, which computes `lanes` samples at once.
fn measure<A: Algebra>(name: &str, a: &mut A, lanes: usize, tree: &Tree, parameters: &[[f64; 10]]) {
    let parameters: Vec<_> = parameters.iter().map(|body| body.map(|value| a.constant(value))).collect();
    let gravity = [0.0, 0.0, -9.81].map(|value| a.constant(value));
    let state: Vec<_> = (0..tree.coordinates).map(|k| a.constant(0.3 * k as f64 - 1.0)).collect();
    let armature = vec![a.constant(0.1); tree.coordinates];
    let (q, p) = (&state[..], &parameters[..]);
    let time = |call: &mut dyn FnMut()| {
        let seconds = shortest_time(0.5, || (0..CALLS).for_each(|_| call()));
        seconds / (CALLS * lanes) as f64 * 1e6
    };
    let inverse = time(&mut || {
        black_box(inverse_dynamics(a, tree, p, gravity, black_box(q), q, q));
    });
    let derivatives = time(&mut || {
        black_box(inverse_dynamics_derivatives(a, tree, p, gravity, black_box(q), q, q));
    });
    let forward = time(&mut || {
        black_box(forward_dynamics(a, tree, p, gravity, &armature, black_box(q), q, q));
    });
    let regressor = time(&mut || {
        black_box(regressor(a, tree, gravity, black_box(q), q, q));
    });
    println!("{name:<16} {inverse:>9.2} {derivatives:>16.2} {forward:>9.2} {regressor:>10.2}");
}
