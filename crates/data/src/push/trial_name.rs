//! File names of the MIT Push set, and the settings that they state.
//!
//! `motion_surface=plywood_shape=hex_a=0_v=150_i=1.000_s=0.000_t=-0.349`, with `_rep=0004` for repeats
//! (Yu, Bauza, Fazeli and Rodriguez, IROS 2016), and `block=steel_run=01` for its preliminary pushes.
//! Lengths in the names are millimetres; here they are metres.

use super::error::PushError;
use super::fault::NameFault;
use std::fmt;
use std::path::Path;

/// Closed list of names: what is outside it is refused.
macro_rules! names {
    ($(#[$doc:meta])* $kind:ident: $($(#[$variant_doc:meta])* $variant:ident = $name:literal),+ $(,)?) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum $kind { $($(#[$variant_doc])* $variant),+ }

        impl $kind {
            /// All of them.
            pub const ALL: &'static [$kind] = &[$($kind::$variant),+];

            /// Name as the files have it.
            pub fn name(self) -> &'static str {
                match self { $($kind::$variant => $name),+ }
            }

            /// The one called `name`.
            pub fn from_name(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|known| known.name() == name)
            }
        }
    };
}

names! {
    /// Support on which the object slides.
    Surface:
    /// ABS plastic.
    Abs = "abs",
    /// Delrin.
    Delrin = "delrin",
    /// Plywood.
    Plywood = "plywood",
    /// Polyurethane.
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
    /// Block of the preliminary pushes.
    Block:
    /// Steel square of 98.95 mm.
    Steel = "steel",
    /// Aluminium, size not documented.
    Al = "al",
    /// Plastic, size not documented.
    Plastic = "plastic",
}

impl PushShape {
    /// Number of sides that the field `i` counts; 1 for curved outlines.
    pub fn sides(self) -> u32 {
        match self {
            PushShape::Rect1 | PushShape::Rect2 | PushShape::Rect3 => 4,
            PushShape::Tri1 | PushShape::Tri2 | PushShape::Tri3 => 3,
            PushShape::Hex => 6,
            PushShape::Ellip1 | PushShape::Ellip2 | PushShape::Ellip3 | PushShape::Butter => 1,
        }
    }

    /// Mean distance from the centroid, m: the ratio of largest friction torque to largest friction force under
    /// uniform pressure, by integration over the outline.
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

    /// Area centroid in the tracked frame, m.
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

/// A push as it was planned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Support.
    pub surface: Surface,
    /// Object.
    pub shape: PushShape,
    /// Acceleration of the rod, m/s^2; 0 for constant speed.
    pub acceleration_m_s2: f64,
    /// Speed of the rod, m/s; `None` where it accelerates.
    pub speed_m_s: Option<f64>,
    /// Side of the outline, from 0.
    pub side: u32,
    /// Place on the side (or on the perimeter of a curved outline), 0 to 1.
    pub position: f64,
    /// Angle of the push from the contact normal, rad.
    pub angle_rad: f64,
    /// Number of the repetition.
    pub repeat: Option<u32>,
}

/// Name of a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TrialName {
    /// A trial of the published set.
    Motion(Motion),
    /// A preliminary push in the published layout.
    Preliminary {
        /// Object.
        block: Block,
        /// Number of the run.
        run: u32,
    },
}

