//! Properties of a model's robot at given parameter values, with the effects on them.

use super::robot::link_values;
use super::{How, Model, Target};
use crate::text::{Bindings, Symbol};
use augsim_robot::Numbers;

/// Properties of a robot at given values of the model's parameters, with the effects on them.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotProperties {
    /// The ten inertial parameters of each link of the tree about the origin of its frame, in the order of `augsim_robot`.
    pub links: Vec<[f64; 10]>,
    /// Inertia of each joint's rotor, kg m2 or kg.
    pub armature: Vec<f64>,
    /// Acceleration of gravity in the frame of the base, m/s2.
    pub gravity_m_s2: [f64; 3],
}

/// Values of the model's parameters, from which those of `[let]` follow; anything else is 0.
struct Values<'a> {
    model: &'a Model,
    parameters: &'a [f64],
}

impl Bindings for Values<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        match symbol {
            Symbol::Parameter(index) => self.parameters.get(index).copied().unwrap_or(0.0),
            // A [let] uses only those before it.
            Symbol::Let(index) => self.model.lets[index].value.tree.value(self),
            _ => 0.0,
        }
    }

    fn table(&self, _table: usize, _at: f64) -> f64 {
        0.0
    }

    fn slope(&self, _output: usize) -> f64 {
        0.0
    }
}

impl Model {
    /// Properties of the robot where the parameters have these `values`, in the order of the model, with the effects on
    /// inertias, rotors and gravity; `None` for a model without `[robot]`.
    pub fn robot_properties(&self, values: &[f64]) -> Option<RobotProperties> {
        let robot = self.robot.as_ref()?;
        let bindings = Values { model: self, parameters: values };
        let of = |property: &super::Property| match property {
            super::Property::File(value) => *value,
            super::Property::Parameter(index) => bindings.symbol(Symbol::Parameter(*index)),
        };
        let mut value_of = |_: &mut Numbers, index: usize| bindings.symbol(Symbol::Parameter(index));
        let links = robot.links.iter().map(|link| link_values(&mut Numbers, link, &mut value_of)).collect();
        let mut properties = RobotProperties {
            links,
            armature: robot.armature.iter().map(of).collect(),
            gravity_m_s2: robot.gravity.each_ref().map(of),
        };
        for change in self.additions.iter().flat_map(|a| &a.changes).filter(|c| c.how == How::Add) {
            let changed = match change.target {
                Target::Inertia(link, k) => &mut properties.links[link][k],
                Target::Armature(joint) => &mut properties.armature[joint],
                Target::Gravity(axis) => &mut properties.gravity_m_s2[axis],
                _ => continue,
            };
            *changed += change.value.tree.value(&bindings);
        }
        Some(properties)
    }
}
