//! Contract: published values are read from the authors' file; the table and the page show every set, the reason for
//! one that cannot be declared, and published values beside found ones.

use super::published::{Compared, Property, lines, tx40};
use super::sets::SETS;
use super::*;
use augsim_discovery::{Estimate, Rmse, Verdict};
use augsim_session::joints::{JointEffect, JointParameter, Quantity};

const YAML: &str = "robot: made up\nidentification:\n  robot_params:\n    - q_lim_def: 1.57\n      fv : [2.0, 1.5]\n      \
    fs : [0.5, 0.25]\n      Iam6 : 0.01\n      name : [a, b]\n";

/// A joint whose torque has a standard deviation of 2 N m, and whose errors are 1, 0.5 and 0.1 N m.
fn joint(name: &str, effects: Vec<JointEffect>) -> JointResult {
    let error = |rmse: f64| Rmse { rmse, ci95: [0.9 * rmse, 1.1 * rmse] };
    JointResult {
        joint: name.to_owned(),
        measure: format!("tau_{name}_N_m"),
        quantity: Quantity::Torque,
        unit: "N m".to_owned(),
        measured_sd: Some(2.0),
        declared: error(1.0),
        calibrated: error(0.5),
        augmented: error(0.1),
        effects,
    }
}

fn coulomb(value: f64) -> JointEffect {
    let estimate =
        Estimate { value, ci95: [value - 0.1, value + 0.1], unit: "N m".into(), ..Estimate::default() };
    JointEffect {
        name: "coulomb on all joints".to_owned(),
        kind: "coulomb".to_owned(),
        with: None,
        parameters: vec![JointParameter { name: "f".to_owned(), estimate }],
        removed: Some(0.4),
        removed_share: Some(0.8),
    }
}

fn result() -> ResultFile {
    let compared = vec![
        Compared {
            joint: "joint_1".into(),
            property: Property::Coulomb,
            unit: "N m",
            published: 0.5,
            found: Some((0.52, [0.42, 0.62])),
        },
        Compared {
            joint: "joint_2".into(),
            property: Property::Coulomb,
            unit: "N m",
            published: 0.25,
            found: None,
        },
    ];
    let found = Found {
        verdict: Verdict::Explained,
        sentence: "The model lacks coulomb.".to_owned(),
        kinds: vec!["coulomb on all joints".to_owned()],
        joints: vec![joint("joint_1", vec![coulomb(0.52)]), joint("joint_2", Vec::new())],
        compared,
        report: PathBuf::from("made-up/report.html"),
    };
    let row = |set, left_out, found| SetRow { set, source: "a source", left_out, found, seconds: 12.3 };
    let sets = vec![
        row("made-up", None, Some(found)),
        row("without-inertias", Some("link `arm` has no inertia".to_owned()), None),
    ];
    ResultFile::new("robots", sets, 1)
}

#[test]
fn published_values_are_read_from_the_file_of_the_authors() {
    let values = tx40(YAML);
    let of = |property: Property| -> Vec<(&str, f64)> {
        values.iter().filter(|p| p.property == property).map(|p| (p.joint.as_str(), p.value)).collect()
    };
    assert_eq!(of(Property::Coulomb), [("joint_1", 0.5), ("joint_2", 0.25)]);
    assert_eq!(of(Property::Viscous), [("joint_1", 2.0), ("joint_2", 1.5)]);
    assert_eq!(of(Property::CoupledRotor), [("joint_5", 0.01)]);
    assert!(of(Property::Rotor).is_empty(), "not in this file");
}

#[test]
fn table_has_errors_effects_published_values_and_reasons() {
    let text = text(&result());
    let row = text.lines().find(|line| line.starts_with("made-up")).expect("a row");
    let cells: Vec<&str> = row.split_whitespace().collect();
    assert_eq!(cells, ["made-up", "2", "50.0", "25.0", "5.0", "12"]);
    for part in [
        "effects: coulomb on all joints",
        "Coulomb friction, published (found), N m: joint_1 0.5 (0.520), joint_2 0.25 (-)",
        "source: a source",
        "without-inertias  left out: link `arm` has no inertia",
    ] {
        assert!(text.contains(part), "{part}:\n{text}");
    }
    assert!(lines(&[]).is_empty());
}

#[test]
fn page_shows_all_sets_and_compares_published_values() {
    let html = page::page(&result(), Path::new("sets"), "augsim reproduce robots").render();
    for part in ["left out: link", "has no inertia", "Published values beside those found", "25.0", "% of sd"]
    {
        assert!(html.contains(part), "{part}");
    }
    let json = serde_json::to_value(result()).expect("JSON");
    assert!(json["sets"][0].get("seconds").is_none(), "run times differ from run to run");
    assert_eq!(json["sets"][0]["found"]["joints"][0]["effects"][0]["kind"], "coulomb");
}

#[test]
fn simulated_arm_can_be_declared_and_measured_sets_have_a_folder() {
    let arm = SETS.iter().find(|set| set.folder.is_none()).expect("a simulated arm");
    let declared = (arm.declare)(Path::new("")).expect("an arm");
    let robot = augsim_robot::read(&declared.description, declared.file).expect("a robot");
    let made = model_from_robot(&robot, &declared.log, &declared.request).expect("a model");
    assert_eq!(made.joints, ["shoulder", "elbow"]);
    assert!(made.text.contains("inverse_dynamics(elbow)"));
    let axis = SETS.iter().find(|set| set.name == "robot-arm-axis1").expect("an axis");
    assert!((axis.declare)(Path::new("")).is_err_and(|reason| reason.contains("no positions")));
}
