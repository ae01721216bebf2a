//! Compiles the dynamics of a model's robot: the torques and accelerations of its joints.

use super::joint_quantity::JointQuantity;
use super::lower::{Lowering, Smoothing};
use super::{Code, Graph, Id};
use crate::model::{How, Joint, Property, RobotModel, Target};
use crate::text::Symbol;
use augsim_robot::{Algebra, forward_dynamics, inverse_dynamics};
use std::sync::Arc;

/// Arithmetic that appends operations to a graph.
struct Operations<'g>(&'g mut Graph);

impl Algebra for Operations<'_> {
    type Value = Id;

    fn constant(&mut self, value: f64) -> Id {
        self.0.constant(value)
    }
    fn add(&mut self, a: Id, b: Id) -> Id {
        self.0.add(a, b)
    }
    fn subtract(&mut self, a: Id, b: Id) -> Id {
        self.0.subtract(a, b)
    }
    fn multiply(&mut self, a: Id, b: Id) -> Id {
        self.0.multiply(a, b)
    }
    fn divide(&mut self, a: Id, b: Id) -> Id {
        self.0.divide(a, b)
    }
    fn negate(&mut self, a: Id) -> Id {
        self.0.negate(a)
    }
    fn sin(&mut self, a: Id) -> Id {
        self.0.unary(Code::Sin, a)
    }
    fn cos(&mut self, a: Id) -> Id {
        self.0.unary(Code::Cos, a)
    }
}

