//! Reads files of unknown layout into a data set, with notes about the assumptions.

use super::RecognitionOptions;
use super::assumptions::{column_notes, layout_note, row_notes};
use super::dialect::{Sheet, number, read_table};
use super::heading::Heading;
use super::named::column_name;
use super::recording::{RecordedFile, RecordingKind, Target};
use super::roles::{Axis, Role, assign_roles};
use super::rows::{Draft, RowChanges, read_drafts};
use super::scene::Scene;
use super::side_by_side::stacked;
use super::text::decode;
use super::unrecognised::Unrecognised;
use crate::column::Column;
use crate::csv_long::MissingCells;
use crate::dataset::Dataset;
use crate::error::{ColumnError, DataError, EVERY_VALUE_IS_NEEDED};
use crate::foreign::{Content, content};
use crate::source::Source;
use crate::trajectory::Trajectory;
use crate::unit::{Unit, to_si};
use crate::whole_file::read_whole;
use std::path::{Path, PathBuf};

/// Extensions of the files that are read as recordings when a folder is given.
const EXTENSIONS: [&str; 11] =
    ["csv", "tsv", "txt", "dat", "csv.gz", "tsv.gz", "txt.gz", "lvm", "xlsx", "mat", "jsonl"];
/// Extensions of recordings that are read only when the file itself is given.
///
/// Folders hold such files for other purposes.
const SINGLE_EXTENSIONS: [&str; 8] = ["csv.zip", "zip", "json", "ndjson", "h5", "hdf5", "npz", "gz"];
/// Identifier of the only trajectory of a single file.
const SINGLE_ID: &str = "run";

/// Result of [`recognise`]: the data set and the assumptions with which it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct RecognisedData {
    /// Data set with columns in SI units.
    pub data: Dataset,
    /// Kind of the recording: a fall, a push, another motion, or no positions.
    pub recording: RecordingKind,
    /// Assumptions about layout, units and columns, one sentence each.
    pub assumptions: Vec<String>,
}

/// Reads files of unknown layout, or a folder of them; all must have the same columns.
///
/// Each file holds one or several trajectories.
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
    let mut sheets: Vec<Sheet> = Vec::with_capacity(files.len());
    for path in &files {
        let text = match content(path, read_whole(path)?, missing)? {
            Content::Data(data) if files.len() == 1 => {
                return Ok(RecognisedData {
                    recording: RecordingKind::of(&data),
                    data,
                    assumptions: Vec::new(),
                });
            }
            content => content.into_text(),
        };
        sheets.push(read_sheet(path, text, reading)?);
    }
    let origin = match paths {
        [one] => one.clone(),
        _ => files.first().cloned().unwrap_or_default(),
    };
    recognised(&origin, sheets, reading, missing)
}

/// Like [`recognise`], for one file whose text was read, without options.
pub(crate) fn recognise_bytes(
    path: &Path,
    bytes: Vec<u8>,
    missing: MissingCells,
) -> Result<RecognisedData, DataError> {
    let reading = RecognitionOptions::default();
    let sheet = read_sheet(path, bytes, &reading)?;
    recognised(path, vec![sheet], &reading, missing)
}

/// Files of a folder that have the extension of a recording, sorted by name.
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

/// Decodes the bytes of a text file and splits the text into a table.
fn read_sheet(path: &Path, bytes: Vec<u8>, reading: &RecognitionOptions) -> Result<Sheet, DataError> {
    if bytes.is_empty() {
        return Err(DataError::Empty { path: path.to_owned() });
    }
    let not_text = || DataError::NotRecognised { path: path.to_owned(), reason: Unrecognised::NotText };
    let (text, encoding) = decode(&bytes).ok_or_else(not_text)?;
    let mut out = stacked(read_table(path, &text, reading.separator, reading.decimal)?);
    if let Some(encoding) = encoding {
        out.comments.push(format!("encoding {encoding}"));
    }
    Ok(out)
}

/// Infers the meaning of the columns and builds one data set from the tables of all files.
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

/// Pairs each table with the roles of its columns, which are inferred from the first table.
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
                if sheet.names.is_none() {
                    roles_without_names(&sheet, &mut roles, reading);
                }
                keep_numbers(&sheet, &headings, &mut roles);
                roles
            }
        };
        out.push(RecordedFile { sheet, headings, roles });
    }
    Ok(out)
}

