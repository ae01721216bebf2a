//! Why a description and a choice of joints are no tree of moving bodies.

/// Why a [`Tree`](super::Tree) cannot be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TreeError {
    /// No joint has this name.
    #[error("`{file}` has no joint `{joint}`{suggestion}")]
    UnknownJoint {
        /// Name of the description file.
        file: String,
        /// The unknown name.
        joint: String,
        /// The closest name of a joint, or all of them.
        suggestion: String,
    },
    /// A moving joint is named twice.
    #[error("joint `{joint}` is named twice; name each moving joint once")]
    NamedTwice {
        /// Name of the joint.
        joint: String,
    },
    /// A fixed joint is named as a moving or as a locked one.
    #[error("joint `{joint}` ({file}, line {line}) is fixed and cannot move; remove its name")]
    Fixed {
        /// Name of the description file.
        file: String,
        /// Name of the joint.
        joint: String,
        /// Line of the joint in the file, from 1.
        line: usize,
    },
    /// A joint that follows another one is named as a moving one.
    #[error(
        "joint `{joint}` ({file}, line {line}) follows joint `{leader}`; name `{leader}` instead, `{joint}` then moves with it"
    )]
    Coupled {
        /// Name of the description file.
        file: String,
        /// Name of the joint.
        joint: String,
        /// Line of the joint in the file, from 1.
        line: usize,
        /// Name of the joint that it follows.
        leader: String,
    },
    /// A joint is both moving and locked.
    #[error("joint `{joint}` is both moving and locked; remove it from one of the two")]
    MovingAndLocked {
        /// Name of the joint.
        joint: String,
    },
    /// A joint that follows a moving joint is locked.
    #[error(
        "joint `{joint}` is locked, but it moves with joint `{leader}`; unlock it, or lock `{leader}` too"
    )]
    LockedFollower {
        /// Name of the locked joint.
        joint: String,
        /// Name of the moving joint.
        leader: String,
    },
    /// A locked position is not a finite number.
    #[error("the locked position of joint `{joint}` is not a finite number; state it in rad or m")]
    LockedNotFinite {
        /// Name of the joint.
        joint: String,
    },
    /// Couplings form a circle.
    #[error("joint `{joint}` ({file}, line {line}) follows itself through its couplings; remove one of them")]
    CircularCoupling {
        /// Name of the description file.
        file: String,
        /// Name of the joint.
        joint: String,
        /// Line of the joint in the file, from 1.
        line: usize,
    },
    /// Links and joints form a loop.
    #[error(
        "link `{link}` ({file}, line {line}) is part of a loop of joints or the child of two joints; only trees are supported"
    )]
    Loop {
        /// Name of the description file.
        file: String,
        /// Name of the link.
        link: String,
        /// Line of the link in the file, from 1.
        line: usize,
    },
    /// An element that is not supported changes the motion of a named joint.
    #[error(
        "{element} ({file}, line {line}) is not supported and acts on joint `{joint}`; remove the element, or leave the joint out so that it is locked"
    )]
    Unsupported {
        /// Name of the description file.
        file: String,
        /// The element and its name.
        element: String,
        /// Line of the element in the file, from 1.
        line: usize,
        /// Name of the joint.
        joint: String,
    },
    /// The inertia that a joint moves is 0 or negative, so that its acceleration is undefined.
    #[error(
        "joint `{joint}` ({file}, line {line}) moves no positive inertia; give a link that it moves a mass and an inertia, or give the joint an armature"
    )]
    NoInertia {
        /// Name of the description file.
        file: String,
        /// Name of the joint.
        joint: String,
        /// Line of the joint in the file, from 1.
        line: usize,
    },
}
