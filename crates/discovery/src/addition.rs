//! What can be added to a declared model, and how sets of additions are named.

use augsim_physics::effects::{
    Against, SCATTER_KIND, ScatterPer, TABLE_KIND, Table, Target, index_of, spec_of,
};
use augsim_physics::model::Per;
use augsim_physics::system::{Law, Table as TableLaw};

/// Knots of a one-feature law.
pub(crate) const KNOTS: usize = 8;

/// Something that a hypothesis adds to the declared model.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Addition {
    /// An effect of the library, with one value for all or one for each group.
    Kind(&'static str, Per),
    /// Scatter of the restitution.
    Scatter(ScatterPer),
    /// A law of one feature that is not in the library.
    Law(Table),
}

impl Addition {
    /// Kind as results name it.
    pub fn kind(&self) -> &'static str {
        match self {
            Addition::Kind(kind, _) => kind,
            Addition::Scatter(_) => SCATTER_KIND,
            Addition::Law(_) => TABLE_KIND,
        }
    }

    /// Kind with what distinguishes its variants.
    pub fn label(&self) -> String {
        match self {
            Addition::Kind(kind, Per::Group) => format!("{kind} per group"),
            Addition::Kind(kind, _) => (*kind).to_string(),
            Addition::Scatter(per) => format!("{SCATTER_KIND} per {}", per.name()),
            Addition::Law(t) => format!("{} against {}", t.target.name(), t.against.name()),
        }
    }

    /// The law that it adds to a system; none for scatter.
    pub fn law(&self) -> Option<Law> {
        match self {
            Addition::Kind(kind, _) => index_of(kind).map(Law::Effect),
            Addition::Scatter(_) => None,
            Addition::Law(t) => Some(Law::Table(TableLaw {
                target: Target::ALL.iter().position(|target| *target == t.target)?,
                against: Against::ALL.iter().position(|against| *against == t.against)?,
                first: t.first,
                last: t.last,
                knots: KNOTS,
            })),
        }
    }

    /// Whether this addition acts through the other and means nothing without it.
    pub fn acts_through(&self, other: &Addition) -> bool {
        spec_of(self.kind()).and_then(|s| s.joins).is_some_and(|join| join.kind == other.kind())
    }

    /// Whether the two cannot stand in one model.
    pub fn excludes(&self, other: &Addition) -> bool {
        let listed =
            |a: &Addition, b: &Addition| spec_of(a.kind()).is_some_and(|s| s.excludes.contains(&b.kind()));
        match (self, other) {
            (Addition::Law(a), Addition::Law(b)) => a == b,
            (Addition::Law(_), _) | (_, Addition::Law(_)) => false,
            _ => self.kind() == other.kind() || listed(self, other),
        }
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
            Addition::Law(_) | Addition::Kind(_, Per::Group) => a.label(),
            _ => a.kind().to_string(),
        })
        .collect();
    k.sort();
    k
}
