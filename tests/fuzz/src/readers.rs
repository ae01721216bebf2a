//! All file readers of augsim, with the guarantees that are checked for accepted files.
//!
//! A data set or model file that was accepted can be written and is then read back unchanged; a checkpoint
//! makes a net.

use crate::envelope::Envelope;
use crate::reader::Reader;
use crate::seeds;
use crate::verdict::{Verdict, refusal};
use augsim_data::convert::{CONVERTERS, Converted};
use augsim_data::{
    DataError, Dataset, MissingCells, NamedCsv, Summary, Unit, read_csv, read_dataset, write_csv,
};
use augsim_nn::{checkpoint, weights};
use augsim_physics::ball::Axes;
use augsim_physics::model::ModelFile;
use augsim_robot::description::{Joint, JointKind};
use augsim_robot::{Changes, JointChange, Numbers, Robot, Tree, inverse_dynamics, write_back};
use augsim_system::{Offsets, Prepare, Record, Seed, Simulate, Simulated, Stream, Task};
use augsim_trainer::{NetModel, Settings, Training, TrainingState};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// All readers, in the order in which inputs take turns.
pub const READERS: [Reader; 21] = [
    reader("csv", Envelope::Plain, data),
    reader("csv-gzip", Envelope::Gzip, data),
    reader("ball-layout", Envelope::Plain, data),
    reader("npz", Envelope::Arrays, data),
    reader("hdf5", Envelope::Plain, data),
    reader("push-json", Envelope::Plain, data),
    reader("push-zip", Envelope::Zip, data),
    reader("ball-model", Envelope::Plain, model),
    reader("push-model", Envelope::Plain, model),
    reader("written-model", Envelope::Plain, written_model),
    reader("robot", Envelope::Plain, robot),
    reader("written-data", Envelope::Plain, written_data),
    reader("checkpoint", Envelope::Checkpoint, training_state),
    reader("safetensors", Envelope::Plain, safetensors),
    reader("config", Envelope::Plain, config),
    reader("cmu-mlab", Envelope::Plain, |path| converted(path, "cmu-mlab")),
    reader("mit-pusher-slider", Envelope::Plain, |path| converted(path, "mit-pusher-slider")),
    reader("mit-push", Envelope::Plain, |path| converted(path, "mit-push")),
    folder("desilva-ball-drops", |path| converted(path, "desilva-ball-drops")),
    folder("paper-stack-bounces", |path| converted(path, "paper-stack-bounces")),
    folder("spindoe-table-tennis", |path| converted(path, "spindoe-table-tennis")),
];

/// Makes a [`Reader`] of one file.
const fn reader(name: &'static str, envelope: Envelope, read: fn(&Path) -> Verdict) -> Reader {
    Reader { name, envelope, takes_folder: false, read }
}

/// Makes a [`Reader`] of a folder of files.
const fn folder(name: &'static str, read: fn(&Path) -> Verdict) -> Reader {
    Reader { name, envelope: Envelope::Plain, takes_folder: true, read }
}

/// Finds the reader with this name, including those of [`deliberate`](crate::corpus::deliberate).
pub fn by_name(name: &str) -> Option<Reader> {
    READERS.into_iter().chain(crate::corpus::deliberate()).find(|r| r.name == name)
}

/// Reads a data set in any supported layout and checks it.
fn data(path: &Path) -> Verdict {
    examine(path, read_dataset(path, MissingCells::AsGap))
}

/// Converts a published data set with the converter called `set` and checks it.
fn converted(path: &Path, set: &str) -> Verdict {
    let Some((_, convert)) = CONVERTERS.iter().find(|(name, _)| *name == set) else {
        return Verdict::Broken(format!("there is no converter `{set}`"));
    };
    let read = convert(path).map(|Converted { data, .. }| data);
    examine(path, read)
}

