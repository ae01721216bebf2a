//! Measured pushes: the published MIT Push files, streams with separate clocks, frames and resampling.
//!
//! A set of pushes is a [`Dataset`](crate::Dataset) with the columns `pusher_x_m, pusher_y_m` (centre of the
//! rod), `x_m, y_m, theta_rad` (pose of the object's area centroid) and, where measured, `force_x_N,
//! force_y_N` (force on the rod), in the frame of the robot's base, z up. Where rod, object and force have
//! separate clocks, the rows are at the union of their times, and `pusher_new`, `object_new`, `force_new` are
//! 1 at the fresh samples of each stream. Only these are observations; the values between them are
//! interpolated.
//!
//! The clocks of robot and motion capture may be about 10 ms apart, which is not corrected here. A rod in
//! contact then seems to penetrate the moving object, by 0.5 mm at 50 mm/s and by 1.2 mm in the official
//! trial at 150 mm/s.
//!
//! [`read_push_trials`] reads the published files as they are, and [`read_push_dataset`] as a data set of
//! this form. [`resample`] converts it to a constant sample rate, [`in_start_frame`] to the frame of the
//! object's first pose. Other sets are read by [`convert`](crate::convert).

pub(crate) mod archive;
mod collection;
mod error;
mod fault;
mod frame;
mod hdf5;
mod json;
mod resample;
mod stream;
mod trial;
mod trial_name;
pub(crate) mod union_clock;

pub(crate) use collection::read_push_dataset_bytes;
pub use collection::{read_push_dataset, read_push_trials};
pub use error::PushError;
pub use fault::{FilePart, NameFault, StreamLayout};
pub use frame::{PlanarPose, in_start_frame};
pub(crate) use resample::FRESH_SUFFIX;
pub use resample::resample;
pub use stream::Stream;
pub use trial::PushTrial;
pub(crate) use trial::{TRIAL_COLUMNS, holds_trials, is_hdf5, is_named_like_a_trial};
pub use trial_name::{Block, Motion, PushShape, Surface, TrialName};
