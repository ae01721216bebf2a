//! The macro that turns a list of effects into a library with look-ups by kind; the ball and pushing both use it.

/// Declares `all`, the listed effects in their order, and the look-ups by kind. The module that it is used in has the trait
/// `Effect` and a scatter (`SCATTER_KIND`, `SCATTER_SPEC`), which is looked up but not listed; `unlisted` are the kinds that
/// model files may name besides.
macro_rules! registry {
    (unlisted $($unlisted:path),*; $($effect:path),* $(,)?) => {
        const COUNT: usize = [$(stringify!($effect)),*].len();

        /// All effects, in the order in which they act.
        pub fn all<S: $crate::Scalar>() -> [&'static dyn Effect<S>; COUNT] {
            [$(&$effect),*]
        }

        /// Position of a kind in [`all`].
        pub fn index_of(kind: &str) -> Option<usize> {
            all::<f64>().iter().position(|e| e.spec().kind == kind)
        }

        /// The description of a kind, the scatter included.
        pub fn spec_of(kind: &str) -> Option<&'static $crate::effects::EffectSpec> {
            all::<f64>().into_iter().map(|e| e.spec()).chain([&SCATTER_SPEC]).find(|s| s.kind == kind)
        }

        /// The known kinds that `kind` may have meant: those that end in it as a word, or else the one that is spelt most
        /// like it.
        pub fn kinds_like(kind: &str) -> Vec<&'static str> {
            let known = || all::<f64>().into_iter().map(|e| e.spec().kind).chain([$($unlisted),*]);
            let ends: Vec<&str> =
                known().filter(|k| k.strip_suffix(kind).is_some_and(|rest| rest.ends_with('-'))).collect();
            if !kind.is_empty() && !ends.is_empty() {
                return ends;
            }
            known().min_by_key(|k| $crate::model::edit_distance(kind, k)).into_iter().collect()
        }
    };
}

pub(crate) use registry;
