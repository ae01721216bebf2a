//! Contract: the report and the result of a discovery on a robot state effects and errors by joint, in units of torque,
//! on data that no fit used; the friction curve follows the true friction, and the points lie on it.
//!
//! Two pendulums on one base are simulated in closed form. The left one has Coulomb friction that the model lacks.

use augsim_data::random_stream;
use augsim_discovery::{AllowedEffects, Options};
use augsim_session::discovery_page::page;
use augsim_session::equations::figures::{Figures, figures};
use augsim_session::joints::{Quantity, ResultFile};
use augsim_session::{DataFrom, DiscoverRequest, Discovered, OpenData, ReportContext, Subject, discover_in};
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;
use std::sync::OnceLock;

const PENDULUM: &str = "<link name=\"NAME_link\"><inertial><origin xyz=\"0 0 -0.3\"/><mass value=\"2\"/>\
    <inertia ixx=\"0.02\" iyy=\"0.02\" izz=\"0.02\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\
    <joint name=\"NAME\" type=\"continuous\"><parent link=\"base\"/><child link=\"NAME_link\"/><axis xyz=\"0 1 0\"/></joint>";
const MODEL: &str = "scenario = \"system\"\nname = \"pair\"\n[robot]\nfile = \"pair.urdf\"\njoints = [\"left\", \"right\"]\n\
    gravity_m_s2 = [0.0, 0.0, -9.81]\nposition = [\"q1_rad\", \"q2_rad\"]\nspeed = [\"w1_rad_s\", \"w2_rad_s\"]\n\
    acceleration = [\"a1_rad_s2\", \"a2_rad_s2\"]\n[inputs]\nq1_rad = { hold = \"linear\" }\nw1_rad_s = { hold = \"linear\" }\n\
    a1_rad_s2 = { hold = \"linear\" }\nq2_rad = { hold = \"linear\" }\nw2_rad_s = { hold = \"linear\" }\n\
    a2_rad_s2 = { hold = \"linear\" }\n[parameters]\nleft_viscous = { nominal = 0.0, min = 0.0, unit = \"N m s\" }\n[outputs]\n\
    tau1_N_m = { value = \"inverse_dynamics(left) + left_viscous * w1_rad_s\", sd = \"estimate\" }\n\
    tau2_N_m = { value = \"inverse_dynamics(right)\", sd = \"estimate\" }\n";
/// Coulomb friction of the left pendulum, N m, and its viscous friction, N m s/rad.
const FRICTION: [f64; 2] = [0.4, 0.1];

fn subject() -> Subject {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let links = ["left", "right"].map(|name| PENDULUM.replace("NAME", name)).concat();
    let urdf = format!("<robot name=\"pair\"><link name=\"base\"/>{links}</robot>");
    std::fs::write(folder.join("pair.urdf"), urdf).expect("a description file");
    Subject::parse(MODEL, &folder.join("pair.toml").display().to_string()).expect("a model")
}

/// Twenty-five records of sinusoidal motions, with the torques of both pendulums and 0.01 N m of noise.
fn log() -> DataFrom {
    let mut csv =
        "trajectory,t_s,q1_rad,w1_rad_s,a1_rad_s2,q2_rad,w2_rad_s,a2_rad_s2,tau1_N_m,tau2_N_m\n".to_owned();
    for record in 0..25 {
        let mut rng = random_stream(7, "pendulums", record);
        let rate = TAU * (0.4 + 0.02 * record as f64);
        for sample in 0..120 {
            let t = 0.02 * f64::from(sample);
            let _ = write!(csv, "{record},{t}");
            let mut torques = String::new();
            for (amplitude, [coulomb, viscous], phase) in [(1.2, FRICTION, 0.1), (0.8, [0.0; 2], 0.7)] {
                let (sin, cos) = (rate * t + phase).sin_cos();
                let (q, w, a) = (amplitude * sin, amplitude * rate * cos, -amplitude * rate * rate * sin);
                let noise: f64 = StandardNormal.sample(&mut rng);
                let rigid = (0.02 + 2.0 * 0.3 * 0.3) * a + 2.0 * 9.81 * 0.3 * q.sin();
                let torque = rigid + viscous * w + coulomb * (w / 0.05).tanh() + 0.01 * noise;
                let _ = write!(csv, ",{q},{w},{a}");
                let _ = write!(torques, ",{torque}");
            }
            let _ = writeln!(csv, "{torques}");
        }
    }
    DataFrom::Table { name: "pendulums".into(), csv: csv.into_bytes().into() }
}

