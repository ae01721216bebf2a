//! The library of effects: one file per effect, registered here by name.
//!
//! To add one: write `effects/my_effect.rs` on the pattern of its neighbours (a unit struct, a `static SPEC`, the hooks of
//! [`Law`] that it needs), then add one line to the registry below. Everything else (model files, search, reports, the
//! tests that run over the registry) finds it there.

mod law;
mod registry;
mod scatter;
mod spec;
mod table;

pub use law::{Effect, Flight, Law, Sight};
pub use registry::{all, index_of, nearest_kind, spec_of};
pub use scatter::{SCATTER_KIND, SCATTER_SPEC, ScatterPer};
pub use spec::{EffectSpec, Location, Needs, ParameterSpec};
pub use table::{Against, TABLE_KIND, Table, Target};
