//! Reader of MJCF files, with the semantics of MuJoCo 3.3.2.

mod actuator;
mod actuator_values;
mod body;
mod classes;
mod equality;
mod geom;
mod inertia;
mod joint;
mod names;
mod orientation;
mod references;
mod settings;

use body::{Bodies, Reach};
use classes::Classes;
use names::Names;
use settings::Settings;

use crate::description::{Format, Link, Robot};
use crate::error::DescriptionError;
use crate::origins::Origins;
use crate::structure;
use crate::xml::{Element, Lines, parse};

/// Reads an MJCF file.
///
/// `file` is its name for messages. The world is the first link, called `world`; geoms count only for inertias. Elements
/// that change the motion and are not supported are listed in [`Robot::unsupported`]: ball and free joints, tendons, contact
/// pairs, constraints other than linear couplings of joints, `flex`, `composite`, `replicate`, plugins, and inertias that
/// follow from meshes. Format: <https://mujoco.readthedocs.io/en/3.3.2/XMLreference.html>.
///
/// # Errors
///
/// XML that is not well-formed or too large, `include`, numbers that are not finite, names that do not exist or exist twice,
/// and what MuJoCo's compiler refuses of the elements that are read.
pub fn read_mjcf(text: &str, file: &str) -> Result<Robot, DescriptionError> {
    read_with_origins(text, file).map(|(robot, _)| robot)
}

/// Reads an MJCF file, and where in the text its bodies and joints are.
pub(crate) fn read_with_origins(text: &str, file: &str) -> Result<(Robot, Origins), DescriptionError> {
    let document = parse(text, file)?;
    let lines = Lines::new(text);
    let root = Element::new(document.root_element(), file, &lines);
    if root.tag() != "mujoco" {
        let problem = format!("the first element is <{}> instead of <mujoco>", root.tag());
        return Err(root.error(problem, "give an MJCF file"));
    }
    refuse_includes(root)?;
    let mut unsupported = Vec::new();
    let settings = Settings::read(root, &mut unsupported)?;
    let classes = Classes::read(root)?;
    let world = root.child("worldbody").map_or(1, |world| world.line());
    let mut bodies = Bodies {
        settings: &settings,
        classes: &classes,
        robot: Robot {
            name: root.attribute("model").unwrap_or("MuJoCo Model").into(),
            file: file.into(),
            format: Format::Mjcf,
            links: vec![Link { name: "world".into(), line: world, inertia: None, shift_m: [0.0; 3] }],
            joints: Vec::new(),
            actuators: Vec::new(),
            gravity_m_s2: Some(settings.gravity),
            unsupported: Vec::new(),
        },
        origins: Origins { links: vec![None], joints: Vec::new() },
        names: Names::default(),
        pending: Vec::new(),
    };
    for section in root.children().filter(|section| section.tag() == "worldbody") {
        bodies.read_world(section)?;
    }
    bodies.names.give(&mut bodies.robot);
    structure::check(&bodies.robot)?;
    let is_body: Vec<bool> = bodies.origins.links.iter().map(Option::is_some).collect();
    inertia::apply_settings(&mut bodies.robot, &is_body, &settings);
    read_sections(root, &mut bodies)?;
    let Bodies { mut robot, origins, pending, .. } = bodies;
    unsupported.extend(references::resolve(&robot, pending));
    robot.unsupported = unsupported;
    structure::check(&robot)?;
    Ok((robot, origins))
}

/// Reads the sections that refer to joints and bodies.
fn read_sections(root: Element, bodies: &mut Bodies) -> Result<(), DescriptionError> {
    for section in root.children() {
        let mut elements = section.children();
        match section.tag() {
            "worldbody" | "compiler" | "option" | "default" | "size" | "visual" | "statistic" | "custom"
            | "asset" | "sensor" | "keyframe" | "extension" => {}
            "actuator" => elements.try_for_each(|element| actuator::read(element, bodies))?,
            "equality" => elements.try_for_each(|element| equality::read(element, bodies))?,
            "tendon" | "contact" | "deformable" => elements.try_for_each(|element| {
                if matches!(element.tag(), "exclude" | "skin") {
                    return Ok(());
                }
                bodies.add_references(&format!("{} {}", section.tag(), element.title()), element);
                bodies.check_count(element)
            })?,
            _ => bodies.add_pending(section.title(), section, Reach::Above(0)),
        }
    }
    Ok(())
}

/// Refuses models that consist of several files: only MuJoCo finds the others.
fn refuse_includes(root: Element) -> Result<(), DescriptionError> {
    let mut pending = vec![root];
    while let Some(element) = pending.pop() {
        if matches!(element.tag(), "include" | "attach") {
            let other = element.attribute("file").or(element.attribute("model")).unwrap_or_default();
            let problem =
                format!("<{}> adds `{other}`, which is another file and is not read", element.tag());
            let remedy = "save the whole model in one file: in Python, mujoco.mj_saveLastXML('whole.xml', \
                          mujoco.MjModel.from_xml_path('robot.xml'))";
            return Err(element.error(problem, remedy));
        }
        pending.extend(element.children());
    }
    Ok(())
}
