//! Corpus: inputs that once broke a file reader. Small ones are committed as `corpus/READER/CASE/`; large
//! ones are generated here.

use crate::envelope::{Envelope, gzipped, zipped};
use crate::reader::{Files, Reader};
use crate::verdict::Verdict;
use std::fs;
use std::io;
use std::path::Path;

/// One input that once broke a file reader.
#[derive(Debug, Clone)]
pub struct Case {
    /// Name of the file reader.
    pub reader: String,
    /// Descriptive name of the input.
    pub name: String,
    /// Input files of the reader.
    pub files: Files,
}

/// Returns all inputs of the corpus: the committed and the generated ones.
///
/// # Errors
/// The corpus cannot be read.
pub fn cases() -> io::Result<Vec<Case>> {
    let mut cases = Vec::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    for reader in subfolders(&root)? {
        for name in subfolders(&root.join(&reader))? {
            let files = Files::read(&root.join(&reader).join(&name))?;
            cases.push(Case { reader: reader.clone(), name, files });
        }
    }
    cases.extend(generated()?);
    Ok(cases)
}

/// Names of the subfolders of a folder, sorted.
fn subfolders(path: &Path) -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(path)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    names.sort_unstable();
    Ok(names)
}

/// Generates the inputs of the corpus that are large and simple.
fn generated() -> io::Result<Vec<Case>> {
    let case =
        |reader: &str, name: &str, files: Files| Case { reader: reader.into(), name: name.into(), files };
    // Repeated lines compress a hundredfold: unpacked, this file exceeds both the limit and the memory.
    let row = b"a,0,1\n".repeat(1 << 20);
    let bomb = [gzipped(b"trajectory,t_s,height_m\n")?, gzipped(&row)?.repeat(128)].concat();
    let header = |descr: &str, shape: &str| {
        let text = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}");
        [b"\x93NUMPY\x01\x00".as_slice(), &(text.len() as u16).to_le_bytes(), text.as_bytes()].concat()
    };
    let npz = |array: Vec<u8>| io::Result::Ok(Files::one("data.npz", zipped(&[("t_s.npy".into(), array)])?));
    let columns: Vec<String> = (0..100_000).map(|k| format!("x{k}_m")).collect();
    let wide = format!("trajectory,t_s,{}\na,0{}\n", columns.join(","), ",1".repeat(columns.len()));
    let long_cell = format!("trajectory,t_s,height_m\na,0,{}\n", "x".repeat(50 << 20));
    Ok(vec![
        case("csv-gzip", "bomb", Files::one("data.csv.gz", bomb)),
        case("npz", "nested-brackets", npz(header(&"[".repeat(200), "(1,)"))?),
        case("npz", "text-of-nine-exabytes", npz(header("'|S9223372036854775807'", "(1,)"))?),
        case("npz", "shape-of-everything", npz(header("'<f8'", "(18446744073709551615,)"))?),
        case("csv", "hundred-thousand-columns", Files::one("data.csv", wide)),
        case("csv", "cell-of-50-megabytes", Files::one("data.csv", long_cell)),
    ])
}

/// Five readers that misbehave on purpose, to test that the harness notices (see `tests/corpus.rs`).
pub fn deliberate() -> [Reader; 5] {
    let reader = |name, read| Reader { name, envelope: Envelope::Plain, takes_folder: true, read };
    [
        reader("deliberate-panic", |path: &Path| panic!("a deliberate panic at {}", path.display())),
        reader("deliberate-hang", |_| {
            loop {
                std::thread::sleep(std::time::Duration::from_millis(10));
            }
        }),
        reader("deliberate-flood", |_| match vec![1_u8; 1 << 30].iter().all(|b| *b == 1) {
            true => Verdict::Accepted,
            false => Verdict::Refused,
        }),
        reader("deliberate-escape", |path| crate::verdict::refusal(path, &"a cell holds \u{1b}[31m")),
        reader("deliberate-chatter", |path| crate::verdict::refusal(path, &"x".repeat(100_000))),
    ]
}
