//! The section `[robot]`: rigid-body dynamics of a robot, which expressions use as functions of its joints.

use super::toml_reader::Item;
use super::{Expression, Model, Target};
use crate::error::{Fault, ModelError};
use crate::text::{Bindings, Symbol};
use augsim_data::{Unit, escape_control_characters};
use augsim_robot::description::STANDARD_GRAVITY;
use augsim_robot::{Algebra, MAX_FILE_BYTES, Numbers, Robot, Tree, forward_dynamics, inverse_dynamics};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// A joint of the robot, with the quantities of the model that move it.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Name of the joint in expressions: that of the description file, with `_` for characters that no name may have.
    pub name: String,
    /// Expression of the joint's position, rad or m.
    pub position: Expression,
    /// Expression of the joint's speed, rad/s or m/s.
    pub speed: Expression,
    /// Expression of the joint's acceleration, rad/s2 or m/s2; `None` if the model uses no inverse dynamics.
    pub acceleration: Option<Expression>,
    /// Expression of the torque of the joint's drive, N m or N; `None` if the model uses no forward dynamics.
    pub torque: Option<Expression>,
}

/// Where the value of a property of the robot comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Property {
    /// The description file.
    File(f64),
    /// The parameter of the model with this index.
    Parameter(usize),
}

impl Property {
    /// The value of the description file; `None` if a parameter of the model states it.
    pub fn of_file(self) -> Option<f64> {
        match self {
            Property::File(value) => Some(value),
            Property::Parameter(_) => None,
        }
    }
}

/// Inertial properties of a link of the tree.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkProperties {
    /// Name of the link in parameters: that of the description file, with `_` for characters that no name may have.
    pub name: String,
    /// Mass, kg.
    pub mass: Property,
    /// Centre of mass in the link frame, m.
    pub centre: [Property; 3],
    /// Moments xx, yy, zz and products xy, xz, yz of the inertia about the centre of mass, kg m2.
    pub inertia: [Property; 6],
    /// Parameters that state mass times centre directly, kg m; they replace `centre`.
    pub moment: [Option<usize>; 3],
    /// Parameters that state the inertia about the origin of the link frame directly, kg m2; they replace `inertia`.
    pub origin_inertia: [Option<usize>; 6],
}

/// Rigid-body dynamics of a robot whose joints the equations of the model move.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotModel {
    /// Path of the description file, as the model file states it.
    pub file: String,
    /// Text of the description file.
    pub text: Arc<str>,
    /// The robot of the description file.
    pub description: Arc<Robot>,
    /// Its moving bodies.
    pub tree: Arc<Tree>,
    /// Joints that the model moves, in the order of the tree's coordinates.
    pub joints: Vec<Joint>,
    /// Inertial properties of the links of the tree.
    pub links: Vec<LinkProperties>,
    /// Inertia of the rotors that each joint turns, kg m2 or kg.
    pub armature: Vec<Property>,
    /// Acceleration of gravity in the frame of the base, m/s2.
    pub gravity: [Property; 3],
}

/// Endings of the parameters that state properties of a link, in the order of [`LinkProperties`].
const LINK_ENDINGS: [&str; 19] = [
    "mass_kg",
    "com_x_m",
    "com_y_m",
    "com_z_m",
    "inertia_xx_kg_m2",
    "inertia_yy_kg_m2",
    "inertia_zz_kg_m2",
    "inertia_xy_kg_m2",
    "inertia_xz_kg_m2",
    "inertia_yz_kg_m2",
    "moment_x_kg_m",
    "moment_y_kg_m",
    "moment_z_kg_m",
    "origin_inertia_xx_kg_m2",
    "origin_inertia_yy_kg_m2",
    "origin_inertia_zz_kg_m2",
    "origin_inertia_xy_kg_m2",
    "origin_inertia_xz_kg_m2",
    "origin_inertia_yz_kg_m2",
];

/// Endings of the parameters that state the ten inertial parameters of a link directly, in the order of `augsim_robot`.
pub const LINEAR_ENDINGS: [&str; 10] = [
    "mass_kg",
    "moment_x_kg_m",
    "moment_y_kg_m",
    "moment_z_kg_m",
    "origin_inertia_xx_kg_m2",
    "origin_inertia_xy_kg_m2",
    "origin_inertia_xz_kg_m2",
    "origin_inertia_yy_kg_m2",
    "origin_inertia_yz_kg_m2",
    "origin_inertia_zz_kg_m2",
];

/// Names of the parameters that state the acceleration of gravity.
const GRAVITY_NAMES: [&str; 3] = ["gravity_x_m_s2", "gravity_y_m_s2", "gravity_z_m_s2"];

