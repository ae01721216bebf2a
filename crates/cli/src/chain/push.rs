//! The whole chain on pushing: pushes of the virtual laboratory, whose friction is not what the textbook model declares.

use super::nets::{Nets, Runs};
use super::sets::{self, SetRow};
use crate::output::Output;
use crate::push::{Laboratory, Plan, Row, engine_of};
use augsim_physics::model::PushModel;
use augsim_trainer::Forecaster;
use augsim_trainer::models::{Physics, Zero};
use augsim_trainer::push::score::evaluate_pushes;
use serde::Serialize;

/// Name of the set, and of the folder of its report.
pub const LABORATORY: &str = "push-laboratory";
/// Training pushes that the loop reads: 2 to 3 CPU minutes, as fast pushes with inertia are slow to simulate.
const LOOP_PUSHES: usize = 120;

/// What is run.
pub struct Chain<'a> {
    /// Numbers of pushes, and their thinning.
    pub plan: Plan,
    /// How it is run.
    pub runs: Runs<'a>,
}

/// What came of it.
#[derive(Debug, Serialize)]
pub struct Pushing {
    /// The discovery on training pushes.
    #[serde(flatten)]
    pub set: SetRow,
    /// The table on the test pushes.
    pub chain: Vec<Row>,
}

impl Chain<'_> {
    /// Closes the loop and makes the table; `None` if the user stopped it.
    pub fn run(&self, output: &Output) -> anyhow::Result<Option<Pushing>> {
        let Runs { out, seed, resume, .. } = self.runs;
        let lab = Laboratory::new(&self.plan, seed)?;
        let some: Vec<usize> = (0..LOOP_PUSHES.min(self.plan.train)).collect();
        let some = lab.data.select(&some);
        let declared = lab.declared.to_toml();
        let set = sets::one(LABORATORY, &some, &declared, out, seed, resume, output)?;
        let estimate = |name: &str| set.found.calibrated.get(name).map(|e| e.value);
        let textbook = engine_of(lab.declared.clone())?;
        let calibrated = engine_of(lab.declared.with_nominal(estimate))?;
        let augmented = engine_of(PushModel::parse(&set.found.model_toml, "the augmented model")?)?;

        let nets = Nets {
            declared: textbook.clone(),
            augmented: augmented.clone(),
            source: &lab.source,
            train: &lab.train,
            runs: Runs { out: &out.join("chain-push"), ..self.runs },
        };
        let Some(nets) = nets.train(output)? else { return Ok(None) };
        let (read, whole) = (some.trajectories().len(), lab.train.items.len());
        let [textbook, calibrated, augmented] = [textbook, calibrated, augmented].map(Physics);
        let mut models: Vec<(&str, &dyn Forecaster, usize)> = vec![
            ("Zero", &Zero, 0),
            ("Physics", &textbook, 0),
            ("Physics calibrated", &calibrated, read),
            ("Physics augmented", &augmented, read),
        ];
        models.extend(nets.iter().map(|(label, net)| (*label, net as &dyn Forecaster, whole)));
        let mut chain = Vec::new();
        for (label, model, trained) in models {
            let score = evaluate_pushes(model, &lab.test.pushes)?;
            chain.push(Row::new("virtual laboratory", label, &lab.test, trained, &score));
        }
        Ok(Some(Pushing { set, chain }))
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the chain on pushing has the rows of the whole project in one table, on pushes that neither the loop nor a
    //! net has seen; the augmented physics is that of the discovery's model file; going on repeats nothing and changes nothing.

    use super::*;
    use crate::run_dir::RunDir;
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
    fn the_whole_chain_is_in_one_table_and_goes_on_from_what_is_there() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let plan = Plan { train: 16, test: 5, ..Plan::quick() };
        let run = |resume: bool| {
            let runs = Runs { out: dir.path(), iterations: 3, seed: 2, resume };
            let chain = Chain { plan: plan.clone(), runs };
            let done = chain.run(&Output::new(false, true, false)).expect("it runs");
            done.expect("nobody stopped it")
        };
        let first = run(false);
        assert_eq!(first.chain.iter().map(|r| r.model.as_str()).collect::<Vec<_>>(), ROWS);
        let error = |model: &str| {
            let row = first.chain.iter().find(|r| r.model == model).expect("a row");
            assert_eq!((row.split, row.test_pushes), ("test", 5));
            row.errors.pos_mm
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
        assert_eq!(again.chain, first.chain);
    }
}
