//! Error of a sweep with failed tasks.

/// Error of a sweep in which tasks failed; the first failure determines the exit code.
#[derive(Debug)]
pub struct TaskFailed {
    /// Index of the first failed task.
    pub index: usize,
    /// Number of tasks of the sweep that failed.
    pub failures: usize,
    /// Exit code of the first failed task.
    pub code: u8,
    /// Error message of the first failed task.
    pub error: String,
}

impl std::fmt::Display for TaskFailed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.failures {
            1 => write!(f, "task {} failed: {}", self.index, self.error),
            n => write!(f, "{n} tasks failed, the first of them task {}: {}", self.index, self.error),
        }
    }
}

impl std::error::Error for TaskFailed {}