fn found() -> &'static (Subject, Discovered, Figures) {
    static FOUND: OnceLock<(Subject, Discovered, Figures)> = OnceLock::new();
    FOUND.get_or_init(|| {
        let only = ["coulomb", "linear-damping"].map(str::to_owned).to_vec();
        let effects = AllowedEffects { only, ..AllowedEffects::default() };
        let options = Options { null_runs: 0, effects, ..Options::default() };
        let wanted = DiscoverRequest { options, ..DiscoverRequest::default() };
        let subject = subject();
        let data = OpenData::open(&subject, &log()).expect("data");
        let discovered = discover_in(&subject, data, &wanted, &mut |_| {}).expect("an answer");
        let drawn = figures(&subject, &discovered.found, &discovered.data);
        (subject, discovered, drawn)
    })
}

#[test]
fn effects_and_errors_are_listed_by_joint_in_units_of_torque() {
    let (_, discovered, figures) = found();
    let [left, right] = &figures.joints[..] else { panic!("{:?}", figures.joints) };
    assert_eq!((left.joint.as_str(), left.quantity, left.unit.as_str()), ("left", Quantity::Torque, "N m"));
    let [effect] = &left.effects[..] else { panic!("{:?}", discovered.found.sentence) };
    assert_eq!(effect.kind, "coulomb");
    let f = &effect.parameters[0];
    assert_eq!((f.name.as_str(), f.estimate.unit.as_str()), ("f", "N m"));
    assert!((f.estimate.value - FRICTION[0]).abs() < 0.01, "{f:?}");
    // Without Coulomb friction the error is most of it; with it only the noise of 0.01 N m is left.
    let removed = effect.removed_share.expect("the error that it removes");
    assert!((0.5..1.0).contains(&removed), "{removed}");
    assert!(left.augmented.rmse < 0.012 && left.calibrated.rmse > 0.05, "{left:?}");
    let percent = left.percent(left.augmented).expect("the torque varies");
    assert!((0.1..1.0).contains(&percent), "{percent} %");
    assert!(right.effects.is_empty() && right.measure == "tau2_N_m", "{right:?}");
}

#[test]
fn friction_curves_follow_the_true_friction() {
    let (.., figures) = found();
    let curve = &figures.friction[0];
    let [coulomb, viscous] = FRICTION;
    for (v, torque) in curve.speed.iter().zip(&curve.torque) {
        let truth = viscous * v + coulomb * (v / 0.05).tanh();
        assert!((torque - truth).abs() < 0.04, "{torque} and not {truth} N m at {v} rad/s");
    }
    assert!(curve.speed.len() > 100 && (100..=300).contains(&curve.measured_speed.len()));
    for (v, torque) in curve.measured_speed.iter().zip(&curve.measured_torque) {
        let truth = viscous * v + coulomb * (v / 0.05).tanh();
        assert!((torque - truth).abs() < 0.06, "{torque} and not {truth} N m at {v} rad/s");
    }
    assert!(figures.friction[1].speed.is_empty(), "the right joint has no friction");
}

#[test]
fn page_shows_the_joints_in_a_section_with_their_figures() {
    let (subject, discovered, figures) = found();
    let context = ReportContext { figures: figures.clone(), ..ReportContext::default() };
    let text = page(&context, subject, &discovered.found).render();
    let start = text.find(">Joints</h2>").expect("a section of the joints");
    let end = start + text[start..].find("</section>").expect("its end");
    let section = &text[start..end];
    for part in [
        "Coulomb friction",
        "f = 0.",
        "% of sd",
        "Torque of left",
        "Friction of left",
        "Torque of right",
        "held out",
    ] {
        assert!(section.contains(part), "{part}");
    }
    assert!(!section.contains(" J<") && !section.contains(" J "), "no energies");
    // Figures are drawn for wide and for narrow screens, and the table scrolls in a box of its own.
    assert!(
        section.matches("class=\"wide\"").count() == 4 && section.matches("class=\"narrow\"").count() == 4
    );
    assert!(section.contains("class=\"scroll"));
    assert!(text.find(">What was found</h2>").is_some_and(|place| place < start));
}

#[test]
fn result_file_lists_the_joints_and_can_be_read_back() {
    let (subject, discovered, _) = found();
    let file = ResultFile::new(subject, &discovered.found, Some(&discovered.data));
    let text = serde_json::to_string_pretty(&file).expect("JSON");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(json["joints"][0]["effects"][0]["parameters"][0]["unit"], "N m");
    assert!(json["joints"][1]["measured_sd"].as_f64().is_some_and(|sd| sd > 1.0));
    let read: augsim_discovery::Discovery = serde_json::from_str(&text).expect("still a result");
    assert_eq!(read.effects, discovered.found.effects);
}
