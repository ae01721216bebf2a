//! Measured records: read, cut into parts and windows, and as fits see them.

pub(crate) mod parts;
mod view;

pub(crate) use view::View;
