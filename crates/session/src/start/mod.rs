//! A data set and a starting model file from recordings in any layout.

mod draft;

use augsim_data::{
    DataError, Dataset, MissingCells, RecognisedData, RecognitionOptions, RecordingKind, recognise,
};
use augsim_physics::ball::detected_floor_m;
use augsim_physics::model::template;
use draft::draft;
use std::path::PathBuf;

/// Absolute floor height, m, above which the model file declares it; larger than the radius of a ball.
const MIN_DECLARED_FLOOR_M: f64 = 0.05;

/// A recording as a data set, with a model file to start from.
#[derive(Debug, Clone, PartialEq)]
pub struct Started {
    /// Trajectories with columns in SI units.
    pub data: Dataset,
    /// Text of the model file; `None` if no column varies, so that there is nothing to model.
    pub model: Option<String>,
    /// Kind of the recording.
    pub recording: RecordingKind,
    /// Assumptions about layout, units and columns, one sentence each.
    pub assumptions: Vec<String>,
    /// Height of the floor on which an object bounces, m; `None` without impacts.
    pub floor_height_m: Option<f64>,
    /// Columns of drafted equations; `None` for a ball or pushes.
    pub drafted: Option<Drafted>,
}

/// Names of the columns that drafted equations use.
#[derive(Debug, Clone, PartialEq)]
pub struct Drafted {
    /// Columns that act on the system.
    pub inputs: Vec<String>,
    /// Columns that the equations predict.
    pub outputs: Vec<String>,
}

/// Reads files or folders in any layout and drafts a model file for them.
///
/// # Errors
/// Those of [`recognise`].
pub fn from_files(paths: &[PathBuf], layout: &RecognitionOptions) -> Result<Started, DataError> {
    let recognised = recognise(paths, layout, MissingCells::AsGap)?;
    let source: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
    let stem = paths.first().and_then(|f| f.file_stem()).unwrap_or_default().to_string_lossy();
    Ok(started(recognised, &source.join(" "), &stem))
}

/// Drafts a model file for trajectories in memory; `name` is that of the system.
pub fn from_data(data: Dataset, name: &str) -> Started {
    let recording = RecordingKind::of(&data);
    started(RecognisedData { data, recording, assumptions: Vec::new() }, name, name)
}

fn started(recognised: RecognisedData, source: &str, name: &str) -> Started {
    let RecognisedData { data, recording, assumptions } = recognised;
    let floor_height_m = match recording {
        RecordingKind::Falls(_) => detected_floor_m(&data),
        _ => None,
    };
    let source = source.replace(['\n', '\r'], " ");
    let (model, drafted) = match recording {
        RecordingKind::Moves(_) | RecordingKind::Other => draft(&data, &system_name(name), &source).unzip(),
        _ => (built_in_model(recording, floor_height_m, &source), None),
    };
    Started { data, model, recording, assumptions, floor_height_m, drafted }
}

/// Text of a starting model file of a ball or of pushing; `None` if neither fits the recording.
fn built_in_model(recording: RecordingKind, floor: Option<f64>, source: &str) -> Option<String> {
    let head = |text: &str| format!("# Made by augsim start from {source}.\n{text}");
    match recording {
        RecordingKind::Falls(_) => {
            let mut text = template("ball")?.to_owned();
            let suggested = "# floor_height_m = { nominal = 0.0, min = -0.5, max = 0.5 }";
            match floor {
                // The restitution cannot be calibrated without impacts.
                None => {
                    text = text.replace("\nrestitution = ", "\n# No impacts were found.\n# restitution = ")
                }
                Some(z) if z.abs() > MIN_DECLARED_FLOOR_M => {
                    let (low, high) = (z - 0.5, z + 0.5);
                    let line =
                        format!("floor_height_m = {{ nominal = {z:.4}, min = {low:.4}, max = {high:.4} }}");
                    text = text.replace(suggested, &line);
                }
                Some(_) => {}
            }
            Some(head(&text))
        }
        RecordingKind::Pushes => template("push").map(head),
        RecordingKind::Moves(_) | RecordingKind::Other => None,
    }
}

/// Name of the system in a drafted model: `name`, reduced to letters and digits.
fn system_name(name: &str) -> String {
    let name: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { ' ' }).collect();
    let name = name.split_whitespace().collect::<Vec<_>>().join(" ");
    if name.is_empty() { "system".to_owned() } else { name }
}
