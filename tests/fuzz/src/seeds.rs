//! Seed files: valid files from which the fuzzer makes mutated inputs.
//!
//! They are the committed fixtures, small files in every layout, and the beginnings of measured files if
//! `../shared/data` (or `AUGSIM_DATA`) exists.

use crate::envelope::{gzipped, inflated, zipped};
use crate::reader::Files;
use anyhow::Context;
use augsim_data::{Dataset, MissingCells, read_csv, write_npz};
use augsim_nn::{Init, Params, checkpoint, weights};
use augsim_physics::ball::drop_distribution::{DropDistribution, published_predictor};
use augsim_trainer::{Engine, NetSettings, Recipe, Sequences, Settings, Training};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Name of a published push file, which encodes its conditions.
const TRIAL: &str = "motion_surface=abs_shape=tri1_a=0_v=20_i=1.000_s=0.400_t=0.000";

/// Number of bytes that are used of a measured text file; its beginning has every kind of line.
const BEGINNING: usize = 3000;

/// CSV text of two drops with groups, an empty cell and a quoted cell.
const DROPS: &str = "trajectory,t_s,height_m,velocity_m_s,group\n\
    a,0,4.5,0,red\na,0.0166,4.49,-0.16,red\na,0.0333,4.48,,red\nb,0,4.2,0,\"blue, big\"\nb,0.5,2.97,-4.9,\"blue, big\"\n";

/// CSV text of one push with forces and flags of new samples.
const PUSHES: &str = "trajectory,t_s,pusher_x_m,pusher_y_m,x_m,y_m,theta_rad,force_x_N,force_y_N,pusher_new,object_new,force_new\n\
    p,0,0,0,0.05,0,0,0,0,1,1,1\np,0.1,0.01,0,0.06,0,0.02,-1,0,1,0,1\np,0.2,0.02,0,0.07,0.001,0.04,-1,0,1,1,0\n";

/// Model file of a ball with values per group and two effects.
const BALL_MODEL: &str = r#"scenario = "ball"
[parameters]
gravity_m_s2 = { nominal = 9.81, frozen = true }
restitution = { nominal = 0.5, min = 0.0, max = 1.0, per = "group", groups = { red = 0.4, "blue, big" = 0.6 } }
radius_m = 0.02
inertia_ratio = 0.4
[sensor]
position_sd_m = 0.002
[release]
kind = "free"
[[effect]]
kind = "quadratic-drag"
k_per_m = { nominal = 0.0132, ci95 = [0.0127, 0.0138] }
[[effect]]
kind = "height-offset"
b_m = { nominal = 0.0, per = "trajectory" }
"#;

/// Model file of pushing with values per group and one effect.
const PUSH_MODEL: &str = r#"scenario = "push"
object = "rect1"
[parameters]
c_m = { nominal = 0.0344, min = 0.005, max = 0.1, per = "group", groups = { "10-21" = 0.031, "10-23" = 0.042 } }
contact_friction = { nominal = 0.3, min = 0.0, max = 1.0 }
rod_radius_m = { nominal = 0.00475, frozen = true }
support_friction = { nominal = 0.35, frozen = true }
mass_kg = { nominal = 1.053, frozen = true }
[sensor]
position_sd_m = 0.0003
angle_sd_rad = 0.002
[[effect]]
kind = "pose-latency"
delay_s = { nominal = 0.0108, ci95 = [0.0070, 0.0146] }
"#;

/// Text of a push log in the layout of `cmu-mlab`.
const PUSH_LOG: &str = "1\n636.1 34.3 9.8 0.365 0.009 0 0.930\n643.0 43.6 10.0 0.323 0.008 0 0.946\n\
    3\n10.0 0.1 0.2\n10.2 0.3 0.2\n10.4 0.2 0.1\n3\n10.0 600 30 9 1 0 0 0\n10.2 610 31 9 1 0 0 0\n10.4 620 32 9 1 0 0 0\n";

