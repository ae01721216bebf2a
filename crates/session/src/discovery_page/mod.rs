//! The HTML report of a discovery: what the model lacks, the statistical support, and errors before and after.

mod errors;
mod examples;
mod findings;
mod groups;
mod hidden_states;
mod joints;
mod methods;
mod residuals;

pub use examples::{Example, TopView};
pub use hidden_states::{HiddenState, StepResponse};
pub use residuals::EffectCurve;

use crate::{ReportContext, Subject};
use augsim_discovery::{Discovery, Verdict};
use augsim_physics::model::ModelFile;
use augsim_report::figure::Tone;
use augsim_report::page::{Block, Page, Provenance, Section};
use augsim_system::Parameter;

/// Colour of the model before effects were added, the same in all figures of the report.
const BEFORE: Tone = Tone::Series(1);
const AFTER: Tone = Tone::Series(0);

/// A parameter of the declared model, as the report lists it.
#[derive(Debug)]
struct DeclaredParameter {
    name: String,
    value: f64,
    is_frozen: bool,
}

/// The parts of the declared model that the report shows.
#[derive(Debug)]
struct DeclaredModel {
    /// Name of the built-in scenario, or of the equation model.
    scenario: String,
    /// Description of the quantity whose error is reported.
    quantity: String,
    parameters: Vec<DeclaredParameter>,
    /// Declared standard deviation of the measurement noise, in the sensor's unit; `None` without one for the report.
    sensor_sd: Option<f64>,
}

impl DeclaredModel {
    fn from_subject(subject: &Subject) -> Self {
        match subject {
            Subject::BuiltIn(model) => Self::of_built_in(model),
            Subject::Equations(model) => {
                let output = model.outputs.first().map_or("", |o| &o.name);
                let parameters = model.parameters.iter();
                Self {
                    scenario: model.name.clone(),
                    quantity: format!("free run of {output} from its first samples"),
                    parameters: parameters
                        .map(|p| DeclaredParameter {
                            name: p.name.clone(),
                            value: p.nominal,
                            is_frozen: p.frozen,
                        })
                        .collect(),
                    sensor_sd: None,
                }
            }
        }
    }

    fn of_built_in(model: &ModelFile) -> Self {
        let (scenario, quantity, parameters, sensor_sd): (&str, &str, &[Parameter], Option<f64>) = match model
        {
            ModelFile::Ball(m) => ("ball", "forecast after the first flight", &m.parameters, m.position_sd_m),
            ModelFile::Push(m) => (
                "push",
                "position of the object, open loop from a measured pose",
                &m.parameters,
                m.position_sd_m,
            ),
        };
        let parameter =
            |p: &Parameter| DeclaredParameter { name: p.name.clone(), value: p.nominal, is_frozen: p.frozen };
        Self {
            scenario: scenario.to_owned(),
            quantity: quantity.to_owned(),
            parameters: parameters.iter().map(parameter).collect(),
            sensor_sd,
        }
    }
}

/// Builds the HTML report of a discovery.
pub fn page(context: &ReportContext, subject: &Subject, d: &Discovery) -> Page {
    let declared = DeclaredModel::from_subject(subject);
    let figures = &context.figures;
    let runs = match (figures.examples.is_empty(), d.heldout.is_empty()) {
        (false, _) => "Runs of both models",
        (true, false) => "Held-out trajectories",
        (true, true) => "Trajectories and both models",
    };
    let prose = |list: &[String]| list.iter().cloned().map(Block::Prose).collect::<Vec<_>>();
    let warnings: Vec<String> = d.warnings.iter().map(|w| w.text.clone()).collect();
    let command = Some(&context.reproduce).filter(|command| !command.is_empty());
    let reproduce = command.map(|text| Block::Code { caption: String::new(), text: text.clone() });
    Page {
        overline: format!("augsim · discovery report · {}", declared.scenario),
        title: format!("{}: what the model lacks", context.name),
        verdict: verdict_text(d.verdict).to_owned(),
        summary: without_intervals(&d.sentence),
        key_figures: errors::key_figures(d),
        sections: vec![
            Section::new("What was found", findings::found(d, &declared.parameters)),
            Section::new("Joints", joints::blocks(context, subject, d)),
            Section::new("Groups of recordings", groups::blocks(d)),
            Section::new(runs, examples::blocks(d, &figures.examples)),
            Section::new("Warnings about the data", prose(&warnings)),
            Section::new("Error on held-out data", errors::blocks(d, &declared.quantity)),
            Section::new("Leads: suggested effects, not established", findings::leads(d)),
            Section::new("Added effects as curves", residuals::laws(&figures.curves)),
            Section::new("Hidden states of the added effects", hidden_states::blocks(&figures.hidden_states)),
            Section::new("Open questions", findings::open_questions(d)),
            Section::new("Residual, before and after", residuals::blocks(d)),
            Section::new("Candidates", findings::candidates(d)),
            Section::new("Correlation of the parameter estimates", findings::correlations(d)),
            Section::new("Noise", findings::noise(d, declared.sensor_sd)),
            Section::new("Augmented model", findings::model(d)),
            Section::new("Remarks", prose(&methods::notes(d))),
            Section::new("Methods and references", vec![Block::Methods(methods::methods(d))]),
            Section::new("How to reproduce", reproduce.into_iter().collect()),
        ],
        provenance: Provenance {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: Some(context.seed),
            data: context.sources.clone(),
            ..Provenance::default()
        },
    }
}

/// Text of the verdict at the top of the report.
fn verdict_text(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NothingToAdd => "nothing to add",
        Verdict::Explained => "explained",
        Verdict::PartlyExplained => "partly explained",
        Verdict::Unknown => "unknown effect",
        Verdict::NotThisSystem => "not this system",
    }
}

/// Display unit of an error, and conversion factor to it: mm for m, as in the sentences of a result.
fn display_unit(unit: &str) -> (&str, f64) {
    if unit == "m" { ("mm", 1e3) } else { (unit, 1.0) }
}

/// Removes the confidence intervals from the sentence of a result; the tables have them.
fn without_intervals(sentence: &str) -> String {
    let mut out = String::new();
    let mut remaining = sentence;
    while let Some((before, after)) = remaining.split_once(" [") {
        match after.split_once(']') {
            // An interval is two numbers.
            Some((inside, behind)) if inside.split(", ").all(|n| n.parse::<f64>().is_ok()) => {
                out += before;
                remaining = behind;
            }
            _ => {
                out += before;
                out += " [";
                remaining = after;
            }
        }
    }
    out + remaining
}

#[cfg(test)]
mod tests {
    //! Contract: the summary of the report omits intervals and nothing else.
    use super::without_intervals;

    #[test]
    fn intervals_are_removed_and_other_brackets_are_kept() {
        assert_eq!(
            without_intervals("lacks drag (k = 0.3 [0.2, 0.4]) and x [a, b]; gain"),
            "lacks drag (k = 0.3) and x [a, b]; gain"
        );
        assert_eq!(without_intervals("no [end"), "no [end");
    }
}
