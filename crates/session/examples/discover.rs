//! Discovery of an effect that a model lacks, in twenty lines: `cargo run --release -p augsim-session
//! --example discover`.

use augsim_session::{DataFrom, DiscoverRequest, Subject, discover};
use std::path::Path;

/// Prints the summary sentence, the effects with values and intervals, and the augmented model.
#[expect(clippy::print_stdout, reason = "an example prints its result")]
pub fn main() -> anyhow::Result<()> {
    let sealed = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/sealed"));
    let model = Subject::read(&sealed.join("model.toml"))?;
    let data = DataFrom::File(sealed.join("bounces.csv"));
    let found = discover(&model, &data, &DiscoverRequest::default(), &mut |_| {})?;
    println!("{}", found.sentence);
    for effect in &found.effects {
        for (name, estimate) in &effect.parameters {
            println!("{}: {name} = {}, 95 % interval {:?}", effect.kind, estimate.value, estimate.ci95);
        }
    }
    println!("{}", found.model_toml);
    Ok(())
}
