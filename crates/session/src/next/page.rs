//! Pages of a plan and of a judgement.

use super::plan::Planned;
use super::state::{PromiseOf, State};
use super::text::{odds_text, run_row, runs_text};
use augsim_data::digits;
use augsim_report::figure::{Axis, Figure, Line, Series, Tone};
use augsim_report::page::{
    Block, Cell, Column, Columns, Grid, Method, Page, Provenance, Row, Section, Table,
};

/// Page of a plan: promise, runs with inputs and predictions, explanations, methods.
pub fn plan_page(planned: &Planned, seed: u64) -> Page {
    let state = &planned.state;
    let figures = |run: usize| -> Vec<Figure> {
        let experiment = &planned.experiments[run];
        let times = &experiment.times;
        let [inputs, outputs] = &planned.columns;
        let mut figures: Vec<Figure> = (inputs.iter().zip(&experiment.inputs))
            .map(|((name, unit), values)| {
                let line = Line::new(name, Axis::linear("time", "s"), Axis::linear(name, unit));
                Figure::from(line.with(Series::line(name, Tone::Series(0), times.clone(), values.clone())))
            })
            .collect();
        for (output, (name, unit)) in outputs.iter().enumerate() {
            let mut line =
                Line::new(&format!("predicted {name}"), Axis::linear("time", "s"), Axis::linear(name, unit));
            for (k, (name, paths)) in
                state.live_names().into_iter().zip(&planned.predictions[run]).enumerate()
            {
                line = line.with(Series::line(
                    name,
                    Tone::Series(u8::try_from(k).unwrap_or(u8::MAX)),
                    times.clone(),
                    paths[output].clone(),
                ));
            }
            figures.push(Figure::from(line));
        }
        figures
    };
    let runs = (0..state.plan.len()).flat_map(|run| {
        let planned_run = &state.plan[run];
        let grid = Grid {
            columns: Columns::Two,
            legend: Vec::new(),
            figures: figures(run),
            caption: "Inputs, and the outputs that each explanation predicts with its fitted values."
                .to_owned(),
        };
        [Block::Heading(planned_run.file.clone()), Block::Grid(grid)]
    });
    let usage = "Apply the inputs of a file, begin at its start values, and record the outputs. Then let `augsim listen` judge the recording with this \
                 folder: one may look after every run.";
    let head = [Block::Table(runs_table(state)), Block::Prose(usage.to_owned())];
    let mut sections = vec![Section::new("Runs", head.into_iter().chain(runs).collect())];
    sections.extend(promise_section(state));
    let note = state.note.clone().map(Block::Prose);
    let explanations = std::iter::once(Block::Table(explanations_table(state))).chain(note);
    sections.push(Section::new("Explanations", explanations.collect()));
    sections.push(Section::new("Methods and references", vec![Block::Methods(methods())]));
    page("next experiment", &state.sentence, "plan", sections, Some(seed))
}

/// Page of a judgement: weights, evidence of each run, the promise beside what came.
pub fn listen_page(state: &State) -> Page {
    let rows = state.heard.iter().enumerate().map(|(k, run)| {
        let evidence: Vec<String> = run.log_density.iter().map(|l| format!("{l:.1}")).collect();
        vec![(k + 1).to_string(), run.recording.id.clone(), evidence.join(", "), odds_text(run.log_odds)]
    });
    let names: Vec<&str> = state.explanations.iter().map(|e| e.name.as_str()).collect();
    let caption = format!("The log densities are in the order {}.", names.join(", "));
    let runs = table(
        &["run", "recording", "log density under each explanation, nats", "odds of the leading explanation"],
        rows.collect(),
    );
    let mut sections = vec![
        Section::new("Explanations", vec![Block::Table(explanations_table(state))]),
        Section::new("Runs", vec![Block::Table(Table { caption, ..runs })]),
    ];
    sections.extend(promise_section(state));
    sections.push(Section::new("Methods and references", vec![Block::Methods(methods())]));
    let verdict = match state.verdict.as_str() {
        "enough" => "enough",
        "none-fits" => "no explanation fits",
        _ => "not enough yet",
    };
    page("what the new recordings say", &state.sentence, verdict, sections, None)
}

fn page(title: &str, summary: &str, verdict: &str, sections: Vec<Section>, seed: Option<u64>) -> Page {
    Page {
        overline: "augsim · experiment".to_owned(),
        title: title.to_owned(),
        verdict: verdict.to_owned(),
        summary: summary.to_owned(),
        key_figures: Vec::new(),
        sections,
        provenance: Provenance {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed,
            ..Provenance::default()
        },
    }
}

