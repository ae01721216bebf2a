//! Writes the text of a model file for a robot: its joints, friction, drives and free parameters.

use augsim_data::digits;
use augsim_equations::model::plain_name;
use augsim_robot::Robot;
use augsim_robot::description::{Drive, Joint, JointKind};
use augsim_robot::signals::Preparation;
use std::fmt::Write;

/// How the motion of a robot and its torques are related in a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Formulation {
    /// The measured motion is the input, and the torque of each drive is the output.
    Inverse,
    /// The torque of each drive, or its commanded position, is the input, and the motion is the output.
    Forward,
}

/// Groups of properties of the robot that a fit may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Free {
    /// The inertial parameters that the log can identify.
    pub inertias: bool,
    /// The inertias of the rotors.
    pub armature: bool,
    /// Viscous friction of joints for which the file states none.
    pub viscous: bool,
}

/// A free parameter of the drafted model: name, value of the file, and whether it cannot be negative.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FreeParameter {
    pub name: String,
    pub nominal: f64,
    pub is_positive: bool,
}

/// A joint of the drafted model, with the names of its columns.
pub(super) struct DraftJoint<'r> {
    pub joint: &'r Joint,
    /// Name of the joint in expressions.
    pub name: String,
    pub position: String,
    pub speed: String,
    pub acceleration: String,
    /// Column of the commanded position or speed, with the drive that follows it and its gear ratio.
    pub command: Option<(String, Drive, f64)>,
    /// Largest torque of the drive, from the file; `None` if unlimited.
    pub limit: Option<f64>,
    /// Root mean square of the speed in the log, which the width of the smoothed sign is a share of.
    pub speed_rms: f64,
}

impl<'r> DraftJoint<'r> {
    pub fn new(joint: &'r Joint) -> Self {
        let name = plain_name(&joint.name);
        let unit = if joint.kind == JointKind::Prismatic { "m" } else { "rad" };
        Self {
            position: format!("q_{name}_{unit}"),
            speed: format!("w_{name}_{unit}_s"),
            acceleration: format!("a_{name}_{unit}_s2"),
            command: None,
            limit: None,
            speed_rms: 0.0,
            name,
            joint,
        }
    }

    pub fn is_prismatic(&self) -> bool {
        self.joint.kind == JointKind::Prismatic
    }

    /// Unit of the joint's position.
    pub fn position_unit(&self) -> &'static str {
        if self.is_prismatic() { "m" } else { "rad" }
    }

    /// Unit of the joint's torque or force.
    pub fn torque_unit(&self) -> &'static str {
        if self.is_prismatic() { "N" } else { "N m" }
    }

    /// Name of the joint's torque column.
    pub fn torque_name(&self) -> String {
        format!("tau_{}_{}", self.name, self.torque_unit().replace(' ', "_"))
    }

    /// Name of the joint's column of commands to a drive: positions, or speeds for a speed loop.
    pub fn command_name(&self, drive: Drive) -> String {
        let per_second = if matches!(drive, Drive::Velocity { .. }) { "_s" } else { "" };
        format!("command_{}_{}{per_second}", self.name, self.position_unit())
    }
}

/// Width of the smoothed sign of Coulomb friction, as a share of the root mean square of the speed.
const SIGN_WIDTH_RATIO: f64 = 0.02;

/// What the text of a model file needs to know.
pub(super) struct Draft<'r> {
    pub robot: &'r Robot,
    pub joints: Vec<DraftJoint<'r>>,
    pub formulation: Formulation,
    pub gravity: [f64; 3],
    pub free: Free,
    /// Inertial parameters and rotor inertias that a fit may change.
    pub properties: Vec<FreeParameter>,
    /// Name of the description file beside the model file.
    pub file: String,
    /// Name of the log, for a comment.
    pub log: String,
    /// How the log was filtered; `None` if it was not.
    pub preparation: Option<Preparation>,
}

