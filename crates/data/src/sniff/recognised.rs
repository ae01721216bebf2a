//! From files to a data set, with what was taken for granted on the way.

use super::Reading;
use super::assumptions::{columns_assumed, layout, rows_assumed};
use super::dialect::{Sheet, sheet};
use super::heading::Heading;
use super::recording::{Recorded, Recording, Target};
use super::roles::{Axis, Part, roles};
use super::rows::{Done, Draft, drafts};
use super::scene::Scene;
use super::text::decoded;
use super::unrecognised::Unrecognised;
use crate::column::Column;
use crate::csv_long::MissingCells;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::source::Source;
use crate::trajectory::Trajectory;
use crate::whole_file::{gunzip, is_gzip, read_whole};
use std::path::{Path, PathBuf};

/// Endings of the files that a folder of recordings consists of.
const ENDINGS: [&str; 6] = ["csv", "tsv", "txt", "dat", "csv.gz", "tsv.gz"];
/// Name of the one recording of a file.
const ONLY: &str = "run";
/// A data set that was recognised.
#[derive(Debug, Clone, PartialEq)]
pub struct Recognised {
    /// The recording in the long form's columns.
    pub data: Dataset,
    /// Kind of the recording.
    pub recording: Recording,
    /// Assumptions that were made, one sentence each.
    pub assumed: Vec<String>,
}

/// Reads files, or a folder of them, each with one or several trajectories in the same columns.
///
/// # Errors
/// [`DataError`], with file, line or column, and the option that says what could not be told.
pub fn recognise(
    paths: &[PathBuf],
    reading: &Reading,
    missing: MissingCells,
) -> Result<Recognised, DataError> {
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() {
            files.extend(files_in(path)?);
        } else {
            files.push(path.clone());
        }
    }
    let sheets: Vec<Sheet> =
        files.iter().map(|path| read_sheet(path, read_whole(path)?, reading)).collect::<Result<_, _>>()?;
    let origin = match paths {
        [one] => one.clone(),
        _ => files.first().cloned().unwrap_or_default(),
    };
    recognised(&origin, sheets, reading, missing)
}

/// [`recognise`] of a file whose bytes were read.
pub(crate) fn recognise_bytes(
    path: &Path,
    bytes: Vec<u8>,
    missing: MissingCells,
) -> Result<Recognised, DataError> {
    let reading = Reading::default();
    let sheet = read_sheet(path, bytes, &reading)?;
    recognised(path, vec![sheet], &reading, missing)
}

/// Files of a folder that may be recordings, by name.
pub(crate) fn files_in(folder: &Path) -> Result<Vec<PathBuf>, DataError> {
    let unreadable = |cause| DataError::Unreadable { path: folder.to_owned(), cause };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        if path.is_file() && ENDINGS.iter().any(|ending| name.ends_with(&format!(".{ending}"))) {
            files.push(path);
        }
    }
    files.sort();
    if files.is_empty() {
        let open = Unrecognised::NoRecordings { endings: &ENDINGS };
        return Err(DataError::NotRecognised { path: folder.to_owned(), open });
    }
    Ok(files)
}

fn read_sheet(path: &Path, mut bytes: Vec<u8>, reading: &Reading) -> Result<Sheet, DataError> {
    if is_gzip(&bytes) {
        bytes = gunzip(path, &bytes)?;
    }
    if bytes.is_empty() {
        return Err(DataError::Empty { path: path.to_owned() });
    }
    let not_text = || DataError::NotRecognised { path: path.to_owned(), open: Unrecognised::NoText };
    let (text, encoding) = decoded(&bytes).ok_or_else(not_text)?;
    let mut out = sheet(path, &text, reading.separator, reading.decimal)?;
    if let Some(encoding) = encoding {
        out.comments.push(format!("encoding {encoding}"));
    }
    Ok(out)
}

fn recognised(
    origin: &Path,
    sheets: Vec<Sheet>,
    reading: &Reading,
    missing: MissingCells,
) -> Result<Recognised, DataError> {
    let files = with_parts(sheets, reading)?;
    let Some(first) = files.first() else {
        return Err(DataError::NotRecognised { path: origin.to_owned(), open: Unrecognised::NoFile });
    };
    let mut assumed = vec![layout(first)];
    let mut done = Done::default();
    let mut all: Vec<Draft> = Vec::new();
    for file in &files {
        let named = file.parts.contains(&Part::Trajectory);
        let stem = stem(&file.sheet.path);
        let id = if files.len() > 1 { stem.as_str() } else { ONLY };
        all.extend(drafts(
            &file.sheet,
            &file.headings,
            &file.parts,
            id,
            named && files.len() > 1,
            &mut done,
        )?);
    }
    let used: Vec<(&Heading, &Part)> = first
        .headings
        .iter()
        .zip(&first.parts)
        .filter(|(_, p)| matches!(p, Part::Axis(..) | Part::Named(..)))
        .collect();
    let (columns, recording, all, of_scene) = Scene::new(origin, reading, first, all, used).settled()?;
    assumed.extend(columns_assumed(first, &columns));
    assumed.extend(of_scene);
    assumed.extend(rows_assumed(&files, &all, done));
    let data = dataset(origin, &columns, all, missing)?.with_notes(assumed.clone());
    Ok(Recognised { data, recording, assumed })
}

