//! Colours of a discovery.

use crate::figure::Tone;

/// Colours of the stages, the same in the whole report.
pub(super) const BEFORE: Tone = Tone::Series(1);
pub(super) const AFTER: Tone = Tone::Series(0);
