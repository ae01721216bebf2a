//! Assertions that hold for every answer of the discovery.

use augsim_discovery::Discovery;

/// Asserts that the JSON text of a discovery is the same, byte for byte, on one, two and seven threads.
///
/// # Panics
/// If the texts differ, or if a thread pool or the JSON text cannot be made.
pub fn assert_independent_of_threads(answer: impl Fn() -> Discovery + Sync) {
    let answer_on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        serde_json::to_string(&pool.install(&answer)).expect("JSON")
    };
    let expected = answer_on(1);
    assert_eq!(expected, answer_on(2));
    assert_eq!(expected, answer_on(7));
}