impl TrialName {
    /// Parses the name of `path` (its extension `.h5`, `.hdf5` or `.json` is left out), or an identifier
    /// that [`TrialName`]'s `Display` wrote.
    ///
    /// # Errors
    /// [`PushError::UnknownName`] and [`PushError::Name`].
    pub fn parse(path: &Path) -> Result<Self, PushError> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let stem = [".h5", ".hdf5", ".json"].iter().find_map(|e| name.strip_suffix(e)).unwrap_or(&name);
        let fields = Fields { path, stem };
        if let Some(rest) = stem.strip_prefix("motion_") {
            return fields.motion(rest).map(TrialName::Motion);
        }
        let [block, run] = fields.split(stem, ["block", "run"])?;
        let run = fields.number(run, "run")?;
        Ok(TrialName::Preliminary { block: fields.known(block, "block", Block::ALL, Block::name)?, run })
    }

    /// Label that trials of the same support and object share: `plywood/hex`, `preliminary/steel`.
    pub fn group(&self) -> String {
        match self {
            TrialName::Motion(m) => format!("{}/{}", m.surface.name(), m.shape.name()),
            TrialName::Preliminary { block, .. } => format!("preliminary/{}", block.name()),
        }
    }

    /// Area centroid in the tracked frame, m; that of the preliminary blocks is not documented and is taken
    /// to be the tracked point (for steel it is within 2 mm).
    pub fn centroid_m(&self) -> [f64; 2] {
        match self {
            TrialName::Motion(m) => m.shape.centroid_m(),
            TrialName::Preliminary { .. } => [0.0, 0.0],
        }
    }
}

struct Fields<'a> {
    path: &'a Path,
    stem: &'a str,
}

impl<'a> Fields<'a> {
    fn wrong(&self, fault: NameFault) -> PushError {
        PushError::Name { path: self.path.to_owned(), fault }
    }

    /// Values of `key=value` pairs in this order.
    fn split<const N: usize>(&self, text: &'a str, keys: [&str; N]) -> Result<[&'a str; N], PushError> {
        let mut parts = text.split('_');
        let mut values = [""; N];
        for (value, key) in values.iter_mut().zip(keys) {
            let part = parts.next().unwrap_or_default();
            let of_key = part.strip_prefix(key).and_then(|rest| rest.strip_prefix('='));
            *value = of_key.ok_or_else(|| {
                let [expected, stem, found] = [key, self.stem, part].map(str::to_owned);
                self.wrong(NameFault::Key { expected, stem, found })
            })?;
        }
        match parts.next() {
            None => Ok(values),
            Some(more) => Err(self.wrong(NameFault::TooMany { field: more.to_owned() })),
        }
    }

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

    fn number<T: std::str::FromStr>(&self, value: &str, field: &str) -> Result<T, PushError> {
        let fault = || NameFault::NoNumber { field: field.to_owned(), value: value.to_owned() };
        value.parse().map_err(|_| self.wrong(fault()))
    }

    fn real(&self, value: &str, field: &str, within: [f64; 2]) -> Result<f64, PushError> {
        let number: f64 = self.number(value, field)?;
        if !(within[0]..=within[1]).contains(&number) {
            let (field, value) = (field.to_owned(), value.to_owned());
            return Err(self.wrong(NameFault::OutOfRange { field, value, within }));
        }
        Ok(number)
    }

    fn motion(&self, text: &'a str) -> Result<Motion, PushError> {
        let (text, repeat) = match text.rsplit_once("_rep=") {
            Some((text, repeat)) => (text, Some(self.number(repeat, "rep")?)),
            None => (text, None),
        };
        let [surface, shape, a, v, i, s, t] =
            self.split(text, ["surface", "shape", "a", "v", "i", "s", "t"])?;
        let surface = self.known(surface, "surface", Surface::ALL, Surface::name)?;
        let shape = self.known(shape, "shape", PushShape::ALL, PushShape::name)?;
        let side = self.real(i, "i", [0.0, f64::from(shape.sides() - 1)])?;
        if side.fract() != 0.0 {
            return Err(self.wrong(NameFault::NoIndex { value: i.to_owned() }));
        }
        let speed = self.real(v, "v", [-1.0, 1e4])?;
        Ok(Motion {
            surface,
            shape,
            acceleration_m_s2: self.real(a, "a", [0.0, 1e5])? / 1000.0,
            speed_m_s: (speed >= 0.0).then_some(speed / 1000.0),
            side: side as u32,
            position: self.real(s, "s", [0.0, 1.0])?,
            angle_rad: self.real(t, "t", [-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2])?,
            repeat,
        })
    }
}

impl fmt::Display for TrialName {
    /// The file name without its extension.
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
