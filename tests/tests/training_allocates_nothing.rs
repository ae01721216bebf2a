//! Contract: a training iteration of the ball configuration (batch 100, 400 samples) allocates nothing
//! after the first, on the calling thread and on every worker. A counting allocator sees every allocation
//! of this process, so this file holds one test and nothing else runs beside it.
//!
//! One exception is allowed and counted: rayon's queue of jobs from outside its pool is a linked list of
//! blocks of 63 jobs. A training that is called from outside the pool takes one block of memory in 63
//! iterations, for any network. Called from inside the pool, as here, it takes none.
#![expect(unsafe_code, reason = "counting allocations takes a global allocator")]

use augsim_physics::ball::drop_distribution::{DropDistribution, published_predictor};
use augsim_trainer::{Engine, Recipe, Sequences, Settings, Training};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

struct Counting;

/// Number of memory allocations since last set to zero; next constant: the largest of them, bytes.
static COUNT: AtomicUsize = AtomicUsize::new(0);
static LARGEST: AtomicUsize = AtomicUsize::new(0);

fn count(bytes: usize) {
    COUNT.fetch_add(1, SeqCst);
    LARGEST.fetch_max(bytes, SeqCst);
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size);
        unsafe { System.realloc(block, layout, size) }
    }
    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Number of memory allocations during `f`, and the largest in bytes.
fn requests(f: impl FnOnce()) -> (usize, usize) {
    COUNT.store(0, SeqCst);
    LARGEST.store(0, SeqCst);
    f();
    (COUNT.load(SeqCst), LARGEST.load(SeqCst))
}

fn ok<R, E: std::fmt::Display>(result: Result<R, E>) -> R {
    result.unwrap_or_else(|e| panic!("{e}"))
}

/// Lets a worker make the allocations of its start and of its first search for work.
///
/// Otherwise some worker might allocate only during a later iteration.
fn warm_up() {
    rayon::yield_now();
}

fn train(data: &Sequences, recipe: Recipe, what: &str) {
    let engine = Engine::PybulletBall(published_predictor());
    let mut training = ok(Training::new(Settings::new(recipe, 10_000, 1, engine), data));
    let (first, _) = requests(|| {
        ok(training.step());
    });
    assert!(first > 0, "the counter does not count");
    // Two batches an epoch: seven more iterations shuffle three times.
    for iteration in 2..=8 {
        let (count, largest) = requests(|| {
            ok(training.step());
        });
        assert_eq!(
            count, 0,
            "{recipe:?}, {what}: iteration {iteration} asked for memory {count} times, at most {largest} bytes"
        );
    }
}

#[test]
fn a_training_iteration_allocates_nothing_after_the_first() {
    let (dataset, _) = ok(DropDistribution::default().generate(200, 1));
    let equal = ok(Sequences::new(&dataset, &["height_m", "velocity_m_s"]));
    let recipes = [Recipe::Neural, Recipe::Hybrid, Recipe::HybridStandardised, Recipe::HybridPlus];
    // Driven from outside the pool: what rayon's queue takes, and no more. Before any other pool: threads of one that ends
    // ask for memory when they go, whenever that is.
    let settings = Settings::new(Recipe::Hybrid, 10_000, 1, Engine::PybulletBall(published_predictor()));
    let short = DropDistribution { samples: 10, ..DropDistribution::default() };
    let short = ok(Sequences::new(&ok(short.generate(100, 1)).0, &["height_m", "velocity_m_s"]));
    let mut training = ok(Training::new(settings, &short));
    rayon::broadcast(|_| warm_up());
    ok(training.step());
    let (count, largest) = requests(|| {
        for _ in 0..630 {
            ok(training.step());
        }
    });
    assert!(
        count <= 11 && largest <= 2048,
        "{count} requests, the largest of {largest} bytes, in 630 iterations"
    );

    let pools = [1, 2, 7].map(|threads| ok(rayon::ThreadPoolBuilder::new().num_threads(threads).build()));
    for pool in &pools {
        pool.broadcast(|_| warm_up());
        let what = format!("{} threads", pool.current_num_threads());
        pool.install(|| recipes.iter().for_each(|r| train(&equal, *r, &what)));
    }
}