/// CSV text of a run in the layout of `mit-pusher-slider`.
const SLIDER: &str = "t_s,pusher_x_m,pusher_y_m,slider_x_m,slider_y_m,slider_th_rad,pusher_new,slider_new\n\
    0,0,0,0.05,0,0,1,1\n0.004,0.001,0,0.05,0,0.01,1,0\n0.008,0.002,0,0.051,0.001,0.02,1,1\n0.012,0.003,0,0.052,0.001,0.03,0,1\n";

/// Valid files from which mutated inputs of the file reader `reader` are made.
///
/// # Errors
/// A fixture cannot be read.
pub fn of(reader: &str) -> anyhow::Result<Vec<Files>> {
    let fixture = |name: &str| {
        let path = workspace().join("fixtures").join(name);
        fs::read(&path).with_context(|| path.display().to_string())
    };
    let trial = |suffix: &str| fixture(&format!("mit-push/{TRIAL}{suffix}.h5"));
    let mut seeds = match reader {
        "csv" => {
            let bounces = beginning(&fixture("sealed/bounces.csv")?, BEGINNING);
            [DROPS, PUSHES]
                .map(|text| Files::one("data.csv", text))
                .into_iter()
                .chain([Files::one("data.csv", bounces)])
                .collect()
        }
        "csv-gzip" => vec![
            Files::one("data.csv.gz", gzipped(DROPS.as_bytes())?),
            Files::one("data.csv.gz", fixture("push-golden/00_stick_centre.csv.gz")?),
        ],
        "ball-layout" => {
            let test = inflated(&fixture("pybullet-ball/test_first5.csv.gz")?).context("a gzip stream")?;
            vec![Files::one("data.csv", beginning(&test, BEGINNING))]
        }
        "npz" => [DROPS, PUSHES]
            .into_iter()
            .map(|text| Ok(Files::one("data.npz", npz(text)?)))
            .collect::<anyhow::Result<_>>()?,
        "hdf5" | "mit-push" => vec![
            Files::one(&format!("{TRIAL}.h5"), trial("")?),
            Files::one(&format!("{TRIAL}_rep=0001.h5"), trial("_rep=0001")?),
        ],
        "push-json" => vec![Files::one(&format!("{TRIAL}.json"), push_json())],
        "push-zip" => {
            let members = [
                (format!("abs/{TRIAL}.json"), push_json().into_bytes()),
                (format!("abs/{TRIAL}_rep=0001.h5"), trial("")?),
            ];
            vec![Files::one("pushes.zip", zipped(&members)?)]
        }
        "ball-model" => vec![
            Files::one("model.toml", BALL_MODEL),
            Files::one("model.toml", fixture("sealed/model.toml")?),
        ],
        "push-model" => vec![
            Files::one("model.toml", PUSH_MODEL),
            Files::one("model.toml", fixture("steel-square.model.toml")?),
        ],
        "written-model" => {
            let examples = augsim_equations::EXAMPLES.iter();
            let mut files: Vec<Files> = examples.map(|(_, text)| Files::one("model.toml", *text)).collect();
            files.push(Files::one("model.toml", format!("{}{EFFECTS}", augsim_equations::EXAMPLES[0].1)));
            let [arm, slide] = ["robots/two-link-planar.urdf", "robots/slide-arm.xml"].map(fixture);
            files.extend(robot_models(&arm?, &slide?));
            files
        }
        "robot" => ROBOTS
            .iter()
            .map(|name| Ok(Files::one(name, fixture(&format!("robots/{name}"))?)))
            .collect::<anyhow::Result<_>>()?,
        "written-data" => vec![Files::one("data.csv", TANKS)],
        "checkpoint" => {
            let state = Training::new(small_settings(), short_drops())?.state().clone();
            vec![Files::one("checkpoint.bin", checkpoint::encode(&state)?)]
        }
        "safetensors" => vec![Files::one("weights.safetensors", weights::encode(&small_net())?)],
        "config" => vec![Files::one("config.resolved.toml", config()?)],
        "cmu-mlab" => vec![Files::one("wood_10_90__exp.txt", PUSH_LOG)],
        "mit-pusher-slider" => vec![Files::one("1021_run.csv", SLIDER)],
        "desilva-ball-drops" => {
            let text = "ball,drop,t_s,height_m,velocity_m_s\nbaseball,1,0,4.7,0.6\nbaseball,1,0.07,3.6,0.2\nbaseball,1,0.13,2.7,0.2\ngolf,2,0,1.7,0\ngolf,2,0.1,0.6,0\n";
            vec![Files::one("drops.csv", text)]
        }
        "paper-stack-bounces" => vec![paper_stack()],
        "spindoe-table-tennis" => vec![table_tennis()],
        _ => Vec::new(),
    };
    seeds.extend(measured(reader)?);
    Ok(seeds)
}

