//! `augsim demo`: a two-minute demonstration of discovery, training and forecasting.

use crate::args::Demo;
use augsim_data::atomic_write;
use augsim_reproduce::experiment::data::Data;
use augsim_reproduce::experiment::{ball, table};
use augsim_session::folders;
use augsim_session::run_dir::DataSource;
use augsim_terminal::Outcome;
use augsim_terminal::destination::{REPORT, RESULT, Results};
use augsim_terminal::discover_args::Discover;
use augsim_terminal::discovery::run_whole_discovery;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use augsim_trainer::Recipe;
use std::io::Write;

/// Files of the demonstration: a measured data set, and a model file that lacks one effect of these data.
const DEMO_FILES: [(&str, &[u8]); 2] = [
    ("bounces.csv", include_bytes!("../../demo/bounces.csv")),
    ("declared.toml", include_bytes!("../../demo/declared.toml")),
];

/// Number of training iterations of each of the three networks.
const ITERATIONS: u64 = 900;

/// Runs `augsim demo`: discovery on a measured data set, then training of three networks.
pub fn run(args: &Demo, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let record = Record::new("demo").setting("seed", seed);
    let claim =
        Results { folder: &args.out, files: &[RESULT, REPORT], inputs: &[], record, force }.claim()?;
    claim.begin()?;
    let out = args.out.join("discover");
    folders::make(&out)?;
    for (name, bytes) in DEMO_FILES {
        atomic_write(&out.join(name), |w| w.write_all(bytes))?;
    }
    output.note("First: throws of a ball. The model file lacks one effect, which augsim has to find:");
    let discover = Discover {
        model: out.join("declared.toml"),
        data: vec![out.join("bounces.csv")],
        out,
        null_runs: 19,
        ..Discover::default()
    };
    let found = run_whole_discovery(&discover, seed, true, output)?;
    output.note(format!("  {}\n  report: {}\n", found.sentence, discover.out.join("report.html").display()));
    output.note(
        "Then: drops of a ball. Each drop has a different restitution, which is unknown at release. The physics model \
         assumes one constant restitution and a damping that does not exist. Three networks learn the error of this model.",
    );
    let experiment = ball::experiment(
        "Demo: a bouncing ball",
        "generated",
        &[Recipe::Neural, Recipe::Hybrid, Recipe::HybridPlus].map(|recipe| (recipe, ITERATIONS)),
        (format!("augsim demo --seed {seed} --out DIR"), seed, false),
    );
    let drops = |trajectories, seed| DataSource::DropDistribution { trajectories, seed };
    let (data, truth) = Data::drops(&drops(400, seed), &drops(200, seed.wrapping_add(1_000_000)))?;
    let Some(finished) = experiment.run(&data, Some(&truth), &claim, output)? else {
        return Ok(Outcome::Interrupted);
    };
    output.result(&finished.result, || {
        format!(
            "{}\nThe row \"Floor\" estimates the lowest error that a forecast from the first state can have; one that is as good as possible can lie slightly above or below it by chance.\nreport: {}",
            table(&finished.result),
            finished.report.display()
        )
    })?;
    Ok(Outcome::Done)
}
