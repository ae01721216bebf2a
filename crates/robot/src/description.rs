//! A robot as its description file has it: links, joints between them, and actuators.

/// Gravity along the negative z axis of the base that simulators of robots assume where nothing is stated, m/s2.
pub const STANDARD_GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

/// Format of a description file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Unified Robot Description Format, of ROS.
    Urdf,
    /// Format of MuJoCo.
    Mjcf,
}

/// Position and orientation of a frame in another frame.
///
/// A point `p` of the frame has the coordinates `rotation * p + translation_m` in the other frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Rotation matrix, by rows; its columns are the axes of the frame in the other frame.
    pub rotation: [[f64; 3]; 3],
    /// Origin of the frame in the other frame, m.
    pub translation_m: [f64; 3],
}

impl Placement {
    /// The placement of a frame in itself.
    pub const IDENTITY: Placement =
        Placement { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation_m: [0.0; 3] };
}

/// Mass, centre of mass and inertia of a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertia {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass in the frame of the link, m.
    pub centre_m: [f64; 3],
    /// Moments xx, yy, zz and products xy, xz, yz of the inertia tensor about the centre of mass, along the axes of the
    /// link frame, kg m2. The products are elements of the tensor: xy is minus the integral of x y dm.
    pub inertia_kg_m2: [f64; 6],
}

/// A rigid link.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Name of the link; a body of an MJCF file without a name is called `body1`, `body2` and so on, in the order of the file.
    pub name: String,
    /// Line of the link in the file, from 1.
    pub line: usize,
    /// Inertia of the link; `None` if the file states none, as for a base or a frame.
    pub inertia: Option<Inertia>,
    /// Origin of the link frame in the frame of the body of an MJCF file, m.
    ///
    /// The frame of a link is at its joint, while a body of an MJCF file has its joint at `pos`. Zero in a URDF file.
    pub shift_m: [f64; 3],
}

/// Motion that a joint allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// None: the child link is rigidly attached.
    Fixed,
    /// Rotation about the axis; positions in rad, torques in N m.
    Revolute,
    /// Translation along the axis; positions in m, forces in N.
    Prismatic,
}

/// Coupling of a joint to another one: position = `ratio` * position of the other joint + `offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Coupling {
    /// Index of the other joint.
    pub joint: usize,
    /// Factor of the other joint's position.
    pub ratio: f64,
    /// Position of this joint where the other one is at 0, rad or m.
    pub offset: f64,
}

/// A joint between a parent and a child link.
///
/// The joint frame is the frame of the child link. At joint position `q` the child frame is `placement` in the frame of the
/// parent, then turned by `q - reference` about `axis` (revolute), or moved by it along `axis` (prismatic).
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Name of the joint.
    pub name: String,
    /// Line of the joint in the file, from 1.
    pub line: usize,
    /// Motion that the joint allows.
    pub kind: JointKind,
    /// Index of the parent link.
    pub parent: usize,
    /// Index of the child link.
    pub child: usize,
    /// Placement of the child frame in the parent frame at the position `reference`.
    pub placement: Placement,
    /// Axis of the motion in the child frame, of length 1.
    pub axis: [f64; 3],
    /// Joint position at which the child frame is at `placement`, rad or m; 0 in a URDF file, `ref` in an MJCF file.
    pub reference: f64,
    /// Smallest and largest joint position, rad or m; `None` if unlimited.
    pub range: Option<[f64; 2]>,
    /// Largest torque or force of the drive, N m or N; `None` if the file states none.
    pub effort: Option<f64>,
    /// Viscous friction, N m s/rad or N s/m.
    pub damping: f64,
    /// Coulomb friction, N m or N.
    pub friction_loss: f64,
    /// Inertia of the rotor, seen at the joint, kg m2 or kg.
    pub armature: f64,
    /// Stiffness of a spring in the joint, N m/rad or N/m.
    pub stiffness: f64,
    /// Joint position at which the spring is at rest, rad or m.
    pub spring_reference: f64,
    /// Coupling to another joint (`mimic` in URDF, `equality/joint` in MJCF); `None` for an independent joint.
    pub coupling: Option<Coupling>,
}

/// What an actuator of an MJCF file, or a transmission of a URDF file, does with its command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// The command is a force: joint torque = gear * command.
    Motor,
    /// Position loop: force = kp * (command - length) - kv * speed, with length = gear * joint position.
    Position {
        /// Gain of the position error, N m/rad or N/m.
        kp: f64,
        /// Gain of the speed, N m s/rad or N s/m.
        kv: f64,
    },
    /// Speed loop: force = kv * (command - speed).
    Velocity {
        /// Gain of the speed error, N m s/rad or N s/m.
        kv: f64,
    },
}

/// An actuator of a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Actuator {
    /// Name of the actuator; that of its joint if the file states none.
    pub name: String,
    /// Line of the actuator in the file, from 1.
    pub line: usize,
    /// Index of the joint.
    pub joint: usize,
    /// What the actuator does with its command.
    pub drive: Drive,
    /// Gear ratio: joint torque = gear * force of the actuator.
    pub gear: f64,
    /// Smallest and largest command; `None` if unlimited.
    pub command_range: Option<[f64; 2]>,
    /// Smallest and largest force before the gear, N m or N; `None` if unlimited.
    pub force_range: Option<[f64; 2]>,
}

/// An element of the file that is not supported.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unsupported {
    /// The element and its name, such as ``tendon `cable` ``.
    pub element: String,
    /// Line of the element in the file, from 1.
    pub line: usize,
    /// Indices of the joints whose motion the element changes; a model with one of these joints is an error.
    pub joints: Vec<usize>,
}

/// A robot as its description file has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Name of the robot.
    pub name: String,
    /// Name of the description file, for messages.
    pub file: String,
    /// Format of the description file.
    pub format: Format,
    /// Links; the root of the tree is the base, which does not move.
    pub links: Vec<Link>,
    /// Joints, fixed ones included.
    pub joints: Vec<Joint>,
    /// Actuators.
    pub actuators: Vec<Actuator>,
    /// Acceleration of gravity in the frame of the base, m/s2; `None` if the file does not state it, as in URDF.
    pub gravity_m_s2: Option<[f64; 3]>,
    /// Elements of the file that are not supported.
    pub unsupported: Vec<Unsupported>,
}

impl Robot {
    /// Index of the joint with this name; `None` if there is none.
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Index of the link with this name; `None` if there is none.
    pub fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }
}
