//! What the tests share.

pub mod battery;
pub mod sealed;
