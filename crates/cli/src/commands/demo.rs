//! `augsim demo`: the whole chain in about two minutes.

use super::discover::close_loop;
use crate::args::{Accept, Demo, Discover};
use crate::ball::{self, Experiment, NetPlan};
use crate::exit::Outcome;
use crate::output::Output;
use crate::run_dir::DataSource;
use augsim_data::atomic_write;
use augsim_trainer::Recipe;
use std::io::Write;

/// A measured set with an effect that its model file does not declare, and that model file.
const SEALED: [(&str, &[u8]); 2] = [
    ("bounces.csv", include_bytes!("../../../../fixtures/sealed/bounces.csv")),
    ("model.toml", include_bytes!("../../../../fixtures/sealed/model.toml")),
];

/// Runs the subcommand.
pub fn run(args: &Demo, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    let sealed = args.out.join("sealed");
    std::fs::create_dir_all(&sealed)?;
    for (name, bytes) in SEALED {
        atomic_write(&sealed.join(name), |w| w.write_all(bytes))?;
    }
    output.note("First, throws of a ball whose model file misses something, and nobody says what:");
    let discover = Discover {
        model: sealed.join("model.toml"),
        data: sealed.join("bounces.csv"),
        out: args.out.join("discover"),
        train_share: 0.7,
        group: Vec::new(),
        accept: Accept::default(),
    };
    let found = close_loop(&discover, seed, output)?;
    output.note(format!("  {}\n  report: {}\n", found.sentence, discover.out.join("report.html").display()));
    output.note(
        "Then, drops of a ball: each one has its own restitution, which cannot be seen at release. The physics model \
         believes one restitution and a damping that is not there. Three nets learn what it gets wrong.",
    );
    let experiment = Experiment {
        title: "Demo: a bouncing ball".to_owned(),
        command: format!("augsim demo --out {} --seed {seed}", args.out.display()),
        train: DataSource::PaperLaw { trajectories: 400, seed },
        test: DataSource::PaperLaw { trajectories: 200, seed: seed.wrapping_add(1_000_000) },
        test_name: "generated".to_owned(),
        nets: [(Recipe::Neural, 600), (Recipe::Hybrid, 600), (Recipe::HybridPlus, 1500)]
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
