//! A robot as an MJCF file.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::mjcf::inertial_element;
use super::number::{comment, escape, number, numbers};
use crate::description::{Actuator, Drive, Joint, JointKind, Placement, Robot};
use crate::rotation::{IDENTITY, apply, compose, to_quaternion, transpose};

/// Writes a robot as an MJCF file, which MuJoCo and [`crate::read_mjcf`] read.
///
/// The base is fixed to the world. A massless link between two moving joints, which MuJoCo would refuse, becomes part of the
/// next body, which then has several joints. Elements that are not supported are listed in a comment.
pub fn to_mjcf(robot: &Robot) -> String {
    let mut writer = Writer { robot, children: children(robot), text: String::new(), depth: 1 };
    writer.head();
    writer.bodies();
    writer.couplings();
    writer.actuators();
    writer.text.push_str("</mujoco>\n");
    writer.text
}

/// Joints whose parent is each link.
fn children(robot: &Robot) -> Vec<Vec<usize>> {
    let mut children = vec![Vec::new(); robot.links.len()];
    for (k, joint) in robot.joints.iter().enumerate() {
        children[joint.parent].push(k);
    }
    children
}

/// A body to write, or the end of one.
enum Step {
    Body(usize),
    End,
}

struct Writer<'r> {
    robot: &'r Robot,
    children: Vec<Vec<usize>>,
    text: String,
    depth: usize,
}

impl Writer<'_> {
    fn line(&mut self, xml: &str) {
        self.text.push_str(&"  ".repeat(self.depth));
        self.text.push_str(xml);
        self.text.push('\n');
    }

    fn head(&mut self) {
        let robot = self.robot;
        let _ = writeln!(self.text, "<mujoco model=\"{}\">", escape(&robot.name));
        self.line(&comment(&format!("Converted from {}.", robot.file)));
        for item in &robot.unsupported {
            self.line(&comment(&format!("Not converted: {} (line {}).", item.element, item.line)));
        }
        self.line("<compiler angle=\"radian\" autolimits=\"true\"/>");
        if let Some(gravity) = robot.gravity_m_s2 {
            self.line(&format!("<option gravity=\"{}\"/>", numbers(&gravity)));
        }
    }

    fn bodies(&mut self) {
        self.line("<worldbody>");
        self.depth += 1;
        let robot = self.robot;
        let moved: BTreeSet<usize> = robot.joints.iter().map(|joint| joint.child).collect();
        let base = (0..robot.links.len()).find(|link| !moved.contains(link));
        let has_body = |link: &usize| robot.links[*link].name != "world";
        let mut pending = Vec::new();
        if let Some(base) = base.filter(has_body) {
            self.open_body(base, &Placement::IDENTITY, &[]);
            pending.push(Step::End);
        }
        if let Some(base) = base {
            pending.extend(self.children[base].iter().rev().map(|joint| Step::Body(*joint)));
        }
        while let Some(step) = pending.pop() {
            match step {
                Step::End => {
                    self.depth -= 1;
                    self.line("</body>");
                }
                Step::Body(joint) => {
                    let link = self.write_chain(joint);
                    pending.push(Step::End);
                    pending.extend(self.children[link].iter().rev().map(|joint| Step::Body(*joint)));
                }
            }
        }
        self.depth -= 1;
        self.line("</worldbody>");
    }

    /// Writes the start of the body at the end of a chain of moving joints with massless links between them.
    fn write_chain(&mut self, first: usize) -> usize {
        let robot = self.robot;
        let moves = |joint: usize| robot.joints[joint].kind != JointKind::Fixed;
        let mut chain = vec![first];
        let mut last = first;
        loop {
            let child = robot.joints[last].child;
            let is_massless = robot.links[child].inertia.is_none_or(|inertia| inertia.mass_kg == 0.0);
            match self.children[child][..] {
                [next] if is_massless && moves(last) && moves(next) => {
                    chain.push(next);
                    last = next;
                }
                _ => break,
            }
        }
        let place =
            |placement: Placement, joint: &usize| compose(&placement, &robot.joints[*joint].placement);
        let placement = chain.iter().fold(Placement::IDENTITY, place);
        let joints: Vec<(usize, Placement)> = chain
            .iter()
            .enumerate()
            .map(|(k, joint)| (*joint, chain[k + 1..].iter().fold(Placement::IDENTITY, place)))
            .collect();
        let link = robot.joints[last].child;
        self.open_body(link, &placement, &joints);
        link
    }

    /// Writes the start of a body, with its inertia and joints.
    ///
    /// `joints` are those between the parent and the body, each with the placement of the body in its frame.
    fn open_body(&mut self, link: usize, placement: &Placement, joints: &[(usize, Placement)]) {
        let robot = self.robot;
        let mut tag = format!("<body name=\"{}\"", escape(&robot.links[link].name));
        if placement.translation_m != [0.0; 3] {
            let _ = write!(tag, " pos=\"{}\"", numbers(&placement.translation_m));
        }
        if placement.rotation != IDENTITY {
            let _ = write!(tag, " quat=\"{}\"", numbers(&to_quaternion(&placement.rotation)));
        }
        self.line(&format!("{tag}>"));
        self.depth += 1;
        if let Some(inertia) = robot.links[link].inertia.filter(|inertia| inertia.mass_kg > 0.0) {
            self.line(&inertial_element(&inertia));
        }
        for (joint, body) in joints {
            let joint = &robot.joints[*joint];
            if joint.kind != JointKind::Fixed {
                self.line(&joint_element(joint, body));
            }
        }
    }

    fn couplings(&mut self) {
        let robot = self.robot;
        let coupled: Vec<&Joint> = robot.joints.iter().filter(|joint| joint.coupling.is_some()).collect();
        if coupled.is_empty() {
            return;
        }
        self.line("<equality>");
        for joint in coupled {
            if let Some(coupling) = &joint.coupling {
                let leader = &robot.joints[coupling.joint];
                // MJCF counts both positions from their references.
                let constant = coupling.offset - joint.reference + coupling.ratio * leader.reference;
                let xml = format!(
                    "  <joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{} {} 0 0 0\"/>",
                    escape(&joint.name),
                    escape(&leader.name),
                    number(constant),
                    number(coupling.ratio)
                );
                self.line(&xml);
            }
        }
        self.line("</equality>");
    }

    fn actuators(&mut self) {
        let robot = self.robot;
        if robot.actuators.is_empty() {
            return;
        }
        self.line("<actuator>");
        let mut names = BTreeSet::new();
        for actuator in &robot.actuators {
            // Two actuators of a URDF file may have the same name.
            let mut name = actuator.name.clone();
            while !names.insert(name.clone()) {
                name.push('_');
            }
            let joint = &robot.joints[actuator.joint].name;
            self.line(&actuator_element(actuator, &name, joint));
        }
        self.line("</actuator>");
    }
}

