//! Name, seed, sources and command line of a discovery, as its page shows them.

use crate::command_line::quoted;
use crate::equations::figures::Figures;
use crate::provenance::display_path;
use crate::{DataFrom, DiscoverRequest};
use augsim_report::page::DataSource;
use std::path::{Path, PathBuf};

/// Name, seed, sources, command line and figures of a discovery, as its report shows them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReportContext {
    /// Name of the data in the report.
    pub name: String,
    /// Seed of every random draw of the discovery.
    pub seed: u64,
    /// Paths and checksums of the model file and the data.
    pub sources: Vec<DataSource>,
    /// The command line that repeats the discovery; empty if model or data are not files.
    pub reproduce: String,
    /// Free runs of the models and curves of the added effects; empty for built-in scenarios.
    pub figures: Figures,
}

impl ReportContext {
    /// Collects the context of a discovery whose report is written to the folder `out`.
    ///
    /// `model` is `None` if it is not a file. `fingerprint` returns the checksum of an input file or folder.
    pub fn new(
        model: Option<&Path>,
        data: &DataFrom,
        wanted: &DiscoverRequest,
        out: &Path,
        fingerprint: &dyn Fn(&Path) -> String,
    ) -> Self {
        let source_of = |path: &Path| DataSource { path: display_path(path, out), hash: fingerprint(path) };
        let mut sources: Vec<DataSource> = model.map(source_of).into_iter().collect();
        let (name, reproduce) = match data.ungrouped() {
            DataFrom::File(path) | DataFrom::FileWithTime { path, .. } => {
                sources.push(source_of(path));
                (
                    name_of(path),
                    model.map_or_else(String::new, |model| {
                        command(model, data, std::slice::from_ref(path), wanted, out)
                    }),
                )
            }
            DataFrom::Files { paths, .. } => {
                sources.extend(paths.iter().map(|path| source_of(path)));
                let name = paths.first().map_or_else(String::new, |path| name_of(path));
                let repeat = |model| command(model, data, paths, wanted, out);
                (format!("{name} and {} more", paths.len() - 1), model.map_or_else(String::new, repeat))
            }
            DataFrom::Grouped { .. } | DataFrom::Table { .. } => {
                let name = &data.to_string();
                sources.push(DataSource { path: name.clone(), hash: data.fingerprint() });
                (name.clone(), String::new())
            }
        };
        ReportContext { name, seed: wanted.options.seed, sources, reproduce, figures: Figures::default() }
    }
}

/// Name of the data in a report: the stem of the file, or the folder's name if the stem is just `data`.
fn name_of(path: &Path) -> String {
    let text = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let file = text(path.file_name());
    let stem = file.trim_end_matches(".gz").trim_end_matches(".csv").trim_end_matches(".npz");
    let folder = text(path.parent().and_then(Path::file_name));
    if stem == "data" && !folder.is_empty() { folder } else { stem.to_owned() }
}

/// Command line that repeats the discovery. `--out DIR` is a placeholder: it does not change the results.
fn command(model: &Path, from: &DataFrom, data: &[PathBuf], wanted: &DiscoverRequest, out: &Path) -> String {
    let DiscoverRequest { groups, accept, options } = wanted;
    let mut words = vec!["augsim".to_owned(), "discover".to_owned()];
    let paths = [model].into_iter().chain(data.iter().map(PathBuf::as_path));
    words.extend(paths.map(|path| display_path(path, out)));
    if let DataFrom::FileWithTime { time, .. } | DataFrom::Files { time: Some(time), .. } = from.ungrouped() {
        words.extend(["--time".to_owned(), time.clone()]);
    }
    if let DataFrom::Grouped { column, .. } = from {
        words.extend(["--group-by".to_owned(), column.clone()]);
    }
    words.extend(["--null-runs".to_owned(), options.null_runs.to_string()]);
    if !options.library {
        words.extend(["--library", "none"].map(str::to_owned));
    }
    for (option, names) in [("--only", &options.effects.only), ("--exclude", &options.effects.exclude)] {
        if !names.is_empty() {
            words.extend([option.to_owned(), names.join(",")]);
        }
    }
    words.extend(groups.iter().flat_map(|group| ["--group".to_owned(), group.clone()]));
    words.extend(accept.iter().flat_map(|check| ["--accept".to_owned(), check.to_string()]));
    words.extend(["--seed".to_owned(), options.seed.to_string(), "--out".to_owned(), "DIR".to_owned()]);
    quoted(&words)
}
