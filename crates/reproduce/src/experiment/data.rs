//! Data of experiments: files, simulated drops, the virtual laboratory of pushing, published pushes.

use super::layout::Layout;
use super::rows::{Row, Tested};
use super::sizes::Sizes;
use anyhow::Context;
use augsim_data::push::{Surface, read_push_dataset, resample};
use augsim_data::{Dataset, Split, SplitSize};
use augsim_physics::model::{ModelFile, PushModel};
use augsim_physics::push::laboratory::{Generated, PushDesign};
use augsim_report::page::DataSource as Origin;
use augsim_session::provenance::fingerprint;
use augsim_session::run_data::{
    PUBLISHED_RATE_HZ, load, object_on_surface, published_predictor, read, recipe, sequences,
};
use augsim_session::run_dir::DataSource;
use augsim_session::usage::Takes;
use augsim_terminal::Usage;
use augsim_trainer::push::{Subsampling, pushes};
use augsim_trainer::score::Score;
use augsim_trainer::{self as trainer, Engine, Sequences};
use std::collections::BTreeMap;
use std::path::Path;

/// Offset of the seed for each further data set, so that their random draws differ.
const SEED_STEP: u64 = 1_000_000;
/// Name of the source of pushes from the virtual laboratory, in rows.
pub const LABORATORY: &str = "virtual laboratory";
/// `(object, surface)` of the training data.
const TRAINING_PAIR: (&str, &str) = ("rect1", "abs");
/// `(object, surface)` pairs that are only in test data.
const UNSEEN_PAIRS: [(&str, &str); 4] =
    [("rect1", "plywood"), ("rect1", "pu"), ("rect1", "delrin"), ("rect2", "abs")];

/// Trajectories of one test set, and the simulator of their declared model.
#[derive(Debug, Clone)]
pub struct Set {
    /// `(object, surface, split)`; split is `test`, `unseen surface` or `unseen object`.
    ///
    /// `None` if there is only one test set.
    pub on: Option<(String, String, &'static str)>,
    /// Simulator of the declared model.
    pub engine: Engine,
    /// Trajectories of the test set.
    pub items: Sequences,
}

impl Set {
    /// Makes the table row of `model`, which was trained on `trained` trajectories and scored on this set.
    pub fn row(
        &self,
        data: Option<&'static str>,
        model: &str,
        protocol: trainer::Protocol,
        trained: usize,
        score: &Score,
    ) -> Row {
        let tested = self.on.clone().map(|(object, surface, split)| Tested {
            surface,
            object,
            split,
            train_pushes: trained,
            test_pushes: score.trajectories,
        });
        let mut row = Row::new(Layout::for_engine(&self.engine), model, protocol, score);
        (row.data, row.tested) = (data, tested);
        row
    }

    /// Makes a test set of pushes of an object on a surface, with its declared model.
    pub fn of_pushes(
        object: &str,
        surface: &str,
        split: &'static str,
        items: Sequences,
    ) -> anyhow::Result<Self> {
        let engine = engine(object, surface)?;
        Ok(Set { on: Some((object.to_owned(), surface.to_owned(), split)), engine, items })
    }
}

/// Training and test data of an experiment.
#[derive(Debug, Clone)]
pub struct Data {
    /// Name of the data source in rows; `None` if rows have none.
    pub name: Option<&'static str>,
    /// Source of the training set, stored in run directories; smaller training sets are its beginning.
    pub source: DataSource,
    /// Simulator of the declared model of the training set.
    pub engine: Engine,
    /// Trajectories of the training set.
    pub train: Sequences,
    /// Test sets; the first has the object and surface of the training set.
    pub tests: Vec<Set>,
    /// Role, path and hash of each data source, for the report page.
    pub origin: Vec<Origin>,
    /// Notes about trajectories that were left out.
    pub notes: Vec<String>,
}

/// Pushes of the training object and surface from the virtual laboratory, split into training and test.
///
/// A cell of contact, angle and speed is in both parts only if there are more than 7,128 pushes.
#[derive(Debug, Clone)]
pub struct Laboratory {
    /// Declared (textbook) model of the pushes.
    pub declared: PushModel,
    /// All simulated measurements of the pushes, the training pushes first.
    pub data: Dataset,
    /// Source of the pushes, with their seed.
    pub source: DataSource,
    /// Training pushes, subsampled in time.
    pub train: Sequences,
    /// Test pushes, subsampled in time.
    pub test: Set,
}

impl Laboratory {
    /// Generates training and test pushes of the training object and surface.
    pub fn new(plan: &Sizes, seed: u64) -> anyhow::Result<Self> {
        let (object, surface) = TRAINING_PAIR;
        let count = plan.train + plan.test;
        let Generated { data, declared, .. } =
            recipe(PushDesign::Mit, object, surface, count)?.generate(seed)?;
        let all = pushes(&data, Subsampling::default())?;
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
            test: Set::of_pushes(object, surface, "test", part(&all, plan.train, count))?,
        })
    }
}

/// Returns the simulator of the declared (textbook) model of an object on a surface.
pub fn engine(object: &str, surface: &str) -> anyhow::Result<Engine> {
    let (known, sheet) = object_on_surface(object, surface)?;
    let friction = |name: &str| (name == "support_friction").then_some(sheet.friction);
    engine_of(PushModel::textbook(known).with_nominal(friction))
}

/// Returns the simulator of a push model.
pub fn engine_of(model: PushModel) -> anyhow::Result<Engine> {
    Ok(Engine::from_model_file(&ModelFile::Push(model), None)?)
}