/// Beginnings of measured files for a reader; they are not committed because they are not ours.
fn measured(reader: &str) -> anyhow::Result<Vec<Files>> {
    let root =
        std::env::var_os("AUGSIM_DATA").map_or_else(|| workspace().join("../shared/data"), PathBuf::from);
    let text = |name: &str| {
        let path = root.join(name);
        let content = fs::read(&path).with_context(|| path.display().to_string())?;
        anyhow::Ok(beginning(&content, BEGINNING))
    };
    let hexagon = "motion_surface=plywood_shape=hex_a=0_v=150_i=1.000_s=0.000_t=-0.349.json";
    let sources: &[(&str, &str)] = match reader {
        "desilva-ball-drops" => &[("desilva-ball-drops", "drops.csv")],
        "mit-pusher-slider" => &[("mit-pusher-slider-runs/runs", "1021_NoPerturbations.csv")],
        "csv" => &[("cascaded-tanks", "estimation.csv")],
        "push-json" => &[("mit-pnpush-pushes/official", hexagon)],
        _ => &[],
    };
    let existing = sources.iter().filter(|(folder, name)| root.join(folder).join(name).exists());
    existing.map(|(folder, name)| Ok(Files::one(name, text(&format!("{folder}/{name}"))?))).collect()
}

/// The whole lines within the first `bytes` bytes, or all these bytes if they contain no line end.
fn beginning(text: &[u8], bytes: usize) -> Vec<u8> {
    let part = &text[..text.len().min(bytes)];
    let end = part.iter().rposition(|b| *b == b'\n').map_or(part.len(), |k| k + 1);
    part[..end].to_vec()
}

/// Path of the root folder of the workspace.
fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Text of a push file in the published JSON layout.
fn push_json() -> String {
    let rows = |scale: f64| {
        let rows: Vec<_> = (0..12)
            .map(|k| format!("[{}, {}, {}, 0.01]", 1.46e9 + f64::from(k) / 10.0, scale * f64::from(k), scale))
            .collect();
        rows.join(", ")
    };
    format!(
        "{{\"tip_pose\": [{}], \"object_pose\": [{}], \"ft_wrench\": [{}]}}",
        rows(0.002),
        rows(0.001),
        rows(0.5)
    )
}

/// Small data set of files in the layout of `paper-stack-bounces`.
fn paper_stack() -> Files {
    let index = "series,file,ball,drop,sheets,repeat,pressure_mbar,frames,frame_gaps,usable_impacts,accel_px_per_frame2,px_per_m_if_200fps,arc_rms_px,t_imp1_frame,v_in1_px_per_frame,e1,v_in2_px_per_frame,e2,v_in3_px_per_frame,e3,note\n\
        a4,1.csv,blue,high,10,1,,60,0,2,0.3,1270,0.07,97.3,19.3,0.36,6.9,0.47,,,\n";
    let mut drops = "series,file,frame,x_px,y_px\n".to_owned();
    for frame in 60..130 {
        drops.push_str(&format!("a4,1.csv,{frame},152,{}\n", 900.0 - (f64::from(frame) - 97.3).abs() * 10.0));
    }
    Files(vec![("drops.csv".into(), drops.into_bytes()), ("index.csv".into(), index.into())])
}

