//! Properties that every answer of the loop has.

use augsim_discovery::Discovery;

/// Asserts that an answer is the same, byte for byte, on one, two and seven threads.
///
/// # Panics
/// If it is not, or if threads or JSON cannot be had.
pub fn assert_same_on_any_number_of_threads(answer: impl Fn() -> Discovery + Sync) {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        serde_json::to_string(&pool.install(&answer)).expect("JSON")
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(7));
}