/// Name of a joint or link in expressions: characters that no name may have become `_`.
pub fn plain_name(name: &str) -> String {
    let letters = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' });
    let plain: String = letters.collect();
    if plain.starts_with(|c: char| c.is_ascii_alphabetic()) { plain } else { format!("n_{plain}") }
}

/// The robot of a model file and its joints, before the expressions are read.
#[derive(Debug)]
pub(super) struct Declared {
    file: String,
    text: Arc<str>,
    description: Arc<Robot>,
    tree: Arc<Tree>,
    /// Names of the joints in expressions.
    pub(super) joints: Vec<String>,
    gravity: [f64; 3],
}

/// Reads the description file and the joints of the section `[robot]`; `None` if the file has no such section.
pub(super) fn declare(file: &Item<'_, '_>) -> Result<Option<Declared>, ModelError> {
    let Some(item) = file.entry("robot") else { return Ok(None) };
    item.table("a table, such as [robot] with file = \"arm.urdf\" and joints = [\"joint1\"]")?;
    item.check_keys(&[
        "file",
        "joints",
        "locked",
        "gravity_m_s2",
        "base",
        "position",
        "speed",
        "acceleration",
        "torque",
    ])?;
    let missing = |key, example| item.error(Fault::Missing { key, example });
    let path = item.entry("file").ok_or_else(|| missing("file", "file = \"arm.urdf\""))?;
    let path_text = path.text("the path of a URDF or MJCF file in quotes")?;
    if let Some(base) = item.entry("base") {
        base.word(&[("fixed", ())], "\"fixed\"; robots with a moving base are not supported")?;
    }
    let text = description_text(&path, path_text)?;
    let description =
        augsim_robot::read(&text, path_text).map_err(|e| path.error(robot_fault(&e.to_string())))?;
    let list = item.entry("joints").ok_or_else(|| missing("joints", "joints = [\"joint1\", \"joint2\"]"))?;
    let joints = list.texts("a list of the joints that move, such as [\"joint1\", \"joint2\"]")?;
    let mut locked = BTreeMap::new();
    if let Some(table) = item.entry("locked") {
        for (name, value) in table.entries("a table such as { finger = 0.0 }")? {
            locked.insert(name.to_owned(), value.number()?);
        }
    }
    let tree =
        Tree::new(&description, &joints, &locked).map_err(|e| list.error(robot_fault(&e.to_string())))?;
    if item.entry("torque").is_some() {
        tree.check_inertia(&description).map_err(|e| list.error(robot_fault(&e.to_string())))?;
    }
    let gravity = match item.entry("gravity_m_s2") {
        Some(entry) => {
            let expected = "a list of three numbers, such as [0.0, 0.0, -9.81]";
            let found = entry.numbers(expected)?;
            <[f64; 3]>::try_from(found).map_err(|_| entry.wrong(expected))?
        }
        None => description.gravity_m_s2.unwrap_or(STANDARD_GRAVITY),
    };
    Ok(Some(Declared {
        file: path_text.to_owned(),
        text: text.into(),
        description: Arc::new(description),
        tree: Arc::new(tree),
        joints: joints.iter().map(|name| plain_name(name)).collect(),
        gravity,
    }))
}

/// The fault that a message describes, on one line and with control characters escaped.
fn robot_fault(message: &str) -> Fault {
    let cause = escape_control_characters(message).replace('\t', "\\t").replace('\n', " ");
    Fault::Robot { cause }
}

/// Reads the text of a description file, whose path is relative to the folder of the model file.
fn description_text(item: &Item<'_, '_>, path: &str) -> Result<String, ModelError> {
    let folder = Path::new(item.reader.file).parent().unwrap_or(Path::new(""));
    let path = folder.join(path);
    let wrong = |cause: String| item.error(robot_fault(&format!("{}: {cause}", path.display())));
    let about = std::fs::metadata(&path).map_err(|e| wrong(format!("{e}; check the path")))?;
    if !about.is_file() {
        return Err(wrong("not a file; give the path of a URDF or MJCF file".into()));
    }
    if about.len() > MAX_FILE_BYTES as u64 {
        return Err(wrong(format!("{} bytes, but at most {MAX_FILE_BYTES} are allowed", about.len())));
    }
    std::fs::read_to_string(&path).map_err(|e| wrong(format!("{e}; check the path")))
}