impl Draft<'_> {
    /// The text of the model file.
    pub fn text(&self) -> String {
        let mut parameters = String::new();
        let torques: Vec<String> =
            self.joints.iter().map(|joint| passive_torque(joint, self.free, &mut parameters)).collect();
        for p in &self.properties {
            let bound = if p.is_positive { ", min = 0.0" } else { "" };
            let unit = if p.name.contains("inertia_") { ", unit = \"kg m^2\"" } else { "" };
            let nominal = if p.is_positive { p.nominal.max(0.0) } else { p.nominal };
            let _ = writeln!(parameters, "{} = {{ nominal = {}{bound}{unit} }}", p.name, number(nominal));
        }
        let mut out = self.head();
        match self.formulation {
            Formulation::Inverse => self.inverse(&torques, &mut out, &parameters),
            Formulation::Forward => self.forward(&torques, &mut out, parameters),
        }
        out
    }

    fn head(&self) -> String {
        let name = self.robot.name.replace(['"', '\\', '\n', '\r'], " ");
        format!(
            "# Made by augsim model from-robot from {} and {}.\n\
             # docs/robots.md explains [robot]; docs/model-file.md explains every other key.\n\
             scenario = \"system\"\nname = \"{name}\"\n",
            comment(&self.robot.file),
            comment(&self.log)
        )
    }

    /// The section `[robot]`; `last` is its last line.
    fn robot_section(&self, last: &str) -> String {
        let quoted = |values: Vec<&str>| -> String {
            values.iter().map(|v| format!("{v:?}")).collect::<Vec<String>>().join(", ")
        };
        let list =
            |of: for<'j> fn(&'j DraftJoint<'_>) -> &'j str| quoted(self.joints.iter().map(of).collect());
        let [x, y, z] = self.gravity.map(number);
        format!(
            "\n[robot] # rigid-body dynamics of the description file; joints that are not listed are locked\n\
             file = {:?}\njoints = [{}]\ngravity_m_s2 = [{x}, {y}, {z}]\nposition = [{}]\nspeed = [{}]\n{last}\n",
            self.file,
            list(|j| &j.joint.name),
            list(|j| &j.position),
            list(|j| &j.speed),
        )
    }

    /// Writes the sections of a model whose input is the measured motion.
    fn inverse(&self, passive: &[String], out: &mut String, parameters: &str) {
        let accelerations: Vec<String> =
            self.joints.iter().map(|j| format!("{:?}", j.acceleration)).collect();
        *out += &self.robot_section(&format!("acceleration = [{}]", accelerations.join(", ")));
        *out += "\n[inputs] # measured motion, filtered and differentiated";
        let mut low_pass = String::new();
        if let Some(p) = &self.preparation {
            let rate_hz = 1.0 / (p.interval_s * p.motion_decimation as f64);
            let (cutoff, rate) = (digits(p.motion_cutoff_hz), digits(rate_hz));
            let _ = write!(out, " below {cutoff} Hz, {rate} samples per second");
            low_pass = format!(", low_pass_hz = {}", number(p.cutoff_hz));
        }
        out.push('\n');
        for joint in &self.joints {
            for name in [&joint.position, &joint.speed, &joint.acceleration] {
                let _ = writeln!(out, "{name} = {{ hold = \"linear\" }}");
            }
        }
        if !parameters.is_empty() {
            *out += &format!("\n[parameters]\n{parameters}");
        }
        *out += "\n[outputs] # torque of each drive: rigid bodies, and what the file states of the joint; measured and modelled torques are \
                 compared below low_pass_hz\n";
        for (joint, passive) in self.joints.iter().zip(passive) {
            let value = format!("inverse_dynamics({}){passive}", joint.name);
            let name = joint.torque_name();
            let _ = writeln!(out, "{name} = {{ value = {value:?}, sd = \"estimate\"{low_pass} }}");
        }
    }

    /// Writes the sections of a model whose output is the motion.
    fn forward(&self, passive: &[String], out: &mut String, mut parameters: String) {
        let mut torques = Vec::new();
        for (joint, passive) in self.joints.iter().zip(passive) {
            let drive = drive_torque(joint, &mut parameters);
            // The passive torque is written as it adds to the torque of the drive; here it opposes the motion.
            let opposing = if passive.is_empty() { String::new() } else { format!(" - ({})", &passive[3..]) };
            torques.push(format!("{:?}", format!("{drive}{opposing}")));
        }
        *out += &self.robot_section(&format!("torque = [{}]", torques.join(", ")));
        *out += "\n[inputs] # torque or commanded position of each drive\n";
        for joint in &self.joints {
            let input = joint.command.as_ref().map_or_else(|| joint.torque_name(), |(name, ..)| name.clone());
            let _ = writeln!(out, "{input} = {{ hold = \"zero\" }}");
        }
        if !parameters.is_empty() {
            *out += &format!("\n[parameters]\n{parameters}");
        }
        let measured = |joint: &DraftJoint<'_>| format!("measured_{}", &joint.position);
        *out += "\n[states]\n";
        for joint in &self.joints {
            let _ = writeln!(out, "{} = {{ start = {:?} }}", joint.position, measured(joint));
            let _ = writeln!(out, "{} = {{ start = \"slope({})\" }}", joint.speed, measured(joint));
        }
        *out += "\n[rates]\n";
        for joint in &self.joints {
            let _ = writeln!(out, "{} = {:?}", joint.position, joint.speed);
            let _ = writeln!(out, "{} = \"forward_dynamics({})\"", joint.speed, joint.name);
        }
        *out += "\n[outputs]\n";
        for joint in &self.joints {
            let _ =
                writeln!(out, "{} = {{ value = {:?}, sd = \"estimate\" }}", measured(joint), joint.position);
        }
    }
}

