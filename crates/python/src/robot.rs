//! Makes models of robots from their descriptions and logs of their joints.

use crate::background;
use crate::model::Model;
use crate::source::Source;
use augsim_data::{DataError, MissingCells, atomic_write, write_dataset};
use augsim_robot::MAX_FILE_BYTES;
use augsim_session::robot::{Formulation, Free, RobotRequest, model_from_robot};
use augsim_session::{Subject, folders};
use pyo3::prelude::*;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Expressions of columns for joints, by the names of the joints.
type Expressions = Vec<(String, String)>;

/// Writes the model of a robot, its data and its description into a folder; returns the model, and the notes on it.
///
/// `free` are the groups `inertias`, `armature` and `viscous`; `is_forward` is `None` if the log decides.
#[pyfunction]
#[pyo3(signature = (robot, log, folder, *, joints, positions, torques, is_forward, gravity, free))]
#[expect(clippy::too_many_arguments, reason = "all but three are keywords of Python")]
pub fn from_robot(
    py: Python<'_>,
    robot: PathBuf,
    log: &Source,
    folder: PathBuf,
    joints: Vec<String>,
    positions: Expressions,
    torques: Expressions,
    is_forward: Option<bool>,
    gravity: Option<[f64; 3]>,
    free: [bool; 3],
) -> PyResult<(Model, Vec<String>)> {
    let log = log.from.clone();
    let [inertias, armature, viscous] = free;
    let request = RobotRequest {
        joints,
        positions,
        torques,
        formulation: is_forward.map(|is_forward| match is_forward {
            true => Formulation::Forward,
            false => Formulation::Inverse,
        }),
        gravity,
        free: Free { inertias, armature, viscous },
        file: robot.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        log: log.to_string(),
    };
    let (subject, path, notes) = background::run(py, None, move |_| {
        let text = description(&robot)?;
        let description = augsim_robot::read(&text, &robot.display().to_string())?;
        let made = model_from_robot(&description, &log.read(MissingCells::AsGap)?, &request)?;
        folders::make(&folder)?;
        let model = folder.join("model.toml");
        // The model names its description, which is copied beside it unless it is there.
        let copy = folder.join(&request.file);
        if std::fs::canonicalize(&copy).ok() != std::fs::canonicalize(&robot).ok() {
            atomic_write(&copy, |w| w.write_all(text.as_bytes()))?;
        }
        atomic_write(&model, |w| w.write_all(made.text.as_bytes()))?;
        write_dataset(&made.data, &folder.join("data.csv"))?;
        Ok((Subject::read(&model)?, model, made.notes))
    })?;
    Ok((Model { subject, path: Some(path), function: None }, notes))
}

/// Reads the text of a description file, which must not be too long.
fn description(path: &Path) -> anyhow::Result<String> {
    let unreadable = |cause| DataError::Unreadable { path: path.to_path_buf(), cause };
    let bytes = std::fs::metadata(path).map_err(unreadable)?.len();
    if bytes > MAX_FILE_BYTES as u64 {
        let text = format!("{bytes} bytes, but at most {MAX_FILE_BYTES} are allowed");
        return Err(unreadable(std::io::Error::other(text)).into());
    }
    Ok(std::fs::read_to_string(path).map_err(unreadable)?)
}