impl Declared {
    /// Reads the expressions of the joints with `read`, and assigns the parameters of the model to the robot's properties.
    pub(super) fn complete(
        self,
        file: &Item<'_, '_>,
        model: &Model,
        mut read: impl FnMut(&Item<'_, '_>) -> Result<Expression, ModelError>,
    ) -> Result<RobotModel, ModelError> {
        let Some(item) = file.entry("robot") else {
            return Err(file.error(Fault::Missing { key: "robot", example: "[robot]" }));
        };
        let count = self.joints.len();
        let mut list = |key: &'static str| -> Result<Option<Vec<Expression>>, ModelError> {
            let Some(entry) = item.entry(key) else { return Ok(None) };
            let expected = "a list with one expression in quotes for each joint";
            let values = entry.value.get_ref().as_array().ok_or_else(|| entry.wrong(expected))?;
            if values.len() != count {
                let cause = format!(
                    "the list has {} expressions, but `joints` has {count}; give one expression for each joint",
                    values.len()
                );
                return Err(entry.error(Fault::Robot { cause }));
            }
            values
                .iter()
                .map(|value| read(&Item { value, ..entry.clone() }))
                .collect::<Result<_, _>>()
                .map(Some)
        };
        let missing = |key, example| item.error(Fault::Missing { key, example });
        let positions = list("position")?.ok_or_else(|| {
            missing("position", "position = [\"q1_rad\"], with one expression for each joint")
        })?;
        let speeds = list("speed")?
            .ok_or_else(|| missing("speed", "speed = [\"w1_rad_s\"], with one expression for each joint"))?;
        let (accelerations, torques) = (list("acceleration")?, list("torque")?);
        let joints = (0..count).map(|i| Joint {
            name: self.joints[i].clone(),
            position: positions[i].clone(),
            speed: speeds[i].clone(),
            acceleration: accelerations.as_ref().map(|list| list[i].clone()),
            torque: torques.as_ref().map(|list| list[i].clone()),
        });
        let joints = joints.collect();
        Ok(RobotModel {
            links: self.link_properties(model),
            armature: self.armature(model),
            gravity: std::array::from_fn(|axis| property(model, GRAVITY_NAMES[axis], self.gravity[axis])),
            joints,
            file: self.file,
            text: self.text,
            description: self.description,
            tree: self.tree,
        })
    }

    /// Inertial properties of the links of the tree, from the description file or parameters of the model.
    fn link_properties(&self, model: &Model) -> Vec<LinkProperties> {
        let of_link = |attached: &augsim_robot::tree::Attached| {
            let link = &self.description.links[attached.link];
            let name = plain_name(&link.name);
            let own = |ending: usize| format!("{name}_{}", LINK_ENDINGS[ending]);
            let inertia = link.inertia.unwrap_or(augsim_robot::description::Inertia {
                mass_kg: 0.0,
                centre_m: [0.0; 3],
                inertia_kg_m2: [0.0; 6],
            });
            LinkProperties {
                mass: property(model, &own(0), inertia.mass_kg),
                centre: std::array::from_fn(|k| property(model, &own(1 + k), inertia.centre_m[k])),
                inertia: std::array::from_fn(|k| property(model, &own(4 + k), inertia.inertia_kg_m2[k])),
                moment: std::array::from_fn(|k| model.parameter(&own(10 + k))),
                origin_inertia: std::array::from_fn(|k| model.parameter(&own(13 + k))),
                name,
            }
        };
        self.tree.links.iter().map(of_link).collect()
    }

    /// Inertias of the rotors that each joint turns, its own and those of the joints that follow it.
    fn armature(&self, model: &Model) -> Vec<Property> {
        let of_joint = |(name, nominal): (&String, f64)| {
            let other = property(model, &format!("{name}_armature_kg"), nominal);
            match model.parameter(&format!("{name}_armature_kg_m2")) {
                Some(index) => Property::Parameter(index),
                None => other,
            }
        };
        self.joints.iter().zip(self.tree.armature(&self.description)).map(of_joint).collect()
    }
}

/// The parameter of the model with this name, or else the value of the file.
fn property(model: &Model, name: &str, value: f64) -> Property {
    model.parameter(name).map_or(Property::File(value), Property::Parameter)
}

