//! Paths that cannot be read or must not be written.

use super::Difference;
use std::fmt;
use std::path::PathBuf;

/// Why a path cannot be used as requested.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum PathFault {
    /// The file extension is not that of a data format.
    NoDataEnding,
    /// The file extension is not that of a figure.
    NoFigureEnding,
    /// The path is a dangling symbolic link.
    DanglingLink,
    /// The path is a folder, but a file is to be written there.
    Folder,
    /// The path is neither a file nor a folder.
    Special,
    /// The path is not a folder, but a folder is to be written there.
    NotAFolder,
    /// The output path is the input itself.
    Input { input: PathBuf },
    /// The output path is a file inside an input folder.
    FileInInput { input: PathBuf },
    /// The output path is a folder inside an input folder.
    FolderInInput { input: PathBuf },
    /// Another process is writing to the path.
    Busy,
    /// The file to be written holds a different model.
    OtherModel,
    /// The folder holds results with other settings.
    OtherRun { difference: Difference },
    /// The folder holds a result with unknown settings.
    UnknownRun { file: String },
    /// The folder holds a run of `train`, which can be resumed if it has a checkpoint.
    Run { has_checkpoint: bool },
    /// The folder holds a run of `train`; the message is for callers without command-line options.
    RunSaved,
    /// The folder holds a trained net of the same reproduction.
    NetOfReproduction,
    /// The settings of the run differ from those of the request.
    OtherSettings { difference: Difference },
    /// The settings on disk differ from those that the checkpoint was trained with.
    EditedSettings { difference: Difference },
    /// The path is neither a run directory nor a model file.
    NeitherRunNorModel { config: &'static str, model: &'static str },
    /// The path is a folder without the result of a discovery.
    NoDiscovery,
}

/// Advice in messages about existing results that would be replaced.
const REPLACE: &str = "add --force to replace its results, or choose another --out";

impl fmt::Display for PathFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            PathFault::NoDataEnding => {
                "the file extension is of no data format; use .csv, .csv.gz or .npz"
            }
            PathFault::NoFigureEnding => "figures are written as SVG; use the file extension .svg",
            PathFault::DanglingLink => {
                "is a link to a file that does not exist; remove it, or choose another --out"
            }
            PathFault::Folder => "is a folder; give the name of a file to write",
            PathFault::Special => "is a device, pipe or socket; only regular files are written",
            PathFault::NotAFolder => {
                "is not a folder, so nothing can be written in it; choose another --out"
            }
            PathFault::Busy => {
                "another augsim process is writing there; wait until it has ended, or choose another --out"
            }
            PathFault::OtherModel => {
                "contains another model; add --force to replace it, or choose another --out"
            }
            PathFault::Run { has_checkpoint: true } => {
                "already contains a run; add --resume to continue it, add --force to replace it, or choose another --out"
            }
            PathFault::Run { has_checkpoint: false } => {
                "already contains a run; add --force to replace it, or choose another --out"
            }
            PathFault::RunSaved => "already contains a run; choose another folder",
            PathFault::NetOfReproduction => {
                "already contains a net of this run; add --resume to continue, or --force to train again from the start"
            }
            PathFault::NoDiscovery => {
                "contains no result.json of this version of `augsim discover`; give the folder that it wrote (--out)"
            }
            PathFault::Input { input } => {
                let input = input.display();
                return write!(f, "is the input {input}, which would be replaced; choose another --out");
            }
            PathFault::FileInInput { input } => {
                let input = input.display();
                return write!(f, "is inside the input {input}; write it elsewhere, or remove it first");
            }
            PathFault::FolderInInput { input } => {
                return write!(f, "is inside the input {}; choose another --out", input.display());
            }
            PathFault::OtherRun { difference } => {
                return write!(f, "contains another run: {difference}; {REPLACE}");
            }
            PathFault::UnknownRun { file } => return write!(f, "contains {file} of another run; {REPLACE}"),
            PathFault::OtherSettings { difference } => {
                return write!(
                    f,
                    "{difference}; repeat the settings of the run, or leave out --resume and add --force to replace it"
                );
            }
            PathFault::EditedSettings { difference: Difference { key, there, here } } => {
                return write!(
                    f,
                    "{key} is {there}, but the checkpoint was trained with {here}; restore the line, or train again with \
                     another --out"
                );
            }
            PathFault::NeitherRunNorModel { config, model } => {
                return write!(
                    f,
                    "contains neither {config} nor {model}; give a run directory of `train`, a folder that `discover` wrote, \
                     or a model file"
                );
            }
        })
    }
}
