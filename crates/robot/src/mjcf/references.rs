//! Elements of an MJCF file that are not supported, and the joints that they change through the names they refer to.

use super::body::{Bodies, Pending, Reach};
use crate::description::{Robot, Unsupported};
use crate::structure::{is_moving, joints_above, joints_below, parent_joints};
use crate::xml::Element;

impl Bodies<'_> {
    /// Lists an element that is not supported, with the joints that it and the elements inside it refer to.
    ///
    /// The references are joints, and bodies, geoms and sites, which the joints between them and the base move.
    pub fn add_references(&mut self, title: &str, element: Element) {
        self.add_pending(title.into(), element, Reach::Above(0));
        let mut pending = vec![element];
        while let Some(element) = pending.pop() {
            for attribute in element.node().attributes() {
                let (name, value) = (attribute.name(), attribute.value());
                let link = match name {
                    "joint" | "joint1" | "joint2" => {
                        if let Some(joint) = self.robot.joint(value) {
                            self.add_pending(title.into(), element, Reach::Joint(joint));
                        }
                        None
                    }
                    "body" | "body1" | "body2" => self.names.bodies.get(value),
                    "geom" | "geom1" | "geom2" => self.names.geoms.get(value),
                    "site" | "site1" | "site2" | "sidesite" => self.names.sites.get(value),
                    _ => None,
                };
                if let Some(&link) = link {
                    self.add_pending(title.into(), element, Reach::Above(link));
                }
            }
            pending.extend(element.children());
        }
    }
}

/// Resolves the joints of the elements that are not supported; entries of the same element are merged.
pub(super) fn resolve(robot: &Robot, pending: Vec<Pending>) -> Vec<Unsupported> {
    let parents = parent_joints(robot);
    let mut list: Vec<Unsupported> = Vec::new();
    for Pending { element, line, reach } in pending {
        let joints = match reach {
            Reach::Above(link) => joints_above(robot, &parents, link),
            Reach::Joint(joint) => vec![joint],
            Reach::AroundJoint(joint) => {
                let child = robot.joints[joint].child;
                let mut joints = joints_below(robot, child);
                joints.extend(joints_above(robot, &parents, child));
                joints
            }
        };
        // A joint that is itself not supported counts as fixed, and has to be listed all the same.
        let is_listed = |joint: &usize| is_moving(robot, *joint) || matches!(reach, Reach::AroundJoint(_));
        match list.last_mut() {
            Some(last) if last.element == element => {
                last.joints.extend(joints.iter().filter(|joint| is_listed(joint)))
            }
            _ => list.push(Unsupported {
                element,
                line,
                joints: joints.into_iter().filter(is_listed).collect(),
            }),
        }
    }
    for item in &mut list {
        item.joints.sort_unstable();
        item.joints.dedup();
    }
    list
}
