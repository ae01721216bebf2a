//! NPZ, the array archive of numpy: one-dimensional arrays named as the columns of the long form.
//!
//! ```python
//! numpy.savez("drops.npz", trajectory=["a", "a", "b"], t_s=[0, 0.1, 0], height_m=[4.4, 4.3, 4.1])
//! ```
//! `trajectory` and the optional `group` are arrays of text or of whole numbers; all others are arrays of
//! numbers of any type. NaN is a gap.

use crate::assemble::Assembler;
use crate::atomic_file::atomic_write;
use crate::column::{Column, GROUP, TIME, TRAJECTORY};
use crate::csv_long::MissingCells;
use crate::dataset::Dataset;
use crate::error::DataError;
use crate::limits::{Limit, LimitExceeded};
use crate::npz_fault::ArrayFault;
use crate::push::archive::{members, unpack};
use crate::source::Source;
use crate::whole_file::read_whole;
use npyz::{DType, NpyFile, TypeChar, WriterBuilder};
use std::collections::BTreeMap;
use std::io::{self, Cursor, Write};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{DateTime, ZipWriter};

const EXTENSION: &str = ".npy";

/// Reads a data set from NPZ, plain or compressed.
///
/// # Errors
/// A [`DataError`] with file, array and remedy. Messages count rows from 1, like the lines of a CSV file
/// without a header.
pub fn read_npz(path: &Path, missing: MissingCells) -> Result<Dataset, DataError> {
    read_npz_bytes(path, &read_whole(path)?, missing)
}

/// Number of cells that one text counts as in the limit on cells, because of its use of memory.
const CELLS_PER_TEXT: u64 = 8;

/// Like [`read_npz`], for a file whose bytes were read; `path` is its name in messages.
pub(crate) fn read_npz_bytes(path: &Path, bytes: &[u8], missing: MissingCells) -> Result<Dataset, DataError> {
    let mut texts = BTreeMap::new();
    let mut numbers = Vec::new();
    let names: Vec<String> =
        members(path, bytes)?.into_iter().filter(|name| name.ends_with(EXTENSION)).collect();
    let exceeded = |cause| DataError::Limit { origin: Source::File(path.to_owned()), cause };
    Limit::Columns.check(names.len() as u64).map_err(exceeded)?;
    let mut cells = 0;
    unpack(path, bytes, &names, |member, content| {
        let name = member.strip_suffix(EXTENSION).unwrap_or(member);
        let array = Array::parse(path, name, content)?;
        let is_text = [TRAJECTORY, GROUP].contains(&name);
        cells += array.file.len() * if is_text { CELLS_PER_TEXT } else { 1 };
        Limit::Cells.check(cells).map_err(exceeded)?;
        if is_text {
            texts.insert(name.to_owned(), array.texts()?);
        } else {
            numbers.push((name.to_owned(), array.numbers()?));
        }
        Ok(())
    })?;
    assemble(path, texts, numbers, missing)
}

/// Builds a data set from the arrays of an NPZ file: texts by name, and (name, numbers) pairs.
fn assemble(
    path: &Path,
    mut texts: BTreeMap<String, Vec<String>>,
    mut numbers: Vec<(String, Vec<f64>)>,
    missing: MissingCells,
) -> Result<Dataset, DataError> {
    let available: Vec<String> = texts.keys().chain(numbers.iter().map(|(name, _)| name)).cloned().collect();
    let absent = |column: &str| DataError::Array {
        path: path.to_owned(),
        array: column.to_owned(),
        fault: ArrayFault::Missing { available: available.clone() },
    };
    let ids = texts.remove(TRAJECTORY).ok_or_else(|| absent(TRAJECTORY))?;
    let time = numbers.iter().position(|(name, _)| name == TIME).ok_or_else(|| absent(TIME))?;
    let (_, time) = numbers.remove(time);
    let groups = texts.remove(GROUP);
    let lengths = numbers.iter().map(|(name, values)| (name.as_str(), values.len()));
    let groups_length = groups.iter().map(|g| (GROUP, g.len()));
    for (name, length) in lengths.chain([(TIME, time.len())]).chain(groups_length) {
        if length != ids.len() {
            return Err(DataError::Array {
                path: path.to_owned(),
                array: name.to_owned(),
                fault: ArrayFault::Length { found: length, samples: ids.len() },
            });
        }
    }
    let mut columns = Vec::new();
    for (name, _) in &numbers {
        let bad = |cause| DataError::BadColumn { path: path.to_owned(), cause };
        columns.push(Column::new(name).map_err(bad)?);
    }
    if columns.is_empty() {
        return Err(DataError::NoValueColumns { path: path.to_owned() });
    }
    let mut rows = Assembler::new(path.to_owned(), TRAJECTORY, TIME, columns.len());
    let mut row = vec![0.0; columns.len()];
    for (k, id) in ids.iter().enumerate() {
        let line = k as u64 + 1;
        let check_number = |name: &str, value: f64, may_be_gap: bool| {
            if value.is_finite() || (may_be_gap && value.is_nan()) {
                return Ok(value);
            }
            Err(DataError::BadNumber {
                path: path.to_owned(),
                line,
                column: name.to_owned(),
                cell: value.to_string(),
            })
        };
        let time_s = check_number(TIME, time[k], false)?;
        for (out, (name, values)) in row.iter_mut().zip(&numbers) {
            *out = check_number(name, values[k], missing == MissingCells::AsGap)?;
        }
        rows.push(line, id, groups.as_ref().map(|g| g[k].as_str()), time_s, &row)?;
    }
    Dataset::with_origin(columns, rows.finish()?, Source::File(path.to_owned()))
}

