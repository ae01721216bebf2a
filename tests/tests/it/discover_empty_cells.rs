//! Contract (issue 13, item 1): an empty cell is a missing measurement and nothing else. A row whose only
//! position is empty gives the same answer, to the last digit, as data without the row. A row that lost one
//! of two channels keeps the other. No share and no pattern of empty cells creates or hides an effect.
//!
//! In an earlier version the first empty height spread to all later heights, so that their impacts were not
//! detected. The sets come from the independent generator [`augsim_tests::sealed`], whose truth is known.

use augsim_data::{Dataset, random_stream};
use augsim_discovery::{Discovery, Options, discover};
use augsim_physics::model::Model;
use augsim_tests::battery::{Battery, run_with_gaps};
use augsim_tests::gaps::Gaps;
use augsim_tests::sealed::{Scene, Truth, seal};

/// A small set of drops without a missing effect, and its model.
fn drops() -> (Dataset, Model) {
    let truth = Truth { declared_ratio: 1.0, ..Truth::default() };
    let sealed = seal(&Scene::DROPS, truth, &mut random_stream(1, "drops", 0)).expect("well formed");
    (sealed.data, Model::parse(&sealed.model, "sealed.toml").expect("well formed"))
}

fn answer(model: &Model, data: &Dataset) -> Discovery {
    discover(model, data, &Options::default(), &mut |_| {}).expect("an answer")
}

/// Returns `data` without the rows whose height is empty.
fn without_empty_rows(data: &Dataset) -> Dataset {
    let kept = data.trajectories().iter().map(|t| {
        let rows: Vec<usize> = (0..t.len()).filter(|&k| t.column(0)[k].is_finite()).collect();
        let of = |column: &[f64]| rows.iter().map(|&k| column[k]).collect::<Vec<_>>();
        t.with_samples(of(t.time_s()), t.values().iter().map(|c| of(c)).collect()).expect("well formed")
    });
    let names: Vec<&str> = data.columns().iter().map(|c| c.name()).collect();
    Dataset::from_names(&names, kept.collect()).expect("well formed")
}

#[test]
fn an_empty_height_is_a_row_that_was_not_written() {
    let (data, model) = drops();
    for (share, runs) in [(0.01, false), (0.1, true)] {
        let cut = Gaps { share, runs }.cut(&data, &mut random_stream(1, "gaps", 0)).expect("well formed");
        let (empty, removed) = (answer(&model, &cut), answer(&model, &without_empty_rows(&cut)));
        assert!(empty == removed, "{share}: {}\nagainst {}", empty.sentence, removed.sentence);
    }
}

#[test]
fn empty_cells_make_no_effects() {
    let mut wrong = String::new();
    // One set of each share and pattern.
    let s = run_with_gaps(Battery::Null, 8, 8, &mut |row| {
        if !row.right {
            wrong.push_str(&row.line);
        }
    });
    assert!(wrong.is_empty() && s.false_alarms == 0, "{s}\n{wrong}");
}

#[test]
fn empty_cells_hide_no_effects() {
    let mut wrong = String::new();
    let s = run_with_gaps(Battery::Single, 8, 8, &mut |row| {
        if !row.right {
            wrong.push_str(&row.line);
        }
    });
    assert!(s.visible >= 6, "{s}");
    assert!(wrong.is_empty(), "{s}\n{wrong}");
}
