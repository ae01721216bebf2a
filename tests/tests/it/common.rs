//! Runs `discover` on a model of equations and a table, as the command line does.

use augsim_discovery::{Discovery, Options};
use augsim_equations::model;
use augsim_session::{DataFrom, DiscoverRequest, Subject, discover};

/// Runs `discover` with the model file `text` on the trajectories of the CSV text `csv`, with seed 1.
pub fn answer_to(text: &str, csv: String) -> Discovery {
    let model = model::parse(text, "model.toml").unwrap_or_else(|e| panic!("{e}"));
    let data = DataFrom::Table { name: "data.csv".into(), csv: csv.into_bytes().into() };
    let subject = Subject::Equations(Box::new(model));
    let wanted =
        DiscoverRequest { options: Options { seed: 1, ..Options::default() }, ..DiscoverRequest::default() };
    discover(&subject, &data, &wanted, &mut |_| {}).unwrap_or_else(|e| panic!("{e}"))
}