/// Whether a zip archive is an NPZ file, by its extension or by the names of its members.
pub(crate) fn is_npz(path: &Path, bytes: &[u8]) -> Result<bool, DataError> {
    // A damaged archive with this extension counts as NPZ, so that the reader reports the damage.
    let is_named_npz = path.extension().is_some_and(|extension| extension == "npz");
    Ok(is_named_npz || members(path, bytes)?.iter().any(|name| name.ends_with(EXTENSION)))
}

/// One array of an NPZ archive, with the path of the archive and the array's name for messages.
struct Array<'a> {
    path: &'a Path,
    name: &'a str,
    file: NpyFile<Cursor<Vec<u8>>>,
}

impl<'a> Array<'a> {
    /// Reads the header of an array and checks that the array is one-dimensional and complete.
    fn parse(path: &'a Path, name: &'a str, content: Vec<u8>) -> Result<Self, DataError> {
        let size = content.len() as u64;
        check_header(&content).map_err(|cause| DataError::Array {
            path: path.to_owned(),
            array: name.to_owned(),
            fault: ArrayFault::Limit(cause),
        })?;
        let file = NpyFile::new(Cursor::new(content)).map_err(|e| damaged(path, name, e))?;
        let array = Array { path, name, file };
        if matches!(array.element_type(), Some((TypeChar::Object, _))) {
            return Err(array.fault(ArrayFault::Objects));
        }
        if array.file.shape().len() != 1 {
            let shape = array.file.shape().to_vec();
            return Err(array.fault(ArrayFault::Shape { shape }));
        }
        // A damaged header must not make the reader allocate more memory than the file can fill.
        let width = array.file.dtype().num_bytes().map_or(u64::MAX, |width| width as u64);
        if array.file.len() > size || width > size || array.file.len().saturating_mul(width) > size {
            return Err(damaged(path, name, io::Error::from(io::ErrorKind::UnexpectedEof)));
        }
        Ok(array)
    }

    fn fault(&self, fault: ArrayFault) -> DataError {
        DataError::Array { path: self.path.to_owned(), array: self.name.to_owned(), fault }
    }

    /// Type of the array's elements and their size, bytes (characters for Unicode); `None` for structured types.
    fn element_type(&self) -> Option<(TypeChar, u64)> {
        match self.file.dtype() {
            DType::Plain(plain) => Some((plain.type_char(), plain.size_field())),
            _ => None,
        }
    }

    /// Reads the elements of the array as `T` and converts each of them.
    fn values<T: npyz::Deserialize, U>(self, convert: impl FnMut(T) -> U) -> Result<Vec<U>, DataError> {
        let (path, name) = (self.path, self.name);
        let values = self.file.into_vec::<T>().map_err(|e| damaged(path, name, e))?;
        Ok(values.into_iter().map(convert).collect())
    }

    /// Reads the elements of the array as floating-point numbers.
    fn numbers(self) -> Result<Vec<f64>, DataError> {
        match self.element_type() {
            Some((TypeChar::Float, 8)) => self.values(|v: f64| v),
            Some((TypeChar::Float, 4)) => self.values(|v: f32| f64::from(v)),
            Some((TypeChar::Bool, _)) => self.values(|v: bool| if v { 1.0 } else { 0.0 }),
            Some((TypeChar::Int, 8)) => self.values(|v: i64| v as f64),
            Some((TypeChar::Int, 4)) => self.values(|v: i32| f64::from(v)),
            Some((TypeChar::Int, 2)) => self.values(|v: i16| f64::from(v)),
            Some((TypeChar::Int, 1)) => self.values(|v: i8| f64::from(v)),
            Some((TypeChar::Uint, 8)) => self.values(|v: u64| v as f64),
            Some((TypeChar::Uint, 4)) => self.values(|v: u32| f64::from(v)),
            Some((TypeChar::Uint, 2)) => self.values(|v: u16| f64::from(v)),
            Some((TypeChar::Uint, 1)) => self.values(|v: u8| f64::from(v)),
            _ => Err(self.fault(ArrayFault::NotNumbers)),
        }
    }