impl RobotModel {
    /// Names of the joints in expressions.
    pub fn joint_names(&self) -> impl Iterator<Item = String> + '_ {
        self.joints.iter().map(|joint| joint.name.clone())
    }

    /// Index of the joint with this name in expressions; `None` if there is none.
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Whether a joint is prismatic; otherwise it is revolute.
    pub fn is_prismatic(&self, joint: usize) -> bool {
        let body = self.tree.bodies.iter().find(|body| body.coordinate == joint && body.ratio == 1.0);
        body.is_some_and(|body| body.is_prismatic)
    }

    /// Unit of the torque of a joint: N m, or N for a prismatic joint; `None` for an unknown joint.
    pub fn torque_unit(&self, joint: usize) -> Option<Unit> {
        self.joints.get(joint)?;
        Unit::parse(if self.is_prismatic(joint) { "N" } else { "N m" })
    }

    /// Unit of the acceleration of a joint: rad/s^2, or m/s^2 for a prismatic joint; `None` for an unknown joint.
    pub fn acceleration_unit(&self, joint: usize) -> Option<Unit> {
        self.joints.get(joint)?;
        Unit::parse(if self.is_prismatic(joint) { "m/s^2" } else { "rad/s^2" })
    }

    /// Indices of the parameters of the model that state properties of the robot.
    pub fn parameters(&self) -> impl Iterator<Item = usize> + '_ {
        let of = |property: &Property| match property {
            Property::Parameter(index) => Some(*index),
            Property::File(_) => None,
        };
        let links = self.links.iter().flat_map(move |link| {
            let listed = std::iter::once(&link.mass).chain(&link.centre).chain(&link.inertia);
            let direct = link.moment.iter().chain(&link.origin_inertia).filter_map(|index| *index);
            listed.filter_map(of).chain(direct).collect::<Vec<usize>>()
        });
        links.chain(self.armature.iter().chain(&self.gravity).filter_map(of))
    }

    /// Name, for users, of a quantity of the robot that an effect changes; empty for any other target.
    pub(crate) fn target_name(&self, target: Target) -> String {
        const PARAMETERS: [&str; 10] =
            ["mass", "moment x", "moment y", "moment z", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"];
        match target {
            Target::Joint(joint) => format!("torque on {}", self.joints[joint].name),
            Target::Inertia(link, k) => format!("{} of {}", PARAMETERS[k], self.links[link].name),
            Target::Armature(joint) => format!("rotor inertia of {}", self.joints[joint].name),
            Target::Gravity(axis) => format!("gravity along {}", ["x", "y", "z"][axis]),
            _ => String::new(),
        }
    }

    /// Unit of a quantity of the robot that an effect changes; `None` for any other target.
    pub(crate) fn target_unit(&self, target: Target) -> Option<Unit> {
        match target {
            Target::Joint(joint) => self.torque_unit(joint),
            Target::Inertia(_, 0) => Unit::parse("kg"),
            Target::Inertia(_, 1..=3) => Unit::parse("kg m"),
            Target::Inertia(..) => Unit::parse("kg m^2"),
            Target::Armature(joint) => Unit::parse(if self.is_prismatic(joint) { "kg" } else { "kg m^2" }),
            Target::Gravity(_) => Unit::parse("m/s^2"),
            _ => None,
        }
    }

    /// Typical size of a property of the robot in its unit; 1 if the description file gives none.
    pub(crate) fn typical_property(&self, target: Target) -> f64 {
        let mass = self.links.iter().filter_map(|link| link.mass.of_file()).fold(0.0, f64::max);
        match target {
            Target::Inertia(..) if mass > 0.0 => mass,
            Target::Gravity(_) => STANDARD_GRAVITY[2].abs(),
            _ => 1.0,
        }
    }

    /// Acceleration of gravity along an axis, from the files; 0 if it is a parameter.
    pub(crate) fn nominal_gravity(&self, axis: usize) -> f64 {
        self.gravity[axis].of_file().unwrap_or(0.0)
    }

    /// Quantities of the model that are the position, speed or acceleration of a joint by themselves.
    pub(crate) fn motion_symbols(&self) -> impl Iterator<Item = Symbol> + '_ {
        let motion = self.joints.iter().flat_map(|joint| {
            [Some(&joint.position), Some(&joint.speed), joint.acceleration.as_ref()].into_iter().flatten()
        });
        motion.flat_map(|expression| expression.tree.symbols())
    }

    /// All expressions of the joints.
    pub fn expressions(&self) -> impl Iterator<Item = &Expression> {
        self.joints.iter().flat_map(|joint| {
            let always = [&joint.position, &joint.speed];
            always.into_iter().chain(&joint.acceleration).chain(&joint.torque)
        })
    }

    /// Inertial parameters of the bodies of the tree: mass, mass times centre, and inertia about the origin.
    ///
    /// `value_of` gives the value of a parameter of the model; `change` what effects add to parameter `k` of a link.
    pub(crate) fn body_parameters<A: Algebra>(
        &self,
        a: &mut A,
        mut value_of: impl FnMut(&mut A, usize) -> A::Value,
        mut change: impl FnMut(&mut A, usize, usize, A::Value) -> A::Value,
    ) -> Vec<[A::Value; 10]> {
        let mut links = Vec::with_capacity(self.links.len());
        for (index, link) in self.links.iter().enumerate() {
            let values = link_values(a, link, &mut value_of);
            let mut changed = values;
            for (k, value) in values.into_iter().enumerate() {
                changed[k] = change(a, index, k, value);
            }
            links.push(changed);
        }
        self.tree.body_parameters(a, &links)
    }

    /// Value of a joint's torque or acceleration at one point, without effects; 0 for any other symbol.
    pub(crate) fn value(&self, symbol: Symbol, bindings: &dyn Bindings) -> f64 {
        let a = &mut Numbers;
        let value = |expression: &Expression| expression.tree.value(bindings);
        let of = |property: &Property| match property {
            Property::File(value) => *value,
            Property::Parameter(index) => bindings.symbol(Symbol::Parameter(*index)),
        };
        let parameters =
            self.body_parameters(a, |_, p| bindings.symbol(Symbol::Parameter(p)), |_, _, _, v| v);
        let gravity = self.gravity.each_ref().map(of);
        let armature: Vec<f64> = self.armature.iter().map(of).collect();
        let position: Vec<f64> = self.joints.iter().map(|j| value(&j.position)).collect();
        let speed: Vec<f64> = self.joints.iter().map(|j| value(&j.speed)).collect();
        let listed = |of: fn(&Joint) -> Option<&Expression>| -> Vec<f64> {
            self.joints.iter().map(|j| of(j).map_or(0.0, value)).collect()
        };
        match symbol {
            Symbol::JointTorque(joint) => {
                let acceleration = listed(|j| j.acceleration.as_ref());
                let torques =
                    inverse_dynamics(a, &self.tree, &parameters, gravity, &position, &speed, &acceleration);
                torques[joint] + armature[joint] * acceleration[joint]
            }
            Symbol::JointAcceleration(joint) => {
                let torque = listed(|j| j.torque.as_ref());
                forward_dynamics(a, &self.tree, &parameters, gravity, &armature, &position, &speed, &torque)
                    [joint]
            }
            _ => 0.0,
        }
    }
}

