//! Settings of an MJCF file that change how its other elements are read: `compiler` and `option`.

use crate::description::Unsupported;
use crate::error::DescriptionError;
use crate::rotation::{IDENTITY, Matrix, about_axis, product};
use crate::xml::Element;

/// When the inertia of a body comes from its geoms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum InertiaFromGeom {
    /// Never.
    Never,
    /// Where the body has no `inertial`.
    Auto,
    /// Always, if the body has geoms.
    Always,
}

/// The settings.
#[derive(Debug, Clone)]
pub(super) struct Settings {
    /// Whether angles are in degrees; otherwise they are in rad.
    pub is_in_degrees: bool,
    /// Axis of each Euler angle (0 to 2), and whether it is fixed (upper case) or turns with the body (lower case).
    euler: [(usize, bool); 3],
    /// Whether a range that is stated limits.
    pub has_auto_limits: bool,
    /// When the inertia of a body comes from its geoms.
    pub inertia_from_geom: InertiaFromGeom,
    /// Groups of the geoms that have mass, first and last.
    pub inertia_groups: [f64; 2],
    /// Whether an impossible inertia is replaced by that of a sphere with the same trace.
    pub balances_inertia: bool,
    /// Smallest mass of a body, kg.
    pub min_mass: f64,
    /// Smallest principal moment of inertia of a body, kg m2.
    pub min_inertia: f64,
    /// Mass of the whole robot, to which all inertias are scaled, kg; not positive for no scaling.
    pub total_mass: f64,
    /// Acceleration of gravity, m/s2.
    pub gravity: [f64; 3],
    /// Whether couplings of joints act.
    pub has_equality: bool,
}

impl Settings {
    /// MuJoCo's settings where a file states none.
    fn new() -> Settings {
        Settings {
            is_in_degrees: true,
            euler: [(0, false), (1, false), (2, false)],
            has_auto_limits: true,
            inertia_from_geom: InertiaFromGeom::Auto,
            inertia_groups: [0.0, 5.0],
            balances_inertia: false,
            min_mass: 0.0,
            min_inertia: 0.0,
            total_mass: -1.0,
            gravity: [0.0, 0.0, -9.81],
            has_equality: true,
        }
    }

    /// Reads the settings of a file, whose sections may be repeated; lists options that are not supported.
    pub fn read(root: Element, unsupported: &mut Vec<Unsupported>) -> Result<Settings, DescriptionError> {
        let mut settings = Settings::new();
        for section in root.children() {
            match section.tag() {
                "compiler" => settings.read_compiler(section)?,
                "option" => settings.read_option(section, unsupported)?,
                _ => {}
            }
        }
        Ok(settings)
    }

    fn read_compiler(&mut self, element: Element) -> Result<(), DescriptionError> {
        if element.attribute("coordinate").is_some_and(|value| value != "local") {
            let problem = "compiler: global coordinates are no longer part of MJCF";
            return Err(element.error(problem, "load and save the file in MuJoCo 2.3.3 or older"));
        }
        match element.attribute("angle") {
            None => {}
            Some("degree") => self.is_in_degrees = true,
            Some("radian") => self.is_in_degrees = false,
            Some(_) => {
                return Err(
                    element.error("compiler: angle is neither degree nor radian", "write one of them")
                );
            }
        }
        if let Some(word) = element.attribute("eulerseq") {
            self.euler = parse_sequence(word).ok_or_else(|| {
                element.error(
                    "compiler: eulerseq is not three letters of xyzXYZ",
                    "write a sequence such as xyz",
                )
            })?;
        }
        self.inertia_from_geom = match element.attribute("inertiafromgeom") {
            None => self.inertia_from_geom,
            Some("false") => InertiaFromGeom::Never,
            Some("auto") => InertiaFromGeom::Auto,
            Some("true") => InertiaFromGeom::Always,
            Some(_) => {
                let problem = "compiler: inertiafromgeom is neither true, false nor auto";
                return Err(element.error(problem, "write one of them"));
            }
        };
        self.has_auto_limits = element.is_true("autolimits")?.unwrap_or(self.has_auto_limits);
        self.balances_inertia = element.is_true("balanceinertia")?.unwrap_or(self.balances_inertia);
        self.min_mass = element.number("boundmass")?.unwrap_or(self.min_mass);
        self.min_inertia = element.number("boundinertia")?.unwrap_or(self.min_inertia);
        self.total_mass = element.number("settotalmass")?.unwrap_or(self.total_mass);
        self.inertia_groups = element.vector("inertiagrouprange")?.unwrap_or(self.inertia_groups);
        Ok(())
    }

    fn read_option(&mut self, element: Element, list: &mut Vec<Unsupported>) -> Result<(), DescriptionError> {
        self.gravity = element.vector("gravity")?.unwrap_or(self.gravity);
        let mut unsupported = |element: Element, name: String| {
            list.push(Unsupported { element: name, line: element.line(), joints: Vec::new() });
        };
        for name in ["density", "viscosity"] {
            if element.number(name)?.is_some_and(|value| value != 0.0) {
                unsupported(element, format!("forces of a medium (option {name})"));
            }
        }
        for flag in element.children().filter(|child| child.tag() == "flag") {
            if flag.is_true("gravity")? == Some(false) {
                self.gravity = [0.0; 3];
            }
            if flag.is_true("equality")? == Some(false) {
                self.has_equality = false;
            }
            for name in ["passive", "frictionloss"] {
                if flag.is_true(name)? == Some(false) {
                    unsupported(
                        flag,
                        format!("flag {name}=\"disable\", which the values of the joints contradict"),
                    );
                }
            }
        }
        Ok(())
    }

    /// An angle of the file in rad.
    pub fn radians(&self, angle: f64) -> f64 {
        if self.is_in_degrees { angle.to_radians() } else { angle }
    }

    /// The rotation of three Euler angles in the units of the file.
    pub fn euler_rotation(&self, angles: [f64; 3]) -> Matrix {
        let turns = self.euler.iter().zip(angles);
        turns.fold(IDENTITY, |rotation, (&(axis, is_fixed), angle)| {
            let turn = about_axis(IDENTITY[axis], self.radians(angle));
            if is_fixed { product(&turn, &rotation) } else { product(&rotation, &turn) }
        })
    }
}

/// Axes of a sequence of Euler angles such as `xyz` or `ZYX`.
fn parse_sequence(word: &str) -> Option<[(usize, bool); 3]> {
    let axes: Option<Vec<(usize, bool)>> =
        word.chars().map(|letter| "xyzXYZ".find(letter).map(|k| (k % 3, k >= 3))).collect();
    axes?.try_into().ok()
}
