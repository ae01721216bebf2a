//! Pages of a plan and of a judgement.

use super::plan::Planned;
use super::state::State;
use super::text::{odds_text, run_row};
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
    let mut sections =
        vec![Section::new("Runs", [Block::Table(runs_table(state))].into_iter().chain(runs).collect())];
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
    let runs = table(
        &["run", "recording", "log density under each explanation, nats", "odds of the leading explanation"],
        rows.collect(),
    );
    let mut sections = vec![
        Section::new("Explanations", vec![Block::Table(explanations_table(state))]),
        Section::new("Runs", vec![Block::Table(runs)]),
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
        let rejected = if e.rejected { "rejected" } else { "" };
        let odds = if state.heard.is_empty() { "no run yet".to_owned() } else { odds_text(e.log_e_value) };
        vec![e.name.clone(), format!("{:.4}", e.weight), odds, rejected.to_owned()]
    });
    table(&["explanation", "weight", "odds against it (e-value)", ""], rows.collect())
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
    let note = format!(
        "From {} simulated sequences for each explanation, judged as measured ones are.",
        p.sequences
    );
    Some(Section::new("Promise", vec![Block::Table(promised), Block::Prose(note)]))
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