/// A joint in the frame of its body, where `body` is the placement of the body in the frame of the joint.
fn joint_element(joint: &Joint, body: &Placement) -> String {
    let turned = transpose(&body.rotation);
    let position = apply(&turned, body.translation_m.map(|component| -component));
    let kind = if joint.kind == JointKind::Prismatic { "slide" } else { "hinge" };
    let axis = numbers(&apply(&turned, joint.axis));
    let mut tag = format!("<joint name=\"{}\" type=\"{kind}\" axis=\"{axis}\"", escape(&joint.name));
    if position != [0.0; 3] {
        let _ = write!(tag, " pos=\"{}\"", numbers(&position));
    }
    if let Some(range) = joint.range.filter(|[low, high]| low < high) {
        let _ = write!(tag, " range=\"{}\"", numbers(&range));
    }
    if let Some(effort) = joint.effort.filter(|effort| *effort > 0.0) {
        let _ = write!(tag, " actuatorfrcrange=\"{}\"", numbers(&[-effort, effort]));
    }
    let values = [
        ("ref", joint.reference),
        ("damping", joint.damping),
        ("frictionloss", joint.friction_loss),
        ("armature", joint.armature),
        ("stiffness", joint.stiffness),
        ("springref", joint.spring_reference),
    ];
    for (name, value) in values.iter().filter(|(_, value)| *value != 0.0) {
        let _ = write!(tag, " {name}=\"{}\"", number(*value));
    }
    format!("{tag}/>")
}

/// An actuator of a joint.
fn actuator_element(actuator: &Actuator, name: &str, joint: &str) -> String {
    let (kind, gains) = match actuator.drive {
        Drive::Motor => ("motor", String::new()),
        Drive::Position { kp, kv } => ("position", format!(" kp=\"{}\" kv=\"{}\"", number(kp), number(kv))),
        Drive::Velocity { kv } => ("velocity", format!(" kv=\"{}\"", number(kv))),
    };
    let mut tag = format!("  <{kind} name=\"{}\" joint=\"{}\"{gains}", escape(name), escape(joint));
    if actuator.gear != 1.0 {
        let _ = write!(tag, " gear=\"{}\"", number(actuator.gear));
    }
    for (name, range) in [("ctrlrange", actuator.command_range), ("forcerange", actuator.force_range)] {
        if let Some(range) = range {
            let _ = write!(tag, " {name}=\"{}\"", numbers(&range));
        }
    }
    format!("{tag}/>")
}
