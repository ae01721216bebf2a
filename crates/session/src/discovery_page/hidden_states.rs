//! Section of the report on the hidden states of added effects: over a recording, and after a step of an input.

use super::AFTER;
use augsim_data::digits;
use augsim_report::capitalised;
use augsim_report::figure::{Axis, Figure, Line, Series};
use augsim_report::page::{Block, Columns, Grid};

/// A state that an effect added to the model, over a recording and after a step of an input.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HiddenState {
    /// Kind of the effect that the state belongs to.
    pub effect: String,
    /// Name of the state, local to the effect.
    pub name: String,
    /// Name of the recording.
    pub trajectory: String,
    /// Times of the recording's samples, s.
    pub t_s: Vec<f64>,
    /// Value of the state at each sample, in the unit that its rate implies.
    pub values: Vec<f64>,
    /// Response to a step of an input; `None` for a model without inputs.
    pub step: Option<StepResponse>,
}

/// Response of a hidden state to a step of an input between the quartiles of its samples.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StepResponse {
    /// Name of the input.
    pub input: String,
    /// Level of the input before and after the step, in its unit.
    pub levels: [f64; 2],
    /// Time since the step, s.
    pub t_s: Vec<f64>,
    /// Value of the state.
    pub values: Vec<f64>,
}

/// Figures of the hidden states: each over a recording, and beside it its response to a step.
pub(super) fn blocks(states: &[HiddenState]) -> Vec<Block> {
    let figures: Vec<Figure> = states.iter().flat_map(figures_of).collect();
    if figures.is_empty() {
        return Vec::new();
    }
    let caption = "States that the added effects bring into the model and that no sensor measures, from a free run of the augmented \
                   model over the first recording; and after a step of the input between the quartiles of its samples, with all other \
                   inputs constant."
        .to_owned();
    vec![Block::Grid(Grid { columns: Columns::Two, legend: Vec::new(), figures, caption })]
}

fn figures_of(state: &HiddenState) -> Vec<Figure> {
    let name = format!("{} of {}", state.name, state.effect);
    let line = |title: &str, label: &str, t_s: &[f64], values: &[f64]| {
        let mut line =
            Line::new(&capitalised(title), Axis::linear(label, "s"), Axis::linear(&state.name, ""));
        line.hide_legend = true;
        line.with(Series::line(&state.name, AFTER, t_s.to_vec(), values.to_vec())).into()
    };
    let mut figures = vec![line(
        &format!("hidden state {name}, trajectory {}", state.trajectory),
        "time",
        &state.t_s,
        &state.values,
    )];
    figures.extend(state.step.as_ref().map(|step| {
        let [low, high] = step.levels.map(digits);
        let title = format!("hidden state {name}, {} from {low} to {high}", step.input);
        line(&title, "time since the step", &step.t_s, &step.values)
    }));
    figures
}

#[cfg(test)]
mod tests {
    //! Contract: a state has a figure over the recording, and one of its step response if there is an input.
    use super::*;

    #[test]
    fn each_state_has_its_figures() {
        let state = HiddenState {
            effect: "input-lag".to_owned(),
            name: "z".to_owned(),
            t_s: vec![0.0, 1.0],
            values: vec![0.0, 0.5],
            ..HiddenState::default()
        };
        assert!(blocks(&[]).is_empty());
        assert_eq!(figures_of(&state).len(), 1);
        let step =
            Some(StepResponse { t_s: vec![0.0, 1.0], values: vec![0.0, 1.0], ..StepResponse::default() });
        assert_eq!(figures_of(&HiddenState { step, ..state }).len(), 2);
    }
}
