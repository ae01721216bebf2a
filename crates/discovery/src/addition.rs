//! Effects added to a declared model, and names of sets of them.

use augsim_system::{
    Augment, Describe, Effect, EffectParameter, ModelTerm, Per, Quantity, ScatterPer, Simulate, Table, Target,
};
use std::sync::Arc;

/// Name in results of an effect that is given as a table of values, not by the library.
const TABLE_KIND: &str = "table";

/// An effect of the library, with its index there.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Listed {
    pub index: usize,
    pub effect: Effect,
    /// Number of grid points of the effect's shape parameters (widths, thresholds, periods, ...) at which it is tried.
    pub points: usize,
    /// Whether the effect has a period.
    pub is_periodic: bool,
}

/// A random effect: the parameter of the system's events varies between events or between records.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RandomEffect {
    pub per: ScatterPer,
    pub draw_unit: String,
    pub effect: Effect,
}

/// An effect that is a tabulated function of one feature, with the descriptions of target and feature.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tabulated {
    pub table: Table,
    pub target: Target,
    pub feature: Quantity,
}

/// A declared parameter that may have a different value in each group of records.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Split {
    /// Index of the parameter in the declared parameter vector.
    pub index: usize,
    /// Name in results: `NAME per group`, with the name of the parameter.
    pub kind: String,
}

/// An effect that a hypothesis adds to the declared model.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Addition {
    /// An effect of the library, with one parameter value for all records or one per group.
    Effect(Arc<Listed>, Per),
    /// A random effect of the parameter of the system's events.
    Scatter(Arc<RandomEffect>),
    /// An effect that is a tabulated function of one feature.
    Table(Arc<Tabulated>),
    /// A declared parameter that gets one value per group of records.
    Split(Arc<Split>),
}

impl Addition {
    /// Gives the declared parameter with this index one value per group of records.
    pub fn split(system: &dyn Describe, index: usize) -> Self {
        let kind = format!("{} per group", system.quantity(index).name);
        Addition::Split(Arc::new(Split { index, kind }))
    }

    /// The effect with this index in a system's library; `None` if there is none.
    pub fn effect(system: &dyn Augment, index: usize, per: Per) -> Option<Self> {
        let effect = system.library().get(index)?.clone();
        let lists = [system.null_points(index), system.scan_points(index), system.cycle_points(index)];
        let points = lists.iter().map(Vec::len).sum();
        let is_periodic = !lists[2].is_empty();
        Some(Addition::Effect(Arc::new(Listed { index, effect, points, is_periodic }), per))
    }

    /// The library effect with this name (`kind`), with one value for all records; `None` if there is none.
    pub fn with_kind(system: &dyn Augment, kind: &str) -> Option<Self> {
        let index = system.library().iter().position(|e| e.kind == kind)?;
        Self::effect(system, index, Per::All)
    }

    /// The random effect of the parameter of a system's events; `None` for a system without events.
    pub fn scatter(system: &dyn Simulate, per: ScatterPer) -> Option<Self> {
        let schema = system.schema();
        let effect = schema.event.as_ref()?.scatter.clone();
        Some(Addition::Scatter(Arc::new(RandomEffect {
            per,
            draw_unit: per.word(schema).to_string(),
            effect,
        })))
    }

    /// The effect described by `table`; `None` if the system lacks its target or its feature.
    pub fn table(system: &dyn Simulate, table: Table) -> Option<Self> {
        let schema = system.schema();
        let (target, against) =
            (schema.targets.get(table.target)?.clone(), schema.features.get(table.feature)?.clone());
        Some(Addition::Table(Arc::new(Tabulated { table, target, feature: against })))
    }

    /// Name of the effect in results, without its variant.
    pub fn kind(&self) -> &str {
        match (self, self.listed()) {
            (_, Some(effect)) => &effect.kind,
            (Addition::Split(split), None) => &split.kind,
            (_, None) => TABLE_KIND,
        }
    }

    /// Name of the effect with its variant: per group, per record or event, or target and feature of a table.
    pub fn label(&self) -> String {
        match self {
            Addition::Effect(listed, Per::Group) => format!("{} per group", listed.effect.kind),
            Addition::Effect(listed, _) => listed.effect.kind.clone(),
            Addition::Scatter(s) => format!("{} per {}", s.effect.kind, s.draw_unit),
            Addition::Split(split) => split.kind.clone(),
            Addition::Table(t) => format!("{} against {}", t.target.quantity.name, t.feature.name),
        }
    }

