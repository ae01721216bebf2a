//! Tasks that failed, for whoever started them.

/// Tasks of a sweep failed; the first of them decides the exit code.
#[derive(Debug)]
pub struct TaskFailed {
    /// Place of the first that failed.
    pub index: usize,
    /// Number of tasks that failed.
    pub failures: usize,
    /// Exit code of the task.
    pub code: u8,
    /// The sentence that it ended with.
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
