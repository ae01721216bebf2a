//! Additions to a declared model, and names of sets of them.

use augsim_physics::model::Per;
use augsim_physics::system::{Effect, EffectParameter, Law, Quantity, ScatterPer, System, Table, Target};
use std::sync::Arc;

/// Kind of a law that is not in the library.
const TABLE_KIND: &str = "table";

/// An effect with its place in the library.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Listed {
    pub index: usize,
    pub effect: Effect,
    /// Points that it is tried at: its shape parameters on their grids.
    pub points: usize,
}

/// A scatter with the word for what one draw of it belongs to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Scattered {
    pub per: ScatterPer,
    pub word: String,
    pub effect: Effect,
}

/// A law of one feature with the words for both.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tabulated {
    pub table: Table,
    pub target: Target,
    pub against: Quantity,
}

/// A declared parameter that may have a value of its own in each group.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Split {
    /// Place in the declared vector.
    pub index: usize,
    /// Kind as results name it: `NAME per group`.
    pub kind: String,
    /// Number of groups.
    pub groups: usize,
}

/// Something that a hypothesis adds to the declared model.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Addition {
    /// An effect of the library, with one value for all or one for each group.
    Effect(Arc<Listed>, Per),
    /// Scatter of the parameter of the schema's events.
    Scatter(Arc<Scattered>),
    /// A law of one feature that is not in the library.
    Table(Arc<Tabulated>),
    /// A value for each group of a declared parameter.
    Split(Arc<Split>),
}

impl Addition {
    /// A value for each of `groups` groups of the declared parameter at place `index`.
    pub fn split(system: &dyn System, index: usize, groups: usize) -> Self {
        let kind = format!("{} per group", system.quantity(index).name);
        Addition::Split(Arc::new(Split { index, kind, groups }))
    }

    /// The effect of index `index` in a system's library.
    pub fn effect(system: &dyn System, index: usize, per: Per) -> Option<Self> {
        let effect = system.library().get(index)?.clone();
        let points = system.null_points(index).len() + system.scan_points(index).len();
        Some(Addition::Effect(Arc::new(Listed { index, effect, points }), per))
    }

    /// The effect of a kind, one value for all.
    pub fn of_kind(system: &dyn System, kind: &str) -> Option<Self> {
        let index = system.library().iter().position(|e| e.kind == kind)?;
        Self::effect(system, index, Per::All)
    }

    /// The scatter of a system's events; `None` for a system without events.
    pub fn scatter(system: &dyn System, per: ScatterPer) -> Option<Self> {
        let schema = system.schema();
        let effect = schema.event.as_ref()?.scatter.clone();
        Some(Addition::Scatter(Arc::new(Scattered { per, word: per.word(schema).to_string(), effect })))
    }

    /// A law of one feature.
    pub fn table(system: &dyn System, table: Table) -> Option<Self> {
        let schema = system.schema();
        let (target, against) =
            (schema.targets.get(table.target)?.clone(), schema.features.get(table.against)?.clone());
        Some(Addition::Table(Arc::new(Tabulated { table, target, against })))
    }

    /// Kind as results name it.
    pub fn kind(&self) -> &str {
        match (self, self.listed()) {
            (_, Some(effect)) => &effect.kind,
            (Addition::Split(split), None) => &split.kind,
            (_, None) => TABLE_KIND,
        }
    }

    /// Kind with what distinguishes its variants.
    pub fn label(&self) -> String {
        match self {
            Addition::Effect(listed, Per::Group) => format!("{} per group", listed.effect.kind),
            Addition::Effect(listed, _) => listed.effect.kind.clone(),
            Addition::Scatter(s) => format!("{} per {}", s.effect.kind, s.word),
            Addition::Split(split) => split.kind.clone(),
            Addition::Table(t) => format!("{} against {}", t.target.quantity.name, t.against.name),
        }
    }

    /// Its description; none for a law that is not in the library.
    pub fn listed(&self) -> Option<&Effect> {
        match self {
            Addition::Effect(listed, _) => Some(&listed.effect),
            Addition::Scatter(s) => Some(&s.effect),
            Addition::Table(_) | Addition::Split(_) => None,
        }
    }

    /// Its parameters, as the library describes them; none for a law that is not in it.
    pub fn parameters(&self) -> &[EffectParameter] {
        self.listed().map_or(&[], |effect| &effect.parameters)
    }

    /// Number of parameters that it adds to a system.
    pub fn size(&self) -> usize {
        match self {
            Addition::Table(t) => t.table.knots,
            Addition::Split(_) => 0,
            _ => self.parameters().len(),
        }
    }

    /// At how many points it is tried: with the best of so many shapes chance has as many tries.
    pub fn tries(&self) -> f64 {
        match self {
            Addition::Effect(listed, _) if !self.is_structural() => listed.points.max(1) as f64,
            _ => 1.0,
        }
    }

    /// Whether it makes every simulation dearer.
    pub fn is_costly(&self) -> bool {
        match self {
            Addition::Table(t) => t.target.costly,
            _ => self.listed().is_some_and(|effect| effect.costly),
        }
    }

    /// Whether it changes the simulation even where its parameters have their nulls, so that its test needs a simulation of its
    /// own: a switch without parameters, or a law that is singular at its null.
    pub fn is_structural(&self) -> bool {
        let of = |effect: &Effect| effect.parameters.is_empty() || !effect.probe.is_empty();
        matches!(self, Addition::Effect(listed, _) if of(&listed.effect))
    }

    /// The law that it adds to a system; none for scatter and for values by group.
    pub fn law(&self) -> Option<Law> {
        match self {
            Addition::Effect(listed, _) => Some(Law::Effect(listed.index)),
            Addition::Scatter(_) | Addition::Split(_) => None,
            Addition::Table(t) => Some(Law::Table(t.table)),
        }
    }

    /// Whether this addition acts through the other and means nothing without it.
    pub fn acts_through(&self, other: &Addition) -> bool {
        let join = self.listed().and_then(|effect| effect.joins.as_ref());
        join.is_some_and(|join| join.kind == other.kind())
    }

    /// Whether the two cannot stand in one model.
    pub fn excludes(&self, other: &Addition) -> bool {
        match (self.listed(), other.listed()) {
            (Some(one), Some(another)) => one.kind == another.kind || one.excludes.contains(&another.kind),
            (None, None) => self == other,
            _ => false,
        }
    }

    /// Whether the two are forms of one law: each describes the same thing, or one turns into the other where some of its parameters have
    /// their nulls.
    pub fn is_form_of(&self, other: &Addition) -> bool {
        let contains = |one: &Addition, another: &Addition| match (one.listed(), another.listed()) {
            (Some(one), Some(another)) => one.contains.as_ref() == Some(&another.kind),
            _ => false,
        };
        self.excludes(other) || other.excludes(self) || contains(self, other) || contains(other, self)
    }
}

/// A set of additions as a key.
pub(crate) fn labels(additions: &[Addition]) -> Vec<String> {
    let mut l: Vec<String> = additions.iter().map(Addition::label).collect();
    l.sort();
    l
}

/// Kinds of a set, sorted.
pub(crate) fn kinds(additions: &[Addition]) -> Vec<String> {
    let mut k: Vec<String> = additions
        .iter()
        .map(|a| match a {
            Addition::Scatter(_) => a.kind().to_string(),
            _ => a.label(),
        })
        .collect();
    k.sort();
    k
}
