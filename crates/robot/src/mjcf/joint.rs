//! Joints of an MJCF file.

use super::settings::Settings;
use crate::description::{Joint, JointKind, Placement};
use crate::error::DescriptionError;
use crate::rotation::{IDENTITY, add, apply, normalize};
use crate::xml::Element;

/// Whether a range limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Limited {
    /// Yes.
    Yes,
    /// No.
    No,
    /// If it is stated.
    Auto,
}

impl Limited {
    /// The setting of an attribute; `before` where it is missing.
    pub fn read(element: Element, name: &str, before: Limited) -> Result<Limited, DescriptionError> {
        match element.attribute(name) {
            Some("auto") => Ok(Limited::Auto),
            _ => Ok(match element.is_true(name)? {
                Some(true) => Limited::Yes,
                Some(false) => Limited::No,
                None => before,
            }),
        }
    }

    /// The range, if it limits; `name` is the attribute of the range for messages.
    pub fn limit(
        self,
        range: [f64; 2],
        name: &str,
        element: Element,
        settings: &Settings,
    ) -> Result<Option<[f64; 2]>, DescriptionError> {
        let is_stated = range != [0.0; 2];
        let is_limited = match self {
            Limited::Yes => true,
            Limited::No => false,
            // As in MuJoCo, a range in the wrong order does not limit.
            Limited::Auto if settings.has_auto_limits => range[0] < range[1],
            Limited::Auto if is_stated => {
                let problem = format!(
                    "{} has {name}, and autolimits=\"false\" leaves open whether it limits",
                    element.title()
                );
                return Err(element.error(problem, "add limited, ctrllimited or forcelimited"));
            }
            Limited::Auto => false,
        };
        if is_limited && range[0] >= range[1] {
            let problem = format!("{}: {name}=\"{} {}\" is empty", element.title(), range[0], range[1]);
            return Err(element.error(problem, "give the smaller bound first"));
        }
        Ok(is_limited.then_some(range))
    }
}

/// Type of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum JointType {
    Hinge,
    Slide,
    Ball,
    Free,
}

/// Attributes of a joint, from its class and its element.
#[derive(Debug, Clone)]
pub(super) struct JointValues {
    /// Type of the joint.
    pub joint_type: JointType,
    position: [f64; 3],
    axis: [f64; 3],
    limited: Limited,
    range: [f64; 2],
    force_limited: Limited,
    force_range: [f64; 2],
    reference: f64,
    spring_reference: f64,
    damping: f64,
    friction_loss: f64,
    armature: f64,
    stiffness: f64,
    spring_damper: [f64; 2],
}

impl JointValues {
    /// MuJoCo's values where neither class nor element states any.
    pub const DEFAULT: JointValues = JointValues {
        joint_type: JointType::Hinge,
        position: [0.0; 3],
        axis: [0.0, 0.0, 1.0],
        limited: Limited::Auto,
        range: [0.0; 2],
        force_limited: Limited::Auto,
        force_range: [0.0; 2],
        reference: 0.0,
        spring_reference: 0.0,
        damping: 0.0,
        friction_loss: 0.0,
        armature: 0.0,
        stiffness: 0.0,
        spring_damper: [0.0; 2],
    };

    /// Replaces what an element states.
    pub fn apply(&mut self, element: Element) -> Result<(), DescriptionError> {
        self.joint_type = match element.attribute("type") {
            None => self.joint_type,
            Some("hinge") => JointType::Hinge,
            Some("slide") => JointType::Slide,
            Some("ball") => JointType::Ball,
            Some("free") => JointType::Free,
            Some(other) => {
                let problem = format!("{} has the unknown type `{other}`", element.title());
                return Err(element.error(problem, "use hinge or slide"));
            }
        };
        self.position = element.vector("pos")?.unwrap_or(self.position);
        self.axis = element.vector("axis")?.unwrap_or(self.axis);
        self.limited = Limited::read(element, "limited", self.limited)?;
        self.range = element.vector("range")?.unwrap_or(self.range);
        self.force_limited = Limited::read(element, "actuatorfrclimited", self.force_limited)?;
        self.force_range = element.vector("actuatorfrcrange")?.unwrap_or(self.force_range);
        self.spring_damper = element.vector("springdamper")?.unwrap_or(self.spring_damper);
        let values = [
            (&mut self.reference, "ref"),
            (&mut self.spring_reference, "springref"),
            (&mut self.damping, "damping"),
            (&mut self.friction_loss, "frictionloss"),
            (&mut self.armature, "armature"),
            (&mut self.stiffness, "stiffness"),
        ];
        for (value, name) in values {
            *value = element.number(name)?.unwrap_or(*value);
        }
        Ok(())
    }

    /// Whether stiffness and damping follow from the time constant and damping ratio of `springdamper`.
    pub fn has_spring_damper(&self) -> bool {
        self.spring_damper.iter().all(|value| *value > 0.0)
    }

    /// Position of the joint in the frame of the body, m, where `frame` is the placement of the elements around it.
    pub fn anchor(&self, frame: &Placement) -> [f64; 3] {
        add(frame.translation_m, apply(&frame.rotation, self.position))
    }

    /// The joint between two links; its placement is set by the caller.
    pub fn build(
        &self,
        element: Element,
        settings: &Settings,
        frame: &Placement,
        [parent, child]: [usize; 2],
    ) -> Result<Joint, DescriptionError> {
        let is_hinge = self.joint_type == JointType::Hinge;
        let kind = match self.joint_type {
            JointType::Hinge => JointKind::Revolute,
            JointType::Slide => JointKind::Prismatic,
            JointType::Ball | JointType::Free => JointKind::Fixed,
        };
        let angle = |value: f64| if is_hinge { settings.radians(value) } else { value };
        let range = match kind {
            JointKind::Fixed => None,
            _ => self.limited.limit(self.range, "range", element, settings)?,
        };
        let forces = self.force_limited.limit(self.force_range, "actuatorfrcrange", element, settings)?;
        let axis = normalize(self.axis).ok_or_else(|| {
            element.error(format!("{}: its axis has the length 0", element.title()), "give a direction")
        })?;
        Ok(Joint {
            name: element.attribute("name").unwrap_or_default().into(),
            line: element.line(),
            kind,
            parent,
            child,
            placement: Placement { rotation: IDENTITY, translation_m: [0.0; 3] },
            axis: apply(&frame.rotation, axis),
            reference: if kind == JointKind::Fixed { 0.0 } else { angle(self.reference) },
            range: range.map(|range| range.map(angle)),
            effort: forces.map(|[low, high]| low.abs().max(high.abs())),
            damping: self.damping,
            friction_loss: self.friction_loss,
            armature: self.armature,
            stiffness: self.stiffness,
            spring_reference: if kind == JointKind::Fixed { 0.0 } else { angle(self.spring_reference) },
            coupling: None,
        })
    }
}