    /// Reads the elements of the array as texts; whole numbers are printed.
    fn texts(self) -> Result<Vec<String>, DataError> {
        match self.element_type() {
            Some((TypeChar::UnicodeStr | TypeChar::ByteStr, _)) => self.values(|v: String| v),
            Some((TypeChar::Int, 8)) => self.values(|v: i64| v.to_string()),
            Some((TypeChar::Int, 4)) => self.values(|v: i32| v.to_string()),
            Some((TypeChar::Uint, 8)) => self.values(|v: u64| v.to_string()),
            Some((TypeChar::Uint, 4)) => self.values(|v: u32| v.to_string()),
            _ => Err(self.fault(ArrayFault::NotTexts)),
        }
    }
}

/// Checks the length of an array's header and its number of brackets before it is parsed.
///
/// The time of the parser grows exponentially with the depth of nested brackets. Bytes that are not a numpy
/// array pass this check, and the parser refuses them.
fn check_header(content: &[u8]) -> Result<(), LimitExceeded> {
    const MAGIC_AND_VERSION: usize = 8;
    let (length, begin) = match content.get(6..12) {
        Some(&[1, _, a, b, ..]) => (u32::from(u16::from_le_bytes([a, b])), MAGIC_AND_VERSION + 2),
        Some(&[_, _, a, b, c, d]) => (u32::from_le_bytes([a, b, c, d]), MAGIC_AND_VERSION + 4),
        _ => return Ok(()),
    };
    Limit::HeaderBytes.check(u64::from(length))?;
    // Brackets are counted, not matched, because a closing bracket may be inside a string.
    let header = content.iter().skip(begin).take(length as usize);
    Limit::Brackets.check(header.filter(|&&byte| matches!(byte, b'(' | b'[' | b'{')).count() as u64)
}

fn damaged(path: &Path, name: &str, cause: io::Error) -> DataError {
    DataError::Array { path: path.to_owned(), array: name.to_owned(), fault: ArrayFault::Damaged(cause) }
}

/// Writes `dataset` atomically as compressed NPZ; equal data sets give equal bytes.
///
/// # Errors
/// The data set has no trajectories, or the file cannot be written.
pub fn write_npz(dataset: &Dataset, path: &Path) -> Result<(), DataError> {
    if dataset.trajectories().is_empty() {
        return Err(DataError::NothingToWrite { path: path.to_owned() });
    }
    atomic_write(path, |file| {
        let mut archive = ZipWriter::new(file);
        let trajectories = dataset.trajectories();
        let labels = |label: fn(&crate::Trajectory) -> Option<&str>| {
            trajectories.iter().flat_map(move |t| label(t).map(|text| std::iter::repeat_n(text, t.len())))
        };
        write_texts(&mut archive, TRAJECTORY, labels(|t| Some(t.id())).flatten())?;
        if trajectories.iter().any(|t| t.group().is_some()) {
            write_texts(&mut archive, GROUP, labels(|t| t.group()).flatten())?;
        }
        write_numbers(&mut archive, TIME, trajectories.iter().flat_map(|t| t.time_s()))?;
        for (i, column) in dataset.columns().iter().enumerate() {
            write_numbers(&mut archive, column.name(), trajectories.iter().flat_map(|t| t.column(i)))?;
        }
        archive.finish().map_err(io::Error::other)?;
        Ok(())
    })?;
    Ok(())
}

/// Begins the file of the array `name` (`name.npy`) in the zip archive.
fn start_array<W: Write + io::Seek>(archive: &mut ZipWriter<W>, name: &str) -> io::Result<()> {
    let options = SimpleFileOptions::default().last_modified_time(DateTime::default()).large_file(true);
    archive.start_file(format!("{name}{EXTENSION}"), options).map_err(io::Error::other)
}

fn write_numbers<'a, W: Write + io::Seek>(
    archive: &mut ZipWriter<W>,
    name: &str,
    values: impl Iterator<Item = &'a f64> + Clone,
) -> io::Result<()> {
    start_array(archive, name)?;
    let length = values.clone().count() as u64;
    let mut writer = npyz::WriteOptions::new().default_dtype().shape(&[length]).writer(archive).begin_nd()?;
    writer.extend(values.copied())?;
    writer.finish()
}

fn write_texts<'a, W: Write + io::Seek>(
    archive: &mut ZipWriter<W>,
    name: &str,
    texts: impl Iterator<Item = &'a str> + Clone,
) -> io::Result<()> {
    start_array(archive, name)?;
    let (length, width) =
        texts.clone().fold((0, 1), |(n, width), text| (n + 1, width.max(text.chars().count())));
    let kind = format!("<U{width}").parse().map_err(io::Error::other)?;
    let options = npyz::WriteOptions::<str>::new().dtype(DType::new_scalar(kind));
    let mut writer = options.shape(&[length]).writer(archive).begin_nd()?;
    for text in texts {
        writer.push(text)?;
    }
    writer.finish()
}
