//! Model files of planar pushing: `scenario = "push"`.

use super::parse::{Library, Reader, Value};
use super::{EffectBlock, ModelError, Place, Rule, read, write};
use crate::push::effects::{self, SCATTER_KIND, index_of};
use crate::push::{BASE_PARAMETERS, Object, World};
use augsim_system::{Parameter, Per, ScatterPer};
use std::fmt::Write as _;
use std::path::Path;
use toml::de::{DeTable, DeValue};

const PUSH: Library = Library {
    spec_of: effects::spec_of,
    similar_kinds: effects::similar_kinds,
    example: "kind = \"exact-surface\"",
};

/// A model of one object pushed by a rod.
///
/// ```
/// use augsim_physics::model::PushModel;
///
/// let text = r#"
/// scenario = "push"
/// object = "rect1"                 # or polygon_m = [[0.05, 0.0], [-0.03, 0.04], [-0.03, -0.04]]
/// [parameters]
/// contact_friction = { nominal = 0.25, min = 0.05, max = 1.0 }
/// rod_radius_m = 0.00475
/// [sensor]
/// position_sd_m = 0.0003
/// angle_sd_rad = 0.0017
/// [[effect]]
/// kind = "exact-surface"
/// "#;
/// let model = PushModel::parse(text, "push.toml").expect("a model");
/// let (world, parameters) = model.world();
/// assert_eq!(parameters.len(), world.parameter_count());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PushModel {
    /// Path of the model file, for messages.
    pub file: String,
    /// The object that the rod pushes.
    pub object: Object,
    /// Outline of the object as given in the file, vertices in m; `None` for a named object.
    pub polygon_m: Option<Vec<[f64; 2]>>,
    /// Base parameters in the order of [`BASE_PARAMETERS`]; frozen at their defaults if not in the file.
    ///
    /// The default of `c_m` is that of uniform pressure.
    pub parameters: Vec<Parameter>,
    /// Names of the base parameters that the file declares.
    pub declared: Vec<String>,
    /// Declared standard deviation of the position sensor, m; `None` if not declared.
    pub position_sd_m: Option<f64>,
    /// Declared standard deviation of the angle sensor, rad; `None` if not declared.
    pub angle_sd_rad: Option<f64>,
    /// Effects that the model file declares.
    pub effects: Vec<EffectBlock>,
}

impl PushModel {
    /// The textbook model of an object: ellipsoidal limit surface, uniform pressure, friction 0.25.
    ///
    /// The rod has a radius of 4.75 mm. `c_m` and `contact_friction` are calibrated.
    pub fn textbook(object: Object) -> Self {
        let mut parameters = base_parameters(&object);
        parameters[0].frozen = false;
        parameters[1].frozen = false;
        Self {
            file: "model".into(),
            object,
            polygon_m: None,
            parameters,
            declared: BASE_PARAMETERS.iter().map(|s| s.to_string()).collect(),
            position_sd_m: None,
            angle_sd_rad: None,
            effects: Vec::new(),
        }
    }

    /// Sets the nominal value of each base parameter to `value(name)`, where that is `Some`.
    pub fn with_nominal(mut self, value: impl Fn(&str) -> Option<f64>) -> Self {
        for p in &mut self.parameters {
            p.nominal = value(&p.name).unwrap_or(p.nominal);
        }
        self
    }

    /// Reads and parses the model file of a pushed object.
    ///
    /// # Errors
    /// [`ModelError`], with file, line and remedy.
    pub fn read(path: &Path) -> Result<Self, ModelError> {
        read(path, Self::parse)
    }

    /// Parses the text of a pushed object's model file; `file` is used in messages.
    ///
    /// # Errors
    /// [`ModelError`], with file, line and remedy.
    pub fn parse(text: &str, file: &str) -> Result<Self, ModelError> {
        let reader = Reader { text, file };
        let root = reader.root()?;
        let root = root.get_ref();
        let known = ["scenario", "object", "polygon_m", "parameters", "sensor", "effect"];
        reader.known(root, Place::File, &known)?;
        reader.scenario(root, "push", "scenario = \"push\"")?;
        let (object, polygon_m) = object(&reader, root)?;
        let mut parameters = base_parameters(&object);
        let mut declared = Vec::new();
        if let Some(value) = root.get("parameters") {
            let table = reader.table("parameters", value)?;
            reader.known(table, Place::Table("parameters"), &BASE_PARAMETERS)?;
            for p in &mut parameters {
                if let Some(v) = table.get(p.name.as_str()) {
                    // Given as a bare number, these count as measured and are frozen. The last two cannot be
                    // identified from poses anyway.
                    let measured = ["rod_radius_m", "support_friction", "mass_kg"].contains(&p.name.as_str());
                    let plain_number = v.get_ref().as_table().is_none();
                    reader.parameter(p, v, !(plain_number && measured))?;
                    if p.per == Per::Trajectory {
                        return Err(reader.wrong("per", v, "\"all\" or \"group\" in a model of pushing"));
                    }
                    declared.push(p.name.clone());
                }
            }
        }
        let mut sd = [None; 2];
        if let Some(value) = root.get("sensor") {
            let table = reader.table("sensor", value)?;
            let keys = ["position_sd_m", "angle_sd_rad"];
            reader.known(table, Place::Table("sensor"), &keys)?;
            for (key, slot) in keys.iter().zip(&mut sd) {
                if let Some(v) = table.get(*key) {
                    *slot = Some(reader.positive(key, v)?);
                }
            }
        }
        let effects = reader.effects(root, |block, earlier| {
            let value = block;
            let block = reader.listed(block, earlier, &PUSH, &[])?;
            if let Some(p) = block.parameters.iter().find(|p| p.per != Per::All) {
                let expected =
                    "\"all\" in [[effect]] blocks: effects of pushing have one value for all groups";
                return Err(reader.wrong(&format!("{}.per", p.name), value, expected));
            }
            let scatter = (block.kind == SCATTER_KIND).then_some(ScatterPer::Record);
            Ok(EffectBlock { scatter, ..block })
        })?;
        let [position_sd_m, angle_sd_rad] = sd;
        Ok(Self {
            file: file.into(),
            object,
            polygon_m,
            parameters,
            declared,
            position_sd_m,
            angle_sd_rad,
            effects,
        })
    }

