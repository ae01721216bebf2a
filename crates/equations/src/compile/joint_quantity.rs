//! The quantities of a robot's joints that are compiled together.

/// The quantity of the joints that an expression uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum JointQuantity {
    /// Torque by inverse dynamics, without the effects on joints.
    RigidTorque,
    /// Torque by inverse dynamics, minus the torques of the effects on joints.
    Torque,
    /// Acceleration by forward dynamics, with the torques of the effects on joints.
    Acceleration,
}
