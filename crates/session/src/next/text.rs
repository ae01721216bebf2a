//! Sentences and tables of a plan and of a judgement, as text.

use super::state::{PlannedRun, State};
use augsim_data::digits;
use augsim_design::{Explanation, Limits, Run};
use augsim_system::InitialValue;
use std::fmt::Write;

/// Log odds, nats, above which odds are given as a bound: a million to one.
const SHOWN_LOG_ODDS: f64 = 13.815_510_557_964_274;
/// Ratio of the separation without and with a refit above which the rival's parameters are the reason.
const ABSORBED_RATIO: f64 = 4.0;

/// Odds from nats: `1000 to 1`.
pub(super) fn odds_text(log_odds: f64) -> String {
    if log_odds > SHOWN_LOG_ODDS {
        "more than a million to 1".to_owned()
    } else if log_odds < 0.0 {
        "less than 1 to 1".to_owned()
    } else {
        let odds = log_odds.exp();
        if odds >= 10.0 { format!("{odds:.0} to 1") } else { format!("{odds:.1} to 1") }
    }
}

/// Odds that are reached at least, from nats: `1000 to 1 or more`.
fn odds_bound(log_odds: f64) -> String {
    let is_bound = !(0.0..=SHOWN_LOG_ODDS).contains(&log_odds);
    if is_bound { odds_text(log_odds) } else { format!("{} or more", odds_text(log_odds)) }
}

/// `1 run` or `N runs`.
pub(super) fn runs_text(count: usize) -> String {
    if count == 1 { "1 run".to_owned() } else { format!("{count} runs") }
}

/// Names of the explanations, joined by `from`.
fn names(state: &State) -> String {
    let names = state.live_names();
    match names[..] {
        [one] => one.to_owned(),
        [first, second] => format!("{first} from {second}"),
        _ => format!("the {} explanations ({})", names.len(), names.join(", ")),
    }
}

/// What unknown initial states cost, for the states whose initial value is estimated from each recording.
pub(super) fn note_on_starts(explanations: &[Explanation]) -> Option<String> {
    let mut names: Vec<&str> = Vec::new();
    for state in explanations.iter().flat_map(|e| &e.system.schema().states) {
        let is_estimated = matches!(state.initial, InitialValue::Free | InitialValue::Measured(_));
        if is_estimated && !names.contains(&state.quantity.name.as_str()) {
            names.push(&state.quantity.name);
        }
    }
    let list = names.join(", ");
    (!names.is_empty()).then(|| {
        format!(
            "The initial values of {list} are estimated from each recording. Where a run begins at a known value, declare it in [states] (start = 0.0, \
             sd = 0.001): fewer runs are then needed."
        )
    })
}

/// Sentence that sums up a plan.
pub(super) fn plan_sentence(state: &State, limits: &Limits) -> String {
    let duration = digits(limits.duration_s);
    let Some(p) = &state.promise else {
        let gain = state.plan.iter().filter_map(|run| run.information.first()).sum::<f64>();
        return format!(
            "There is one explanation; {} of {duration} s {} its parameters by {gain:.1} nats (D-optimal).",
            runs_text(state.plan.len()),
            if state.plan.len() == 1 { "narrows" } else { "narrow" }
        );
    };
    let share = 100.0 * p.share;
    match &p.why_not {
        None => format!(
            "{} of {duration} s {} {} with odds of {:.0} to 1 or more in {share:.0} % of cases; in nine of ten cases the odds are {}.",
            capital(&runs_text(p.runs)),
            if p.runs == 1 { "tells" } else { "tell" },
            names(state),
            state.odds,
            odds_bound(p.log_odds)
        ),
        Some(why) => format!(
            "{} of {duration} s {} not enough to tell {} with odds of {:.0} to 1: these are reached in {share:.0} % of cases, and in nine of ten \
             cases the odds are {}. {why}",
            capital(&runs_text(p.runs)),
            if p.runs == 1 { "is" } else { "are" },
            names(state),
            state.odds,
            odds_bound(p.log_odds)
        ),
    }
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |c| c.to_uppercase().chain(chars).collect())
}

