//! The kinds of trap sets (peculiarities that are no missing effect), and which answers to them are right.

use super::plants::Law;

/// Class of a trap set (a set whose peculiarity is no missing effect); it decides which answers are right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// The model is right and only noise or sampling is unusual; `nothing-to-add` is right.
    Noise,
    /// The log is faulty; rejection of the data is right, or any verdict that names no absent effect.
    Logging,
    /// The true system has an unlisted defect; a verdict that reports it and names no effect is right.
    Defect,
    /// The true system has an effect that the model declares too; `nothing-to-add` is right.
    Declared,
}

/// Measurement noise of a data set, in units of the sensor's standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// Independent normal errors with the sensor's standard deviation.
    White,
    /// AR(1) errors with this correlation from one sample to the next and the same variance as white ones.
    Correlated(f64),
    /// Values rounded to multiples of this many standard deviations, after white noise of 0.3 of them.
    Quantised(f64),
    /// White noise plus errors of 2 % of the measured value.
    Multiplicative,
    /// Laplace-distributed errors of unit variance.
    Laplace,
    /// Errors of Student's t distribution with three degrees of freedom, scaled to unit variance.
    Student,
    /// White noise, and outliers of 15 to 40 standard deviations in 1 % of the samples.
    Outliers,
    /// White noise whose standard deviation is multiplied by 0.3 to 3, drawn per recording.
    PerRecording,
    /// White noise whose standard deviation grows from 0.3 to 3 times its value along each recording.
    Growing,
    /// White noise of 0.1 % of the sensor's standard deviation.
    Tiny,
    /// White noise and a sine of half its size at 0.37 cycles per sample, with a phase drawn per recording.
    Hum,
}

/// Unusual number, length or equality of the recordings of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Every recording has the same input and the same initial state.
    Repeats,
    /// One recording of 800 samples.
    One,
    /// Ten recordings of 15 samples.
    VeryShort,
    /// Forty recordings of 25 samples.
    ManyShort,
}

/// A fault between the rig and the data file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Logging {
    /// The input is logged this many samples late (early if negative).
    InputLate(isize),
    /// The model declares a zero-order hold, but the true input is linear between samples.
    LinearHold,
    /// The input of one recording has the other sign.
    SignInOne,
    /// The clock of one recording is in milliseconds.
    MillisecondsInOne,
    /// The column of the second output is a copy of the first.
    Duplicate,
    /// The first output of one recording is 1000 times too large.
    ThousandInOne,
    /// The input is in thousands of its declared unit.
    Kilo,
    /// The clock is in minutes, but its column name says seconds.
    Minutes,
    /// Outputs were smoothed beforehand (Savitzky-Golay, quadratic, 11 samples).
    Smoothed,
    /// The first sensor settles with a time constant of four samples.
    SettlingSensor,
    /// The input has the other sign in every recording.
    SignReversed,
    /// Recordings are joined in pairs, with a continuous clock.
    Concatenated,
    /// Outputs were measured at every sixth sample and interpolated linearly.
    Resampled,
    /// Three measured values have lost their decimal point.
    MissingDecimal,
    /// The columns of the two outputs are swapped.
    Swapped,
}

/// A defect of the true system that no effect of the library describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Defect {
    /// The first parameter is 1.5 times as large in one recording.
    ParameterInOne,
    /// The second parameter grows by 2 % from each recording to the next.
    DriftBetween,
    /// The surroundings differ in one recording (a tilt, the temperature of the room, an inflow).
    SurroundingsInOne,
    /// A hidden state stores and returns part of the driving quantity.
    HiddenLag,
    /// The rig is bumped once, in one recording.
    Bump,
    /// The second parameter is 1.25 times as large in the second half of each recording.
    StepHalfWay,
}

/// The one peculiarity of a trap set (a test set that must not be answered by an effect).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trap {
    /// Unusual measurement noise.
    Noise(Noise),
    /// 15 % of the output cells are empty, one by one.
    DropOuts,
    /// Runs of 10 to 25 cells are empty, one in each output of each recording.
    DropOutRuns,
    /// The second sensor is sampled at every fifth sample only.
    TwoRates,
    /// Time stamps have errors of up to 3 % of the sampling interval.
    Jitter,
    /// Sampling intervals vary between 0.5 and 1.5 times their mean, with right time stamps.
    Uneven,
    /// Process noise acts on a rate; holds its RMS relative to that of the rate.
    ProcessNoise(f64),
    /// The input comes from a PI controller that reads the measured output.
    ClosedLoop,
    /// All parameters are frozen at their true values.
    Frozen,
    /// Unusual number, length or equality of the recordings.
    Layout(Layout),
    /// A fault between the rig and the data file.
    Logging(Logging),
    /// A defect of the true system that no effect of the library describes.
    Defect(Defect),
    /// An effect of the true system that the model declares too.
    Declared(Law),
}

/// A kind of test set: a peculiarity that is no missing effect, and effects that answers may name.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Short name of the kind, for reports.
    pub name: &'static str,
    /// The peculiarity of sets of this kind.
    pub trap: Trap,
    /// Effects that are equivalent to the peculiarity, so that an answer may name them.
    ///
    /// To first order, another input hold is a shift by half a sample, and `input-delay` says that it may
    /// stand for one.
    pub allowed: &'static [&'static str],
}