/// Torque that opposes the motion of a joint as the file states it: friction and spring, each term with its sign before it.
fn passive_torque(joint: &DraftJoint<'_>, free: Free, parameters: &mut String) -> String {
    let (name, stated) = (&joint.name, joint.joint);
    let [damping, loss, stiffness, position] =
        if joint.is_prismatic() { ["N s/m", "N", "N/m", "m"] } else { ["N m s", "N m", "N m", "rad"] };
    let mut text = String::new();
    if stated.damping > 0.0 || free.viscous {
        let _ = writeln!(
            parameters,
            "{name}_viscous = {{ nominal = {}, min = 0.0, unit = \"{damping}\" }}",
            number(stated.damping)
        );
        text += &format!(" + {name}_viscous * {}", joint.speed);
    }
    if stated.friction_loss > 0.0 {
        let width = (SIGN_WIDTH_RATIO * joint.speed_rms).max(1e-6);
        let _ = writeln!(
            parameters,
            "{name}_coulomb = {{ nominal = {}, min = 0.0, unit = \"{loss}\" }}",
            number(stated.friction_loss)
        );
        let _ = writeln!(
            parameters,
            "{name}_sign_width_{position}_s = {{ nominal = {}, frozen = true }}",
            number(width)
        );
        text += &format!(" + {name}_coulomb * tanh({} / {name}_sign_width_{position}_s)", joint.speed);
    }
    if stated.stiffness > 0.0 {
        let _ = writeln!(
            parameters,
            "{name}_stiffness = {{ nominal = {}, min = 0.0, unit = \"{stiffness}\" }}\n{name}_spring_rest_{position} = {{ nominal = {}, frozen = true }}",
            number(stated.stiffness),
            number(stated.spring_reference)
        );
        text += &format!(" + {name}_stiffness * ({} - {name}_spring_rest_{position})", joint.position);
    }
    text
}

/// Torque of the drive of a joint: its column, or what its position or speed loop makes of the command.
fn drive_torque(joint: &DraftJoint<'_>, parameters: &mut String) -> String {
    let (name, Some((command, drive, gear))) = (&joint.name, &joint.command) else {
        return joint.torque_name();
    };
    // The length and the speed of an actuator are the gear ratio times those of its joint, and so is its torque.
    let geared =
        |text: &str| if *gear == 1.0 { text.to_owned() } else { format!("{} * {text}", number(*gear)) };
    let [gain, damping, torque] =
        if joint.is_prismatic() { ["N/m", "N s/m", "N"] } else { ["N m", "N m s", "N m"] };
    let mut parameter = |ending: &str, value: f64, unit: &str| {
        let _ = writeln!(
            parameters,
            "{name}_{ending} = {{ nominal = {}, min = 0.0, unit = \"{unit}\" }}",
            number(value)
        );
    };
    let wanted = match drive {
        Drive::Motor => command.clone(),
        Drive::Velocity { kv } => {
            parameter("kv", *kv, damping);
            format!("{name}_kv * ({command} - {})", geared(&joint.speed))
        }
        Drive::Position { kp, kv } => {
            parameter("kp", *kp, gain);
            parameter("kv", *kv, damping);
            let (position, speed) = (geared(&joint.position), geared(&joint.speed));
            format!("{name}_kp * ({command} - {position}) - {name}_kv * {speed}")
        }
    };
    let limited = match joint.limit {
        Some(limit) => {
            parameter("limit", limit, torque);
            format!("clamp({wanted}, -{name}_limit, {name}_limit)")
        }
        None => format!("({wanted})"),
    };
    geared(&limited)
}

/// A number as TOML writes it, exactly.
pub(super) fn number(value: f64) -> String {
    format!("{value:?}")
}

/// Text in one line of a comment.
fn comment(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}