/// Small data set of files in the layout of `spindoe-table-tennis`.
fn table_tennis() -> Files {
    let flight: String = (0..30)
        .map(|k| {
            format!("{};{};0;{}\n", f64::from(k) * 0.01, f64::from(k) * 0.02, 0.3 - f64::from(k) * 0.002)
        })
        .collect();
    let index = "traj_file,x_spin,y_spin,z_spin\n0,10,200,-5\n1,0,0,900\n";
    Files(vec![("000.csv".into(), flight.into_bytes()), ("index.csv".into(), index.into())])
}

/// Converts a data set from CSV text to NPZ.
fn npz(text: &str) -> anyhow::Result<Vec<u8>> {
    let folder = tempfile::tempdir()?;
    let csv = folder.path().join("data.csv");
    fs::write(&csv, text)?;
    let data: Dataset = read_csv(&csv, MissingCells::AsGap)?;
    file_bytes(|path| Ok(write_npz(&data, path)?))
}

/// Calls `write` with a temporary file and returns the bytes of the file.
fn file_bytes(write: impl FnOnce(&Path) -> anyhow::Result<()>) -> anyhow::Result<Vec<u8>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("file");
    write(&path)?;
    Ok(fs::read(path)?)
}

/// Training settings of the smallest hybrid network.
fn small_settings() -> Settings {
    let settings = Settings::new(Recipe::Hybrid, 100, 1, Engine::PybulletBall(published_predictor()));
    Settings { net: NetSettings { hidden: 2, layers: 1, latent: 1, ..settings.net }, ..settings }
}

/// Text of a `config.resolved.toml` with the smallest hybrid network.
fn config() -> anyhow::Result<String> {
    #[derive(serde::Serialize)]
    struct Config {
        checkpoint_every: u64,
        data: toml::Value,
        settings: Settings,
    }
    let data = toml::Value::Table(
        [("file".to_owned(), toml::Value::String("ball.csv".into()))].into_iter().collect(),
    );
    Ok(toml::to_string_pretty(&Config { checkpoint_every: 100, data, settings: small_settings() })?)
}

/// A small set of network parameters, into which weights are read.
pub fn small_net() -> Params<f32> {
    let mut params = Params::new(augsim_data::random_stream(1, "fuzz-weights", 0));
    params.add("gru.weight_ih_l0".into(), &[6, 3], Init::Constant(0.0));
    params.add("gru.bias_ih_l0".into(), &[6], Init::Constant(0.0));
    params
}

/// Two simulated drops of ten samples each at the sampling rate of the paper.
///
/// # Panics
/// Never, because drops from the paper's distribution can be simulated.
pub fn short_drops() -> &'static Sequences {
    static DROPS: OnceLock<Sequences> = OnceLock::new();
    DROPS.get_or_init(|| {
        let law = DropDistribution { samples: 10, ..DropDistribution::default() };
        let drops = law.generate(2, 1).map(|(data, _)| Sequences::new(&data, &["height_m", "velocity_m_s"]));
        drops.expect("drops of the paper's law").expect("its two columns")
    })
}

/// Text of effect and candidate blocks that are appended to the model file of the pendulum example.
const EFFECTS: &str = r#"
[[effect]]
kind = "coulomb"
on = "omega_rad_s"
f = { nominal = 0.3, ci95 = [0.2, 0.4] }
w = 0.1
[[effect]]
kind = "formula"
on = "omega_rad_s"
add = "a * tanh(theta_rad / w)"
a_per_s2 = { nominal = 0.3, unit = "1/s^2" }
w_rad = { nominal = 0.1, min = 0.01, max = 1.0 }
also_fits = ["a * theta_rad"]
[[effect]]
kind = "table"
on = "angle_rad"
against = "abs(omega_rad_s)"
first = -1.0
last = 1.0
values = [0.0, 0.1, 0.0]
[[candidate]]
kind = "magnet"
on = "force"
add = "-a * x * exp(-(x / w)^2) - k * z"
a = { min = 0.0, typical = 2.0 }
k = {}
w = { of = "x", grid = [0.1, 0.3] }
states = { z = { rate = "v - z", start = 0.0 } }
"#;

