//! Contract: the examples of this crate run and find the effects that they announce. Each is included as a
//! module, so that a change of the library that breaks an example fails to compile here.

#[path = "../../examples/discover.rs"]
mod discover;
#[path = "../../examples/own_effect.rs"]
mod own_effect;
#[path = "../../examples/own_system.rs"]
mod own_system;

#[test]
fn minimal_discovery_runs() {
    discover::main().expect("an answer");
}

#[test]
fn own_effect_is_found() {
    // The example returns an error if the magnet is not among the effects.
    own_effect::main().expect("the magnet");
}

#[test]
fn own_system_lacks_its_seepage_and_nothing_else() {
    let found = own_system::found().expect("an answer");
    let kinds: Vec<&str> = found.effects.iter().map(|effect| effect.kind.as_str()).collect();
    assert_eq!(kinds, ["seepage"], "{}", found.sentence);
    for (estimate, truth) in [
        (&found.effects[0].parameters["k_m2_s"], own_system::TRUTH[1]),
        (&found.parameters["outlet_m2"], own_system::TRUTH[0]),
    ] {
        assert!((estimate.value / truth - 1.0).abs() < 0.05, "{estimate:?} against {truth}");
    }
    own_system::main().expect("an answer");
}
