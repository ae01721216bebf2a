//! Options of `train`.

use augsim_session::configure::Corrected;
use augsim_session::{DataFrom, Usage};
use augsim_terminal::discover_args::Accept;
use augsim_trainer::Recipe;
use clap::Args as ClapArgs;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use std::path::PathBuf;

/// Words of the recipes, each with what it is.
fn recipes() -> impl TypedValueParser<Value = Recipe> {
    let word = |recipe: Recipe| PossibleValue::new(recipe.name()).help(recipe.about());
    PossibleValuesParser::new(Recipe::all().map(word))
        .try_map(|name| Recipe::named(&name).ok_or_else(|| format!("no recipe is called {name}")))
}

/// Options of `train`.
#[derive(Debug, ClapArgs)]
pub struct Train {
    /// Trajectories to train on (CSV, plain or gzip). Without it 800 drops are generated.
    #[arg(long)]
    pub data: Option<PathBuf>,
    /// Train on what the model in this folder of `discover` leaves of the data: the net corrects the augmented model.
    #[arg(long, value_name = "RUN", requires = "data")]
    pub residual_of: Option<PathBuf>,
    /// Model file (TOML) that says what moves in the data: the net corrects it.
    #[arg(long, value_name = "FILE", requires = "data", conflicts_with = "residual_of")]
    pub model: Option<PathBuf>,
    /// The data are of the ball of the paper's experiment: height and velocity at 60 Hz, PyBullet's stepping.
    #[arg(long, requires = "data", conflicts_with_all = ["residual_of", "model"])]
    pub pybullet_ball: bool,
    /// Which net.
    #[arg(long, value_parser = recipes(), default_value = "hybrid-plus")]
    pub recipe: Recipe,
    /// Iterations; the learning-rate schedule scales with them.
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(1..))]
    pub iterations: u64,
    /// Run directory.
    #[arg(long, default_value = "out/run")]
    pub out: PathBuf,
    /// Go on with the run in `--out`, bit for bit as if it had never stopped; its own settings count.
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
    /// Iterations between checkpoints.
    #[arg(long, default_value_t = 500, value_parser = clap::value_parser!(u64).range(1..))]
    pub checkpoint_every: u64,
    /// Checks of suspicious data to do without.
    #[command(flatten)]
    pub accept: Accept,
}

impl Train {
    /// The model that the net is to correct, and the data; nothing for drops that are generated. Reads no file.
    ///
    /// # Errors
    /// There are data, and no option says what moves in them.
    pub fn corrected(&self) -> Result<Option<(Corrected, DataFrom)>, Usage> {
        let Some(data) = self.data.as_ref().map(DataFrom::from) else { return Ok(None) };
        let (residual_of, model) = (self.residual_of.as_deref(), self.model.as_deref());
        let named = Corrected::of_options(residual_of, model, self.pybullet_ball, &data)?;
        Ok(Some((named, data)))
    }
}
