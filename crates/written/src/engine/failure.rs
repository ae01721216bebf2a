//! Why a window cannot be simulated.

use thiserror::Error;

/// A simulation that failed. Times are seconds since the trajectory began.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each explains its values")]
pub enum SimulationError {
    #[error("{record}, t = {time} s: rates.{state} is not finite{}", because(.cause))]
    NotFinite { record: String, time: f64, state: String, cause: Option<String> },
    #[error(
        "{record}, t = {time} s: events.{event} fired more than {allowed} times; give it a `rest`, or check that its `set` moves `when` away from 0"
    )]
    TooManyEvents { record: String, time: f64, event: String, allowed: usize },
    #[error(
        "{record}, t = {time} s: events.{event} fires ever faster without end; give it a `rest`, such as rest = {{ below_m_s = 1e-3, hold = [\"x_m\"] }}"
    )]
    Endless { record: String, time: f64, event: String },
    #[error(
        "rates.{state} is stiff: its fastest rate is {rate:.1e} per second, {ratio:.0} times the sample rate; set [numerics] integrator = \"implicit\" or widen sign_width"
    )]
    Stiff { state: String, rate: f64, ratio: f64 },
    #[error(
        "{record}, t = {time} s: the implicit step does not converge; set [numerics] substeps to more, or widen sign_width"
    )]
    NoConvergence { record: String, time: f64 },
    #[error("{record}: {what} has {found} values, {expected} are needed")]
    Size { record: String, what: &'static str, found: usize, expected: usize },
    #[error("{record}: samples {first} to {last} do not lie within its {samples} samples")]
    Samples { record: String, first: usize, last: usize, samples: usize },
    #[error("{record}: time must rise from sample to sample, but {right} s follows {left} s; sort the rows")]
    TimesDoNotRise { record: String, left: f64, right: f64 },
    #[error(
        "parameter `{name}` has no derivative in this system: compile it with the parameter among the active ones"
    )]
    NotActive { name: String },
}

fn because(cause: &Option<String>) -> String {
    cause
        .as_ref()
        .map_or_else(|| "; check the start values and parameters".to_owned(), |cause| format!(": {cause}"))
}
