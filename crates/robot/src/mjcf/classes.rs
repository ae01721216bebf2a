//! Default classes of an MJCF file: values of joints, geoms and actuators that elements and inner classes inherit.

use std::collections::BTreeMap;

use super::actuator_values::ActuatorValues;
use super::geom::GeomValues;
use super::joint::JointValues;
use crate::error::DescriptionError;
use crate::xml::Element;

/// Name of the outermost class.
pub(super) const MAIN: &str = "main";
/// Largest number of classes.
const MAX_CLASSES: usize = 2_000;

/// Values of a class.
#[derive(Debug, Clone)]
pub(super) struct Class {
    /// Values of joints.
    pub joint: JointValues,
    /// Values of geoms.
    pub geom: GeomValues,
    /// Values of actuators of every type, which share them.
    pub actuator: ActuatorValues,
    /// Whether couplings of joints act.
    pub is_active: bool,
}

/// The classes of a file.
#[derive(Debug, Clone)]
pub(super) struct Classes {
    classes: BTreeMap<String, Class>,
}

impl Classes {
    /// Reads the classes of a file.
    pub fn read(root: Element) -> Result<Classes, DescriptionError> {
        let main = Class {
            joint: JointValues::DEFAULT,
            geom: GeomValues::DEFAULT,
            actuator: ActuatorValues::DEFAULT,
            is_active: true,
        };
        let mut classes = Classes { classes: BTreeMap::from([(MAIN.to_owned(), main)]) };
        for section in root.children().filter(|child| child.tag() == "default") {
            match section.attribute("class") {
                None | Some(MAIN) => {}
                Some(name) => {
                    let problem = format!("the outermost default class is called `{name}`");
                    return Err(section.error(problem, "call it main, or put it inside another <default>"));
                }
            }
            classes.read_class(section, MAIN)?;
        }
        Ok(classes)
    }

    /// Reads the elements of a class, and the classes inside it, which inherit all of them.
    fn read_class(&mut self, section: Element, name: &str) -> Result<(), DescriptionError> {
        let mut class = self.named(name, section)?.clone();
        for element in section.children() {
            match element.tag() {
                "joint" => class.joint.apply(element)?,
                "geom" => class.geom.apply(element)?,
                "general" | "motor" | "position" | "velocity" => class.actuator.apply(element)?,
                "equality" => class.is_active = element.is_true("active")?.unwrap_or(class.is_active),
                _ => {}
            }
        }
        self.classes.insert(name.into(), class.clone());
        for inner in section.children().filter(|child| child.tag() == "default") {
            let Some(inner_name) = inner.attribute("class") else {
                let problem = format!("a default class inside `{name}` has no name");
                return Err(inner.error(problem, "add class=\"...\""));
            };
            if self.classes.contains_key(inner_name) {
                let problem = format!("the default class `{inner_name}` is declared a second time");
                return Err(inner.error(problem, "give it another name"));
            }
            if self.classes.len() == MAX_CLASSES {
                let problem = format!("the file has more than {MAX_CLASSES} default classes");
                return Err(inner.error(problem, "remove those that are not used"));
            }
            self.classes.insert(inner_name.into(), class.clone());
            self.read_class(inner, inner_name)?;
        }
        Ok(())
    }

    /// The class of an element: the one it names, or else the `inherited` one.
    pub fn of(&self, element: Element, inherited: &str) -> Result<&Class, DescriptionError> {
        self.named(element.attribute("class").unwrap_or(inherited), element)
    }

    /// The name of the class that elements inside a body or frame inherit.
    pub fn inherited<'a>(&self, element: Element<'a>, outer: &'a str) -> Result<&'a str, DescriptionError> {
        let name = element.attribute("childclass").unwrap_or(outer);
        self.named(name, element).map(|_| name)
    }

    /// The class with a name.
    fn named(&self, name: &str, element: Element) -> Result<&Class, DescriptionError> {
        self.classes.get(name).ok_or_else(|| {
            let problem = format!("{} has the class `{name}`, which does not exist", element.title());
            element.error(problem, format!("declare <default class=\"{name}\"> or correct the name"))
        })
    }
}