/// Checks that a data set can be summarised, and that it is unchanged after writing and reading it.
fn examine(path: &Path, read: Result<Dataset, DataError>) -> Verdict {
    let data = match read {
        Ok(data) => data,
        Err(e) => return refusal(path, &e),
    };
    drop(Summary::from_dataset(&data));
    if data.trajectories().is_empty() {
        return Verdict::Accepted;
    }
    let copy = path.with_file_name("written-again.csv");
    if let Err(e) = write_csv(&data, &copy) {
        return Verdict::Broken(format!("accepted, but cannot be written: {e}"));
    }
    let again = match read_csv(&copy, MissingCells::AsGap) {
        Ok(again) => again,
        // The strict reader refuses columns without a unit. The reader of any layout keeps them, but may call them otherwise.
        Err(_) => match read_dataset(&copy, MissingCells::AsGap) {
            Ok(_) => return Verdict::Accepted,
            Err(e) => {
                return Verdict::Broken(format!("accepted and written, but cannot be read again: {e}"));
            }
        },
    };
    match same(&data, &again) {
        true => Verdict::Accepted,
        false => Verdict::Broken("it differs after writing and reading it again".into()),
    }
}

/// Whether two data sets are equal bit for bit; all NaN count as equal.
fn same(a: &Dataset, b: &Dataset) -> bool {
    let bits =
        |v: &[f64]| v.iter().map(|x| if x.is_nan() { u64::MAX } else { x.to_bits() }).collect::<Vec<_>>();
    let pairs = || a.trajectories().iter().zip(b.trajectories());
    a.columns() == b.columns()
        && a.trajectories().len() == b.trajectories().len()
        && pairs()
            .all(|(a, b)| (a.id(), a.group(), bits(a.time_s())) == (b.id(), b.group(), bits(b.time_s())))
        && pairs().all(|(s, t)| (0..a.columns().len()).all(|i| bits(s.column(i)) == bits(t.column(i))))
}

/// Reads a model file of a ball or of pushing, and checks that it is written and read back unchanged.
fn model(path: &Path) -> Verdict {
    let model = match ModelFile::read(path) {
        Ok(model) => model,
        Err(e) => return refusal(path, &e),
    };
    let text = match &model {
        ModelFile::Ball(ball) => {
            drop([Axes::Vertical, Axes::Plane, Axes::Space].map(|axes| ball.world(axes)));
            ball.to_toml()
        }
        ModelFile::Push(push) => {
            drop(push.world());
            push.to_toml()
        }
    };
    match ModelFile::parse(&text, &path.display().to_string()) {
        Err(e) => Verdict::Broken(format!("accepted and written, but cannot be read again: {e}")),
        Ok(again) if again != model => {
            Verdict::Broken("it differs after writing and reading it again".into())
        }
        Ok(_) => Verdict::Accepted,
    }
}

/// Reads a model of equations and simulates it briefly.
///
/// Checks that it is written and read back with equal numbers.
fn written_model(path: &Path) -> Verdict {
    let model = match augsim_equations::model::read(path) {
        Ok(model) => model,
        Err(e) => return refusal(path, &e),
    };
    let system = match augsim_equations::EquationSystem::declared_only(&model) {
        Ok(system) => system,
        Err(e) => return refusal(path, &e),
    };
    let times = vec![0.0, 0.01, 0.02];
    let stream = Stream { times: times.clone(), values: vec![vec![0.5; 3]] };
    let mut record = Record {
        values: vec![vec![0.1; 3]; model.outputs.len()],
        inputs: vec![stream; model.inputs.len()].into(),
        times,
        ..Record::default()
    };
    if system.prepare(&mut record, &[]).is_ok() {
        let parameters: Vec<f64> = system.parameters().iter().map(|p| p.nominal).collect();
        let task = Task {
            parameters: &parameters,
            record: &record,
            window: 0..3,
            start: &record.windows[0].start,
            offsets: Offsets::None,
            seeds: &[Seed::Start(0)],
        };
        // The simulation may fail, but must end in time.
        drop(system.simulate(&task, &mut Simulated::default()));
    }
    let text = match model.to_toml() {
        Ok(text) => text,
        Err(e) => return Verdict::Broken(format!("accepted, but cannot be written: {e}")),
    };
    match augsim_equations::model::parse(&text, &path.display().to_string()) {
        Err(e) => Verdict::Broken(format!("accepted and written, but cannot be read again: {e}")),
        Ok(again)
            if again.nominals() != model.nominals() || again.additions.len() != model.additions.len() =>
        {
            Verdict::Broken("it differs after writing and reading it again".into())
        }
        Ok(_) => Verdict::Accepted,
    }
}

