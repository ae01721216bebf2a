//! Parser of model files; unknown keys are errors that name the line.

use super::{EffectBlock, KnownKeys, Model, ModelError, Place, Release, Rule};
use crate::ball::BASE_PARAMETERS;
use crate::ball::effects::{self, Feature, SCATTER_KIND, TABLE_KIND, Table, Target};
use crate::library::{EffectSpec, ParameterSpec, edit_distance};
use augsim_system::{Parameter, Per, ScatterPer};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

pub(super) type Value<'a> = Spanned<DeValue<'a>>;

/// Default of a base parameter that a file does not declare: frozen at its nominal value.
pub(super) fn base_default(name: &str) -> Parameter {
    let (nominal, min, max) = match name {
        "gravity_m_s2" => (9.81, 0.0, 100.0),
        "restitution" => (0.7, 0.0, 1.0),
        "radius_m" => (0.0, 0.0, 100.0),
        "floor_height_m" => (0.0, -1e3, 1e3),
        _ => (0.4, 0.01, 1.0),
    };
    Parameter { frozen: true, ..Parameter::free(name.into(), nominal, min, max) }
}

/// Default of an effect's parameter that a file does not declare: its typical value, calibrated.
pub(super) fn effect_default(spec: &ParameterSpec) -> Parameter {
    Parameter::free(spec.name.into(), spec.typical, spec.min, spec.max)
}

/// Functions that look up effects in the library of a scenario, ball or push.
pub(super) struct Library {
    pub(super) spec_of: fn(&str) -> Option<&'static EffectSpec>,
    pub(super) similar_kinds: fn(&str) -> Vec<&'static str>,
    /// Example line for the error message about a missing `kind`.
    pub(super) example: &'static str,
}

const BALL: Library = Library {
    spec_of: effects::spec_of,
    similar_kinds: effects::similar_kinds,
    example: "kind = \"quadratic-drag\"",
};

/// Reader of TOML values whose errors name file and line.
pub(super) struct Reader<'t> {
    pub(super) text: &'t str,
    pub(super) file: &'t str,
}

