//! Protocol of the league: choose settings on a validation part, train with several seeds, score on
//! every test set.

use super::entrants::Entrant;
use super::factors::{Factors, SETTINGS};
use super::measures::{Measured, keys, measure};
use super::processor::processor_s;
use super::rows::{Row, Scored, Spread, Tried};
use super::set_name;
use crate::args::{LeagueScenario, Reproduce};
use crate::experiment::data::{Data, Set, part};
use augsim_physics::ball::drop_distribution::DropDistribution;
use augsim_session::run_dir::Config;
use augsim_terminal::destination::Claim;
use augsim_terminal::output::Output;
use augsim_terminal::training;
use augsim_trainer::models::{ExactDistribution, NetModel, NonPenetrating, Physics, Still, Zero};
use augsim_trainer::push::{GpOptions, GpPush};
use augsim_trainer::{Forecaster, Recipe, Sequences, Settings};
use std::path::Path;

/// Name of the file in a run directory with the processor time of the training in s.
const CPU_TIME_FILE: &str = "cpu_s";

/// Data sizes and numbers of iterations, settings and seeds of the comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Number of training trajectories of each model class.
    pub train: usize,
    /// Number of test trajectories of the training object and surface.
    pub test: usize,
    /// Number of test trajectories of each other object and surface.
    pub transfer: usize,
    /// Number of training iterations of each network.
    pub iterations: u64,
    /// Number of training settings that each model class tries.
    pub settings: usize,
    /// Number of seeds with which each model class is trained.
    pub seeds: u64,
    /// Number of training steps of the Gaussian processes.
    pub gp_steps: usize,
    /// Whether only some of the sets with other objects or surfaces are used.
    pub few_sets: bool,
    /// Training-set sizes of the learning curves; empty for ball drops.
    pub sizes: &'static [usize],
    /// Number of seeds per size of the learning curves.
    pub size_seeds: u64,
}

impl Effort {
    /// Returns data sizes and numbers for a scenario and the command line options.
    pub fn for_scenario(scenario: LeagueScenario, args: &Reproduce) -> Self {
        let ball = scenario == LeagueScenario::Ball;
        let effort = match (args.quick, ball) {
            (true, true) => Effort {
                train: 200,
                test: 60,
                transfer: 0,
                iterations: 300,
                settings: 2,
                seeds: 3,
                gp_steps: 0,
                few_sets: true,
                sizes: &[],
                size_seeds: 1,
            },
            (true, false) => Effort {
                train: 400,
                test: 60,
                transfer: 40,
                iterations: 500,
                settings: 2,
                seeds: 3,
                gp_steps: 300,
                few_sets: true,
                sizes: &[50, 100, 200, 400],
                size_seeds: 1,
            },
            (false, true) => Effort {
                train: 800,
                test: 1000,
                transfer: 0,
                iterations: 10_000,
                settings: 4,
                seeds: 3,
                gp_steps: 0,
                few_sets: false,
                sizes: &[],
                size_seeds: 1,
            },
            (false, false) => Effort {
                train: 2500,
                test: 628,
                transfer: 300,
                iterations: 5_000,
                settings: 4,
                seeds: 3,
                gp_steps: 800,
                few_sets: false,
                sizes: &[250, 500, 1000, 2500, 6500],
                size_seeds: 3,
            },
        };
        Effort { iterations: args.iterations.unwrap_or(effort.iterations), ..effort }
    }
}

/// Chosen factors of learning rate and width, and all tried settings.
type Choice = (Factors, Vec<Tried>);

/// Data and options of the training runs of a scenario.
#[derive(Debug)]
pub struct Runs<'a> {
    pub data: &'a Data,
    pub effort: Effort,
    pub seed: u64,
    pub resume: bool,
    pub claim: &'a Claim,
    pub output: &'a Output,
    pub scenario: LeagueScenario,
}

/// How the samples of a trained network are used.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Variant {
    /// The samples are unchanged.
    AsTrained,
    /// The samples are projected to poses in which rod and object do not penetrate.
    NonPenetrating,
}

impl Variant {
    /// Returns the name of the network's variant in the table.
    fn label(self, recipe: Recipe) -> String {
        match self {
            Variant::AsTrained => recipe.label().to_owned(),
            Variant::NonPenetrating => format!("{} apart", recipe.label()),
        }
    }
}

/// A trained network and the processor time of its training.
struct Net {
    model: NetModel,
    parameters: usize,
    cpu_s: Option<f64>,
}

