//! Line numbers of positions in a text.

/// Starts of the lines of a text, so that a line number takes a binary search and not a pass over the file.
#[derive(Debug)]
pub(crate) struct Lines {
    starts: Vec<usize>,
}

impl Lines {
    /// Finds the lines of a text.
    pub fn new(text: &str) -> Lines {
        let breaks = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(k, _)| k + 1);
        Lines { starts: std::iter::once(0).chain(breaks).collect() }
    }

    /// Line of a byte of the text, from 1.
    pub fn line(&self, position: usize) -> usize {
        self.starts.partition_point(|start| *start <= position)
    }
}
