//! `augsim train`.

use crate::args::{RecipeArg, Train};
use crate::exit::{Outcome, Usage};
use crate::output::Output;
use crate::run_dir::{Config, DataSource, RunDir};
use crate::session::{self, Ended};
use crate::{ball, residual, run_data};
use augsim_trainer::{Recipe, Settings};
use serde::Serialize;

/// Trajectories that are generated when no data are given: the paper's number.
const GENERATED: usize = 800;

#[derive(Serialize)]
struct Summary {
    run: std::path::PathBuf,
    recipe: Recipe,
    parameters: usize,
    iterations: u64,
    seconds_per_iteration: Option<f64>,
}

/// Runs the subcommand.
pub fn run(args: &Train, seed: u64, output: &Output) -> anyhow::Result<Outcome> {
    let run = RunDir::create(&args.out)?;
    let config = match args.resume {
        true => run.read_config()?,
        false => {
            if run.checkpoint().exists() {
                let run = args.out.display();
                let text =
                    format!("{run} holds a run already; add --resume to go on, or choose another --out");
                return Err(Usage(text).into());
            }
            let data = match &args.data {
                Some(path) => DataSource::File(path.clone()),
                None => DataSource::PaperLaw { trajectories: GENERATED, seed },
            };
            let recipe = recipe(args.recipe);
            let engine = match (&args.residual_of, &args.data) {
                (Some(found), Some(data)) => residual::engine(found, data, recipe, output)?,
                _ => ball::paper_engine(),
            };
            let settings = Settings::new(recipe, args.iterations, seed, engine);
            Config {
                checkpoint_every: args.checkpoint_every,
                data,
                accept: args.accept.accept.clone(),
                settings,
            }
        }
    };
    let (train, warnings) = run_data::admitted(&config)?;
    output.warn(&warnings);
    run.write_config(&config)?;
    match session::train(&run, &config, &train, args.resume, output)? {
        Ended::Interrupted { iteration } => {
            output.note(format!(
                "interrupted after iteration {iteration}; go on with: augsim train --resume --out {}",
                args.out.display()
            ));
            Ok(Outcome::Interrupted)
        }
        Ended::Trained(trained) => {
            let summary = Summary {
                run: args.out.clone(),
                recipe: config.settings.recipe,
                parameters: trained.parameters,
                iterations: config.settings.iterations,
                seconds_per_iteration: trained.seconds_per_iteration,
            };
            output.result(&summary, || {
                let rate = trained
                    .seconds_per_iteration
                    .map_or(String::new(), |s| format!(", {:.1} ms each", s * 1e3));
                format!(
                    "{}: {} parameters, {} iterations{rate}\nrun: {}",
                    config.settings.recipe.label(),
                    trained.parameters,
                    config.settings.iterations,
                    args.out.display()
                )
            })?;
            Ok(Outcome::Done)
        }
    }
}

/// What the word on the command line means.
fn recipe(arg: RecipeArg) -> Recipe {
    match arg {
        RecipeArg::Neural => Recipe::Neural,
        RecipeArg::Hybrid => Recipe::Hybrid,
        RecipeArg::HybridStandardised => Recipe::HybridStandardised,
        RecipeArg::HybridPlus => Recipe::HybridPlus,
    }
}