impl Runs<'_> {
    /// Trains and scores a model class; returns one row per variant and test set, or `None` if interrupted.
    pub fn enter(&self, entrant: Entrant) -> anyhow::Result<Option<Vec<Scored>>> {
        let recipe = match entrant {
            Entrant::Trained(recipe) => recipe,
            _ => return self.untrained(entrant).map(Some),
        };
        let Some((factors, tried)) = self.choose(recipe)? else { return Ok(None) };
        let mut nets = Vec::new();
        for k in 0..self.effort.seeds {
            let seed = self.seed.wrapping_add(k);
            let folder = format!("{}-seed{}", recipe.name(), k + 1);
            let Some(net) = self.net(&self.settings(recipe, factors, seed), &self.data.train, &folder)?
            else {
                return Ok(None);
            };
            nets.push(net);
        }
        let cpu: Option<Vec<f64>> = nets.iter().map(|n| n.cpu_s).collect();
        // The cost of the non-penetration constraint is shown for Hybrid+ only.
        let has_constraint = recipe == Recipe::HybridPlus && self.scenario == LeagueScenario::Push;
        let variants = if has_constraint {
            vec![Variant::NonPenetrating, Variant::AsTrained]
        } else {
            vec![Variant::AsTrained]
        };
        let mut out = Vec::new();
        for variant in variants {
            for set in &self.data.tests {
                let mut seeds = Vec::new();
                for net in &nets {
                    let model = net.model.with_engine(set.engine.clone())?;
                    seeds.push(match variant {
                        Variant::AsTrained => measure(Some(&model), set)?,
                        Variant::NonPenetrating => {
                            measure(Some(&NonPenetrating::new(&model, &set.engine)?), set)?
                        }
                    });
                }
                let mut scored = self.row(set, &variant.label(recipe), &seeds);
                scored.row.parameters = Some(nets[0].parameters);
                scored.row.trained_on = Some(self.data.train.items.len());
                scored.row.tried.clone_from(&tried);
                scored.row.cpu_s = cpu.as_ref().map(|c| median(c.clone()));
                scored.recipe = (variant == Variant::AsTrained).then_some(recipe);
                out.push(scored);
            }
        }
        Ok(Some(out))
    }

    /// Trains a model class with several seeds; returns its row on the first test set, `None` if interrupted.
    pub fn train_at_size(
        &self,
        recipe: Recipe,
        factors: Factors,
        train: &Sequences,
        seeds: u64,
    ) -> anyhow::Result<Option<Row>> {
        let (count, set) = (train.items.len(), &self.data.tests[0]);
        let (mut measured, mut parameters) = (Vec::new(), 0);
        for k in 0..seeds {
            let settings = self.settings(recipe, factors, self.seed.wrapping_add(k));
            let folder = format!("{}-size{count}-seed{}", recipe.name(), k + 1);
            let Some(net) = self.net(&settings, train, &folder)? else { return Ok(None) };
            measured.push(measure(Some(&net.model), set)?);
            parameters = net.parameters;
        }
        let mut row = self.row(set, recipe.label(), &measured).row;
        (row.parameters, row.trained_on) = (Some(parameters), Some(count));
        Ok(Some(row))
    }

    fn untrained(&self, entrant: Entrant) -> anyhow::Result<Vec<Scored>> {
        let gp = match entrant {
            Entrant::GaussianProcess => {
                self.output.note("fitting the Gaussian processes");
                let options = GpOptions { steps: self.effort.gp_steps, seed: self.seed };
                Some(GpPush::fit(&self.data.engine, &self.data.train, options)?)
            }
            _ => None,
        };
        let mut out = Vec::new();
        for set in &self.data.tests {
            let physics = Physics(set.engine.clone());
            let forecaster = ExactDistribution { law: DropDistribution::default(), seed: self.seed };
            let gp = gp.as_ref().map(|gp| gp.with_engine(&set.engine)).transpose()?;
            let still = self.scenario == LeagueScenario::Push;
            let (model, name): (&dyn Forecaster, &str) = match (entrant, &gp) {
                (Entrant::ExactDistribution, _) => (&forecaster, forecaster.name()),
                (Entrant::GaussianProcess, Some(gp)) => (gp, gp.name()),
                (Entrant::Zero, _) if still => (&Still, "Still"),
                (Entrant::Zero, _) => (&Zero, "Zero"),
                (Entrant::Data, _) => {
                    let measured = measure(None, set)?;
                    out.push(self.row(set, "(the data)", &[measured]));
                    continue;
                }
                _ => (&physics, "Physics"),
            };
            let measured = measure(Some(model), set)?;
            let mut scored = self.row(set, name, &[measured]);
            scored.row.trained_on = gp.as_ref().map(|_| self.data.train.items.len());
            out.push(scored);
        }
        Ok(out)
    }

    /// Chooses the training setting with the smallest CRPS on the validation part; `None` if interrupted.
    fn choose(&self, recipe: Recipe) -> anyhow::Result<Option<Choice>> {
        let all = self.data.train.items.len();
        let fitted = all - all / 5;
        let train = part(&self.data.train, 0, fitted);
        let items = part(&self.data.train, fitted, all);
        let check = Set { items, on: None, engine: self.data.engine.clone() };
        let mut tried = Vec::new();
        let count = if recipe.is_fitted() { 1 } else { self.effort.settings.min(SETTINGS.len()) };
        for (k, factors) in SETTINGS.into_iter().take(count).enumerate() {
            let settings = self.settings(recipe, factors, self.seed);
            let folder = format!("{}-setting{}", recipe.name(), k + 1);
            let Some(net) = self.net(&settings, &train, &folder)? else { return Ok(None) };
            let measured = measure(Some(&net.model), &check)?;
            tried.push(Tried {
                learning_rate: settings.learning_rate.initial,
                hidden: settings.net.hidden,
                crps: measured.mean_crps(),
                chosen: false,
            });
        }
        let least = |a: &(usize, &Tried), b: &(usize, &Tried)| a.1.crps.total_cmp(&b.1.crps);
        let best = tried.iter().enumerate().min_by(least).map_or(0, |(k, _)| k);
        tried[best].chosen = true;
        Ok(Some((SETTINGS[best], tried)))
    }

    fn settings(&self, recipe: Recipe, (rate, width): Factors, seed: u64) -> Settings {
        let mut settings = Settings::new(recipe, self.effort.iterations, seed, self.data.engine.clone());
        settings.learning_rate.initial *= rate;
        settings.net.hidden = (settings.net.hidden as f64 * width) as usize;
        settings
    }

    fn net(&self, settings: &Settings, train: &Sequences, folder: &str) -> anyhow::Result<Option<Net>> {
        let folder = self.claim.folder().join(self.scenario.name()).join(folder);
        let config = Config {
            checkpoint_every: 500,
            data: self.data.source.clone(),
            accept: Vec::new(),
            residual_of: None,
            settings: settings.clone(),
        };
        let shown = folder.file_name().unwrap_or_default().to_string_lossy();
        self.output.note(format!("{}: {shown} ({} iterations)", self.scenario.name(), settings.iterations));
        let before = processor_s();
        let Some(trained) = training::train_or_resume(&folder, &config, train, self.resume, self.output)?
        else {
            return Ok(None);
        };
        let cpu = folder.join(CPU_TIME_FILE);
        if trained.seconds_per_iteration.is_some() {
            std::fs::write(&cpu, format!("{:.2}", processor_s() - before))?;
        }
        Ok(Some(Net { model: trained.model, parameters: trained.parameters, cpu_s: read_number(&cpu) }))
    }

    /// Makes the row of a model on a test set from the measured values of each seed.
    fn row(&self, set: &Set, model: &str, seeds: &[Measured]) -> Scored {
        let figures = keys(self.scenario).iter().enumerate().filter_map(|(k, key)| {
            let values: Vec<f64> = seeds.iter().filter_map(|m| m.figures[k]).collect();
            (!values.is_empty()).then(|| (key.name.to_owned(), Spread::from_values(values)))
        });
        let n = seeds.len() as f64;
        let trajectories = seeds.first().map_or(0, |m| m.crps.len());
        let crps = (0..trajectories).map(|i| seeds.iter().map(|m| m.crps[i]).sum::<f64>() / n).collect();
        let cost: Vec<f64> = seeds.iter().filter_map(|m| m.microseconds).collect();
        Scored {
            row: Row {
                model: model.to_owned(),
                set: set_name(set),
                seeds: seeds.len(),
                figures: figures.collect(),
                parameters: None,
                trained_on: None,
                tried: Vec::new(),
                crps_ci95: None,
                cpu_s: None,
                microseconds: (!cost.is_empty()).then(|| median(cost)),
            },
            recipe: None,
            crps,
        }
    }
}

fn read_number(path: &Path) -> Option<f64> {
    std::fs::read_to_string(path).ok()?.trim().parse().ok()
}

/// Returns the median of values; the lower of the two middle ones if their number is even.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[(values.len() - 1) / 2]
}