/// Descriptions of robots in the fixtures, in both formats.
const ROBOTS: [&str; 9] = [
    "two-link-planar.urdf",
    "six-axis-arm.urdf",
    "seven-axis-arm.urdf",
    "gantry.urdf",
    "torso.urdf",
    "gripper.urdf",
    "pendulum.xml",
    "slide-arm.xml",
    "two-hinges.xml",
];

/// Model files of two robots, each with its description: an elbow in URDF, whose torque is the output, and a slide with an
/// locked elbow in MJCF, whose force is the input.
fn robot_models(urdf: &[u8], mjcf: &[u8]) -> Vec<Files> {
    let of = |model: &str, name: &str, description: &[u8]| {
        Files(vec![("model.toml".into(), model.into()), (name.into(), description.to_vec())])
    };
    vec![of(INVERSE_ARM, "arm.urdf", urdf), of(FORWARD_SLIDE, "slide.xml", mjcf)]
}

/// Model file of an elbow whose measured motion is the input, with free inertial parameters and effects.
const INVERSE_ARM: &str = r#"scenario = "system"
[robot]
file = "arm.urdf"
joints = ["elbow"]
locked = { shoulder = 0.3 }
gravity_m_s2 = [0.0, 0.0, -9.81]
base = "fixed"
position = ["q_rad"]
speed = ["w_rad_s"]
acceleration = ["a_rad_s2"]
[inputs]
q_rad = {}
w_rad_s = {}
a_rad_s2 = {}
[parameters]
forearm_mass_kg = { nominal = 1.35, min = 0.0 }
forearm_moment_x_kg_m = { nominal = 0.2 }
payload_origin_inertia_yy_kg_m2 = { nominal = 0.001, unit = "kg m^2" }
elbow_armature_kg_m2 = { nominal = 0.01, min = 0.0 }
elbow_viscous = { nominal = 0.12, min = 0.0, unit = "N m s" }
[outputs]
tau_N_m = { value = "inverse_dynamics(elbow) + elbow_viscous * w_rad_s", sd = "estimate" }
[[effect]]
kind = "coulomb"
on = "elbow"
f = { nominal = 0.3, ci95 = [0.2, 0.4] }
w = 0.05
[[effect]]
kind = "payload"
on = "forearm"
m = 0.2
p_x = 0.02
p_y = 0.0
p_z = 0.0
"#;

/// Model file of a slide with a locked elbow, whose force is the input and whose motion is the output.
const FORWARD_SLIDE: &str = r#"scenario = "system"
[robot]
file = "slide.xml"
joints = ["rail"]
locked = { elbow = 0.4 }
position = ["x_m"]
speed = ["v_m_s"]
torque = ["force_N - friction_N * tanh(v_m_s / 0.01)"]
[inputs]
force_N = { hold = "zero" }
[states]
x_m = { start = "position_m" }
v_m_s = { start = "slope(position_m)" }
[parameters]
friction_N = { nominal = 4.0, min = 0.0 }
[rates]
x_m = "v_m_s"
v_m_s = "forward_dynamics(rail)"
[outputs]
position_m = { value = "x_m", sd = "estimate" }
"#;

/// CSV text of two tanks, with empty cells and an unused column.
const TANKS: &str = "t_s,pump_v,lower_level_v,other\n0,3.25,5.2,x\n4,3.24,,y\n8,,5.1,\n12,3.2,5.0,1\n";
