//! Resolves the names of effects that a user allows or excludes to the effects of a model's library.

use crate::usage::{Inapplicable, UnknownName};
use crate::{Subject, Usage};
use augsim_discovery::{AllowedEffects, Options};
use augsim_equations::library::{Candidate, candidates, is_a_kind, similar_kinds};
use augsim_physics::{ball::effects, model::ModelFile, push};

/// Resolves the effect names in the options to names of effects in the library of the model.
///
/// An equation model lists an effect that it can have in several places once for each place; the kind of the
/// effect selects all of these.
///
/// # Errors
/// A name is unknown, an effect that is to be tried alone has no place in the model, no effect is left, or the
/// library is not used at all.
pub(crate) fn resolve(subject: &Subject, options: &Options) -> anyhow::Result<AllowedEffects> {
    let AllowedEffects { only, exclude } = &options.effects;
    let has_names = !only.is_empty() || !exclude.is_empty();
    if has_names && !options.library {
        return Err(Usage::Inapplicable(Inapplicable::EffectsWithoutLibrary).into());
    }
    let library = Library::of(subject)?;
    let names = |list: &[String], is_excluded: bool| -> anyhow::Result<Vec<String>> {
        let found: anyhow::Result<Vec<_>> =
            list.iter().map(|name| library.effects(name, is_excluded)).collect();
        Ok(found?.concat())
    };
    let resolved = AllowedEffects { only: names(only, false)?, exclude: names(exclude, true)? };
    if resolved.is_closed() && !resolved.only.iter().any(|name| resolved.allows(name)) {
        return Err(Usage::Inapplicable(Inapplicable::EveryEffectExcluded).into());
    }
    Ok(resolved)
}

/// The library of candidate effects of a built-in or an equation model.
enum Library<'a> {
    BuiltIn(&'a ModelFile),
    Equations(&'a augsim_equations::Model, Vec<Candidate>),
}

impl<'a> Library<'a> {
    fn of(subject: &'a Subject) -> anyhow::Result<Self> {
        Ok(match subject {
            Subject::BuiltIn(model) => Library::BuiltIn(model),
            Subject::Equations(model) => Library::Equations(model, candidates(model)?),
        })
    }

    /// Names of the library effects that a user calls `name`. An excluded effect need not apply to the model.
    fn effects(&self, name: &str, is_excluded: bool) -> anyhow::Result<Vec<String>> {
        let (model, nearest) = match self {
            Library::BuiltIn(model) => {
                let (is_known, nearest) = match model {
                    ModelFile::Ball(_) => (effects::spec_of(name).is_some(), effects::similar_kinds(name)),
                    ModelFile::Push(_) => {
                        (push::effects::spec_of(name).is_some(), push::effects::similar_kinds(name))
                    }
                };
                if is_known {
                    return Ok(vec![name.to_owned()]);
                }
                (model.declaration().file(), nearest.into_iter().map(str::to_owned).collect())
            }
            Library::Equations(model, all) => {
                let is_named = |c: &&Candidate| c.shape.is_none() && (c.kind == name || c.name == name);
                let found: Vec<String> = all.iter().filter(is_named).map(|c| c.name.clone()).collect();
                if !found.is_empty() || is_excluded && is_a_kind(name, model) {
                    return Ok(found);
                }
                if is_a_kind(name, model) {
                    let (kind, model) = (name.to_owned(), model.file.clone().into());
                    return Err(Usage::Unknown(UnknownName::PlaceOfEffect { kind, model }).into());
                }
                (model.file.as_str(), similar_kinds(name, all))
            }
        };
        let (name, model) = (name.to_owned(), model.into());
        Err(Usage::Unknown(UnknownName::EffectOn { name, model, nearest }).into())
    }
}
