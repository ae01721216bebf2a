//! Criterion benches; see `benches/`. Run them with `cargo bench -p augsim-benches`.
