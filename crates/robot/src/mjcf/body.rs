//! Bodies of an MJCF file, as links and joints.
//!
//! A body with several joints becomes a chain of links: MuJoCo moves the body by its joints one after another, in the order
//! of the file, each about an anchor and an axis that the earlier ones have moved. All links of the chain but the last are
//! massless. Every link has the axes of its body, and its origin at the `pos` of its joint.

use super::classes::{Classes, MAIN};
use super::geom::GeomMass;
use super::inertia::read_inertial;
use super::joint::JointType;
use super::names::Names;
use super::orientation::read_placement;
use super::settings::{InertiaFromGeom, Settings};
use crate::description::{Inertia, Joint, JointKind, Link, Placement, Robot};
use crate::error::DescriptionError;
use crate::origins::Origins;
use crate::rotation::{IDENTITY, add, apply, compose, subtract, total_inertia};
use crate::structure::check_count;
use crate::xml::Element;

/// Largest number of references to joints, bodies, geoms and sites in elements that are not supported.
const MAX_PENDING: usize = 5_000;

/// Which joints an element that is not supported changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Reach {
    /// Those between a link and the base.
    Above(usize),
    /// The joint itself, and those between it and the base or the ends of the robot.
    AroundJoint(usize),
    /// A joint.
    Joint(usize),
}

/// An element that is not supported, whose joints are found when all bodies have been read.
#[derive(Debug)]
pub(super) struct Pending {
    /// The element, for messages.
    pub element: String,
    /// Line of the element, from 1.
    pub line: usize,
    /// Which joints it changes.
    pub reach: Reach,
}

/// Reads bodies one after another.
pub(super) struct Bodies<'s> {
    /// Settings of the file.
    pub settings: &'s Settings,
    /// Default classes.
    pub classes: &'s Classes,
    /// The robot as far as it is read.
    pub robot: Robot,
    /// Where its links and joints are in the file.
    pub origins: Origins,
    /// Names of bodies, geoms and sites, with their links.
    pub names: Names,
    /// Elements that are not supported.
    pub pending: Vec<Pending>,
}

/// An element inside a body or one of its frames.
#[derive(Clone, Copy)]
struct Placed<'a> {
    element: Element<'a>,
    /// Placement of the innermost frame in the body.
    frame: Placement,
    /// Class that the element inherits.
    class: &'a str,
}

