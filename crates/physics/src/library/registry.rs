//! Macro that declares a library of effects with look-ups by kind; used for the ball and for pushing.

/// Declares `all`, the listed effects in their order, and look-ups by kind.
///
/// The calling module defines the trait `Effect` and the random scatter (`SCATTER_KIND`, `SCATTER_SPEC`),
/// which can be looked up but is not listed. `unlisted` are further kinds that model files may use; only
/// suggestions use them.
macro_rules! registry {
    (unlisted $($unlisted:path),*; $($effect:path),* $(,)?) => {
        const COUNT: usize = [$(stringify!($effect)),*].len();

        /// All effects of the library, in the order in which they act.
        pub fn all<S: $crate::Scalar>() -> [&'static dyn Effect<S>; COUNT] {
            [$(&$effect),*]
        }

        /// Index in [`all`] of the effect of this kind; `None` if there is none.
        pub fn index_of(kind: &str) -> Option<usize> {
            all::<f64>().iter().position(|e| e.spec().kind == kind)
        }

        /// Description of the effect of this kind, including the random scatter; `None` if there is none.
        pub fn spec_of(kind: &str) -> Option<&'static $crate::library::EffectSpec> {
            all::<f64>().into_iter().map(|e| e.spec()).chain([&SCATTER_SPEC]).find(|s| s.kind == kind)
        }

        /// Kinds to suggest for an unknown one: those that end in it as a whole word, else the closest.
        pub fn similar_kinds(kind: &str) -> Vec<&'static str> {
            let known = || all::<f64>().into_iter().map(|e| e.spec().kind).chain([$($unlisted),*]);
            let has_suffix = |k: &&str| k.strip_suffix(kind).is_some_and(|prefix| prefix.ends_with('-'));
            let matches: Vec<&str> = known().filter(has_suffix).collect();
            if !kind.is_empty() && !matches.is_empty() {
                return matches;
            }
            known().min_by_key(|k| $crate::library::edit_distance(kind, k)).into_iter().collect()
        }
    };
}

pub(crate) use registry;
