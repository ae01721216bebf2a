//! Parses the file names of the MIT Push set, which state the settings of a push.
//!
//! Names are `motion_surface=plywood_shape=hex_a=0_v=150_i=1.000_s=0.000_t=-0.349`, with `_rep=0004` for
//! repeats (Yu, Bauza, Fazeli and Rodriguez, IROS 2016), and `block=steel_run=01` for the preliminary pushes.
//! Lengths are millimetres in the names and metres here.

use super::error::PushError;
use super::fault::NameFault;
use std::fmt;
use std::path::Path;

/// Defines an enumeration whose values have the names that the file names use.
macro_rules! names {
    ($(#[$doc:meta])* $kind:ident: $($(#[$variant_doc:meta])* $variant:ident = $name:literal),+ $(,)?) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum $kind { $($(#[$variant_doc])* $variant),+ }

        impl $kind {
            /// All values of the enumeration.
            pub const ALL: &'static [$kind] = &[$($kind::$variant),+];

            /// Name of the value in file names.
            pub fn name(self) -> &'static str {
                match self { $($kind::$variant => $name),+ }
            }

            /// Finds the value whose name in file names is `name`; `None` for an unknown name.
            pub fn from_name(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|known| known.name() == name)
            }
        }
    };
}

names! {
    /// Support on which the object slides.
    Surface:
    /// Support of ABS plastic.
    Abs = "abs",
    /// Support of Delrin.
    Delrin = "delrin",
    /// Support of plywood.
    Plywood = "plywood",
    /// Support of polyurethane.
    Pu = "pu",
}

names! {
    /// Object that is pushed.
    PushShape:
    /// Square of 90 mm.
    Rect1 = "rect1",
    /// Rectangle 90 x 112.6 mm.
    Rect2 = "rect2",
    /// Rectangle 135 x 90 mm.
    Rect3 = "rect3",
    /// Right triangle, legs 125.9 and 125.9 mm.
    Tri1 = "tri1",
    /// Right triangle, legs 151 and 125.9 mm.
    Tri2 = "tri2",
    /// Right triangle, legs 176.5 and 125.6 mm.
    Tri3 = "tri3",
    /// Disc of radius 52.5 mm.
    Ellip1 = "ellip1",
    /// Ellipse, semi-axes 52.5 and 65.4 mm.
    Ellip2 = "ellip2",
    /// Ellipse, semi-axes 52.5 and 78.5 mm.
    Ellip3 = "ellip3",
    /// Hexagon of circumradius 60.5 mm.
    Hex = "hex",
    /// Butter knife outline of 636 points.
    Butter = "butter",
}

names! {
    /// Block that is pushed in the preliminary pushes.
    Block:
    /// Steel square of 98.95 mm.
    Steel = "steel",
    /// Aluminium block, size not documented.
    Al = "al",
    /// Plastic block, size not documented.
    Plastic = "plastic",
}

impl PushShape {
    /// Number of sides of the outline, which the field `i` of a file name counts; 1 for curved outlines.
    pub fn sides(self) -> u32 {
        match self {
            PushShape::Rect1 | PushShape::Rect2 | PushShape::Rect3 => 4,
            PushShape::Tri1 | PushShape::Tri2 | PushShape::Tri3 => 3,
            PushShape::Hex => 6,
            PushShape::Ellip1 | PushShape::Ellip2 | PushShape::Ellip3 | PushShape::Butter => 1,
        }
    }

    /// Maximum friction torque divided by maximum friction force on the support under uniform pressure, m.
    ///
    /// It is the mean distance of the area from the centroid, by integration over the outline.
    pub fn uniform_c_m(self) -> f64 {
        match self {
            PushShape::Rect1 => 0.034434,
            PushShape::Rect2 => 0.038884,
            PushShape::Rect3 => 0.043557,
            PushShape::Tri1 => 0.037947,
            PushShape::Tri2 => 0.041833,
            PushShape::Tri3 => 0.045922,
            PushShape::Ellip1 => 0.034996,
            PushShape::Ellip2 => 0.039429,
            PushShape::Ellip3 => 0.044093,
            PushShape::Hex => 0.036783,
            PushShape::Butter => 0.045943,
        }
    }

