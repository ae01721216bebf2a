//! `augsim demo`: the whole chain in about two minutes.

use crate::args::Demo;
use crate::ball::{self, Experiment, NetPlan};
use crate::exit::Outcome;
use crate::output::Output;
use crate::run_dir::DataSource;
use augsim_trainer::Recipe;

/// Runs the subcommand.
pub fn run(args: &Demo, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    output.note(
        "A ball is dropped; each ball has its own restitution, which cannot be seen at release. The physics model \
         believes one restitution and a damping that is not there. Three nets learn what it gets wrong.",
    );
    let experiment = Experiment {
        title: "Demo: a bouncing ball".to_owned(),
        command: format!("augsim demo --out {} --seed {seed}", args.out.display()),
        train: DataSource::PaperLaw { trajectories: 400, seed },
        test: DataSource::PaperLaw { trajectories: 200, seed: seed.wrapping_add(1_000_000) },
        test_name: "generated".to_owned(),
        nets: [(Recipe::Neural, 800), (Recipe::Hybrid, 800), (Recipe::HybridPlus, 2000)]
            .map(|(recipe, iterations)| NetPlan { recipe, iterations })
            .into(),
        seed,
        out: args.out.clone(),
        resume: false,
    };
    let Some(finished) = experiment.run(output)? else { return Ok(Outcome::Interrupted) };
    output.result(&finished.result, || {
        format!(
            "{}The best that any forecast can do from the first state is the row \"Floor\".\nreport: {}",
            ball::table(&finished.result.rows),
            finished.report.display()
        )
    })?;
    Ok(Outcome::Done)
}