/// Why the planned runs do not separate two explanations: the pair that is hardest, and what limits it.
pub(super) fn why_not(explanations: &[Explanation], runs: &[Run], limits: &Limits) -> String {
    let count = explanations.len();
    let pairs = (0..count).flat_map(|i| (0..count).filter(move |j| *j != i).map(move |j| (i, j)));
    let total = |(i, j): &(usize, usize)| runs.iter().map(|r| r.log_odds[*i][*j]).sum::<f64>();
    let Some((i, j)) = pairs.min_by(|a, b| total(a).total_cmp(&total(b))) else { return String::new() };
    let per_run = total(&(i, j)) / runs.len().max(1) as f64;
    let raw = runs.iter().map(|r| r.without_refit[i][j]).fold(0.0, f64::max);
    let (truth, rival) = (&explanations[i].name, &explanations[j].name);
    let mut text = format!(
        "Hardest is {truth} against {rival}: the best run that was found is expected to give {per_run:.2} nats (6.9 are odds of 1000 to 1)."
    );
    // Writing to a string cannot fail.
    let _ = if raw > ABSORBED_RATIO * per_run.max(0.1) {
        write!(
            text,
            " With its present parameters {rival} would differ by {raw:.1} nats, but other parameter values or another initial state make its \
             predictions alike."
        )
    } else {
        write!(text, " The predictions differ by less than the noise.")
    };
    let limited: Vec<&str> = runs.iter().filter_map(|r| r.limited_by.as_deref()).collect();
    let _ = match limited.first() {
        Some(name) => write!(text, " The range of {name} limits the inputs: a wider one would help."),
        None => {
            let names: Vec<&str> = limits.inputs.iter().map(|i| i.name.as_str()).collect();
            write!(
                text,
                " Needed are wider limits of {}, longer runs, or another output.",
                if names.is_empty() { "the starts".to_owned() } else { names.join(", ") }
            )
        }
    };
    text
}

/// Sentence that sums up what the recordings say, and compares it with the promise.
pub(super) fn listen_sentence(state: &State) -> String {
    let heard = state.heard.len();
    let leader = state.explanations.iter().max_by(|a, b| a.weight.total_cmp(&b.weight));
    let (Some(leader), Some(last)) = (leader, state.heard.last()) else {
        return "No run was heard.".to_owned();
    };
    let left = state.live_names();
    let mut text = match (state.verdict.as_str(), &left[..]) {
        ("enough", [one]) => {
            format!(
                "Enough: {one}. {} {} every other explanation at odds of {:.0} to 1.",
                capital(&runs_text(heard)),
                if heard == 1 { "rejects" } else { "reject" },
                state.odds
            )
        }
        ("none-fits", _) => format!(
            "No explanation predicts the new recordings: the errors of the best, {}, are {:.1} times its noise. Search again for what is missing: \
             `augsim discover` with all recordings.",
            leader.name,
            state.dispersion.sqrt()
        ),
        (_, [_]) => {
            format!("There is one explanation, {}, and the new recordings do not contradict it.", leader.name)
        }
        _ => format!(
            "Not enough: after {} {} leads with odds of {}; {} are left. Next: another planned run, or `augsim next` on this folder.",
            runs_text(heard),
            leader.name,
            odds_text(last.log_odds),
            left.join(" and ")
        ),
    };
    let promised_after = state.promise.as_ref().filter(|p| heard > p.heard_before);
    if let Some(p) = promised_after {
        let run = (heard - p.heard_before).min(p.runs.max(1)) - 1;
        let index = p.truths.iter().position(|name| *name == leader.name);
        if let Some(promised) = index.and_then(|i| p.log_odds_by_truth.get(i)?.get(run)) {
            let most = state.heard.iter().map(|h| h.log_odds).fold(f64::NEG_INFINITY, f64::max);
            // Writing to a string cannot fail.
            let _ = write!(
                text,
                " Promised for {} in nine of ten cases: odds of {}; came: {}.",
                runs_text(run + 1),
                odds_bound(*promised),
                odds_text(most)
            );
        }
    }
    text
}

/// Rows of the table of planned runs: file, signals, starts, expected odds.
pub(super) fn run_row(run: &PlannedRun) -> [String; 4] {
    let starts: Vec<String> = run.starts.iter().map(|(name, v)| format!("{name} = {}", digits(*v))).collect();
    let smallest = run.odds.iter().map(|o| o.log_odds).fold(f64::INFINITY, f64::min);
    let expected = if smallest.is_finite() { format!("{smallest:.1} nats") } else { String::new() };
    let signals = if run.signals.is_empty() { "no input".to_owned() } else { run.signals.join(", ") };
    [run.file.clone(), signals, starts.join(", "), expected]
}

/// The plan as text for a terminal.
pub fn plan_text(state: &State) -> String {
    let mut text = format!("{}\n", state.sentence);
    for run in &state.plan {
        let [file, signals, starts, odds] = run_row(run);
        let starts = if starts.is_empty() { starts } else { format!("; start {starts}") };
        let odds =
            if odds.is_empty() { odds } else { format!("; expected log odds of the hardest pair {odds}") };
        // Writing to a string cannot fail.
        let _ = write!(text, "\n  {file}: {signals}{starts}{odds}");
    }
    text += &explanations_text(state);
    match &state.note {
        Some(note) => format!("{text}\n\n{note}"),
        None => text,
    }
}

/// The judgement as text for a terminal.
pub fn listen_text(state: &State) -> String {
    state.sentence.clone() + "\n" + &explanations_text(state)
}

fn explanations_text(state: &State) -> String {
    let mut text = String::new();
    for e in &state.explanations {
        let rejected = if e.rejected { ", rejected" } else { "" };
        // Writing to a string cannot fail.
        let _ = write!(text, "\n  {:<28} weight {:.4}{rejected}", e.name, e.weight);
    }
    text
}
