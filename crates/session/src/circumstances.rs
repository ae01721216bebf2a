//! The circumstances of a discovery, as its page shows them.

use crate::command_line::quoted;
use crate::provenance::{fingerprint, shown};
use crate::written::pictures::Pictures;
use crate::{DataFrom, Wanted};
use augsim_report::page::DataSource;
use std::path::Path;

/// The circumstances of a discovery.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Circumstances {
    /// Name of the data.
    pub name: String,
    /// Seed.
    pub seed: u64,
    /// The model file and the data.
    pub sources: Vec<DataSource>,
    /// The command line that repeats it; empty where no file on disk would.
    pub reproduce: String,
    /// Runs of the models and laws, for systems of equations.
    pub pictures: Pictures,
}

impl Circumstances {
    /// Collects the circumstances of a discovery whose page lies in the folder `out`. A `model` that is no file has no path.
    pub fn new(model: Option<&Path>, data: &DataFrom, wanted: &Wanted, out: &Path) -> Self {
        let of_file = |path: &Path| DataSource { path: shown(path, out), hash: fingerprint(path) };
        let mut sources: Vec<DataSource> = model.map(of_file).into_iter().collect();
        let (name, reproduce) = match data {
            DataFrom::File(path) => {
                sources.push(of_file(path));
                (name_of(path), model.map_or_else(String::new, |model| command(model, path, wanted, out)))
            }
            DataFrom::Table { name, .. } => {
                sources.push(DataSource { path: name.clone(), hash: data.fingerprint() });
                (name.clone(), String::new())
            }
        };
        Circumstances { name, seed: wanted.options.seed, sources, reproduce, pictures: Pictures::default() }
    }
}

/// The name of data on a page: that of their file, or of its folder where the file has a name like any other (`data.csv`).
fn name_of(path: &Path) -> String {
    let text = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let file = text(path.file_name());
    let stem = file.trim_end_matches(".gz").trim_end_matches(".csv").trim_end_matches(".npz");
    let folder = text(path.parent().and_then(Path::file_name));
    if stem == "data" && !folder.is_empty() { folder } else { stem.to_owned() }
}

/// The command that repeats the discovery; the folder of the results does not decide them.
fn command(model: &Path, data: &Path, wanted: &Wanted, out: &Path) -> String {
    let Wanted { groups, accept, options } = wanted;
    let mut words = vec!["augsim".to_owned(), "discover".to_owned()];
    words.extend([model, data].map(|path| shown(path, out)));
    words.extend(["--null-runs".to_owned(), options.null_runs.to_string()]);
    if !options.library {
        words.extend(["--library", "none"].map(str::to_owned));
    }
    words.extend(groups.iter().flat_map(|group| ["--group".to_owned(), group.clone()]));
    words.extend(accept.iter().flat_map(|check| ["--accept".to_owned(), check.to_string()]));
    words.extend(["--seed".to_owned(), options.seed.to_string(), "--out".to_owned(), "DIR".to_owned()]);
    quoted(&words)
}