    /// Library description of the effect; `None` for tables and for groupwise values of declared parameters.
    pub fn listed(&self) -> Option<&Effect> {
        match self {
            Addition::Effect(listed, _) => Some(&listed.effect),
            Addition::Scatter(s) => Some(&s.effect),
            Addition::Table(_) | Addition::Split(_) => None,
        }
    }

    /// Parameters of the effect as the library describes them; empty for tables and groupwise values.
    pub fn parameters(&self) -> &[EffectParameter] {
        self.listed().map_or(&[], |effect| &effect.parameters)
    }

    /// Number of parameters that the addition appends to the system's parameter vector.
    pub fn size(&self) -> usize {
        match self {
            Addition::Table(t) => t.table.knots,
            Addition::Split(_) => 0,
            _ => self.parameters().len(),
        }
    }

    /// Number of grid points at which the effect is tried. Its penalty grows with it, because the best point
    /// is taken.
    pub fn grid_points(&self) -> f64 {
        match self {
            Addition::Effect(listed, _) if !self.is_structural() => listed.points.max(1) as f64,
            _ => 1.0,
        }
    }

    /// Whether the addition gives a parameter or an effect one value per group of records.
    pub fn has_values_by_group(&self) -> bool {
        matches!(self, Addition::Split(_) | Addition::Effect(_, Per::Group))
    }

    /// Whether the addition makes every simulation more expensive.
    pub fn is_costly(&self) -> bool {
        match self {
            Addition::Table(t) => t.target.costly,
            _ => self.listed().is_some_and(|effect| effect.costly),
        }
    }

    /// Whether the effect changes the simulation even at the null values of its parameters.
    ///
    /// It then needs a simulation of its own: a switch without parameters, or an effect that is singular at its
    /// null values.
    pub fn is_structural(&self) -> bool {
        let is_structural =
            |effect: &Effect| effect.parameters.is_empty() || !effect.first_simulated_at.is_empty();
        matches!(self, Addition::Effect(listed, _) if is_structural(&listed.effect))
    }

    /// Whether the effect is a formula of a grammar rather than a listed effect of the library.
    pub fn is_formula(&self) -> bool {
        self.listed().is_some_and(|effect| effect.formula_domain.is_some())
    }

    /// The equation that the addition appends to the system; `None` for random effects and groupwise values.
    pub fn term(&self) -> Option<ModelTerm> {
        match self {
            Addition::Effect(listed, _) => Some(ModelTerm::Effect(listed.index)),
            Addition::Scatter(_) | Addition::Split(_) => None,
            Addition::Table(t) => Some(ModelTerm::Table(t.table)),
        }
    }

    /// Whether this effect acts only through `other`, and so cannot be in a model without it.
    pub fn acts_through(&self, other: &Addition) -> bool {
        let join = self.listed().and_then(|effect| effect.joins.as_ref());
        join.is_some_and(|join| join.kind == other.kind())
    }

    /// Whether this addition and `other` cannot be in one model.
    pub fn excludes(&self, other: &Addition) -> bool {
        match (self.listed(), other.listed()) {
            (Some(one), Some(another)) => one.kind == another.kind || one.excludes.contains(&another.kind),
            (None, None) => self == other,
            _ => false,
        }
    }

    /// Whether the addition brings states of its own into the system.
    pub fn has_states(&self) -> bool {
        self.listed().is_some_and(|effect| effect.has_states)
    }

    /// Whether the addition has a period, which is not determined where the effect vanishes.
    pub fn is_periodic(&self) -> bool {
        matches!(self, Addition::Effect(listed, _) if listed.is_periodic)
    }

    /// Whether the addition adds an input or a state to a reading.
    pub fn is_added_to_reading(&self) -> bool {
        self.listed().is_some_and(|effect| effect.added_to_reading.is_some())
    }

    /// Whether the addition depends on the past: it has states of its own, or is a delay.
    pub fn depends_on_past(&self) -> bool {
        self.listed().is_some_and(|effect| effect.depends_on_past)
    }

    /// Whether this addition and `other` are forms of the same effect.
    ///
    /// They are if they exclude each other, or if one becomes the other at null values of some parameters.
    pub fn is_variant_of(&self, other: &Addition) -> bool {
        let contains = |one: &Addition, another: &Addition| match (one.listed(), another.listed()) {
            (Some(one), Some(another)) => one.reduces_to.as_ref() == Some(&another.kind),
            _ => false,
        };
        self.excludes(other) || other.excludes(self) || contains(self, other) || contains(other, self)
    }
}

/// Sorted labels of a set of additions, which identify the set.
pub(crate) fn labels(additions: &[Addition]) -> Vec<String> {
    let mut l: Vec<String> = additions.iter().map(Addition::label).collect();
    l.sort();
    l
}

/// Sorted names of a set of additions, as results list them.
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
