#![doc = include_str!("../README.md")]

mod bounded_step;
mod candidate;
mod draw;
mod error;
mod evidence;
mod explanation;
mod joint;
mod limits;
mod linearise;
mod noise_free;
mod posterior;
mod posterior_sample;
mod projection;
mod promise;
mod reduced;
mod score;
mod search;
mod shape;
mod verdict;
mod whiten;

pub use candidate::{Candidate, Experiment};
pub use draw::{draw_recording, draw_values, nominal_run};
pub use error::DesignError;
pub use evidence::Evidence;
pub use explanation::{Explanation, Noise, RateNoise, SensorNoise, factor_of};
pub use limits::{InputLimits, Limits};
pub use linearise::START_SAMPLES;
pub use posterior::after_recordings;
pub use posterior_sample::PosteriorSample;
pub use promise::{PROMISED_SHARE, Promise, TruthPromise, promise};
pub use search::{Request, Run, choose, design, random_run, weights};
pub use shape::{FAMILIES, Family, Shape};
pub use verdict::{Judgement, Tally, Verdict, judge};
