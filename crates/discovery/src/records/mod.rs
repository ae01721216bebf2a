//! Measured records: split into parts and windows, and as fits use them.

pub(crate) mod parts;
mod view;

pub(crate) use view::View;
