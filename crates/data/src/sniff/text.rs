//! Bytes of a file as text.

use encoding_rs::{Encoding, WINDOWS_1252};

/// Encodings without a byte order mark are told apart by this many bytes.
const TELLING: usize = 4096;

/// Text of a file and, where it is not plain UTF-8, what it was; `None` where the bytes are no text.
pub(super) fn decoded(bytes: &[u8]) -> Option<(String, Option<&'static str>)> {
    if let Some((encoding, length)) = Encoding::for_bom(bytes) {
        let (text, broken) = encoding.decode_without_bom_handling(&bytes[length..]);
        let note = (encoding != encoding_rs::UTF_8).then_some(encoding.name());
        return (!broken).then(|| (text.into_owned(), note));
    }
    if let Ok(text) = std::str::from_utf8(bytes) {
        return is_text(bytes).then(|| (text.to_owned(), None));
    }
    // Spreadsheets of old write the letters of western Europe, one byte each.
    let (text, _, broken) = WINDOWS_1252.decode(bytes);
    (!broken && is_text(bytes)).then(|| (text.into_owned(), Some(WINDOWS_1252.name())))
}

/// Whether there are no control characters but tabs and line ends at the beginning.
fn is_text(bytes: &[u8]) -> bool {
    let control = |b: &u8| b.is_ascii_control() && !matches!(b, b'\t' | b'\n' | b'\r' | 0x0c);
    !bytes.iter().take(TELLING).any(control)
}