/// Infers the roles of the columns of a table without a header from their numbers.
///
/// The columns are an optional trajectory number, the time, and one to three coordinates; where these do not
/// fit, columns keep no role. With a sample rate or named columns, only the time is inferred.
fn roles_without_names(sheet: &Sheet, roles: &mut [Role], reading: &RecognitionOptions) {
    let column = |c: usize| -> Option<Vec<f64>> {
        let value = |row: usize| number(&sheet.row(row)[c], sheet.dialect.decimal).ok()?;
        (0..sheet.rows()).map(value).collect()
    };
    // A time grows from row to row, except where a new trajectory begins.
    let is_time = |c: usize| {
        column(c).is_some_and(|v| {
            let increases = v.windows(2).filter(|w| w[1] > w[0]).count();
            v.len() > 1 && 10 * increases > 9 * (v.len() - 1)
        })
    };
    // A trajectory number is whole and changes rarely.
    let is_trajectory_number = |c: usize| {
        column(c).is_some_and(|v| {
            let changes = v.windows(2).filter(|w| w[1] != w[0]).count();
            v.iter().all(|x| x.fract() == 0.0) && 5 * changes < v.len()
        })
    };
    let mut next = 0;
    if roles.contains(&Role::Trajectory) {
        next = 1;
    } else if roles[0] == Role::Unused && is_trajectory_number(0) && sheet.columns > 2 {
        (roles[0], next) = (Role::Trajectory, 1);
    }
    let has_time = roles.iter().any(|role| matches!(role, Role::Time(_)));
    if !has_time && reading.rate_hz.is_none() {
        if next >= sheet.columns || roles[next] != Role::Unused || !is_time(next) {
            return;
        }
        roles[next] = Role::Time(None);
        next += 1;
    }
    if !reading.columns.is_empty() {
        return;
    }
    let coordinates: Vec<usize> = (next..sheet.columns).filter(|c| roles[*c] == Role::Unused).collect();
    let axes: &[Axis] = match coordinates.len() {
        1 => &[Axis::Height],
        2 => &[Axis::X, Axis::Y],
        3 => &[Axis::X, Axis::Y, Axis::Z],
        _ => return,
    };
    coordinates.into_iter().zip(axes).for_each(|(c, axis)| roles[c] = Role::Axis(*axis, None));
}

/// Gives a name to every column of numbers that has no other role, so that no measurement is lost.
///
/// A column of which most filled cells are text, and a column without values, stay unused.
fn keep_numbers(sheet: &Sheet, headings: &[Heading], roles: &mut [Role]) {
    let mut taken: Vec<(String, String)> = Vec::new();
    for (h, role) in headings.iter().zip(roles.iter()) {
        if let Role::Named(name, _) = role {
            taken.push((name.clone(), h.raw.clone()));
        }
    }
    for (c, h) in headings.iter().enumerate().filter(|(_, h)| !h.raw.is_empty()) {
        if roles[c] != Role::Unused {
            continue;
        }
        let cells = || (0..sheet.rows()).map(|row| &sheet.row(row)[c]);
        let numbers = cells().filter(|t| matches!(number(t, sheet.dialect.decimal), Ok(Some(_)))).count();
        let texts = cells().filter(|t| number(t, sheet.dialect.decimal).is_err()).count();
        if numbers <= texts {
            continue;
        }
        let (mut name, conversion) = column_name(h, c, "");
        // Two headings may lose their difference: `angle (deg)` and `angle (rad)`.
        if taken.iter().any(|(other, raw)| *other == name && *raw != h.raw) {
            (name, _) = column_name(h, c, &format!("_{}", c + 1));
        }
        taken.push((name.clone(), h.raw.clone()));
        roles[c] = Role::Named(name, conversion);
    }
}

/// Name of a file without its extension, as the identifier of a trajectory.
pub(crate) fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let cut = EXTENSIONS.iter().chain(&SINGLE_EXTENSIONS).find_map(|e| name.strip_suffix(&format!(".{e}")));
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
            values.push(samples.iter().map(|v| to_si(*v, column.factor, column.offset)).collect());
        }
        let mut trajectory = Trajectory::new(draft.id, draft.times, values)?;
        if let Some(group) = draft.group {
            trajectory = trajectory.with_group(group)?;
        }
        trajectories.push(trajectory);
    }
    // A column whose name states no known unit is kept as a pure number, with a note.
    let column = |c: &Target| match Column::new(&c.name) {
        Err(ColumnError::UnknownUnit { .. }) => Column::with_unit(&c.name, Unit::DIMENSIONLESS),
        column => column,
    };
    let columns = columns.iter().map(column).collect::<Result<Vec<_>, _>>()?;
    Dataset::with_origin(columns, trajectories, Source::File(origin.to_owned()))
}