    /// World (object and effects) and nominal parameter vector of the model, without random effects.
    pub fn world(&self) -> (World, Vec<f64>) {
        let mut world = World::new(self.object.clone());
        let mut values: Vec<f64> = self.parameters.iter().map(|p| p.nominal).collect();
        for block in &self.effects {
            if let Some(index) = index_of(&block.kind) {
                world.add(index);
                values.extend(block.parameters.iter().map(|p| p.nominal));
            }
        }
        (world, values)
    }

    /// Text of the model file; [`parse`](Self::parse) reads it back to the same model.
    pub fn to_toml(&self) -> String {
        let mut s = String::from("scenario = \"push\"\n");
        if self.polygon_m.is_none() || self.object.name != "polygon" {
            let _ = writeln!(s, "object = {}", write::value(&self.object.name));
        }
        if let Some(vertices) = &self.polygon_m {
            let _ = writeln!(s, "polygon_m = {}", write::value(vertices));
        }
        s.push_str("\n[parameters]\n");
        for p in self.parameters.iter().filter(|p| self.declared.contains(&p.name)) {
            s.push_str(&write::entry(p));
        }
        if self.position_sd_m.is_some() || self.angle_sd_rad.is_some() {
            s.push_str("\n[sensor]\n");
            for (key, sd) in [("position_sd_m", self.position_sd_m), ("angle_sd_rad", self.angle_sd_rad)] {
                if let Some(sd) = sd {
                    let _ = writeln!(s, "{key} = {}", write::value(&sd));
                }
            }
        }
        for block in &self.effects {
            let _ = write!(s, "\n[[effect]]\nkind = {}\n", write::value(&block.kind));
            block.parameters.iter().for_each(|p| s.push_str(&write::entry(p)));
        }
        s
    }
}

/// Largest accepted coordinate of an outline, m.
///
/// Areas and moments are polynomials of the coordinates and must not overflow.
const MAX_COORDINATE_M: f64 = 1000.0;

/// Vertices of an object's outline, m.
type Vertices = Vec<[f64; 2]>;

/// Reads the object of a model file: a known name, or an outline with an optional name.
fn object(reader: &Reader<'_>, root: &DeTable<'_>) -> Result<(Object, Option<Vertices>), ModelError> {
    let name = root.get("object");
    let Some(outline) = root.get("polygon_m") else {
        let example = "object = \"rect1\"";
        let value = name.ok_or_else(|| reader.missing(1, Place::File, "object", example))?;
        let object = value.get_ref().as_str().and_then(Object::named);
        return Ok((object.ok_or_else(|| reader.wrong("object", value, Rule::Object))?, None));
    };
    let vertices = polygon(reader, outline)?;
    let name = match name {
        Some(value) => reader.word("object", value, &[])?,
        None => "polygon",
    };
    let object = Object::polygon(name, &vertices);
    let object = object.ok_or_else(|| {
        reader.wrong(
            "polygon_m",
            outline,
            "an outline of at least three different vertices, in metres, with a non-zero area",
        )
    })?;
    Ok((object, Some(vertices)))
}

/// Reads the vertices of an object's outline.
fn polygon(reader: &Reader<'_>, value: &Value<'_>) -> Result<Vertices, ModelError> {
    let expected = "a list of vertices [[x, y], …] in metres";
    let list = value.get_ref().as_array().ok_or_else(|| reader.wrong("polygon_m", value, expected))?;
    list.iter()
        .map(|pair| match reader.numbers("polygon_m", pair) {
            Ok(numbers) => match numbers[..] {
                [x, y] if x.abs().max(y.abs()) <= MAX_COORDINATE_M => Ok([x, y]),
                [_, _] => Err(reader.wrong(
                    "polygon_m",
                    pair,
                    "coordinates in metres with magnitudes of at most 1000 m",
                )),
                _ => Err(reader.wrong("polygon_m", pair, expected)),
            },
            Err(_) if !matches!(pair.get_ref(), DeValue::Array(_)) => {
                Err(reader.wrong("polygon_m", pair, expected))
            }
            Err(error) => Err(error),
        })
        .collect()
}

/// Defaults of the base parameters that a file does not declare: frozen at their nominal values.
fn base_parameters(object: &Object) -> Vec<Parameter> {
    let nominal = World::new(object.clone()).nominal();
    let bounds = [(0.001, 1.0), (0.0, 2.0), (0.0, 0.1), (0.001, 5.0), (0.001, 1000.0)];
    BASE_PARAMETERS
        .iter()
        .zip(nominal)
        .zip(bounds)
        .map(|((name, nominal), (min, max))| Parameter {
            frozen: true,
            ..Parameter::free(name.to_string(), nominal, min, max)
        })
        .collect()
}
