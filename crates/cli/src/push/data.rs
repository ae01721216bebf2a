//! Where pushes come from: the virtual laboratory, published files, measured runs.

use super::plan::Plan;
use crate::run_dir::DataSource;
use anyhow::Context;
use augsim_data::push::{Surface, read_push_dataset, resample};
use augsim_data::{Dataset, MissingCells, Split, SplitSize, read_dataset};
use augsim_physics::model::{ModelFile, PushModel};
use augsim_physics::push::Object;
use augsim_physics::push::laboratory::{Generated, Protocol, Recipe, SupportSheet};
use augsim_trainer::push::{Thinning, pushes};
use augsim_trainer::{Engine, Sequences};
use std::collections::BTreeMap;
use std::path::Path;

/// Added to the seed for each further set, so that no two share draws.
const SEED_STEP: u64 = 1_000_000;
/// Rate at which published recordings are brought onto one clock, Hz: that of their sensors.
const PUBLISHED_RATE_HZ: f64 = 250.0;
/// The object and the support that nets are trained on.
const TRAINED: (&str, &str) = ("rect1", "abs");
/// Pairs of object and support that they have not seen.
const UNSEEN: [(&str, &str); 4] =
    [("rect1", "plywood"), ("rect1", "pu"), ("rect1", "delrin"), ("rect2", "abs")];

/// Pushes of one object on one support, with the model that is declared for them.
#[derive(Debug, Clone)]
pub struct Set {
    /// Object.
    pub object: String,
    /// Support.
    pub surface: String,
    /// `test`, `unseen surface` or `unseen object`.
    pub split: &'static str,
    /// The declared model.
    pub engine: Engine,
    /// The pushes.
    pub pushes: Sequences,
}

/// Everything that the tables are made of.
#[derive(Debug, Clone)]
pub struct PushData {
    /// `virtual laboratory` or `published MIT Push files`.
    pub name: &'static str,
    /// Source of the training pushes, for run directories; the k first of them make a smaller set.
    pub source: DataSource,
    /// The declared model of the training set.
    pub engine: Engine,
    /// Training pushes.
    pub train: Sequences,
    /// Test sets, the first on the training object and support.
    pub tests: Vec<Set>,
    /// What had to be left out.
    pub notes: Vec<String>,
}

/// The laboratory's pushes of the object and on the support that nets are trained on. One layout is cut into training and
/// test pushes: no cell of contact, angle and speed is in both unless there are more than 7,128.
#[derive(Debug, Clone)]
pub struct Laboratory {
    /// The model that is declared.
    pub declared: PushModel,
    /// All pushes as they were measured, those for training first.
    pub data: Dataset,
    /// Their source.
    pub source: DataSource,
    /// Training pushes, thinned.
    pub train: Sequences,
    /// Test pushes, thinned.
    pub test: Set,
}

impl Laboratory {
    /// Makes the pushes of a plan.
    pub fn new(plan: &Plan, seed: u64) -> anyhow::Result<Self> {
        let (object, surface) = TRAINED;
        let count = plan.train + plan.test;
        let Generated { data, declared, .. } =
            recipe(Protocol::Mit, object, surface, count)?.generate(seed)?;
        let all = pushes(&data, plan.thinning)?;
        Ok(Laboratory {
            declared,
            data,
            source: DataSource::PushLaboratory {
                object: object.into(),
                surface: surface.into(),
                pushes: count,
                seed,
            },
            train: part(&all, 0, plan.train),
            test: Set {
                object: object.into(),
                surface: surface.into(),
                split: "test",
                engine: engine(object, surface)?,
                pushes: part(&all, plan.train, count),
            },
        })
    }
}

/// The recipe of a set of the laboratory.
pub fn recipe(protocol: Protocol, object: &str, surface: &str, pushes: usize) -> anyhow::Result<Recipe> {
    let known = Object::named(object).with_context(|| format!("there is no object `{object}`"))?;
    let sheet = SupportSheet::named(surface).with_context(|| format!("there is no support `{surface}`"))?;
    Ok(Recipe::new(protocol, &known, sheet, pushes))
}

/// The declared engine of an object on a support.
pub fn engine(object: &str, surface: &str) -> anyhow::Result<Engine> {
    let known = Object::named(object).with_context(|| format!("there is no object `{object}`"))?;
    let sheet = SupportSheet::named(surface).with_context(|| format!("there is no support `{surface}`"))?;
    let friction = |name: &str| (name == "support_friction").then_some(sheet.friction);
    engine_of(PushModel::textbook(known).with_nominal(friction))
}

/// The engine of a model of pushing.
pub fn engine_of(model: PushModel) -> anyhow::Result<Engine> {
    Ok(Engine::of(&ModelFile::Push(model), None)?)
}

/// The pushes of a source, on one clock and thinned as every push here.
pub fn load(source: &DataSource) -> anyhow::Result<Sequences> {
    match source {
        DataSource::File(path) => on_one_clock(&read_file(path)?),
        DataSource::PushLaboratory { object, surface, pushes, seed } => {
            made(object, surface, *pushes, *seed, Thinning::default())
        }
        DataSource::PaperLaw { .. } => {
            anyhow::bail!("drops of a ball are no pushes: give pushes with --data")
        }
    }
}