impl Bodies<'_> {
    /// Reads the bodies inside `worldbody`, which is link 0.
    pub fn read_world(&mut self, world: Element) -> Result<(), DescriptionError> {
        let class = self.classes.inherited(world, MAIN)?;
        let inside = self.list(world, class)?;
        for item in &inside {
            self.names.record(item.element, 0);
            match item.element.tag() {
                "body" => self.read_body(*item, 0)?,
                "joint" | "freejoint" | "inertial" => {
                    let problem = format!("the world has a {}", item.element.title());
                    return Err(item.element.error(problem, "put it inside a <body>"));
                }
                tag => self.list_unsupported(item.element, tag, 0),
            }
        }
        Ok(())
    }

    /// Elements inside a body, with those of its frames in their place.
    fn list<'a>(&self, body: Element<'a>, class: &'a str) -> Result<Vec<Placed<'a>>, DescriptionError> {
        let mut inside = Vec::new();
        self.list_frame(body, Placement::IDENTITY, class, &mut inside)?;
        Ok(inside)
    }

    fn list_frame<'a>(
        &self,
        outer: Element<'a>,
        frame: Placement,
        class: &'a str,
        inside: &mut Vec<Placed<'a>>,
    ) -> Result<(), DescriptionError> {
        for element in outer.children() {
            if element.tag() == "frame" {
                let inner = compose(&frame, &read_placement(element, self.settings)?);
                self.list_frame(element, inner, self.classes.inherited(element, class)?, inside)?;
            } else {
                inside.push(Placed { element, frame, class });
            }
        }
        Ok(())
    }

    /// Reads a body and those inside it.
    fn read_body(&mut self, body: Placed, parent: usize) -> Result<(), DescriptionError> {
        let element = body.element;
        let class = self.classes.inherited(element, body.class)?;
        let placement = compose(&body.frame, &read_placement(element, self.settings)?);
        let inside = self.list(element, class)?;
        let name = self.names.next_body(element);
        self.check_count(element)?;
        let link = self.add_chain(element, &name, &inside, placement, parent)?;
        self.names.bodies.insert(name.clone(), link);
        for item in &inside {
            self.names.record(item.element, link);
        }
        if element.number("gravcomp")?.is_some_and(|share| share != 0.0) {
            self.add_pending(
                format!("compensation of gravity of body `{name}`"),
                element,
                Reach::Above(link),
            );
        }
        self.robot.links[link].inertia = self.read_inertia(element, &name, &inside, link)?;
        for item in &inside {
            match item.element.tag() {
                "body" => self.read_body(*item, link)?,
                tag => self.list_unsupported(item.element, tag, link),
            }
        }
        Ok(())
    }

    /// Adds the joints and links of a body; returns the link that moves with the body.
    fn add_chain(
        &mut self,
        body: Element,
        name: &str,
        inside: &[Placed],
        placement: Placement,
        parent: usize,
    ) -> Result<usize, DescriptionError> {
        let joints: Vec<&Placed> =
            inside.iter().filter(|item| matches!(item.element.tag(), "joint" | "freejoint")).collect();
        let mut chain = Chain { parent, anchor: [0.0; 3], rotation: placement.rotation };
        // Position of the body in the frame of the parent link, whose origin is at the parent's last joint.
        let start = subtract(placement.translation_m, self.robot.links[parent].shift_m);
        for (k, item) in joints.iter().enumerate() {
            self.check_count(item.element)?;
            let is_last = k + 1 == joints.len();
            let link_name = if is_last { name.to_owned() } else { String::new() };
            let link = self.add_link(link_name, body.line(), is_last.then(|| body.range().start));
            let (joint, anchor) = self.read_joint(item, [chain.parent, link])?;
            let moved = subtract(anchor, chain.anchor);
            let translation_m = if k == 0 { add(start, apply(&placement.rotation, anchor)) } else { moved };
            let joint_name = self.names.next_joint(item.element);
            if !is_last {
                self.names.generated_links.push((link, format!("{name}_{joint_name}")));
            }
            let placement = Placement { rotation: chain.rotation, translation_m };
            self.robot.joints.push(Joint { name: joint_name, placement, ..joint });
            self.origins.joints.push(Some(item.element.range().start));
            self.robot.links[link].shift_m = anchor;
            chain = Chain { parent: link, anchor, rotation: IDENTITY };
        }
        if joints.is_empty() {
            chain.parent =
                self.add_fixed(body, name, Placement { translation_m: start, ..placement }, parent);
        }
        Ok(chain.parent)
    }

    /// Adds a link that is fixed to its parent.
    fn add_fixed(&mut self, body: Element, name: &str, placement: Placement, parent: usize) -> usize {
        let child = self.add_link(name.into(), body.line(), Some(body.range().start));
        self.names.generated_joints.push((self.robot.joints.len(), format!("{name}_fixed")));
        self.origins.joints.push(None);
        self.robot.joints.push(Joint {
            name: String::new(),
            line: body.line(),
            kind: JointKind::Fixed,
            parent,
            child,
            placement,
            axis: [1.0, 0.0, 0.0],
            reference: 0.0,
            range: None,
            effort: None,
            damping: 0.0,
            friction_loss: 0.0,
            armature: 0.0,
            stiffness: 0.0,
            spring_reference: 0.0,
            coupling: None,
        });
        child
    }

    fn add_link(&mut self, name: String, line: usize, origin: Option<usize>) -> usize {
        self.robot.links.push(Link { name, line, inertia: None, shift_m: [0.0; 3] });
        self.origins.links.push(origin);
        self.robot.links.len() - 1
    }

    /// Reads a joint between two links, and its position in the frame of the body.
    fn read_joint(
        &mut self,
        item: &Placed,
        links: [usize; 2],
    ) -> Result<(Joint, [f64; 3]), DescriptionError> {
        let mut values = self.classes.of(item.element, item.class)?.joint.clone();
        values.apply(item.element)?;
        if item.element.tag() == "freejoint" {
            values.joint_type = JointType::Free;
        }
        let joint = values.build(item.element, self.settings, &item.frame, links)?;
        let index = self.robot.joints.len();
        match values.joint_type {
            JointType::Ball => self.add_pending(
                format!("ball {}", item.element.title()),
                item.element,
                Reach::AroundJoint(index),
            ),
            JointType::Free => self.add_pending(
                format!("free {}", item.element.title()),
                item.element,
                Reach::AroundJoint(index),
            ),
            _ if values.has_spring_damper() => {
                let name = format!("springdamper of {}", item.element.title());
                self.add_pending(name, item.element, Reach::Joint(index));
            }
            _ => {}
        }
        let anchor = if values.joint_type == JointType::Free { [0.0; 3] } else { values.anchor(&item.frame) };
        Ok((joint, anchor))
    }

    /// Inertia of a body, from its `inertial` or its geoms, in the frame of its link.
    fn read_inertia(
        &mut self,
        body: Element,
        name: &str,
        inside: &[Placed],
        link: usize,
    ) -> Result<Option<Inertia>, DescriptionError> {
        let explicit = match body.child("inertial") {
            Some(inertial) => Some(read_inertial(inertial, self.settings)?),
            None => None,
        };
        let from_geoms = match (self.settings.inertia_from_geom, explicit) {
            (InertiaFromGeom::Never, _) | (InertiaFromGeom::Auto, Some(_)) => None,
            _ => self.sum_geoms(name, inside, link)?,
        };
        let shift = self.robot.links[link].shift_m;
        let inertia = from_geoms.or(explicit);
        Ok(inertia.map(|inertia| Inertia { centre_m: subtract(inertia.centre_m, shift), ..inertia }))
    }

    /// Inertia of the geoms of a body, in the frame of the body; `None` without mass, or if it needs a mesh.
    fn sum_geoms(
        &mut self,
        name: &str,
        inside: &[Placed],
        link: usize,
    ) -> Result<Option<Inertia>, DescriptionError> {
        let mut parts = Vec::new();
        let mut unknown = None;
        for item in inside.iter().filter(|item| item.element.tag() == "geom") {
            let mut values = self.classes.of(item.element, item.class)?.geom.clone();
            values.apply(item.element)?;
            match values.inertia(item.element, self.settings, &item.frame)? {
                GeomMass::Nothing => {}
                GeomMass::Known(inertia) => parts.push(inertia),
                GeomMass::Unknown => unknown = unknown.or(Some(item.element)),
            }
        }
        let Some(geom) = unknown else { return Ok(total_inertia(&parts)) };
        let shown = match (geom.attribute("name"), geom.attribute("mesh")) {
            (Some(name), _) => format!("geom `{name}`"),
            (None, Some(mesh)) => format!("geom of mesh `{mesh}`"),
            (None, None) => "geom".into(),
        };
        let element = format!("inertia of body `{name}` from {shown} (add <inertial> to the body)");
        self.add_pending(element, geom, Reach::Above(link));
        Ok(None)
    }

    /// Lists an element inside a body if it would change the motion.
    fn list_unsupported(&mut self, element: Element, tag: &str, link: usize) {
        let is_harmless = matches!(
            tag,
            "inertial" | "joint" | "freejoint" | "geom" | "site" | "camera" | "light" | "body" | "skin"
        );
        if !is_harmless {
            self.add_pending(element.title(), element, Reach::Above(link));
        }
    }

    /// Refuses files with too many links, actuators, or elements that are not supported.
    pub fn check_count(&self, element: Element) -> Result<(), DescriptionError> {
        if self.pending.len() > MAX_PENDING {
            let problem = format!(
                "the file refers to more than {MAX_PENDING} joints and bodies in elements that are not supported"
            );
            return Err(element.error(problem, "remove those that do not concern the robot"));
        }
        check_count(&self.robot)
    }

    /// Adds an element that is not supported.
    pub fn add_pending(&mut self, name: String, element: Element, reach: Reach) {
        self.pending.push(Pending { element: name, line: element.line(), reach });
    }
}

/// The end of a chain of joints in one body.
struct Chain {
    /// Link at the end.
    parent: usize,
    /// Position of the last joint in the frame of the body, m.
    anchor: [f64; 3],
    /// Orientation of the next link in the frame of the last one.
    rotation: [[f64; 3]; 3],
}