impl Kind {
    /// Class of this kind, which decides which answers are right.
    pub fn class(&self) -> Class {
        match self.trap {
            Trap::Logging(_) => Class::Logging,
            Trap::Defect(_) => Class::Defect,
            Trap::Declared(_) => Class::Declared,
            _ => Class::Noise,
        }
    }

    /// Whether the peculiarity needs two outputs; then both sensors of a plant are measured.
    pub fn needs_two_outputs(&self) -> bool {
        use Logging::{Duplicate, Swapped};
        matches!(self.trap, Trap::TwoRates | Trap::Logging(Duplicate | Swapped))
    }
}

/// Makes a [`Kind`] without allowed effects.
const fn kind(name: &'static str, trap: Trap) -> Kind {
    Kind { name, trap, allowed: &[] }
}

/// Makes a [`Kind`] of unusual measurement noise.
const fn noise(name: &'static str, noise: Noise) -> Kind {
    kind(name, Trap::Noise(noise))
}

/// Makes a [`Kind`] with an unusual number or length of recordings.
const fn layout(name: &'static str, layout: Layout) -> Kind {
    kind(name, Trap::Layout(layout))
}

/// Makes a [`Kind`] of a logging fault; answers may name the effects `allowed`.
const fn logging(name: &'static str, fault: Logging, allowed: &'static [&'static str]) -> Kind {
    Kind { name, trap: Trap::Logging(fault), allowed }
}

/// Makes a [`Kind`] of a defect of the true system.
const fn defect(name: &'static str, defect: Defect) -> Kind {
    kind(name, Trap::Defect(defect))
}

/// Makes a [`Kind`] whose true effect the model declares too.
const fn declared(name: &'static str, law: Law) -> Kind {
    kind(name, Trap::Declared(law))
}

/// All kinds of trap sets (test sets whose peculiarity is no missing effect).
///
/// Classes are mixed, so that a short run has each of them; the first 40 kinds give 120 sets.
pub const KINDS: [Kind; 55] = [
    noise("white noise", Noise::White),
    logging("input early by 4 samples", Logging::InputLate(-4), &["input-delay", "sensor-delay"]),
    defect("first parameter differs in one recording", Defect::ParameterInOne),
    noise("AR(1) noise, 0.9", Noise::Correlated(0.9)),
    logging("second column copies the first", Logging::Duplicate, &[]),
    kind("closed loop", Trap::ClosedLoop),
    declared("dry law declared with sign", Law::Sign),
    logging("one recording in milliseconds", Logging::MillisecondsInOne, &[]),
    noise("multiplicative noise", Noise::Multiplicative),
    logging("smoothed beforehand", Logging::Smoothed, &[]),
    defect("second parameter drifts between recordings", Defect::DriftBetween),
    kind("two sensors of different rates", Trap::TwoRates),
    logging("input late by 4 samples", Logging::InputLate(4), &["input-delay"]),
    noise("outliers", Noise::Outliers),
    logging("input in thousands of its unit", Logging::Kilo, &["input-gain"]),
    kind("process noise of 3 %", Trap::ProcessNoise(0.03)),
    declared("saturated input declared", Law::Saturation),
    kind("drop-outs at random", Trap::DropOuts),
    logging("settling sensor", Logging::SettlingSensor, &["sensor-lag"]),
    defect("surroundings differ in one recording", Defect::SurroundingsInOne),
    noise("coarse quantisation", Noise::Quantised(4.0)),
    logging("sign of the input in one recording", Logging::SignInOne, &[]),
    kind("all parameters frozen at the truth", Trap::Frozen),
    logging("straight input under a zero-order hold", Logging::LinearHold, &["input-delay"]),
    noise("noise differs per recording", Noise::PerRecording),
    defect("bumped once", Defect::Bump),
    logging("one recording 1000 times too large", Logging::ThousandInOne, &[]),
    kind("uneven sampling", Trap::Uneven),
    logging("recordings joined", Logging::Concatenated, &[]),
    noise("Student noise", Noise::Student),
    defect("hidden lag", Defect::HiddenLag),
    layout("one recording", Layout::One),
    logging("resampled", Logging::Resampled, &[]),
    noise("noise grows with time", Noise::Growing),
    logging("columns swapped", Logging::Swapped, &[]),
    layout("very short recordings", Layout::VeryShort),
    declared("dry law declared smooth", Law::Smooth),
    noise("AR(1) noise, 0.95", Noise::Correlated(0.95)),
    defect("second parameter steps half-way", Defect::StepHalfWay),
    kind("drop-outs in runs", Trap::DropOutRuns),
    noise("AR(1) noise, 0.5", Noise::Correlated(0.5)),
    logging("sign of the input reversed", Logging::SignReversed, &["input-gain"]),
    noise("fine quantisation", Noise::Quantised(1.0)),
    logging("clock in minutes", Logging::Minutes, &[]),
    noise("Laplace noise", Noise::Laplace),
    logging("decimal points lost", Logging::MissingDecimal, &[]),
    noise("tiny noise", Noise::Tiny),
    declared("range of the sensor declared", Law::SensorRange),
    noise("mains hum", Noise::Hum),
    kind("process noise of 1 %", Trap::ProcessNoise(0.01)),
    kind("jittered stamps", Trap::Jitter),
    declared("delay of the input declared", Law::Delay),
    layout("many short recordings", Layout::ManyShort),
    layout("identical recordings", Layout::Repeats),
    logging("input late by 1 sample", Logging::InputLate(1), &["input-delay"]),
];
