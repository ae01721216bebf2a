//! Checks the discovery on measured pushes of two days: `discover_battery push-measured`, about five minutes.

use augsim_data::Dataset;
use augsim_data::convert::CONVERTERS;
use augsim_discovery::{Options, discover};
use augsim_physics::model::{ModelFile, PushModel};
use std::path::Path;

/// Converts the data set in `folder` and returns it with its model.
fn converted(folder: &Path) -> (Dataset, PushModel) {
    let (_, convert) = CONVERTERS.iter().find(|(name, _)| *name == "mit-pusher-slider").expect("a converter");
    let converted = convert(folder).expect("convertible");
    let text = converted.model_toml.expect("a model file");
    let Ok(ModelFile::Push(model)) = ModelFile::parse(&text, "model.toml") else {
        panic!("a model of pushing")
    };
    (converted.data, model)
}

/// Checks the discovery on `mit-pusher-slider-runs` and returns its summary sentence.
///
/// The runs are of two days in two coordinate frames, with disturbances by hand.
///
/// # Panics
/// If the answer contradicts known facts about these runs.
pub fn runs_of_two_days(folder: &Path) -> String {
    let (data, model) = converted(folder);
    let d = discover(&model, &data, &Options::default(), &mut |_| {}).expect("an answer");
    // Calibration is certain in these runs: c and friction differ from the textbook values, and the error
    // drops by a third.
    assert!(d.error.calibrated.rmse < 0.7 * d.error.declared.rmse, "{}\n{:?}", d.sentence, d.error);
    assert!(d.parameters["contact_friction"].ci95[1] < 0.25, "{:?}", d.parameters);
    // The effects found reduce the error on runs that were not fitted, beyond chance.
    assert_eq!(d.error.folds, Some(5));
    assert!(d.error.reduction.ci95[0] > 0.0, "{}\n{:?}", d.sentence, d.error);
    assert!(d.error.augmented.rmse < 0.85 * d.error.calibrated.rmse, "{}\n{:?}", d.sentence, d.error);
    let effect = |kind: &str| {
        let found = d.effects.iter().find(|e| e.kind == kind);
        found.unwrap_or_else(|| panic!("{kind}: {}", d.sentence))
    };
    // According to the notes on the data, runs of the first day have a smaller c (32 mm) than those of the
    // second (43 mm).
    let per_day = effect("c_m per group");
    let c = &per_day.parameters["c_m"].groups;
    assert!(
        (0.028..0.035).contains(&c["10-21"].value) && (0.038..0.046).contains(&c["10-23"].value),
        "{c:?}"
    );
    // On the second day the distance between rod and object grows by 5 to 6 mm per metre of travel during
    // contact.
    let frames = effect("frame-registration");
    let scale = &frames.parameters["scale"];
    assert!((-0.007..-0.003).contains(&scale.value) && scale.ci95[1] < 0.0, "{}", d.sentence);
    for found in [per_day, frames] {
        assert!(found.folds.is_some_and(|[refound, folds]| 2 * refound > folds), "{}", d.sentence);
    }
    // Ten of the runs have disturbances by hand; the windows with them must be left out.
    assert!(d.windows.as_ref().is_some_and(|w| w.excluded[0] > 5));
    d.sentence
}