impl<'t> Reader<'t> {
    /// Parses the text of the file to its root table.
    pub(super) fn root(&self) -> Result<Spanned<DeTable<'t>>, ModelError> {
        DeTable::parse(self.text).map_err(|e| ModelError::Syntax {
            file: self.file.into(),
            line: self.line(e.span().unwrap_or(0..0)),
            cause: Box::new(e),
        })
    }

    /// Checks the key `scenario`; `example` is the line that the error message suggests.
    pub(super) fn scenario(
        &self,
        root: &DeTable<'_>,
        scenario: &'static str,
        example: &'static str,
    ) -> Result<(), ModelError> {
        let value = root.get("scenario");
        let value = value.ok_or_else(|| self.missing(1, Place::File, "scenario", example))?;
        self.word("scenario", value, &[scenario]).map(|_| ())
    }

    /// Line, from 1, on which a byte range of the text begins.
    pub(super) fn line(&self, span: Range<usize>) -> usize {
        1 + self.text.bytes().take(span.start).filter(|&b| b == b'\n').count()
    }

    /// Checks that a table of the file has no keys other than `known`.
    pub(super) fn known(
        &self,
        table: &DeTable<'_>,
        place: Place,
        known: &[&'static str],
    ) -> Result<(), ModelError> {
        for (key, _) in table.iter() {
            let name: &str = key.get_ref();
            if !known.contains(&name) {
                let nearest = known.iter().min_by_key(|k| edit_distance(name, k)).copied();
                return Err(ModelError::UnknownKey {
                    file: self.file.into(),
                    line: self.line(key.span()),
                    key: name.into(),
                    place,
                    known: Box::new(KnownKeys { nearest: nearest.unwrap_or_default(), all: known.to_vec() }),
                });
            }
        }
        Ok(())
    }

    /// Error for a value that breaks a rule.
    pub(super) fn wrong(&self, key: &str, value: &Value<'_>, rule: impl Into<Rule>) -> ModelError {
        ModelError::WrongType {
            file: self.file.into(),
            line: self.line(value.span()),
            key: key.into(),
            rule: rule.into(),
        }
    }

    /// Error for a missing key.
    pub(super) fn missing(
        &self,
        line: usize,
        place: Place,
        key: &'static str,
        example: &'static str,
    ) -> ModelError {
        ModelError::Missing { file: self.file.into(), line, place, key, example }
    }

    /// Reads a finite number.
    pub(super) fn number(&self, key: &str, value: &Value<'_>) -> Result<f64, ModelError> {
        let text = match value.get_ref() {
            DeValue::Float(f) => f.as_str(),
            DeValue::Integer(i) => i.as_str(),
            _ => return Err(self.wrong(key, value, "a number")),
        };
        match text.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            _ => Err(self.wrong(key, value, "a finite number")),
        }
    }

    /// Reads a finite number above 0.
    pub(super) fn positive(&self, key: &str, value: &Value<'_>) -> Result<f64, ModelError> {
        match self.number(key, value)? {
            number if number > 0.0 => Ok(number),
            _ => Err(self.wrong(key, value, "a positive number")),
        }
    }

    /// Reads a string that is one of `words`; any string if that list is empty.
    pub(super) fn word<'v>(
        &self,
        key: &str,
        value: &'v Value<'_>,
        words: &[&'static str],
    ) -> Result<&'v str, ModelError> {
        match value.get_ref().as_str() {
            Some(w) if words.is_empty() || words.contains(&w) => Ok(w),
            _ => Err(self.wrong(key, value, Rule::OneOf(words.to_vec()))),
        }
    }

    /// Reads a table.
    pub(super) fn table<'v, 'a>(
        &self,
        key: &str,
        value: &'v Value<'a>,
    ) -> Result<&'v DeTable<'a>, ModelError> {
        let expected = "a table such as { nominal = 0.65, min = 0.0, max = 1.0 }";
        value.get_ref().as_table().ok_or_else(|| self.wrong(key, value, expected))
    }

    /// Reads a list of finite numbers.
    pub(super) fn numbers(&self, key: &str, value: &Value<'_>) -> Result<Vec<f64>, ModelError> {
        let list = value.get_ref().as_array();
        let list = list.ok_or_else(|| self.wrong(key, value, "a list of numbers"))?;
        list.iter().map(|v| self.number(key, v)).collect()
    }

    /// Overwrites `p` with a value of the file: a table, or a bare number as nominal value.
    ///
    /// `calibrated` is whether a declared parameter is calibrated unless the file says `frozen = true`.
    pub(super) fn parameter(
        &self,
        p: &mut Parameter,
        value: &Value<'_>,
        calibrated: bool,
    ) -> Result<(), ModelError> {
        if calibrated {
            p.frozen = false;
        }
        let name = p.name.clone();
        if let Some(table) = value.get_ref().as_table() {
            let keys = ["nominal", "min", "max", "frozen", "per", "ci95", "groups"];
            self.known(table, Place::Parameter(name.clone()), &keys)?;
            let nominal = table.get("nominal");
            let nominal = nominal.ok_or_else(|| {
                let place = Place::Parameter(name.clone());
                self.missing(self.line(value.span()), place, "nominal", "nominal = 0.0")
            })?;
            p.nominal = self.number(&name, nominal)?;
            for (key, slot) in [("min", &mut p.min), ("max", &mut p.max)] {
                if let Some(v) = table.get(key) {
                    *slot = self.number(key, v)?;
                }
            }
            if let Some(v) = table.get("frozen") {
                let flag = v.get_ref().as_bool();
                p.frozen = flag.ok_or_else(|| self.wrong("frozen", v, "true or false"))?;
            }
            if let Some(v) = table.get("per") {
                p.per = match self.word("per", v, &["all", "group", "trajectory"])? {
                    "group" => Per::Group,
                    "trajectory" => Per::Trajectory,
                    _ => Per::All,
                };
            }
            if let Some(v) = table.get("ci95") {
                match self.numbers("ci95", v)?[..] {
                    [low, high] => p.ci95 = Some([low, high]),
                    _ => return Err(self.wrong("ci95", v, "a list of two numbers")),
                }
            }
            if let Some(v) = table.get("groups") {
                if p.per != Per::Group {
                    return Err(self.wrong("groups", v, "removed, or combined with per = \"group\""));
                }
                for (group, v) in self.table("groups", v)?.iter() {
                    let group: &str = group.get_ref();
                    p.groups.push((group.into(), self.number(group, v)?));
                }
            }
        } else {
            p.nominal = self.number(&name, value)?;
        }
        if !(p.min <= p.nominal && p.nominal <= p.max) {
            return Err(ModelError::OutOfBounds {
                file: self.file.into(),
                line: self.line(value.span()),
                key: name,
                value: p.nominal,
                min: p.min,
                max: p.max,
            });
        }
        Ok(())
    }

    /// Reads the `[[effect]]` blocks with `read_block`, which also gets the preceding blocks.
    pub(super) fn effects(
        &self,
        root: &DeTable<'_>,
        read_block: impl Fn(&Value<'_>, &[EffectBlock]) -> Result<EffectBlock, ModelError>,
    ) -> Result<Vec<EffectBlock>, ModelError> {
        let mut effects = Vec::new();
        if let Some(value) = root.get("effect") {
            let blocks = value.get_ref().as_array();
            let blocks = blocks.ok_or_else(|| self.wrong("effect", value, "written as [[effect]] blocks"))?;
            for block in blocks.iter() {
                let block = read_block(block, &effects)?;
                effects.push(block);
            }
        }
        Ok(effects)
    }

    /// Reads the value of `kind` in an `[[effect]]` block.
    fn kind<'v>(&self, value: &'v Value<'_>, library: &Library) -> Result<&'v str, ModelError> {
        let line = self.line(value.span());
        let kind = self.table("effect", value)?.get("kind");
        let kind = kind.ok_or_else(|| self.missing(line, Place::Effect, "kind", library.example))?;
        self.word("kind", kind, &[])
    }

    /// Reads the block of a library effect; an error if it excludes or repeats a preceding block.
    ///
    /// `extra_keys` are allowed in addition to the names of the parameters.
    pub(super) fn listed(
        &self,
        value: &Value<'_>,
        earlier: &[EffectBlock],
        library: &Library,
        extra_keys: &[&'static str],
    ) -> Result<EffectBlock, ModelError> {
        let (table, kind) = (self.table("effect", value)?, self.kind(value, library)?);
        let (file, line) = (self.file.to_owned(), table.get("kind").map_or(0, |kind| self.line(kind.span())));
        let Some(spec) = (library.spec_of)(kind) else {
            let nearest = (library.similar_kinds)(kind);
            return Err(ModelError::UnknownKind { file, line, kind: kind.into(), nearest });
        };
        let clash = |b: &&EffectBlock| b.kind == kind || spec.excludes.contains(&b.kind.as_str());
        if let Some(other) = earlier.iter().find(clash) {
            return Err(ModelError::Conflict { file, line, kind: spec.kind, other: other.kind.clone() });
        }
        let mut known = vec!["kind"];
        known.extend(spec.parameters.iter().map(|p| p.name));
        known.extend(extra_keys);
        self.known(table, Place::EffectOfKind(spec.kind), &known)?;
        let mut parameters = Vec::new();
        for parameter in spec.parameters {
            let mut p = effect_default(parameter);
            if let Some(v) = table.get(parameter.name) {
                self.parameter(&mut p, v, true)?;
            }
            parameters.push(p);
        }
        Ok(EffectBlock { kind: spec.kind.into(), scatter: None, table: None, parameters })
    }

    /// Reads an `[[effect]]` block of the ball: a library effect, a table or the random scatter.
    fn effect(&self, value: &Value<'_>, earlier: &[EffectBlock]) -> Result<EffectBlock, ModelError> {
        let table = self.table("effect", value)?;
        let kind = self.kind(value, &BALL)?;
        if kind == TABLE_KIND {
            return self.tabulated(table, self.line(value.span()));
        }
        let is_scatter = kind == SCATTER_KIND;
        let block = self.listed(value, earlier, &BALL, if is_scatter { &["per"] } else { &[] })?;
        let scatter = match table.get("per") {
            Some(v) if self.word("per", v, &["impact", "trajectory"])? == "trajectory" => {
                Some(ScatterPer::Record)
            }
            _ => is_scatter.then_some(ScatterPer::Event),
        };
        Ok(EffectBlock { scatter, ..block })
    }

    /// Reads an `[[effect]]` block of kind `table`.
    fn tabulated(&self, table: &DeTable<'_>, line: usize) -> Result<EffectBlock, ModelError> {
        let place = || Place::EffectOfKind(TABLE_KIND);
        self.known(table, place(), &["kind", "target", "against", "first", "last", "values"])?;
        let required = |key: &'static str, example: &'static str| {
            table.get(key).ok_or_else(|| self.missing(line, place(), key, example))
        };
        let targets: Vec<_> = Target::ALL.iter().map(|t| t.name()).collect();
        let features: Vec<_> = Feature::ALL.iter().map(|t| t.name()).collect();
        let target = self.word("target", required("target", "target = \"restitution\"")?, &targets)?;
        let against = self.word("against", required("against", "against = \"impact-speed\"")?, &features)?;
        let knots = required("values", "values = [0.0, -0.01, -0.02]")?;
        let values = self.numbers("values", knots)?;
        if values.is_empty() {
            return Err(self.wrong("values", knots, "a list of one number or more: the values at the knots"));
        }
        let (Some(target), Some(against)) = (Target::from_name(target), Feature::from_name(against)) else {
            return Err(self.missing(line, place(), "target", "target = \"restitution\""));
        };
        let shape = Table {
            target,
            feature: against,
            first: self.number("first", required("first", "first = 0.5")?)?,
            last: self.number("last", required("last", "last = 5.0")?)?,
        };
        if shape.first >= shape.last {
            let last = required("last", "last = 5.0")?;
            return Err(self.wrong(
                "last",
                last,
                "above `first`: the knots are evenly spaced from first to last",
            ));
        }
        Ok(EffectBlock {
            kind: TABLE_KIND.into(),
            scatter: None,
            table: Some(shape),
            parameters: values
                .into_iter()
                .enumerate()
                .map(|(i, nominal)| Parameter { nominal, ..Parameter::knot(i) })
                .collect(),
        })
    }
}

/// Parses the text of a ball model; `file` is its path for messages.
pub(super) fn parse(text: &str, file: &str) -> Result<Model, ModelError> {
    let reader = Reader { text, file };
    let root = reader.root()?;
    let root = root.get_ref();
    reader.known(root, Place::File, &["scenario", "parameters", "sensor", "release", "effect"])?;
    reader.scenario(root, "ball", "scenario = \"ball\"")?;

    let mut parameters: Vec<_> = BASE_PARAMETERS.iter().map(|n| base_default(n)).collect();
    let mut declared = Vec::new();
    if let Some(value) = root.get("parameters") {
        let table = reader.table("parameters", value)?;
        reader.known(table, Place::Table("parameters"), &BASE_PARAMETERS)?;
        for p in &mut parameters {
            if let Some(v) = table.get(p.name.as_str()) {
                // A radius, an inertia ratio or a floor height given as a bare number counts as measured: it
                // is frozen.
                let plain_number = v.get_ref().as_table().is_none();
                let geometry = ["radius_m", "inertia_ratio", "floor_height_m"].contains(&p.name.as_str());
                reader.parameter(p, v, !(plain_number && geometry))?;
                declared.push(p.name.clone());
            }
        }
    }
    let (mut position_sd_m, mut clock_reference_s) = (None, None);
    if let Some(value) = root.get("sensor") {
        let table = reader.table("sensor", value)?;
        reader.known(
            table,
            Place::Table("sensor"),
            &["position_sd_m", "height_sd_m", "clock_reference_s"],
        )?;
        if let Some(v) = table.get("clock_reference_s") {
            clock_reference_s = Some(reader.number("clock_reference_s", v)?);
        }
        for key in ["position_sd_m", "height_sd_m"] {
            if let Some(v) = table.get(key) {
                position_sd_m = Some(reader.positive(key, v)?);
            }
        }
    }
    let mut release = Release::default();
    if let Some(value) = root.get("release") {
        let table = reader.table("release", value)?;
        reader.known(table, Place::Table("release"), &["kind"])?;
        if let Some(v) = table.get("kind") {
            release = match reader.word("kind", v, &["rest", "free"])? {
                "rest" => Release::Rest,
                _ => Release::Free,
            };
        }
    }
    let effects = reader.effects(root, |block, earlier| reader.effect(block, earlier))?;
    Ok(Model { file: file.into(), parameters, declared, position_sd_m, clock_reference_s, release, effects })
}
