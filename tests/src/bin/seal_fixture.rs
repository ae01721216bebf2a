//! Writes the generated data set and model of `fixtures/sealed`: `seal_fixture FOLDER`. The truth is written
//! to `label.txt`.
#![expect(clippy::print_stderr, reason = "a tool for the terminal")]

use augsim_data::{DataError, random_stream, write_csv};
use augsim_tests::sealed::{Kind, draw, seal};
use std::path::Path;

/// Seed from which the data set of `fixtures/sealed` is generated.
const SEED: u64 = 20_263;

/// Generates the fixture and writes its data, model file and truth to `folder`.
fn write(folder: &Path) -> Result<(), DataError> {
    let mut rng = random_stream(SEED, "fixture", 0);
    let (mut scene, mut truth) = draw(&mut rng, Some(0), false);
    truth.effects = vec![Kind::QuadraticDrag(0.031)];
    (scene.trajectories, scene.rate_hz, scene.irregular) = (30, 60.0, false);
    (scene.plane, scene.at_rest) = (true, false);
    let sealed = seal(&scene, truth, &mut rng)?;
    let io = |cause| DataError::Unreadable { path: folder.to_owned(), cause };
    std::fs::create_dir_all(folder).map_err(io)?;
    write_csv(&sealed.data, &folder.join("bounces.csv"))?;
    std::fs::write(folder.join("model.toml"), &sealed.model).map_err(io)?;
    let label = format!(
        "made by: cargo run --release -p augsim-tests --bin seal_fixture fixtures/sealed (seed {SEED})\n{:?}\n",
        sealed.truth()
    );
    std::fs::write(folder.join("label.txt"), label).map_err(io)
}

fn main() {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "fixtures/sealed".into());
    if let Err(e) = write(Path::new(&folder)) {
        eprintln!("{e}");
    }
}