/// The ten inertial parameters of a link about the origin of its frame, in the order of `augsim_robot`.
pub(super) fn link_values<A: Algebra>(
    a: &mut A,
    link: &LinkProperties,
    value_of: &mut impl FnMut(&mut A, usize) -> A::Value,
) -> [A::Value; 10] {
    let mut of = |a: &mut A, property: &Property| match property {
        Property::File(value) => a.constant(*value),
        Property::Parameter(index) => value_of(a, *index),
    };
    let mass = of(a, &link.mass);
    let centre = link.centre.each_ref().map(|property| of(a, property));
    let inertia = link.inertia.each_ref().map(|property| of(a, property));
    let mut moment = centre.map(|c| a.multiply(mass, c));
    for (value, parameter) in moment.iter_mut().zip(link.moment) {
        if let Some(parameter) = parameter {
            *value = value_of(a, parameter);
        }
    }
    // Inertia about the origin by the parallel-axis theorem; xx, yy, zz, xy, xz, yz.
    let square = centre.map(|c| a.multiply(c, c));
    let mut origin = inertia;
    for (k, [i, j]) in [[1, 2], [0, 2], [0, 1]].into_iter().enumerate() {
        let sum = a.add(square[i], square[j]);
        let moved = a.multiply(mass, sum);
        origin[k] = a.add(inertia[k], moved);
    }
    for (k, [i, j]) in [[0, 1], [0, 2], [1, 2]].into_iter().enumerate() {
        let product = a.multiply(centre[i], centre[j]);
        let moved = a.multiply(mass, product);
        origin[3 + k] = a.subtract(inertia[3 + k], moved);
    }
    for (value, parameter) in origin.iter_mut().zip(link.origin_inertia) {
        if let Some(parameter) = parameter {
            *value = value_of(a, parameter);
        }
    }
    let [xx, yy, zz, xy, xz, yz] = origin;
    [mass, moment[0], moment[1], moment[2], xx, xy, xz, yy, yz, zz]
}

impl Model {
    /// Torque of a joint's drive or of its inverse dynamics at one point, N m or N.
    pub(crate) fn joint_torque(&self, joint: usize, bindings: &dyn Bindings) -> f64 {
        let Some(robot) = &self.robot else { return 0.0 };
        match robot.joints.get(joint) {
            Some(Joint { acceleration: None, torque: Some(torque), .. }) => torque.tree.value(bindings),
            _ => robot.value(Symbol::JointTorque(joint), bindings),
        }
    }
}
