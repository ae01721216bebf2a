//! Errors of simulations.

use augsim_data::digits;
use thiserror::Error;

/// Error: a window cannot be simulated. Times are seconds since the trajectory began.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each explains its values")]
pub enum SimulationError {
    #[error("{record}: the simulation diverged at t = {time} s: rates.{state} is not finite{}", describe_cause(.cause))]
    NotFinite { record: String, time: f64, state: String, cause: Option<String> },
    #[error(
        "{record}: events.{event} fired more than {allowed} times up to t = {time} s; give it a `rest`, or check that its `set` moves `when` away from 0"
    )]
    TooManyEvents { record: String, time: f64, event: String, allowed: usize },
    #[error(
        "{record}: events.{event} fires faster and faster without end from t = {time} s on; give it a `rest`, such as rest = {{ below_m_s = 1e-3, hold = [\"x_m\"] }}"
    )]
    Zeno { record: String, time: f64, event: String },
    #[error(
        "{record}: states.{state} reaches its bound and leaves it again and again from t = {time} s on; its rate must not turn away from the bound at once where it points to it just inside"
    )]
    Chatter { record: String, time: f64, state: String },
    #[error(
        "rates.{state} is stiff: its fastest rate is {rate:.1e} per second, {ratio:.0} times the sample rate; check the unit of time (--time COLUMN:UNIT) and the values of the parameters; if both are right, set [numerics] integrator = \"implicit\", or increase sign_width"
    )]
    Stiff { state: String, rate: f64, ratio: f64 },
    #[error(
        "{record}: the pause from t = {} s to {} s is too long to simulate across (the fastest rate of rates.{state} is {rate:.1e} per second); give the rows after it a `trajectory` of their own", digits(*.from), digits(*.to)
    )]
    Pause { record: String, from: f64, to: f64, state: String, rate: f64 },
    #[error(
        "{record}: the implicit step at t = {time} s does not converge; increase substeps or sign_width under [numerics]"
    )]
    NoConvergence { record: String, time: f64 },
    #[error("{record}: {what} has {found} values, but {expected} are needed")]
    Size { record: String, what: &'static str, found: usize, expected: usize },
    #[error("{record}: samples {first} to {last} are not within its {samples} samples")]
    Samples { record: String, first: usize, last: usize, samples: usize },
    #[error(
        "{record}: time must increase from sample to sample, but {right} s follows {left} s; sort the rows"
    )]
    TimesDoNotIncrease { record: String, left: f64, right: f64 },
    #[error(
        "the parameter `{name}` has no derivative in this compiled system; include it in the active parameters when compiling"
    )]
    NotActive { name: String },
}

/// Sentence on the cause of a divergence, or general advice if the cause was not found.
fn describe_cause(cause: &Option<String>) -> String {
    cause
        .as_ref()
        .map_or_else(|| "; check the start values and parameters".to_owned(), |cause| format!(": {cause}"))
}
