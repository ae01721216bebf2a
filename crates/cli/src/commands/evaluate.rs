//! `augsim evaluate`.

use crate::args::{Evaluate, ProtocolArg};
use crate::ball::{self, Row};
use crate::exit::{Outcome, Usage};
use crate::output::Output;
use crate::run_data;
use crate::run_dir::{DataSource, RunDir};
use augsim_trainer::push::score::{PushScore, evaluate_pushes};
use augsim_trainer::{Correction, NetModel, Protocol, evaluate_forecast, evaluate_reconstruction};

/// Runs the subcommand.
pub fn run(args: &Evaluate, output: &Output) -> anyhow::Result<Outcome> {
    let model = NetModel::new(RunDir::open(&args.run).read_model()?)?;
    let settings = &model.state().settings;
    let pushing = settings.correction == Correction::Rollout;
    if pushing && args.protocol == ProtocolArg::Reconstruction {
        let text = "nets of pushes only forecast; leave out --protocol reconstruction";
        return Err(Usage(text.to_owned()).into());
    }
    let test = run_data::load(&DataSource::File(args.data.clone()), &settings.engine)?;
    let error_m = if pushing {
        let score = evaluate_pushes(&model, &test)?;
        output.result(&score, || pushes(settings.recipe.label(), &score))?;
        1e-3 * score.mean_of_10.pos_mm
    } else {
        let (protocol, score) = match args.protocol {
            ProtocolArg::Forecast => (Protocol::Forecast, evaluate_forecast(&model, &test)?),
            ProtocolArg::Reconstruction => {
                (Protocol::Reconstruction, evaluate_reconstruction(&model, &test)?)
            }
        };
        let rows = [Row::of_net(settings.recipe.label(), protocol, &score)];
        output.result(&rows[0], || ball::table(&rows))?;
        score.mean.absolute[0]
    };
    let met = args.require_pos_m.is_none_or(|limit| error_m < limit);
    Ok(if met { Outcome::Done } else { Outcome::CriterionNotMet })
}

/// The score of pushes in a few lines.
fn pushes(model: &str, s: &PushScore) -> String {
    let share = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{:.1} %", 100.0 * v));
    format!(
        "forecast of {} pushes by {model} (from the first pose and the rod's path), mean of 100 samples\n  \
         position {:.3} mm, at the end {:.3} mm; rotation {:.3} deg, at the end {:.3} deg\n  \
         CRPS {:.3} mm, {:.3} deg; in the 50 % band {}, in the 90 % band {}",
        s.pushes,
        s.mean.pos_mm,
        s.mean.end_pos_mm,
        s.mean.rot_deg,
        s.mean.end_rot_deg,
        s.crps_mm,
        s.crps_deg,
        share(s.coverage50),
        share(s.coverage90)
    )
}