    /// Position of the object's area centroid in the frame that motion capture tracks, m.
    ///
    /// The triangles are tracked at a point 45 mm from both legs: vertices (d, d), (d - b, d), (d, d - a)
    /// (the set's shape table). All others are tracked at their centroid, the butter outline to 1e-17 m.
    pub fn centroid_m(self) -> [f64; 2] {
        const D: f64 = 0.045;
        let triangle = |a: f64, b: f64| [D - b / 3.0, D - a / 3.0];
        match self {
            PushShape::Tri1 => triangle(0.12587, 0.12590),
            PushShape::Tri2 => triangle(0.12587, 0.15100),
            PushShape::Tri3 => triangle(0.12561, 0.1765),
            _ => [0.0, 0.0],
        }
    }
}

/// Settings of a push of the main series of the MIT Push set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Support on which the object slides.
    pub surface: Surface,
    /// Object that is pushed.
    pub shape: PushShape,
    /// Acceleration of the rod, m/s^2; 0 for constant speed.
    pub acceleration_m_s2: f64,
    /// Speed of the rod, m/s; `None` where it accelerates.
    pub speed_m_s: Option<f64>,
    /// Index of the side of the outline that is pushed, from 0.
    pub side: u32,
    /// Position of the contact along the side (or the perimeter of a curved outline), 0 to 1.
    pub position: f64,
    /// Angle of the push direction from the contact normal, rad.
    pub angle_rad: f64,
    /// Number of the repetition of the same push; `None` without repetitions.
    pub repeat: Option<u32>,
}

/// Parsed file name of a push trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TrialName {
    /// Push of the main series, whose name states all its settings.
    Motion(Motion),
    /// Preliminary push, made before the main series; its name states only the block and the run.
    Preliminary {
        /// Block that is pushed.
        block: Block,
        /// Number of the preliminary run.
        run: u32,
    },
}

impl TrialName {
    /// Parses the file name of a push trial, without its extension (`.h5`, `.hdf5` or `.json`).
    ///
    /// An identifier that `Display` wrote is parsed as well.
    ///
    /// # Errors
    /// [`PushError::UnknownName`] and [`PushError::Name`].
    pub fn parse(path: &Path) -> Result<Self, PushError> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let stem = [".h5", ".hdf5", ".json"].iter().find_map(|e| name.strip_suffix(e)).unwrap_or(&name);
        let fields = Fields { path, stem };
        if let Some(settings) = stem.strip_prefix("motion_") {
            return fields.motion(settings).map(TrialName::Motion);
        }
        let [block, run] = fields.split(stem, ["block", "run"])?;
        let run = fields.number(run, "run")?;
        Ok(TrialName::Preliminary { block: fields.known(block, "block", Block::ALL, Block::name)?, run })
    }

    /// Group label of support and object, such as `plywood/hex` or `preliminary/steel`.
    pub fn group(&self) -> String {
        match self {
            TrialName::Motion(m) => format!("{}/{}", m.surface.name(), m.shape.name()),
            TrialName::Preliminary { block, .. } => format!("preliminary/{}", block.name()),
        }
    }

    /// Position of the object's area centroid in the frame that motion capture tracks, m.
    ///
    /// For the preliminary blocks it is not documented and assumed to be the tracked point (for steel it is
    /// within 2 mm).
    pub fn centroid_m(&self) -> [f64; 2] {
        match self {
            TrialName::Motion(m) => m.shape.centroid_m(),
            TrialName::Preliminary { .. } => [0.0, 0.0],
        }
    }
}

/// Parser of the `key=value` fields of a file name, with the path for messages.
struct Fields<'a> {
    path: &'a Path,
    stem: &'a str,
}

impl<'a> Fields<'a> {
    fn error(&self, fault: NameFault) -> PushError {
        PushError::Name { path: self.path.to_owned(), fault }
    }