impl Lowering<'_> {
    /// Compiles the torque of a joint by the inverse dynamics.
    ///
    /// In the expression of an effect it is the torque of the rigid bodies alone.
    pub(super) fn joint_torque(&mut self, joint: usize, smoothing: Smoothing) -> Id {
        let quantity = if self.in_joint_effect { JointQuantity::RigidTorque } else { JointQuantity::Torque };
        self.joint_values(quantity, joint, smoothing)
    }

    /// Compiles one quantity of a joint; those of all joints are compiled together and kept.
    pub(super) fn joint_values(&mut self, quantity: JointQuantity, joint: usize, smoothing: Smoothing) -> Id {
        if !self.joint_values.contains_key(&(quantity, smoothing)) {
            let values = match self.robot() {
                Some(robot) => self.compile_joints(&robot, quantity, smoothing),
                None => Vec::new(),
            };
            self.joint_values.insert((quantity, smoothing), values);
        }
        let found =
            self.joint_values.get(&(quantity, smoothing)).and_then(|values| values.get(joint)).copied();
        found.unwrap_or_else(|| self.graph.constant(0.0))
    }

    fn compile_joints(
        &mut self,
        robot: &Arc<RobotModel>,
        quantity: JointQuantity,
        smoothing: Smoothing,
    ) -> Vec<Id> {
        let count = robot.joints.len();
        match quantity {
            JointQuantity::RigidTorque => self.rigid_torques(robot, smoothing),
            JointQuantity::Torque => {
                let torque = |joint: usize, this: &mut Self| {
                    let rigid = this.joint_values(JointQuantity::RigidTorque, joint, smoothing);
                    match this.torque_of_effects(joint, None, smoothing) {
                        Some(added) => this.graph.subtract(rigid, added),
                        None => rigid,
                    }
                };
                (0..count).map(|joint| torque(joint, self)).collect()
            }
            JointQuantity::Acceleration => self.accelerations(robot, smoothing),
        }
    }

    /// Compiles the torques of rigid bodies and rotors by inverse dynamics.
    fn rigid_torques(&mut self, robot: &Arc<RobotModel>, smoothing: Smoothing) -> Vec<Id> {
        let acceleration = self.listed(robot, |joint| joint.acceleration.as_ref(), smoothing);
        let (position, speed) = self.motion(robot, smoothing);
        let (parameters, armature, gravity) = self.properties(robot);
        let a = &mut Operations(&mut self.graph);
        let mut torques =
            inverse_dynamics(a, &robot.tree, &parameters, gravity, &position, &speed, &acceleration);
        for (torque, (inertia, acceleration)) in torques.iter_mut().zip(armature.iter().zip(&acceleration)) {
            let rotor = a.multiply(*inertia, *acceleration);
            *torque = a.add(*torque, rotor);
        }
        torques
    }

    /// Compiles the accelerations of all joints by forward dynamics.
    fn accelerations(&mut self, robot: &Arc<RobotModel>, smoothing: Smoothing) -> Vec<Id> {
        let mut torques = self.listed(robot, |joint| joint.torque.as_ref(), smoothing);
        for (joint, torque) in torques.iter_mut().enumerate() {
            if let Some(changed) = self.torque_of_effects(joint, Some(*torque), smoothing) {
                *torque = changed;
            }
        }
        let (position, speed) = self.motion(robot, smoothing);
        let (parameters, armature, gravity) = self.properties(robot);
        let a = &mut Operations(&mut self.graph);
        forward_dynamics(a, &robot.tree, &parameters, gravity, &armature, &position, &speed, &torques)
    }

    /// Compiles the torque of all effects on a joint, added to `before`; `None` if there are no effects on it.
    fn torque_of_effects(&mut self, joint: usize, before: Option<Id>, smoothing: Smoothing) -> Option<Id> {
        let model = self.model;
        let mut total = None;
        let changes = model.additions.iter().flat_map(|a| &a.changes);
        for change in changes.filter(|c| c.target == Target::Joint(joint)) {
            let was_inside = std::mem::replace(&mut self.in_joint_effect, true);
            let value = self.tree(&change.value.tree, smoothing);
            self.in_joint_effect = was_inside;
            let so_far = total.or(before);
            total = Some(match (so_far, change.how) {
                (Some(so_far), How::Add) => self.graph.add(so_far, value),
                (Some(so_far), How::Factor) => self.graph.multiply(so_far, value),
                (None, _) | (_, How::Replace) => value,
            });
        }
        total
    }

    fn robot(&self) -> Option<Arc<RobotModel>> {
        self.model.robot.clone()
    }

    fn motion(&mut self, robot: &Arc<RobotModel>, smoothing: Smoothing) -> (Vec<Id>, Vec<Id>) {
        let position = self.listed(robot, |joint| Some(&joint.position), smoothing);
        let speed = self.listed(robot, |joint| Some(&joint.speed), smoothing);
        (position, speed)
    }

    /// Compiles one expression of each joint; 0 for a joint without it.
    fn listed(
        &mut self,
        robot: &Arc<RobotModel>,
        of: fn(&Joint) -> Option<&crate::model::Expression>,
        smoothing: Smoothing,
    ) -> Vec<Id> {
        let value = |joint: &Joint| match of(joint) {
            Some(expression) => self.tree(&expression.tree, smoothing),
            None => self.graph.constant(0.0),
        };
        robot.joints.iter().map(value).collect()
    }

    /// Compiles the inertial parameters of all bodies, the inertias of rotors, and gravity, with the effects on them.
    fn properties(&mut self, robot: &Arc<RobotModel>) -> (Vec<[Id; 10]>, Vec<Id>, [Id; 3]) {
        let model = self.model;
        let parameters: Vec<Id> = (0..model.parameters.len())
            .map(|index| self.symbol(Symbol::Parameter(index), Smoothing::Smooth))
            .collect();
        let mut changes: Vec<(Target, Id)> = Vec::new();
        for change in model.additions.iter().flat_map(|a| &a.changes) {
            if matches!(change.target, Target::Inertia(..) | Target::Gravity(_) | Target::Armature(_)) {
                changes.push((change.target, self.tree(&change.value.tree, Smoothing::Smooth)));
            }
        }
        let a = &mut Operations(&mut self.graph);
        let changed = |a: &mut Operations<'_>, target: Target, value: Id| {
            let added = changes.iter().filter(|(changed, _)| *changed == target);
            added.fold(value, |sum, (_, change)| a.add(sum, *change))
        };
        let of = |a: &mut Operations<'_>, property: &Property| match property {
            Property::File(value) => a.constant(*value),
            Property::Parameter(index) => parameters[*index],
        };
        let bodies = robot.body_parameters(
            a,
            |_, index| parameters[index],
            |a, link, k, value| changed(a, Target::Inertia(link, k), value),
        );
        let armature = robot.armature.iter().enumerate().map(|(joint, property)| {
            let value = of(a, property);
            changed(a, Target::Armature(joint), value)
        });
        let armature = armature.collect();
        let gravity = std::array::from_fn(|axis| {
            let value = of(a, &robot.gravity[axis]);
            changed(a, Target::Gravity(axis), value)
        });
        (bodies, armature, gravity)
    }
}
