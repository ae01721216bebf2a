//! `augsim simulate --scenario push`: generates pushes.

use super::prepare_output;
use crate::args::{PushProtocolArg, Simulate};
use augsim_data::{atomic_write, write_dataset};
use augsim_physics::push::laboratory::{Generated, GeneratedTruth, LaboratoryError, PushDesign, PushRecipe};
use augsim_session::run_data::object_on_surface;
use augsim_terminal::destination::check_model;
use augsim_terminal::output::Output;
use augsim_terminal::{Outcome, Usage};
use serde::Serialize;
use std::io::Write;
use std::path::PathBuf;

#[derive(Serialize)]
struct Written {
    data: PathBuf,
    model: PathBuf,
    truth: PathBuf,
    pushes: PathBuf,
    trajectories: usize,
    samples: usize,
    with_inertia: usize,
}

/// Record of how pushes were generated: declared parameters, effects that the model lacks, and settings.
#[derive(Serialize)]
struct Record<'a> {
    schema: &'static str,
    seed: u64,
    declared: Declared,
    hidden: Hidden,
    recipe: &'a PushRecipe,
}

#[derive(Serialize)]
struct Declared {
    limit_surface: &'static str,
    inertia: bool,
    c_m: f64,
    contact_friction: f64,
    rod_radius_m: f64,
    support_friction: f64,
    mass_kg: f64,
}

#[derive(Serialize)]
struct Hidden {
    limit_surface: &'static str,
    friction_map: &'static str,
    contact_friction: f64,
    friction_scatter: f64,
    correlation_m: f64,
    table_anisotropy_ratio: f64,
    table_anisotropy_angle_rad: f64,
    inertia_above_m_s: f64,
}

/// Generates pushes with effects that the model file lacks, and writes data, model file and true values.
pub(super) fn run(args: &Simulate, seed: u64, force: bool, output: &Output) -> anyhow::Result<Outcome> {
    let suffixes = ["model.toml", "truth.toml", "truth.csv"];
    let (out, [model, truth, pushes]) = prepare_output(args.out.as_deref(), "out/push.csv", suffixes)?;
    let protocol = match args.protocol {
        PushProtocolArg::Mit => PushDesign::Mit,
        PushProtocolArg::Repeat => PushDesign::Repeat,
        PushProtocolArg::Random => PushDesign::Random,
    };
    let (object, sheet) = object_on_surface(&args.object, &args.surface)?;
    let recipe = PushRecipe {
        rate_hz: args.rate_hz,
        position_sd_m: args.position_sd_m,
        angle_sd_rad: args.angle_sd_rad,
        ..PushRecipe::new(protocol, &object, sheet, args.trajectories as usize)
    };
    let Generated { data, declared, truths: made } = recipe.generate(seed).map_err(|e| match e {
        LaboratoryError::Setting { .. } => Usage::Laboratory(e).into(),
        LaboratoryError::Data(e) => e.into(),
        other => anyhow::Error::from(other),
    })?;
    let declared_toml = declared.to_toml();
    check_model(&model, &declared_toml, force)?;
    write_dataset(&data, &out)?;
    atomic_write(&model, |w| w.write_all(declared_toml.as_bytes()))?;
    let value = |i: usize| declared.parameters.get(i).map_or(f64::NAN, |p| p.nominal);
    let record = Record {
        schema: "augsim.push-laboratory/1",
        seed,
        declared: Declared {
            limit_surface: "ellipsoid",
            inertia: false,
            c_m: value(0),
            contact_friction: value(1),
            rod_radius_m: value(2),
            support_friction: value(3),
            mass_kg: value(4),
        },
        hidden: Hidden {
            limit_surface: "Coulomb friction summed over the footprint",
            friction_map: "a new one for each push",
            contact_friction: sheet.contact_friction,
            friction_scatter: sheet.friction_scatter,
            correlation_m: sheet.correlation_m,
            table_anisotropy_ratio: sheet.anisotropy_ratio,
            table_anisotropy_angle_rad: sheet.anisotropy_angle_rad,
            inertia_above_m_s: recipe.inertia_above_m_s,
        },
        recipe: &recipe,
    };
    let text = toml::to_string_pretty(&record)?;
    atomic_write(&truth, |w| w.write_all(text.as_bytes()))?;
    write_pushes(&pushes, &made)?;
    let written = Written {
        data: out,
        model,
        truth,
        pushes,
        trajectories: made.len(),
        samples: data.trajectories().iter().map(|t| t.len()).sum(),
        with_inertia: made.iter().filter(|m| m.inertia).count(),
    };
    output.result(&written, || {
        format!(
            "{} pushes, {} samples at {} Hz: {}\ndeclared model: {}\nhidden effects: {}, for each push {}",
            written.trajectories,
            written.samples,
            recipe.rate_hz,
            written.data.display(),
            written.model.display(),
            written.truth.display(),
            written.pushes.display()
        )
    })?;
    Ok(Outcome::Done)
}

fn write_pushes(path: &std::path::Path, made: &[GeneratedTruth]) -> anyhow::Result<()> {
    atomic_write(path, |w| {
        writeln!(
            w,
            "trajectory,side_index,place_fraction,angle_rad,speed_m_s,acceleration_m_s2,travel_m,start_x_m,start_y_m,\
             start_theta_rad,end_x_m,end_y_m,end_theta_rad,inertia_flag"
        )?;
        for (i, m) in made.iter().enumerate() {
            let p = &m.planned;
            let ([a, b, c], [d, e, f]) = (m.start, m.end);
            writeln!(
                w,
                "{i},{},{},{},{},{},{},{a},{b},{c},{d},{e},{f},{}",
                p.side,
                p.fraction,
                p.angle_rad,
                p.speed_m_s,
                p.acceleration_m_s2,
                p.travel_m,
                u8::from(m.inertia)
            )?;
        }
        Ok(())
    })?;
    Ok(())
}