/// Reads the URDF or MJCF file of a robot, and computes the torques of all its joints once.
///
/// Checks that the file is read again after a property of a joint was changed in it.
fn robot(path: &Path) -> Verdict {
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(e) => return refusal(path, &e),
    };
    let name = path.display().to_string();
    let robot = match augsim_robot::read(&text, &name) {
        Ok(robot) => robot,
        Err(e) => return refusal(path, &e),
    };
    for warning in robot.warnings() {
        if let broken @ Verdict::Broken(_) = refusal(path, &warning) {
            return broken;
        }
    }
    let can_move = |joint: &&Joint| joint.kind != JointKind::Fixed && joint.coupling.is_none();
    let joints: Vec<String> = robot.joints.iter().filter(can_move).map(|joint| joint.name.clone()).collect();
    if joints.is_empty() {
        return Verdict::Accepted;
    }
    let tree = match Tree::new(&robot, &joints, &BTreeMap::new()) {
        Ok(tree) => tree,
        Err(e) => return refusal(path, &e),
    };
    let parameters = tree.body_parameters(&mut Numbers, &tree.link_parameters(&robot));
    let [position, speed, acceleration] = [0.3, 0.2, -0.5].map(|value| vec![value; tree.coordinates]);
    let gravity = robot.gravity_m_s2.unwrap_or([0.0, 0.0, -9.81]);
    let torques =
        inverse_dynamics(&mut Numbers, &tree, &parameters, gravity, &position, &speed, &acceleration);
    if torques.len() != joints.len() {
        return Verdict::Broken(format!("{} torques of {} joints", torques.len(), joints.len()));
    }
    rewritten(&text, &robot)
}

/// Checks that a description is read again after the damping of its first joint was changed.
fn rewritten(text: &str, robot: &Robot) -> Verdict {
    let damping = JointChange { damping: Some(0.25), ..JointChange::default() };
    let changes = Changes { joints: vec![(0, damping)], ..Changes::default() };
    let written = match write_back(text, robot, &changes) {
        Ok(written) => written,
        Err(e) => return refusal(Path::new(&robot.file), &e),
    };
    match augsim_robot::read(&written, &robot.file) {
        Err(e) => Verdict::Broken(format!("accepted and written, but cannot be read again: {e}")),
        Ok(again) if again.joints[0].damping != 0.25 || again.links.len() != robot.links.len() => {
            Verdict::Broken("it differs after writing and reading it again".into())
        }
        Ok(_) => Verdict::Accepted,
    }
}

/// Reads two named columns of a data file.
fn written_data(path: &Path) -> Verdict {
    let columns = [("pump_v", Unit::DIMENSIONLESS), ("lower_level_v", Unit::DIMENSIONLESS)];
    let read = NamedCsv::open(path).and_then(|csv| csv.read(&columns));
    match read {
        Err(e) => refusal(path, &e),
        Ok(data) => {
            drop(Summary::from_dataset(&data));
            Verdict::Accepted
        }
    }
}

/// Reads a training checkpoint and makes its network.
fn training_state(path: &Path) -> Verdict {
    match checkpoint::load::<TrainingState>(path) {
        Err(e) => refusal(path, &e),
        Ok(state) => match NetModel::new(state) {
            Err(e) => refusal(path, &e),
            Ok(_) => Verdict::Accepted,
        },
    }
}

/// Reads a safetensors file of weights into a small network.
fn safetensors(path: &Path) -> Verdict {
    match weights::import(path, &mut seeds::small_net()) {
        Err(e) => refusal(path, &e),
        Ok(()) => Verdict::Accepted,
    }
}

/// Contents of `config.resolved.toml` without the source of the data, which `train` opens itself.
#[derive(Deserialize)]
struct Config {
    settings: Settings,
}

/// Reads a resolved training configuration and sets up its training.
fn config(path: &Path) -> Verdict {
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(e) => return refusal(path, &e),
    };
    // The parser quotes the line of the file unchanged; the command line escapes control characters.
    let Ok(Config { settings }) = toml::from_str(&text) else { return Verdict::Refused };
    match Training::new(settings, seeds::short_drops()) {
        Err(e) => refusal(path, &e),
        Ok(_) => Verdict::Accepted,
    }
}
