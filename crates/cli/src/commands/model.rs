//! `augsim model`: writes template model files.

use crate::args::{ModelAction, ModelArgs};
use augsim_data::atomic_write;
use augsim_physics::model::template;
use augsim_session::folders;
use augsim_session::usage::UnknownName;
use augsim_terminal::destination::{check_file, check_model};
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};
use serde::Serialize;
use std::io::Write;
use std::path::PathBuf;

#[derive(Serialize)]
struct Written {
    model: PathBuf,
}

/// Runs `augsim model`: writes a template model file, or the model of a robot.
pub fn run(args: &ModelArgs, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let (name, out) = match &args.action {
        ModelAction::New { name, out } => (name, out),
        ModelAction::FromRobot(args) => return super::from_robot::run(args, force, output),
    };
    let built_in = template(name);
    let text = built_in.or_else(|| augsim_equations::example(name));
    let text = text.ok_or_else(|| Usage::Unknown(UnknownName::Model { name: name.clone() }))?;
    let path = out.clone().unwrap_or_else(|| PathBuf::from(format!("{name}.toml")));
    check_file(&path, &[])?;
    check_model(&path, text, force)?;
    folders::make(folders::parent_of(&path))?;
    atomic_write(&path, |w| w.write_all(text.as_bytes()))?;
    let written = Written { model: path };
    output.result(&written, || {
        let path = written.model.display();
        let next = match built_in {
            Some(_) => {
                format!("next: augsim discover {path} DATA.csv (augsim start makes both from a recording)")
            }
            None => format!("try it: augsim simulate {path} --out out/{name}.csv"),
        };
        format!("{path}: a commented model of a {name}\n{next}")
    })?;
    Ok(Outcome::Done)
}