fn runs_table(state: &State) -> Table {
    let rows = state.plan.iter().map(|run| {
        let [file, signals, starts, odds] = run_row(run);
        vec![file, signals, starts, digits(run.duration_s), odds]
    });
    let caption = format!(
        "The hardest pair are the two explanations that a run separates least. {:.1} nats are odds of {:.0} to 1.",
        state.odds.ln(),
        state.odds
    );
    let columns = ["file", "signals", "start values", "duration, s", "expected log odds of the hardest pair"];
    Table { caption, ..table(&columns, rows.collect()) }
}

fn explanations_table(state: &State) -> Table {
    let rows = state.explanations.iter().map(|e| {
        let rejected = if e.rejected { "rejected" } else { "not rejected" };
        let odds = if state.heard.is_empty() { "no run yet".to_owned() } else { odds_text(e.log_e_value) };
        vec![e.name.clone(), format!("{:.4}", e.weight), odds, rejected.to_owned()]
    });
    let caption = format!(
        "The weight is the probability of an explanation if one of them is true. An explanation is rejected once the odds against it reach {:.0} to 1.",
        state.odds
    );
    Table {
        caption,
        ..table(&["explanation", "weight", "odds against it (e-value)", "verdict"], rows.collect())
    }
}

fn promise_section(state: &State) -> Option<Section> {
    let p = state.promise.as_ref()?;
    let by_truth = p.log_odds_by_truth.iter().zip(&p.share_by_truth);
    let rows = p.truths.iter().zip(by_truth).map(|(name, (odds, shares))| {
        (0..odds.len()).map(move |k| {
            vec![name.clone(), (k + 1).to_string(), odds_text(odds[k]), format!("{:.0} %", 100.0 * shares[k])]
        })
    });
    let required = format!("cases that reach {:.0} to 1", state.odds);
    let promised = table(
        &["if this is true", "runs", "odds in nine of ten cases, at least", &required],
        rows.flatten().collect(),
    );
    Some(Section::new("Promise", vec![Block::Table(promised), Block::Prose(promise_note(state, p))]))
}

/// How the promise was found: number of sequences, effective number of draws, repeated runs.
fn promise_note(state: &State, p: &PromiseOf) -> String {
    let mut note = format!(
        "From {} simulated sequences for each explanation, judged as measured ones are. ",
        p.sequences
    );
    let draws: Vec<String> = (p.truths.iter().zip(&p.effective_draws))
        .filter_map(|(name, draws)| draws.map(|n| format!("{n:.0} for {name}")))
        .collect();
    note += &match draws.is_empty() {
        true => "The true parameters are drawn from the normal distribution of each explanation.".to_owned(),
        false => format!(
            "The true parameters are drawn from what the recordings leave of them; effective number of draws: {}.",
            draws.join(", ")
        ),
    };
    if !state.plan.is_empty() && p.runs > state.plan.len() {
        note += &format!(" The files are applied in turn, until {} were recorded.", runs_text(p.runs));
    }
    note
}

/// Table of texts.
fn table(titles: &[&str], rows: Vec<Vec<String>>) -> Table {
    let row = |cells: Vec<String>| Row::from(cells.into_iter().map(Cell::text).collect::<Vec<_>>());
    Table {
        columns: titles.iter().map(|title| Column::text(title)).collect(),
        rows: rows.into_iter().map(row).collect(),
        ..Table::default()
    }
}

fn methods() -> Vec<Method> {
    let method = |name: &str, purpose: &str, reference: &str| Method {
        name: name.to_owned(),
        purpose: purpose.to_owned(),
        reference: reference.to_owned(),
    };
    vec![
        method(
            "T-optimal design",
            "inputs for which a rival's predictions differ most after its parameters are refitted",
            "Atkinson and Fedorov, Biometrika 62, 1975",
        ),
        method(
            "D-optimal design",
            "inputs that narrow the parameters of a single explanation",
            "Kiefer, J. R. Stat. Soc. B 21, 1959",
        ),
        method(
            "Evidence",
            "density of the new recordings with parameters integrated out, by Laplace's approximation",
            "Tierney and Kadane, J. Am. Stat. Assoc. 81, 1986",
        ),
        method(
            "Universal inference",
            "the explanation that is tested is judged at its best parameters for the new recordings and half of the earlier ones, so that no value \
             of them is rejected wrongly",
            "Wasserman, Ramdas and Balakrishnan, Proc. Natl. Acad. Sci. 117, 2020",
        ),
        method(
            "E-values",
            "odds that stay valid when one looks after every run",
            "Ville 1939; Robbins, Ann. Math. Stat. 41, 1970; Grünwald, de Heide and Koolen, J. R. Stat. Soc. B 86, 2024",
        ),
    ]
}
