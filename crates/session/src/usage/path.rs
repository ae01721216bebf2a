//! Paths that lead to what cannot be read or must not be written.

use super::Difference;
use std::fmt;
use std::path::PathBuf;

/// Why a path cannot be what the request makes of it.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum PathFault {
    /// No ending of data.
    NoDataEnding,
    /// Not the ending of a figure.
    NoFigureEnding,
    /// A link to nothing.
    DanglingLink,
    /// A folder where a file is to be written.
    Folder,
    /// Neither file nor folder.
    Special,
    /// Something else where a folder is to be written.
    NoFolder,
    /// The input.
    Input { input: PathBuf },
    /// A file inside a folder that is read.
    FileInInput { input: PathBuf },
    /// A folder inside a folder that is read.
    FolderInInput { input: PathBuf },
    /// Another process writes there.
    Busy,
    /// A model with another text.
    OtherModel,
    /// Results of other settings.
    OtherRun { difference: Difference },
    /// A result whose settings are not known.
    UnknownRun { file: String },
    /// A run of `train`, which can be gone on with where it has a checkpoint.
    Run { has_checkpoint: bool },
    /// A run of `train`, found by a caller without options.
    RunSaved,
    /// A net of the same reproduction.
    NetOfReproduction,
    /// The settings of the run differ from those of the request.
    OtherSettings { difference: Difference },
    /// The settings differ from those that the checkpoint was trained with.
    EditedSettings { difference: Difference },
    /// Neither a run nor a model.
    NeitherRunNorModel { config: &'static str, model: &'static str },
    /// No result of a discovery.
    NoDiscovery,
}

/// The end of a sentence about results that would be replaced.
const REPLACE: &str = "add --force to replace its results, or choose another --out";

impl fmt::Display for PathFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            PathFault::NoDataEnding => {
                "the ending says no format of data; call the file .csv, .csv.gz or .npz"
            }
            PathFault::NoFigureEnding => "figures are written as SVG; call the file .svg",
            PathFault::DanglingLink => {
                "is a link that leads to no file; remove it, or choose another --out"
            }
            PathFault::Folder => "is a folder; give the name of a file to write",
            PathFault::Special => "is a device, pipe or socket; only regular files are written",
            PathFault::NoFolder => {
                "is not a folder, so nothing can be written in it; choose another --out"
            }
            PathFault::Busy => {
                "another augsim is writing there; wait until it has ended, or choose another --out"
            }
            PathFault::OtherModel => {
                "holds another model; add --force to replace it, or choose another --out"
            }
            PathFault::Run { has_checkpoint: true } => {
                "holds a run already; add --resume to go on with it, add --force to replace it, or choose another --out"
            }
            PathFault::Run { has_checkpoint: false } => {
                "holds a run already; add --force to replace it, or choose another --out"
            }
            PathFault::RunSaved => "holds a run already; choose another folder",
            PathFault::NetOfReproduction => {
                "holds a net of this run already; add --resume to go on, or --force to train anew"
            }
            PathFault::NoDiscovery => {
                "holds no result.json of this augsim's discover; give the folder that it wrote (--out)"
            }
            PathFault::Input { input } => {
                let input = input.display();
                return write!(f, "is the input {input}, which would be replaced; choose another --out");
            }
            PathFault::FileInInput { input } => {
                let input = input.display();
                return write!(f, "lies in the input {input}; write it elsewhere, or remove it first");
            }
            PathFault::FolderInInput { input } => {
                return write!(f, "lies in the input {}; choose another --out", input.display());
            }
            PathFault::OtherRun { difference } => {
                return write!(f, "holds another run: {difference}; {REPLACE}");
            }
            PathFault::UnknownRun { file } => return write!(f, "holds {file} of another run; {REPLACE}"),
            PathFault::OtherSettings { difference } => {
                return write!(
                    f,
                    "{difference}; repeat the settings of the run, or leave out --resume and add --force to throw it away"
                );
            }
            PathFault::EditedSettings { difference: Difference { key, there, here } } => {
                return write!(
                    f,
                    "{key} is {there}, but the checkpoint was trained with {here}; restore the line, or train anew with \
                     another --out"
                );
            }
            PathFault::NeitherRunNorModel { config, model } => {
                return write!(
                    f,
                    "holds neither {config} nor {model}; give a run directory of `train`, a folder that `discover` wrote, \
                     or a model file"
                );
            }
        })
    }
}