/// Each file with the parts of its columns, which are those of the first file.
fn with_parts(sheets: Vec<Sheet>, reading: &Reading) -> Result<Vec<Recorded>, DataError> {
    let mut out: Vec<Recorded> = Vec::with_capacity(sheets.len());
    for sheet in sheets {
        let refuse = |open| DataError::NotRecognised { path: sheet.path.clone(), open };
        let headings: Vec<Heading> = match &sheet.names {
            Some(names) => names
                .iter()
                .enumerate()
                .map(|(i, name)| Heading::read(name, sheet.units.get(i).map_or("", String::as_str)))
                .collect(),
            None => (1..=sheet.columns).map(|i| Heading::read(&i.to_string(), "")).collect(),
        };
        if let Some(first) = out.first()
            && first.headings.iter().map(|h| &h.raw).ne(headings.iter().map(|h| &h.raw))
        {
            let columns = first.headings.iter().map(|h| h.raw.clone()).collect();
            return Err(refuse(Unrecognised::OtherColumns { first: first.sheet.path.clone(), columns }));
        }
        let parts = match out.first() {
            Some(first) => first.parts.clone(),
            None => {
                let mut parts = roles(&headings, reading).map_err(refuse)?;
                if sheet.names.is_none() && reading.columns.is_empty() {
                    let unnamed = || refuse(Unrecognised::NoHeader);
                    parts = parts_without_names(&sheet, &parts).ok_or_else(unnamed)?;
                }
                parts
            }
        };
        out.push(Recorded { sheet, headings, parts });
    }
    Ok(out)
}

/// Parts of the columns of a file without a header: an optional number of the trajectory, a clock, one to three coordinates.
fn parts_without_names(sheet: &Sheet, parts: &[Part]) -> Option<Vec<Part>> {
    let column = |c: usize| -> Option<Vec<f64>> {
        let one = |row: usize| super::dialect::number(&sheet.row(row)[c], sheet.dialect.decimal).ok()?;
        (0..sheet.rows()).map(one).collect()
    };
    let mut out = parts.to_vec();
    let grows = |c: usize| {
        let v = column(c)?;
        let up = v.windows(2).filter(|w| w[1] > w[0]).count();
        (v.len() > 1 && 10 * up > 9 * (v.len() - 1)).then_some(())
    };
    let counts = |c: usize| {
        let v = column(c)?;
        let steps = v.windows(2).filter(|w| w[1] != w[0]).count();
        (v.iter().all(|x| x.fract() == 0.0) && 5 * steps < v.len()).then_some(())
    };
    let mut next = 0;
    if out.contains(&Part::Trajectory) || counts(0).is_some() {
        if !out.contains(&Part::Trajectory) {
            out[0] = Part::Trajectory;
        }
        next = 1;
    }
    if !out.iter().any(|p| matches!(p, Part::Time(_))) {
        grows(next)?;
        out[next] = Part::Time(None);
        next += 1;
    }
    let rest: Vec<usize> = (next..sheet.columns).filter(|c| out[*c] == Part::Extra).collect();
    let axes: &[Axis] = match rest.len() {
        1 => &[Axis::Height],
        2 => &[Axis::X, Axis::Y],
        3 => &[Axis::X, Axis::Y, Axis::Z],
        _ => return None,
    };
    rest.into_iter().zip(axes).for_each(|(c, axis)| out[c] = Part::Axis(*axis, None));
    Some(out)
}

/// Name of a file without its endings.
pub(crate) fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let cut = ENDINGS.iter().find_map(|e| name.strip_suffix(&format!(".{e}")));
    let clean: String = cut.unwrap_or(&name).chars().filter(|c| !c.is_control()).collect();
    if clean.trim().is_empty() { ONLY.to_owned() } else { clean.trim().to_owned() }
}

fn dataset(
    origin: &Path,
    columns: &[Target],
    all: Vec<Draft>,
    missing: MissingCells,
) -> Result<Dataset, DataError> {
    let mut trajectories = Vec::with_capacity(all.len());
    for draft in all {
        let mut values = Vec::with_capacity(columns.len());
        for column in columns {
            let own = &draft.values[column.value];
            if let Some(k) = own.iter().position(|v| v.is_nan()).filter(|_| missing == MissingCells::Refuse) {
                return Err(DataError::EmptyCell {
                    path: draft.path,
                    line: draft.lines[k],
                    column: column.from.clone(),
                    remedy: "every value is needed here: fill it in, or remove the row or the trajectory",
                });
            }
            values.push(own.iter().map(|v| v * column.factor).collect());
        }
        let mut trajectory = Trajectory::new(draft.id, draft.times, values)?;
        if let Some(group) = draft.group {
            trajectory = trajectory.with_group(group)?;
        }
        trajectories.push(trajectory);
    }
    let columns = columns.iter().map(|c| Column::new(&c.name)).collect::<Result<Vec<_>, _>>()?;
    Dataset::with_origin(columns, trajectories, Source::File(origin.to_owned()))
}
