//! Reader of URDF files.

mod joint;
mod transmission;

use crate::description::{Format, Inertia, Link, Robot};
use crate::error::DescriptionError;
use crate::rotation::{from_roll_pitch_yaw, rotate_tensor};
use crate::xml::{Element, Lines, parse, xacro_error};
use crate::{origins::Origins, structure};

/// Reads a URDF file.
///
/// `file` is its name for messages. Links, joints, their limits, friction and couplings (`mimic`), and transmissions are
/// read; elements for drawing, collisions and simulators are skipped. Joints of the types `floating` and `planar` are listed
/// as not supported. Format: <https://wiki.ros.org/urdf/XML>.
///
/// # Errors
///
/// XML that is not well-formed or too large, numbers that are not finite, names that do not exist or exist twice, links that
/// do not form one tree, and masses that no body has.
pub fn read_urdf(text: &str, file: &str) -> Result<Robot, DescriptionError> {
    read_with_origins(text, file).map(|(robot, _)| robot)
}

/// Reads a URDF file, and where in the text its links and joints are.
pub(crate) fn read_with_origins(text: &str, file: &str) -> Result<(Robot, Origins), DescriptionError> {
    let document = parse(text, file)?;
    let lines = Lines::new(text);
    let root = Element::new(document.root_element(), file, &lines);
    if root.tag() != "robot" {
        let problem = format!("the first element is <{}> instead of <robot>", root.tag());
        return Err(root.error(problem, "give a URDF file"));
    }
    for element in root.children() {
        refuse_macros(element, file)?;
    }
    let mut robot = Robot {
        name: root.attribute("name").unwrap_or("robot").into(),
        file: file.into(),
        format: Format::Urdf,
        links: Vec::new(),
        joints: Vec::new(),
        actuators: Vec::new(),
        gravity_m_s2: None,
        unsupported: Vec::new(),
    };
    let mut origins = Origins::default();
    for element in root.children().filter(|element| element.tag() == "link") {
        robot.links.push(read_link(element)?);
        origins.links.push(Some(element.range().start));
        structure::check_count(&robot)?;
    }
    let joints: Vec<Element> = root.children().filter(|element| element.tag() == "joint").collect();
    joint::read_joints(&joints, &mut robot)?;
    origins.joints = joints.iter().map(|element| Some(element.range().start)).collect();
    structure::check(&robot)?;
    joint::list_unsupported_types(&joints, &mut robot);
    for element in root.children().filter(|element| element.tag() == "transmission") {
        transmission::read(element, &mut robot)?;
        structure::check_count(&robot)?;
    }
    structure::check(&robot)?;
    Ok((robot, origins))
}

/// Refuses elements of xacro, which would have to be expanded first.
fn refuse_macros(element: Element, file: &str) -> Result<(), DescriptionError> {
    let is_macro = |namespace: Option<&str>| namespace.is_some_and(|name| name.contains("xacro"));
    let within = element.node().descendants().filter(roxmltree::Node::is_element);
    match within.into_iter().find(|node| is_macro(node.tag_name().namespace())) {
        Some(_) => Err(xacro_error(file, element.line())),
        None => Ok(()),
    }
}

/// Reads a link.
fn read_link(element: Element) -> Result<Link, DescriptionError> {
    let name = element.required("name")?;
    let inertia = match element.child("inertial") {
        Some(inertial) => Some(read_inertia(name, inertial)?),
        None => None,
    };
    Ok(Link { name: name.into(), line: element.line(), inertia, shift_m: [0.0; 3] })
}

/// Reads the inertia of a link, along the axes of the link.
///
/// The tensor of the file is along the axes of `<inertial><origin rpy=...>`.
fn read_inertia(link: &str, inertial: Element) -> Result<Inertia, DescriptionError> {
    let missing = |what: &str| {
        inertial.error(format!("<inertial> of link `{link}` has no {what}"), format!("add {what}"))
    };
    let (rotation, centre_m) = read_origin(inertial)?;
    let mass = inertial.child("mass").ok_or_else(|| missing("<mass value=\"...\"/>"))?;
    let mass_kg = mass.number("value")?.ok_or_else(|| missing("<mass value=\"...\"/>"))?;
    let mut values = [0.0; 6];
    if let Some(tensor) = inertial.child("inertia") {
        for (value, name) in values.iter_mut().zip(["ixx", "iyy", "izz", "ixy", "ixz", "iyz"]) {
            *value = tensor.number(name)?.unwrap_or(0.0);
        }
    } else if mass_kg != 0.0 {
        return Err(missing("<inertia ixx=\"...\" .../>"));
    }
    Ok(Inertia { mass_kg, centre_m, inertia_kg_m2: rotate_tensor(&rotation, values) })
}

/// Orientation and position of the `<origin>` of an element; that of the parent frame where it has none.
fn read_origin(element: Element) -> Result<([[f64; 3]; 3], [f64; 3]), DescriptionError> {
    let Some(origin) = element.child("origin") else { return Ok((from_roll_pitch_yaw([0.0; 3]), [0.0; 3])) };
    let angles = origin.vector::<3>("rpy")?.unwrap_or([0.0; 3]);
    Ok((from_roll_pitch_yaw(angles), origin.vector::<3>("xyz")?.unwrap_or([0.0; 3])))
}
