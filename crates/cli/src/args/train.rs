//! Options of `train`.

use augsim_session::configure::PhysicsSource;
use augsim_session::{DataFrom, Usage};
use augsim_terminal::discover_args::Accept;
use augsim_trainer::Recipe;
use clap::Args as ClapArgs;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use std::path::PathBuf;

/// Argument parser of network recipe names, with the description of each recipe.
fn recipes() -> impl TypedValueParser<Value = Recipe> {
    let possible_value = |recipe: Recipe| PossibleValue::new(recipe.name()).help(recipe.about());
    PossibleValuesParser::new(Recipe::all().map(possible_value))
        .try_map(|name| Recipe::named(&name).ok_or_else(|| format!("no recipe is called {name}")))
}

/// Options of `train`.
#[derive(Debug, ClapArgs)]
pub struct Train {
    /// Training trajectories (CSV, plain or gzip). Without it 800 drops are generated.
    #[arg(long)]
    pub data: Option<PathBuf>,
    /// Train on the residual of the augmented model in this output folder of `discover`. The network
    /// corrects that model.
    #[arg(long, value_name = "RUN", requires = "data")]
    pub residual_of: Option<PathBuf>,
    /// Model file (TOML) of the system in the data. The network corrects it.
    #[arg(long, value_name = "FILE", requires = "data", conflicts_with = "residual_of")]
    pub model: Option<PathBuf>,
    /// The data are of the ball of the paper's experiment: height and velocity at 60 Hz, with the time
    /// stepping of PyBullet.
    #[arg(long, requires = "data", conflicts_with_all = ["residual_of", "model"])]
    pub pybullet_ball: bool,
    /// Network recipe.
    #[arg(long, value_parser = recipes(), default_value = "hybrid-plus")]
    pub recipe: Recipe,
    /// Number of training iterations. The learning-rate schedule scales with it.
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(1..))]
    pub iterations: u64,
    /// Run directory to write.
    #[arg(long, default_value = "out/run")]
    pub out: PathBuf,
    /// Resume the run in `--out` with its own settings. The result is identical to that of an
    /// uninterrupted run.
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
    /// Number of iterations between checkpoints.
    #[arg(long, default_value_t = 500, value_parser = clap::value_parser!(u64).range(1..))]
    pub checkpoint_every: u64,
    /// Data checks to ignore.
    #[command(flatten)]
    pub accept: Accept,
}

impl Train {
    /// Returns the model that the network corrects and the data, or `None` for generated drops. Reads no
    /// file.
    ///
    /// # Errors
    /// Data are given, but no option names the system in them.
    pub fn corrected(&self) -> Result<Option<(PhysicsSource, DataFrom)>, Usage> {
        let Some(data) = self.data.as_ref().map(DataFrom::from) else { return Ok(None) };
        let (residual_of, model) = (self.residual_of.as_deref(), self.model.as_deref());
        let corrected = PhysicsSource::from_options(residual_of, model, self.pybullet_ball, &data)?;
        Ok(Some((corrected, data)))
    }
}
