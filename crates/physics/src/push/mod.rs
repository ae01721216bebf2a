//! Planar pushing of an object on a table by one round rod: quasi-static (limit surfaces) or with inertia.
//!
//! A [`World`] holds an [`Object`] and the effects that act on it. Parameter values are in a flat vector
//! (`c_m`, `contact_friction`, `rod_radius_m`, `support_friction`, `mass_kg`, then those of the effects), as
//! plain numbers or as dual numbers. [`simulate`] moves the rod along a [`Path`] and samples the pose of the
//! object; [`simulate_batch`] does so for many pushes in parallel; [`simulate_poses`] takes longer sub-steps
//! and interpolates between them; a [`Stepper`] moves the object from one sample to the next.
//!
//! ```
//! use augsim_physics::push::{Object, Pose, Push, Run, Steps, StraightPush, World, simulate};
//!
//! let world = World::new(Object::named("rect1").expect("built in"));
//! let parameters = world.nominal();
//! let path = StraightPush {
//!     start_m: [-0.018, 0.04975],
//!     direction: [0.0, -1.0],
//!     speed_m_s: 0.02,
//!     acceleration_m_s2: 0.0,
//!     travel_m: 0.15,
//! };
//! let push = Push {
//!     world: &world,
//!     parameters: &parameters,
//!     start: Pose::new(0.0, 0.0, 0.0),
//!     path: &path,
//!     field: None,
//!     steps: Steps::default(),
//! };
//! let mut run = Run::default();
//! simulate(&push, &[0.0, 3.75, 7.5], &mut run).expect("the rod starts outside");
//! let end = run.poses[2];
//! assert!((end.position[0] - 0.04028).abs() < 1e-5 && (end.angle - 1.26248).abs() < 1e-5);
//! ```

mod batch;
mod contact;
mod contact_solver;
mod covariates;
pub mod effects;
mod engine;
mod field;
mod instant;
pub mod laboratory;
mod moments;
mod object;
mod objection;
mod outline;
mod path;
pub mod planar;
mod poses;
mod preconditions;
mod response;
mod segments;
mod setting;
mod substep;
mod support;
pub mod surface;
mod system;
mod top_view;
mod warm_start;
mod world;

pub use batch::simulate_batch;
pub use contact::{ContactFriction, Mode, Response, Touch};
pub use engine::{Push, PushError, Run, StepResult, Stepper, Steps, simulate, simulate_in_progress};
pub use field::Field;
pub use instant::Instant;
pub use moments::{Moments, mean_radius};
pub use object::{OBJECTS, Object};
pub use outline::{Nearest, Outline, Polygon};
pub use path::{Motion, Path, Recorded, Straight, StraightPiece, StraightPush, simplify_path};
pub use planar::{Pose, Rotation, Twist, Wrench};
pub use poses::simulate_poses;
pub use response::respond;
pub use setting::{Anisotropy, Friction, GRAVITY_M_S2, Setting};
pub use support::{Inertia, Support};
pub use system::{PushDeclaration, Pushing};
pub use world::{
    BASE_PARAMETERS, C_INDEX, CONTACT_FRICTION_INDEX, MASS_INDEX, ROD_RADIUS_INDEX, SUPPORT_FRICTION_INDEX,
    Term, World,
};
