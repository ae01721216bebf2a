//! Contract: a centre of pressure that differs randomly from push to push is distinguished from a common one, its standard
//! deviation is estimated and written into the augmented model, and no other effect is found.

use augsim_discovery::{AllowedEffects, Discovery, Options, Verdict, discover};
use augsim_physics::model::PushModel;
use augsim_tests::sealed_push::{PushKind, PushTruth, SealedPushes, seal_pushes};

fn set(effect: Option<PushKind>, pushes: usize) -> (SealedPushes, PushModel) {
    let truth = PushTruth { effect, patches: false, c_m: 0.0355, contact_friction: 0.28, pushes };
    let set = seal_pushes(truth, 11).expect("well formed");
    let model = PushModel::parse(&set.model, "sealed.toml").expect("well formed");
    (set, model)
}

fn answer(model: &PushModel, set: &SealedPushes, options: &Options) -> Discovery {
    discover(model, &set.data, options, &mut |_| {}).expect("an answer")
}

fn kinds(d: &Discovery) -> Vec<&str> {
    let mut kinds: Vec<&str> = d.effects.iter().map(|e| e.kind.as_str()).collect();
    kinds.sort_unstable();
    kinds
}

/// Options with the effects that move the centre of pressure alone. The whole library takes a minute.
fn few_effects() -> Options {
    let only =
        ["pressure-offset", "friction-gradient", "tip-offset", "table-tilt"].map(str::to_owned).to_vec();
    let effects = AllowedEffects { only, ..AllowedEffects::default() };
    Options { null_runs: 0, effects, ..Options::default() }
}

#[test]
fn a_centre_of_its_own_in_each_push_is_named_with_its_spread() {
    let (set, model) = set(Some(PushKind::FrictionScatter(2e-3, [0.0; 2])), 40);
    let all = Options { null_runs: 0, ..Options::default() };
    let d = answer(&model, &set, &all);
    assert_eq!(kinds(&d), ["friction-scatter"], "{}", d.sentence);
    assert_eq!(d.verdict, Verdict::Explained, "{} {:?}", d.sentence, d.tests);
    let found = &d.effects[0];
    let [low, high] = found.parameters["sd_m"].ci95;
    assert!(low < 2e-3 && 2e-3 < high && high - low < 1.2e-3, "{}", d.sentence);
    assert!(found.per.as_deref() == Some("push") && found.share == 1.0, "{found:?}");
    // No forecast is nearer for it.
    assert_eq!(d.error.augmented, d.error.calibrated);
    // What the pushes differ by is accounted for.
    assert!(d.tests.heterogeneity > 1e-4, "{:?}", d.tests);
    // The augmented model has it, and says nothing more.
    let augmented = PushModel::parse(&d.model_toml, "augmented.toml").expect("a model");
    assert_eq!(augmented.effects[0].kind, "friction-scatter");
    let (few, _) = self::set(Some(PushKind::FrictionScatter(2e-3, [0.0; 2])), 16);
    let again = answer(&augmented, &few, &all);
    assert_eq!(again.verdict, Verdict::NothingToAdd, "{} {:?}", again.sentence, again.tests);
}

#[test]
fn a_common_centre_off_the_centroid_is_no_scatter() {
    let (set, model) = set(Some(PushKind::PressureOffset(2e-3, -1.5e-3)), 24);
    let d = answer(&model, &set, &Options { null_runs: 0, ..Options::default() });
    assert_eq!(kinds(&d), ["pressure-offset"], "{}", d.sentence);
}

#[test]
fn a_centre_off_the_centroid_that_scatters_is_both() {
    let (set, model) = set(Some(PushKind::FrictionScatter(1.5e-3, [4e-3, -3e-3])), 24);
    let d = answer(&model, &set, &few_effects());
    assert_eq!(kinds(&d), ["friction-scatter", "pressure-offset"], "{}", d.sentence);
    let of = |kind: &str, name: &str| {
        let found = d.effects.iter().find(|e| e.kind == kind);
        found.expect(kind).parameters[name].ci95
    };
    for (kind, name, truth) in [
        ("friction-scatter", "sd_m", 1.5e-3),
        ("pressure-offset", "dx_m", 4e-3),
        ("pressure-offset", "dy_m", -3e-3),
    ] {
        let [low, high] = of(kind, name);
        assert!(low < truth && truth < high, "{kind} {name}: {low} to {high}");
    }
}

#[test]
fn few_candidates_do_not_turn_a_scatter_into_an_effect() {
    let (set, model) = set(Some(PushKind::FrictionScatter(2e-3, [0.0; 2])), 40);
    let d = answer(&model, &set, &few_effects());
    assert_eq!(kinds(&d), ["friction-scatter"], "{}", d.sentence);
}
