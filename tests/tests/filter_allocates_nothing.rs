//! Contract: after its first rows and first forecast, a filter processes rows (impacts too) and forecasts
//! without allocating memory. A counting allocator sees every allocation of this process, so this file has
//! one test.
#![expect(unsafe_code, reason = "counting allocations takes a global allocator")]

use augsim_physics::ball::drop_distribution::{DropDistribution, published_predictor};
use augsim_trainer::filter::{Filter, InitialStatePrior, NetTransition, Sensor};
use augsim_trainer::{Engine, NetModel, Recipe, Sequences, Settings, Training};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

struct Counting;

/// Number of memory allocations since the counter was last set to zero.
static COUNT: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, SeqCst);
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, SeqCst);
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.fetch_add(1, SeqCst);
        unsafe { System.realloc(block, layout, size) }
    }
    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn rows_and_forecasts_after_the_first_ask_for_no_memory() {
    let drops = |trajectories, seed| {
        let data = DropDistribution { samples: 90, ..DropDistribution::default() }
            .generate(trajectories, seed)
            .unwrap()
            .0;
        Sequences::new(&data, &["height_m", "velocity_m_s"]).unwrap()
    };
    let (train, test) = (drops(20, 1), drops(1, 2));
    let settings = Settings::new(Recipe::HybridPlus, 200, 1, Engine::PybulletBall(published_predictor()));
    let mut training = Training::new(settings, &train).unwrap();
    for _ in 0..200 {
        training.step().unwrap();
    }
    let model = NetModel::new(training.finish().unwrap().clone()).unwrap();

    let sensor = Sensor::new(vec![Some(0.002), None]).unwrap();
    let law = Box::new(NetTransition::new(&model).unwrap());
    let mut filter =
        Filter::new(law, (sensor, InitialStatePrior::from_training_set(&train)), (&[], 0), 100, (1, 0));
    let observe = |filter: &mut Filter<'_>, rows: std::ops::Range<usize>| {
        rows.for_each(|t| filter.observe(test.items[0].state(t)).unwrap());
    };
    observe(&mut filter, 0..5);
    filter.forecast(80, 100).unwrap();
    COUNT.store(0, SeqCst);
    // The ball lands between rows 53 and 61.
    observe(&mut filter, 5..75);
    assert_eq!(COUNT.load(SeqCst), 0, "rows");
    let spread = |samples: &augsim_trainer::Samples| {
        let last = &samples.values[samples.values.len() - samples.count..];
        last.iter().copied().fold(f32::MIN, f32::max) - last.iter().copied().fold(f32::MAX, f32::min)
    };
    assert!(spread(filter.forecast(15, 100).unwrap()) > 0.0);
    assert_eq!(COUNT.load(SeqCst), 0, "a forecast");
}
