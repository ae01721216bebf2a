//! Effects as curves over the quantity that they depend on, for reports.

use super::scale::Scales;
use crate::model::{How, Model, Target};
use crate::text::Symbol;
use augsim_data::Unit;

/// Number of equidistant values at which an effect is computed: eight for each period of a ripple with 500 periods.
const FINE_POINTS: usize = 4001;
/// Maximum error of the drawn lines between the points of a curve, as a share of the curve's range.
///
/// This is less than the width of a line.
const MAX_ERROR: f64 = 0.002;

/// An effect of a model as a curve over the quantity that it depends on, within its range in the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Kind of the effect.
    pub kind: String,
    /// The rate, output, input, delay or parameter that the effect changes, as text.
    pub target: String,
    /// Unit of the change that the effect makes; empty for a pure number and for a factor.
    pub unit: String,
    /// Name and unit of the state or input that the effect depends on.
    pub of: (String, String),
    /// Values of the quantity that the effect depends on, over its range in the data.
    pub x: Vec<f64>,
    /// Change that the effect makes at each value of `x`; for a factor, the number that it multiplies by.
    pub y: Vec<f64>,
}

/// Computes the curves of all effects of a model that depend on a single state or input.
///
/// Effects with states of their own are left out.
pub fn curves(model: &Model, scales: &Scales) -> Vec<Curve> {
    (0..model.additions.len()).filter_map(|index| curve(model, scales, index)).collect()
}

/// Computes the curve of the effect number `index` of a model.
///
/// `None` if the effect is not a function of a single state or input, or if that quantity has no range in the data.
fn curve(model: &Model, scales: &Scales, index: usize) -> Option<Curve> {
    let addition = &model.additions[index];
    let change = addition.changes.first().filter(|_| addition.states.is_empty())?;
    let mut arguments: Vec<Symbol> =
        change.value.tree.symbols().filter(|s| !matches!(s, Symbol::Parameter(_))).collect();
    arguments.sort_unstable();
    arguments.dedup();
    let [argument] = arguments[..] else { return None };
    let (name, unit) = match argument {
        Symbol::State(i) => (&model.states[i].name, model.states[i].unit),
        Symbol::Input(i) => (&model.inputs[i].name, model.inputs[i].unit),
        _ => return None,
    };
    let symbol = |unit: Option<Unit>| unit.map_or_else(String::new, Unit::symbol);
    let [low, high] = scales.range(name, model)?;
    let fine_x: Vec<f64> =
        (0..FINE_POINTS).map(|k| low + (high - low) * k as f64 / (FINE_POINTS - 1) as f64).collect();
    let fine_y = scales.values_over(model, &change.value.tree, argument, &fine_x)?;
    let points = needed_points(&fine_y);
    let [x, y] = [&fine_x, &fine_y].map(|values| points.iter().map(|k| values[*k]).collect::<Vec<f64>>());
    let per_second = |unit: Option<Unit>| {
        let dimensions = unit?.dimensions() / augsim_data::Dimensions::TIME;
        Unit::from_dimensions(dimensions)
    };
    let (target, target_unit) = match change.target {
        Target::Rate(i) => (format!("d({})/dt", model.states[i].name), per_second(model.states[i].unit)),
        Target::Output(i) => (model.outputs[i].name.clone(), model.outputs[i].unit),
        Target::Input(i) => (model.inputs[i].name.clone(), model.inputs[i].unit),
        Target::Delay(i) => (format!("delay of {}", model.inputs[i].name), Some(Unit::SECOND)),
        Target::Parameter(i) => (model.parameters[i].name.clone(), model.parameters[i].unit),
        Target::Force(k) => {
            let force = model.force(k)?;
            (force.name.clone(), force.unit())
        }
        target => {
            let robot = model.robot.as_ref()?;
            (robot.target_name(target), robot.target_unit(target))
        }
    };
    let unit_of_change = if change.how == How::Factor { String::new() } else { symbol(target_unit) };
    Some(Curve {
        kind: addition.kind.clone(),
        target,
        unit: unit_of_change,
        of: (name.clone(), symbol(unit)),
        x,
        y,
    })
}

/// Indices of the points whose connecting lines represent equidistant values within [`MAX_ERROR`].
///
/// Method of Ramer (1972) and of Douglas and Peucker (1973).
fn needed_points(values: &[f64]) -> Vec<usize> {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let range = finite().fold(f64::NEG_INFINITY, f64::max) - finite().fold(f64::INFINITY, f64::min);
    let last = values.len() - 1;
    let mut points = vec![0, last];
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let slope = (values[to] - values[from]) / (to - from) as f64;
        let error = |k: usize| (values[k] - values[from] - slope * (k - from) as f64).abs();
        let farthest = (from + 1..to).max_by(|a, b| error(*a).total_cmp(&error(*b)));
        // A value that is not finite has no line; its neighbours stay.
        if let Some(middle) = farthest.filter(|k| error(*k) > MAX_ERROR * range || error(*k).is_nan()) {
            points.push(middle);
            open.extend([(from, middle), (middle, to)]);
        }
    }
    points.sort_unstable();
    points
}

#[cfg(test)]
mod tests {
    //! Contract: straight lines between the points of a curve follow it, however often it turns; a straight
    //! one has two points.
    use super::*;

    #[test]
    fn lines_between_the_points_follow_a_ripple_and_a_corner() {
        let position = |k: usize| k as f64 / (FINE_POINTS - 1) as f64;
        let curves: [fn(f64) -> f64; 3] =
            [|x| (std::f64::consts::TAU * 60.0 * x).sin(), |x| ((x - 0.5) / 0.002).tanh(), |x| 2.0 * x];
        let counts = curves.map(|curve| {
            let values: Vec<f64> = (0..FINE_POINTS).map(|k| curve(position(k))).collect();
            let points = needed_points(&values);
            for pair in points.windows(2) {
                for k in pair[0]..pair[1] {
                    let share = (k - pair[0]) as f64 / (pair[1] - pair[0]) as f64;
                    let line = values[pair[0]] + share * (values[pair[1]] - values[pair[0]]);
                    assert!((line - values[k]).abs() <= 2.0 * MAX_ERROR * 1.0001, "{k}");
                }
            }
            points.len()
        });
        // A sine needs about pi / sqrt(8 * 2 * 0.002) = 18 lines per period.
        assert!(counts[0] > 60 * 12 && counts[1] < 40 && counts[2] == 2, "{counts:?}");
    }
}
