//! The loop on a measured set: `discover_measured FOLDER-OF-SETS NAME` (or the folder or file of one set of pushes); prints the answer.
#![expect(clippy::print_stdout, reason = "a tool for the terminal")]

use augsim_data::convert::CONVERTERS;
use augsim_discovery::{Options, discover, discover_push};
use augsim_physics::model::{Model, ModelFile};
use std::path::Path;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let (Some(root), Some(name)) = (args.get(1), args.get(2)) else {
        println!("usage: discover_measured FOLDER-OF-SETS NAME");
        return;
    };
    if name == "pybullet-ball" {
        let model = "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = { nominal = 9.8, frozen = true }\nrestitution = 0.65\n[sensor]\nposition_sd_m = 0.03\n[release]\nkind = \"rest\"\n[[effect]]\nkind = \"linear-drag\"\nc_per_s = 0.04\n[[effect]]\nkind = \"quadratic-drag\"\nk_per_m = 0.04\n";
        let path = Path::new(root).join(name).join("test.csv.gz");
        match (Model::parse(model, "model.toml"), augsim_data::read_legacy_ball(&path)) {
            (Ok(model), Ok(data)) => match discover(&model, &data, &Options::default(), &mut |_| {}) {
                Ok(d) => println!(
                    "{}\n{:#?}\n{:#?}\n{:#?}\n{:?} {:?} {:.2} s",
                    d.sentence, d.effects, d.parameters, d.error, d.tests, d.alternatives, d.seconds
                ),
                Err(e) => println!("{e}"),
            },
            (Err(e), _) => println!("{e}"),
            (_, Err(e)) => println!("{e}"),
        }
    }
    for (set, convert) in CONVERTERS.iter().filter(|(set, _)| set == name) {
        let inner = Path::new(root).join(set);
        let converted = match convert(if inner.exists() { &inner } else { Path::new(root) }) {
            Ok(c) => c,
            Err(e) => return println!("{e}"),
        };
        println!("{} trajectories", converted.data.trajectories().len());
        let text = converted.model_toml.as_deref().unwrap_or_default();
        if let Ok(ModelFile::Push(model)) = ModelFile::parse(text, "model.toml") {
            match discover_push(&model, &converted.data, &Options::default(), &mut |p| {
                println!("{}", p.describe())
            }) {
                Ok(d) => {
                    println!("{}\n{:#?}\n{:#?}\n{:#?}", d.sentence, d.effects, d.parameters, d.push);
                    println!("{:#?}\n{:?}\n{:?}\n{:.2} s", d.error, d.tests, d.alternatives, d.seconds);
                    for c in d.candidates.iter().take(30) {
                        let p: Vec<_> =
                            c.parameters.iter().map(|(n, e)| format!("{n} {:.5}", e.value)).collect();
                        println!(
                            "{:?} gain {:.1} penalty {:.1} heldout {:?} {} {p:?}",
                            c.kinds, c.gain, c.penalty, c.heldout_gain, c.why
                        );
                    }
                }
                Err(e) => println!("{e}"),
            }
            continue;
        }
        let model = match Model::parse(converted.model_toml.as_deref().unwrap_or_default(), "model.toml") {
            Ok(m) => m,
            Err(e) => return println!("{e}"),
        };
        if let Some(kinds) = args.get(3) {
            for set in kinds.split(';') {
                let kinds: Vec<&str> = set.split(',').collect();
                match augsim_discovery::assess(
                    &model,
                    &converted.data,
                    &kinds,
                    augsim_physics::effects::ScatterPer::Impact,
                    &Options::default(),
                ) {
                    Ok(a) => println!("{set}: {a:?}"),
                    Err(e) => println!("{e}"),
                }
            }
            return;
        }
        match discover(&model, &converted.data, &Options::default(), &mut |p| println!("{}", p.describe())) {
            Ok(d) => {
                println!("{}\n{:#?}\n{:#?}\n{:#?}\n{:#?}", d.sentence, d.effects, d.noise, d.error, d.tests);
                println!("{:?}\n{:#?}\n{:.2} s", d.alternatives, d.unexplained, d.seconds);
                for c in d.candidates.iter().take(12) {
                    println!(
                        "{:?} gain {:.1} penalty {:.1} heldout {:?} {}",
                        c.kinds, c.gain, c.penalty, c.heldout_gain, c.why
                    );
                }
            }
            Err(e) => println!("{e}"),
        }
    }
}