fn generate(object: &str, surface: &str, count: usize, seed: u64) -> anyhow::Result<Sequences> {
    let made = recipe(PushDesign::Mit, object, surface, count)?.generate(seed)?;
    Ok(pushes(&made.data, Subsampling::default())?)
}

/// Describes a data source for the report page: role, path or generator, and hash.
fn origin(role: &str, source: &DataSource) -> Origin {
    let (path, hash) = match source {
        DataSource::File(path) => (path.display().to_string(), fingerprint(path)),
        DataSource::Table { name, content } => (name.clone(), content.clone()),
        DataSource::PushLaboratory { object, surface, pushes, seed } => (
            format!("{pushes} pushes of {object} on {surface}, virtual laboratory, seed {seed}"),
            String::new(),
        ),
        DataSource::DropDistribution { trajectories, seed } => {
            (format!("{trajectories} drops generated by the paper's law, seed {seed}"), String::new())
        }
    };
    Origin { path: format!("{role}: {path}"), hash }
}

/// Returns the trajectories `[from, to)` of a set.
pub fn part(all: &Sequences, from: usize, to: usize) -> Sequences {
    Sequences { items: all.items[from..to].to_vec(), ..all.clone() }
}

impl Data {
    /// Loads or generates training and test drops; returns them with the whole test set.
    ///
    /// Their declared model is the published PyBullet simulation of the ball.
    pub fn drops(train: &DataSource, test: &DataSource) -> anyhow::Result<(Self, Dataset)> {
        let engine = published_predictor();
        let (train_set, truth) = (load(train, &engine)?, read(test, &engine)?);
        let items = sequences(&truth, &engine)?;
        let tests = vec![Set { on: None, engine: engine.clone(), items }];
        let origin = vec![origin("training", train), origin("test", test)];
        let notes = Vec::new();
        let data = Data { name: None, source: train.clone(), engine, train: train_set, tests, origin, notes };
        Ok((data, truth))
    }

    fn of_pushes(
        name: &'static str,
        source: DataSource,
        engine: Engine,
        train: Sequences,
        tests: Vec<Set>,
        notes: Vec<String>,
    ) -> Self {
        let origin = vec![Origin { path: name.to_owned(), hash: String::new() }];
        Data { name: Some(name), source, engine, train, tests, origin, notes }
    }

    /// Generates training and test pushes in the virtual laboratory, in the layout of the MIT set.
    pub fn laboratory(plan: &Sizes, seed: u64) -> anyhow::Result<Self> {
        let Laboratory { source, train, test, .. } = Laboratory::new(plan, seed)?;
        let engine = test.engine.clone();
        let mut tests = vec![test];
        for (i, (object, surface)) in UNSEEN_PAIRS.into_iter().enumerate() {
            let seed = seed.wrapping_add((i as u64 + 1) * SEED_STEP);
            let split = if surface == TRAINING_PAIR.1 { "unseen object" } else { "unseen surface" };
            let pushes = generate(object, surface, plan.transfer, seed)?;
            tests.push(Set::of_pushes(object, surface, split, pushes)?);
        }
        Ok(Data::of_pushes(LABORATORY, source, engine, train, tests, Vec::new()))
    }

    /// Loads published MIT Push files as training and test data.
    ///
    /// The training set is rect1 on ABS if available, otherwise the pair of object and surface with the most
    /// pushes; all other pairs are test sets.
    pub fn published(folder: &Path, plan: &Sizes, seed: u64) -> anyhow::Result<Self> {
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
                    "{} pushes of {object} on {surface} omitted: no declared model",
                    items.len()
                ));
            }
            known
        });
        let trained = (TRAINING_PAIR.0.to_owned(), TRAINING_PAIR.1.to_owned());
        let most = pairs.iter().max_by_key(|(_, items)| items.len()).map(|(pair, _)| pair.clone());
        let pair = if pairs.contains_key(&trained) { Some(trained) } else { most };
        let pair = pair.with_context(|| {
            format!("{}: no push of a built-in object on a known support", folder.display())
        })?;
        let items = pairs.remove(&pair).unwrap_or_default();
        let of = |items: &[usize]| -> anyhow::Result<Sequences> {
            let set: Dataset = all.select(items);
            Ok(pushes(&set, Subsampling::default())?)
        };
        let share = plan.train as f64 / (plan.train + plan.test) as f64;
        let split = Split::random(items.len(), SplitSize::TrainFraction(share), seed)?;
        let chosen = |part: &[usize]| part.iter().map(|&i| items[i]).collect::<Vec<_>>();
        let mut train = of(&chosen(&split.train))?;
        train.items.truncate(plan.train);
        let (object, surface) = pair;
        let mut tests = vec![Set::of_pushes(&object, &surface, "test", of(&chosen(&split.test))?)?];
        for ((other, support), items) in pairs {
            let split = if other == object { "unseen surface" } else { "unseen object" };
            let pushes = of(&items[..items.len().min(plan.transfer)])?;
            tests.push(Set::of_pushes(&other, &support, split, pushes)?);
        }
        let source = DataSource::File(folder.to_owned());
        let engine = engine(&object, &surface)?;
        Ok(Data::of_pushes("published MIT Push files", source, engine, train, tests, notes))
    }

    /// Keeps only the first `size` training trajectories.
    pub fn first(mut self, size: usize) -> anyhow::Result<Self> {
        let there = self.train.items.len();
        if size > there {
            return Err(Usage::option("--train-size", size, Takes::TrainingPushes { there }).into());
        }
        self.train.items.truncate(size);
        Ok(self)
    }

    /// Whether a folder contains published MIT Push files: a subfolder is named as one of their surfaces.
    pub fn is_published(folder: &Path) -> bool {
        Surface::ALL.iter().any(|s| folder.join(s.name()).is_dir())
    }
}