    /// Values of the `key=value` pairs of `text`, whose keys must be `keys` in the same order.
    fn split<const N: usize>(&self, text: &'a str, keys: [&str; N]) -> Result<[&'a str; N], PushError> {
        let mut parts = text.split('_');
        let mut values = [""; N];
        for (value, key) in values.iter_mut().zip(keys) {
            let part = parts.next().unwrap_or_default();
            let value_text = part.strip_prefix(key).and_then(|text| text.strip_prefix('='));
            *value = value_text.ok_or_else(|| {
                let [expected, stem, found] = [key, self.stem, part].map(str::to_owned);
                self.error(NameFault::Key { expected, stem, found })
            })?;
        }
        match parts.next() {
            None => Ok(values),
            Some(more) => Err(self.error(NameFault::ExtraField { field: more.to_owned() })),
        }
    }

    /// Parses the value of a field that must be one of the known names of `all`.
    fn known<T: Copy>(
        &self,
        value: &str,
        field: &'static str,
        all: &[T],
        name: fn(T) -> &'static str,
    ) -> Result<T, PushError> {
        all.iter().copied().find(|&known| name(known) == value).ok_or_else(|| PushError::UnknownName {
            path: self.path.to_owned(),
            field,
            value: value.to_owned(),
            known: all.iter().map(|&known| name(known)).collect(),
        })
    }

    /// Parses the value of a field as a number.
    fn number<T: std::str::FromStr>(&self, value: &str, field: &str) -> Result<T, PushError> {
        let fault = || NameFault::NotNumber { field: field.to_owned(), value: value.to_owned() };
        value.parse().map_err(|_| self.error(fault()))
    }

    /// Parses the value of a field as a number and checks that it is within the range `within`.
    fn number_within(&self, value: &str, field: &str, within: [f64; 2]) -> Result<f64, PushError> {
        let number: f64 = self.number(value, field)?;
        if !(within[0]..=within[1]).contains(&number) {
            let (field, value) = (field.to_owned(), value.to_owned());
            return Err(self.error(NameFault::OutOfRange { field, value, within }));
        }
        Ok(number)
    }

    /// Parses the settings of a push of the main series from the rest of its file name.
    fn motion(&self, text: &'a str) -> Result<Motion, PushError> {
        let (text, repeat) = match text.rsplit_once("_rep=") {
            Some((text, repeat)) => (text, Some(self.number(repeat, "rep")?)),
            None => (text, None),
        };
        let [surface, shape, a, v, i, s, t] =
            self.split(text, ["surface", "shape", "a", "v", "i", "s", "t"])?;
        let surface = self.known(surface, "surface", Surface::ALL, Surface::name)?;
        let shape = self.known(shape, "shape", PushShape::ALL, PushShape::name)?;
        let side = self.number_within(i, "i", [0.0, f64::from(shape.sides() - 1)])?;
        if side.fract() != 0.0 {
            return Err(self.error(NameFault::NotWholeIndex { value: i.to_owned() }));
        }
        let speed = self.number_within(v, "v", [-1.0, 1e4])?;
        Ok(Motion {
            surface,
            shape,
            acceleration_m_s2: self.number_within(a, "a", [0.0, 1e5])? / 1000.0,
            speed_m_s: (speed >= 0.0).then_some(speed / 1000.0),
            side: side as u32,
            position: self.number_within(s, "s", [0.0, 1.0])?,
            angle_rad: self.number_within(
                t,
                "t",
                [-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2],
            )?,
            repeat,
        })
    }
}

impl fmt::Display for TrialName {
    /// Writes the file name without its extension.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TrialName::Motion(m) => {
                write!(
                    f,
                    "motion_surface={}_shape={}_a={:.0}_v={:.0}_i={:.3}_s={:.3}_t={:.3}",
                    m.surface.name(),
                    m.shape.name(),
                    m.acceleration_m_s2 * 1000.0,
                    m.speed_m_s.map_or(-1.0, |v| v * 1000.0),
                    f64::from(m.side),
                    m.position,
                    m.angle_rad
                )?;
                m.repeat.map_or(Ok(()), |repeat| write!(f, "_rep={repeat:04}"))
            }
            TrialName::Preliminary { block, run } => write!(f, "block={}_run={run:02}", block.name()),
        }
    }
}
