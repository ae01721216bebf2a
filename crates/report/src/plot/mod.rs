//! Elements that all figures share: scales, ticks, paths, text, colours, the frame.

pub(crate) mod frame;
pub(crate) mod marker;
pub(crate) mod palette;
pub(crate) mod path;
pub(crate) mod scale;
pub(crate) mod text;
pub(crate) mod ticks;
