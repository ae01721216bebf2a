//! The next experiment: designed to separate the live explanations of the data, and judged when it has come.
//!
//! `docs/next.md` has the formulas.

mod evidence;
mod explanation;
mod fault;
mod known;
mod limits;
mod listen;
mod page;
mod plan;
mod source;
mod sources;
mod state;
mod text;

pub use fault::NextFault;
pub use known::{Known, recordings};
pub use limits::{default_limits, read_limits};
pub use listen::{ListenRequest, listen};
pub use page::{listen_page, plan_page};
pub use plan::{PlanOptions, Planned, evidence};
pub use source::Source;
pub use sources::sources;
pub use state::{Explained, HeardRun, PlannedRun, PromiseOf, RunOdds, State};
pub use text::{listen_text, plan_text};
