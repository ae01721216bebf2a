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

        /// The known kind that is spelt most like `kind`.
        pub fn nearest_kind(kind: &str) -> &'static str {
            all::<f64>()
                .into_iter()
                .map(|e| e.spec().kind)
                .chain([$($unlisted),*])
                .min_by_key(|known| $crate::model::edit_distance(kind, known))
                .unwrap_or(SCATTER_KIND)
        }
    };
}

pub(crate) use registry;
