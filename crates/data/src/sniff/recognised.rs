//! Reads files of unknown layout into a data set, with notes about the assumptions.

use super::RecognitionOptions;
use super::assumptions::{column_notes, layout_note, row_notes};
use super::dialect::{Sheet, read_table};
use super::heading::Heading;
use super::recording::{RecordedFile, RecordingKind, Target};
use super::roles::{Axis, Role, assign_roles};
use super::rows::{Draft, RowChanges, read_drafts};
use super::scene::Scene;
use super::text::decode;
use super::unrecognised::Unrecognised;
use crate::column::Column;
use crate::csv_long::MissingCells;
use crate::dataset::Dataset;
use crate::error::{DataError, EVERY_VALUE_IS_NEEDED};
use crate::source::Source;
use crate::trajectory::Trajectory;
use crate::whole_file::{gunzip, is_gzip, read_whole};
use std::path::{Path, PathBuf};

/// Extensions of recordings in a folder.
const EXTENSIONS: [&str; 6] = ["csv", "tsv", "txt", "dat", "csv.gz", "tsv.gz"];
/// Identifier of the only trajectory of a file.
const SINGLE_ID: &str = "run";

/// Result of [`recognise`]: the data set and the assumptions.
#[derive(Debug, Clone, PartialEq)]
pub struct RecognisedData {
    /// The data set with SI columns.
    pub data: Dataset,
    /// Kind of the recording.
    pub recording: RecordingKind,
    /// Assumptions, one sentence each.
    pub assumptions: Vec<String>,
}

/// Reads files of unknown layout, or a folder of them; all must have the same columns.
///
/// Each file has one or several trajectories.
///
/// # Errors
/// [`DataError`] with file, line or column, and the option that states what could not be inferred.
pub fn recognise(
    paths: &[PathBuf],
    reading: &RecognitionOptions,
    missing: MissingCells,
) -> Result<RecognisedData, DataError> {
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

/// [`recognise`] of one file whose bytes were read, without options.
pub(crate) fn recognise_bytes(
    path: &Path,
    bytes: Vec<u8>,
    missing: MissingCells,
) -> Result<RecognisedData, DataError> {
    let reading = RecognitionOptions::default();
    let sheet = read_sheet(path, bytes, &reading)?;
    recognised(path, vec![sheet], &reading, missing)
}

/// Files of a folder with the extension of a recording, sorted by name.
pub(crate) fn files_in(folder: &Path) -> Result<Vec<PathBuf>, DataError> {
    let unreadable = |cause| DataError::Unreadable { path: folder.to_owned(), cause };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        if path.is_file() && EXTENSIONS.iter().any(|extension| name.ends_with(&format!(".{extension}"))) {
            files.push(path);
        }
    }
    files.sort();
    if files.is_empty() {
        let reason = Unrecognised::NoRecordings { endings: &EXTENSIONS };
        return Err(DataError::NotRecognised { path: folder.to_owned(), reason });
    }
    Ok(files)
}

/// Decodes the bytes of a file, plain or gzip, and splits them into a table.
fn read_sheet(path: &Path, mut bytes: Vec<u8>, reading: &RecognitionOptions) -> Result<Sheet, DataError> {
    if is_gzip(&bytes) {
        bytes = gunzip(path, &bytes)?;
    }
    if bytes.is_empty() {
        return Err(DataError::Empty { path: path.to_owned() });
    }
    let not_text = || DataError::NotRecognised { path: path.to_owned(), reason: Unrecognised::NotText };
    let (text, encoding) = decode(&bytes).ok_or_else(not_text)?;
    let mut out = read_table(path, &text, reading.separator, reading.decimal)?;
    if let Some(encoding) = encoding {
        out.comments.push(format!("encoding {encoding}"));
    }
    Ok(out)
}

/// Builds the data set from the tables of all files.
fn recognised(
    origin: &Path,
    sheets: Vec<Sheet>,
    reading: &RecognitionOptions,
    missing: MissingCells,
) -> Result<RecognisedData, DataError> {
    let files = with_roles(sheets, reading)?;
    let Some(first) = files.first() else {
        return Err(DataError::NotRecognised { path: origin.to_owned(), reason: Unrecognised::NoFile });
    };
    let mut assumed = vec![layout_note(first)];
    let mut changes = RowChanges::default();
    let mut drafts: Vec<Draft> = Vec::new();
    for file in &files {
        let has_ids = file.roles.contains(&Role::Trajectory);
        let stem = stem(&file.sheet.path);
        let id = if files.len() > 1 { stem.as_str() } else { SINGLE_ID };
        drafts.extend(read_drafts(file, id, has_ids && files.len() > 1, &mut changes)?);
    }
    let used: Vec<(&Heading, &Role)> = first
        .headings
        .iter()
        .zip(&first.roles)
        .filter(|(_, role)| matches!(role, Role::Axis(..) | Role::Named(..)))
        .collect();
    let (columns, recording, drafts, scene_notes) =
        Scene::new(origin, reading, first, drafts, used).resolve()?;
    assumed.extend(column_notes(first, &columns));
    assumed.extend(scene_notes);
    assumed.extend(row_notes(&files, &drafts, changes));
    let data = dataset(origin, &columns, drafts, missing)?.with_notes(assumed.clone());
    Ok(RecognisedData { data, recording, assumptions: assumed })
}

