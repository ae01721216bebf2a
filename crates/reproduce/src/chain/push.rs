//! Scores models on pushes of the virtual laboratory, whose friction differs from the textbook model.

use super::nets::{Chain, Runs};
use super::sets::{self, SetRow};
use crate::experiment::Sizes;
use crate::experiment::data::{self, Laboratory, engine_of};
use crate::experiment::rows::Row;
use augsim_physics::model::PushModel;
use augsim_terminal::output::Output;
use serde::Serialize;

/// Name of the set of laboratory pushes, and of its report folder.
pub const LABORATORY: &str = "push-laboratory";
/// Number of training pushes that the discovery reads, small to limit its time to 2 to 3 CPU minutes.
///
/// Fast pushes with inertia are slow to simulate.
const LOOP_PUSHES: usize = 120;

/// Discovery and scores on pushes of the virtual laboratory.
#[derive(Debug, Serialize)]
pub struct Pushing {
    /// Discovery on training pushes.
    #[serde(flatten)]
    pub set: SetRow,
    /// Scores of all models on the test pushes.
    pub chain: Vec<Row>,
}

/// Runs the discovery on training pushes and scores all models; returns `None` if interrupted.
pub fn chain(plan: &Sizes, runs: Runs<'_>, output: &Output) -> anyhow::Result<Option<Pushing>> {
    let lab = Laboratory::new(plan, runs.seed)?;
    let some: Vec<usize> = (0..LOOP_PUSHES.min(plan.train)).collect();
    let some = lab.data.select(&some);
    let set = sets::discover_set(
        LABORATORY,
        &some,
        &lab.declared.to_toml(),
        runs.out,
        runs.seed,
        runs.resume,
        output,
    )?;
    let estimate = |name: &str| set.found.calibrated.get(name).map(|e| e.value);
    let chain = Chain {
        name: Some(data::LABORATORY),
        declared: engine_of(lab.declared.clone())?,
        calibrated: engine_of(lab.declared.with_nominal(estimate))?,
        augmented: engine_of(PushModel::parse(&set.found.model_toml, "the augmented model")?)?,
        scattered: None,
        read: some.trajectories().len(),
        source: &lab.source,
        train: &lab.train,
        test: &lab.test,
        runs: Runs { out: &runs.out.join("chain-push"), ..runs },
    };
    let Some(rows) = chain.run(output)? else { return Ok(None) };
    Ok(Some(Pushing { set, chain: rows }))
}

#[cfg(test)]
mod tests {
    //! Contract: one table has all models on held-out pushes; the augmented physics is the discovered
    //! model file; a resumed run repeats nothing and gives the same files.

    use super::*;
    use augsim_session::run_dir::RunDir;
    use augsim_trainer::Engine;

    const ROWS: [&str; 9] = [
        "Zero",
        "Physics",
        "Physics calibrated",
        "Physics augmented",
        "Neural",
        "Hybrid",
        "Hybrid on augmented",
        "Hybrid+",
        "Hybrid+ on augmented",
    ];

    #[test]
    fn makes_one_table_of_all_models_and_resumes() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        // Twenty pushes show the inertia clearly (error of 7.8 mm after calibration, 1.0 mm with
        // inertia). With sixteen other pushes the result depended on rounding.
        let plan = Sizes { train: 20, test: 5, ..Sizes::quick() };
        let run = |resume: bool| {
            let runs = Runs { out: dir.path(), iterations: 3, seed: 11, resume };
            let done = chain(&plan, runs, &Output::new(false, true, false)).expect("it runs");
            done.expect("nobody stopped it")
        };
        let first = run(false);
        assert_eq!(first.chain.iter().map(|r| r.model.as_str()).collect::<Vec<_>>(), ROWS);
        let error = |model: &str| {
            let row = first.chain.iter().find(|r| r.model == model).expect("a row");
            let tested = row.tested.as_ref().expect("pushes say what they are of");
            assert_eq!((tested.split, tested.test_pushes), ("test", 5));
            row.number("pos_mm")
        };
        assert!(error("Physics augmented") < error("Physics") && error("Physics") < error("Zero"));

        let model = |folder: &str| {
            let run = RunDir::open(&dir.path().join("chain-push").join(folder));
            match run.read_config().expect("a configuration").settings.engine {
                Engine::Model(engine) => PushModel::parse(engine.model(), "model").expect("a model"),
                other => panic!("{other:?} is no engine of pushing"),
            }
        };
        let kinds = |folder: &str| model(folder).effects.into_iter().map(|e| e.kind).collect::<Vec<_>>();
        let mut found: Vec<String> = first.set.found.effects.iter().map(|e| e.kind.clone()).collect();
        let mut used = kinds("hybrid-plus-augmented");
        found.sort_unstable();
        used.sort_unstable();
        assert!(!found.is_empty() && used == found, "found {found:?}, used {used:?}");
        assert!(kinds("hybrid-plus").is_empty() && model("hybrid").parameters[1].nominal == 0.25);

        let result = dir.path().join(LABORATORY).join("result.json");
        let written = || std::fs::metadata(&result).and_then(|m| m.modified()).expect("a result");
        let before = written();
        let again = run(true);
        assert_eq!(written(), before, "the loop was run again");
        assert_eq!(again.set.found, first.set.found);
        let rows = |p: &Pushing| serde_json::to_string(&p.chain).expect("rows serialise");
        assert_eq!(rows(&again), rows(&first));
    }
}
