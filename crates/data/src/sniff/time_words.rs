//! Words that name a column of time.

/// Words that name a time column.
pub(super) const TIME_WORDS: [&str; 22] = [
    "time",
    "t",
    "zeit",
    "temps",
    "tiempo",
    "tempo",
    "timestamp",
    "timestamps",
    "stamp",
    "clock",
    "sec",
    "secs",
    "seconds",
    "elapsed",
    "ms",
    "date",
    "datetime",
    "utc",
    "uhrzeit",
    "datum",
    "epoch",
    "unix",
];

/// Whether a word is part of the name of a time column.
pub(super) fn is_time_word(word: &str) -> bool {
    TIME_WORDS.contains(&word)
}