/// The pushes of a file, each stream on its own clock.
pub fn read_file(path: &Path) -> anyhow::Result<Dataset> {
    Ok(read_dataset(path, MissingCells::AsGap)?)
}

/// Pushes on one clock and thinned.
pub fn on_one_clock(data: &Dataset) -> anyhow::Result<Sequences> {
    let streams = data.columns().iter().any(|c| c.name().ends_with("_new"));
    let resampled = streams.then(|| resample(data, PUBLISHED_RATE_HZ)).transpose()?;
    Ok(pushes(resampled.as_ref().unwrap_or(data), Thinning::default())?)
}

fn made(
    object: &str,
    surface: &str,
    count: usize,
    seed: u64,
    thinning: Thinning,
) -> anyhow::Result<Sequences> {
    Ok(pushes(&recipe(Protocol::Mit, object, surface, count)?.generate(seed)?.data, thinning)?)
}

/// The items `[from, to)` of a set.
pub fn part(all: &Sequences, from: usize, to: usize) -> Sequences {
    Sequences { items: all.items[from..to].to_vec(), ..all.clone() }
}

impl PushData {
    /// Pushes laid out as the MIT set, made by the virtual laboratory.
    pub fn laboratory(plan: &Plan, seed: u64) -> anyhow::Result<Self> {
        let Laboratory { source, train, test, .. } = Laboratory::new(plan, seed)?;
        let declared = test.engine.clone();
        let mut tests = vec![test];
        for (i, (object, surface)) in UNSEEN.into_iter().enumerate() {
            let seed = seed.wrapping_add((i as u64 + 1) * SEED_STEP);
            tests.push(Set {
                object: object.into(),
                surface: surface.into(),
                split: if surface == TRAINED.1 { "unseen object" } else { "unseen surface" },
                engine: engine(object, surface)?,
                pushes: made(object, surface, plan.transfer, seed, plan.thinning)?,
            });
        }
        Ok(PushData { name: "virtual laboratory", source, engine: declared, train, tests, notes: Vec::new() })
    }

    /// The published files below a folder. Nets are trained on rect1 on ABS where that is there, otherwise on the
    /// pair of object and support with most pushes; all other pairs are transfer tests.
    pub fn published(folder: &Path, plan: &Plan, seed: u64) -> anyhow::Result<Self> {
        let all = resample(&read_push_dataset(folder)?, PUBLISHED_RATE_HZ)?;
        let mut notes = Vec::new();
        let mut pairs: BTreeMap<(String, String), Vec<usize>> = BTreeMap::new();
        for (i, t) in all.trajectories().iter().enumerate() {
            let (surface, object) =
                t.group().and_then(|g| g.split_once('/')).unwrap_or(("unknown", "unknown"));
            pairs.entry((object.to_owned(), surface.to_owned())).or_default().push(i);
        }
        pairs.retain(|(object, surface), items| {
            let known = engine(object, surface).is_ok();
            if !known {
                notes.push(format!(
                    "{} pushes of {object} on {surface} left out: no declared model",
                    items.len()
                ));
            }
            known
        });
        let trained = (TRAINED.0.to_owned(), TRAINED.1.to_owned());
        let most = pairs.iter().max_by_key(|(_, items)| items.len()).map(|(pair, _)| pair.clone());
        let pair = if pairs.contains_key(&trained) { Some(trained) } else { most };
        let pair = pair.with_context(|| {
            format!("{}: no push of a built-in object on a known support", folder.display())
        })?;
        let items = pairs.remove(&pair).unwrap_or_default();
        let of = |items: &[usize]| -> anyhow::Result<Sequences> {
            let set: Dataset = all.select(items);
            Ok(pushes(&set, plan.thinning)?)
        };
        let share = plan.train as f64 / (plan.train + plan.test) as f64;
        let split = Split::random(items.len(), SplitSize::TrainFraction(share), seed)?;
        let chosen = |part: &[usize]| part.iter().map(|&i| items[i]).collect::<Vec<_>>();
        let mut train = of(&chosen(&split.train))?;
        train.items.truncate(plan.train);
        let (object, surface) = pair;
        let mut tests = vec![Set {
            object: object.clone(),
            surface: surface.clone(),
            split: "test",
            engine: engine(&object, &surface)?,
            pushes: of(&chosen(&split.test))?,
        }];
        for ((other, support), items) in pairs {
            tests.push(Set {
                split: if other == object { "unseen surface" } else { "unseen object" },
                engine: engine(&other, &support)?,
                pushes: of(&items[..items.len().min(plan.transfer)])?,
                object: other,
                surface: support,
            });
        }
        Ok(PushData {
            name: "published MIT Push files",
            source: DataSource::File(folder.to_owned()),
            engine: engine(&object, &surface)?,
            train,
            tests,
            notes,
        })
    }

    /// Whether a folder holds published files: a folder of one of their supports.
    pub fn is_published(folder: &Path) -> bool {
        Surface::ALL.iter().any(|s| folder.join(s.name()).is_dir())
    }
}
