//! Everything in augsim that reads a file, with the promises that hold for what it accepts: a data set is written and
//! read back the same, a model file too, a checkpoint makes a net.

use crate::envelope::Envelope;
use crate::reader::Reader;
use crate::seeds;
use crate::verdict::{Verdict, refusal};
use augsim_data::convert::{CONVERTERS, Converted};
use augsim_data::{DataError, Dataset, MissingCells, Summary, read_csv, read_dataset, write_csv};
use augsim_nn::{checkpoint, weights};
use augsim_physics::ball::Axes;
use augsim_physics::model::ModelFile;
use augsim_trainer::{NetModel, Settings, Training, TrainingState};
use serde::Deserialize;
use std::path::Path;

/// All readers, in the order in which inputs go round.
pub const READERS: [Reader; 18] = [
    reader("csv", Envelope::Plain, data),
    reader("csv-gzip", Envelope::Gzip, data),
    reader("ball-layout", Envelope::Plain, data),
    reader("npz", Envelope::Arrays, data),
    reader("hdf5", Envelope::Plain, data),
    reader("push-json", Envelope::Plain, data),
    reader("push-zip", Envelope::Zip, data),
    reader("ball-model", Envelope::Plain, model),
    reader("push-model", Envelope::Plain, model),
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

const fn reader(name: &'static str, envelope: Envelope, read: fn(&Path) -> Verdict) -> Reader {
    Reader { name, envelope, takes_folder: false, read }
}

const fn folder(name: &'static str, read: fn(&Path) -> Verdict) -> Reader {
    Reader { name, envelope: Envelope::Plain, takes_folder: true, read }
}

/// The reader of that name, also one of [`deliberate`](crate::corpus::deliberate).
pub fn by_name(name: &str) -> Option<Reader> {
    READERS.into_iter().chain(crate::corpus::deliberate()).find(|r| r.name == name)
}

fn data(path: &Path) -> Verdict {
    examine(path, read_dataset(path, MissingCells::AsGap))
}

fn converted(path: &Path, set: &str) -> Verdict {
    let Some((_, convert)) = CONVERTERS.iter().find(|(name, _)| *name == set) else {
        return Verdict::Broken(format!("there is no converter `{set}`"));
    };
    let read = convert(path).map(|Converted { data, .. }| data);
    examine(path, read)
}

/// What was read can be described, and is the same after it was written and read again.
fn examine(path: &Path, read: Result<Dataset, DataError>) -> Verdict {
    let data = match read {
        Ok(data) => data,
        Err(e) => return refusal(path, &e),
    };
    drop(Summary::of(&data));
    if data.trajectories().is_empty() {
        return Verdict::Accepted;
    }
    let copy = path.with_file_name("written-again.csv");
    if let Err(e) = write_csv(&data, &copy) {
        return Verdict::Broken(format!("accepted, but cannot be written: {e}"));
    }
    match read_csv(&copy, MissingCells::AsGap) {
        Err(e) => Verdict::Broken(format!("accepted and written, but cannot be read again: {e}")),
        Ok(again) if !same(&data, &again) => Verdict::Broken("written and read again it is another".into()),
        Ok(_) => Verdict::Accepted,
    }
}

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
        Ok(again) if again != model => Verdict::Broken("written and read again it is another".into()),
        Ok(_) => Verdict::Accepted,
    }
}

fn training_state(path: &Path) -> Verdict {
    match checkpoint::load::<TrainingState>(path) {
        Err(e) => refusal(path, &e),
        Ok(state) => match NetModel::new(state) {
            Err(e) => refusal(path, &e),
            Ok(_) => Verdict::Accepted,
        },
    }
}

fn safetensors(path: &Path) -> Verdict {
    match weights::import(path, &mut seeds::small_net()) {
        Err(e) => refusal(path, &e),
        Ok(()) => Verdict::Accepted,
    }
}

/// `config.resolved.toml`, less the source of the data, whose path the command opens.
#[derive(Deserialize)]
struct Config {
    settings: Settings,
}

fn config(path: &Path) -> Verdict {
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(e) => return refusal(path, &e),
    };
    // The parser quotes the line of the file as it stands; the command line makes it printable.
    let Ok(Config { settings }) = toml::from_str(&text) else { return Verdict::Refused };
    match Training::new(settings, seeds::short_drops()) {
        Err(e) => refusal(path, &e),
        Ok(_) => Verdict::Accepted,
    }
}