/// Each table with the roles of its columns, which are inferred from the first table.
///
/// # Errors
/// The tables have different columns, or the roles cannot be inferred.
fn with_roles(sheets: Vec<Sheet>, reading: &RecognitionOptions) -> Result<Vec<RecordedFile>, DataError> {
    let mut out: Vec<RecordedFile> = Vec::with_capacity(sheets.len());
    for sheet in sheets {
        let refuse = |reason| DataError::NotRecognised { path: sheet.path.clone(), reason };
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
            return Err(refuse(Unrecognised::DifferentColumns { first: first.sheet.path.clone(), columns }));
        }
        let roles = match out.first() {
            Some(first) => first.roles.clone(),
            None => {
                let mut roles = assign_roles(&headings, reading).map_err(refuse)?;
                if sheet.names.is_none() && reading.columns.is_empty() {
                    let no_header = || refuse(Unrecognised::NoHeader);
                    roles = roles_without_names(&sheet, &roles).ok_or_else(no_header)?;
                }
                roles
            }
        };
        out.push(RecordedFile { sheet, headings, roles });
    }
    Ok(out)
}

/// Roles of the columns of a table without a header, from their numbers; `None` where they do not fit.
///
/// The columns are an optional trajectory number, the time, and one to three coordinates.
fn roles_without_names(sheet: &Sheet, roles: &[Role]) -> Option<Vec<Role>> {
    let column = |c: usize| -> Option<Vec<f64>> {
        let value = |row: usize| super::dialect::number(&sheet.row(row)[c], sheet.dialect.decimal).ok()?;
        (0..sheet.rows()).map(value).collect()
    };
    let mut out = roles.to_vec();
    // A time grows from row to row, except where a new trajectory begins.
    let check_time = |c: usize| {
        let v = column(c)?;
        let increases = v.windows(2).filter(|w| w[1] > w[0]).count();
        (v.len() > 1 && 10 * increases > 9 * (v.len() - 1)).then_some(())
    };
    // A trajectory number is whole and changes rarely.
    let is_trajectory_number = |c: usize| {
        column(c).is_some_and(|v| {
            let changes = v.windows(2).filter(|w| w[1] != w[0]).count();
            v.iter().all(|x| x.fract() == 0.0) && 5 * changes < v.len()
        })
    };
    let mut next = 0;
    if out.contains(&Role::Trajectory) || is_trajectory_number(0) {
        if !out.contains(&Role::Trajectory) {
            out[0] = Role::Trajectory;
        }
        next = 1;
    }
    if !out.iter().any(|role| matches!(role, Role::Time(_))) {
        check_time(next)?;
        out[next] = Role::Time(None);
        next += 1;
    }
    let coordinates: Vec<usize> = (next..sheet.columns).filter(|c| out[*c] == Role::Unused).collect();
    let axes: &[Axis] = match coordinates.len() {
        1 => &[Axis::Height],
        2 => &[Axis::X, Axis::Y],
        3 => &[Axis::X, Axis::Y, Axis::Z],
        _ => return None,
    };
    coordinates.into_iter().zip(axes).for_each(|(c, axis)| out[c] = Role::Axis(*axis, None));
    Some(out)
}

/// Name of a file without its extension, for an identifier.
pub(crate) fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let cut = EXTENSIONS.iter().find_map(|e| name.strip_suffix(&format!(".{e}")));
    let clean: String = cut.unwrap_or(&name).chars().filter(|c| !c.is_control()).collect();
    if clean.trim().is_empty() { SINGLE_ID.to_owned() } else { clean.trim().to_owned() }
}

/// Builds the data set from trajectories in the units of the file, converted to SI.
fn dataset(
    origin: &Path,
    columns: &[Target],
    drafts: Vec<Draft>,
    missing: MissingCells,
) -> Result<Dataset, DataError> {
    let mut trajectories = Vec::with_capacity(drafts.len());
    for draft in drafts {
        let mut values = Vec::with_capacity(columns.len());
        for column in columns {
            let samples = &draft.values[column.value];
            if let Some(k) =
                samples.iter().position(|v| v.is_nan()).filter(|_| missing == MissingCells::Refuse)
            {
                return Err(DataError::EmptyCell {
                    path: draft.path,
                    line: draft.lines[k],
                    column: column.from.clone(),
                    remedy: EVERY_VALUE_IS_NEEDED,
                });
            }
            values.push(samples.iter().map(|v| v * column.factor + column.offset).collect());
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
