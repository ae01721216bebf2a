//! Decodes the bytes of a file as text.

use encoding_rs::{Encoding, WINDOWS_1252};

/// Number of bytes at the start of a file that are searched for control characters.
const CHECKED_BYTES: usize = 4096;

/// Decodes a file as text and names its encoding where that is not UTF-8; `None` where it is not text.
pub(super) fn decode(bytes: &[u8]) -> Option<(String, Option<&'static str>)> {
    if let Some((encoding, length)) = Encoding::for_bom(bytes) {
        let (text, has_errors) = encoding.decode_without_bom_handling(&bytes[length..]);
        let note = (encoding != encoding_rs::UTF_8).then_some(encoding.name());
        return (!has_errors).then(|| (text.into_owned(), note));
    }
    if let Ok(text) = std::str::from_utf8(bytes) {
        return is_text(bytes).then(|| (text.to_owned(), None));
    }
    // Old spreadsheets write western European text with one byte per character.
    let (text, _, has_errors) = WINDOWS_1252.decode(bytes);
    (!has_errors && is_text(bytes)).then(|| (text.into_owned(), Some(WINDOWS_1252.name())))
}

/// Whether the start of a file has no control characters other than tabs, line ends and form feeds.
fn is_text(bytes: &[u8]) -> bool {
    let is_control = |b: &u8| b.is_ascii_control() && !matches!(b, b'\t' | b'\n' | b'\r' | 0x0c);
    !bytes.iter().take(CHECKED_BYTES).any(is_control)
}
