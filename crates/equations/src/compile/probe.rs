//! Numerical tests of properties of a model that its expressions do not show.
//!
//! The tests evaluate expressions at a few points where a quantity is 0: whether the branches of an `if`
//! agree there, and whether an event moves its own condition away from 0.

use super::{Code, Graph, Id};
use crate::external::ExternalFunction;
use crate::machine;
use crate::model::{Model, Table};

/// Maximum number of operations that all tests of one model may cost together: about 0.1 s.
///
/// Beyond it the cautious answer is given, so that no file can make the compiler slow.
const MAX_TEST_OPERATIONS: usize = 10_000_000;
/// Number of points, zeros of a quantity, at which a property is tested.
const TESTED_ZEROS: usize = 6;
/// Maximum number of attempts to find zeros of a quantity.
const MAX_SEARCHES: usize = 24;

/// Evaluates operations of a model at points drawn from a fixed random sequence.
#[derive(Debug)]
pub(crate) struct Probe {
    nominals: Vec<f64>,
    tables: Vec<Table>,
    external: Option<ExternalFunction>,
    /// Number of operations that may still be evaluated.
    remaining: usize,
}

/// Values of states, inputs, parameters and time at which operations are evaluated.
#[derive(Debug, Clone)]
pub(crate) struct Point {
    states: Vec<f64>,
    inputs: Vec<f64>,
    time: f64,
    parameters: Vec<f64>,
}

impl Probe {
    pub(crate) fn new(model: &Model) -> Self {
        Self {
            nominals: model.nominals(),
            tables: model.tables.clone(),
            external: model.external.as_ref().and_then(|external| external.rates.clone()),
            remaining: MAX_TEST_OPERATIONS,
        }
    }

    /// Whether two `branches` have the same value where `difference` is 0, within rounding.
    pub(crate) fn branches_agree(&mut self, graph: &Graph, difference: Id, branches: [Id; 2]) -> bool {
        let points = self.find_zeros(graph, difference);
        let agree = |point: &Point| {
            let values = self.values(graph, point, &branches);
            let (a, b) = (values[0], values[1]);
            (a - b).abs() <= 1e-7 * (a.abs() + b.abs()) + 1e-9
        };
        points.len() == TESTED_ZEROS && points.iter().all(agree)
    }

    /// Finds points where operation `id` is 0; empty if the budget of operations is spent or none is found.
    pub(crate) fn find_zeros(&mut self, graph: &Graph, id: Id) -> Vec<Point> {
        let dependencies = dependencies(graph, id);
        let cost = graph.needed_by(&[id]).iter().filter(|n| **n).count();
        let mut random = 0x9e37_79b9_7f4a_7c15_u64;
        let mut points = Vec::new();
        for trial in 0..MAX_SEARCHES {
            // One search costs at most 60 bisections and 16 points of the scan.
            if dependencies.is_empty() || self.remaining < 80 * cost || points.len() == TESTED_ZEROS {
                break;
            }
            self.remaining -= 80 * cost;
            let mut point = self.draw_point(graph, &mut random);
            let (code, index) = dependencies[trial % dependencies.len()];
            if let Some(value) = self.find_zero_along(graph, id, &point, (code, index)) {
                *point.leaf(code, index) = value;
                points.push(point);
            }
        }
        points
    }

    /// Finds a value of one quantity (state, input or time) at which operation `id` is 0, by a scan and bisection.
    ///
    /// The other quantities have their values from `point`.
    fn find_zero_along(
        &self,
        graph: &Graph,
        id: Id,
        point: &Point,
        (code, index): (Code, usize),
    ) -> Option<f64> {
        let mut trial_point = point.clone();
        let mut value = |x: f64| {
            *trial_point.leaf(code, index) = x;
            self.values(graph, &trial_point, &[id])[0]
        };
        let middle = *point.clone().leaf(code, index);
        let grid: Vec<f64> =
            [-100.0, -10.0, -3.0, -1.0, -0.3, -0.1, -0.01, 0.0, 0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0]
                .iter()
                .map(|x| x * (1.0 + 0.3 * middle))
                .collect();
        let grid_values: Vec<f64> = grid.iter().map(|x| value(*x)).collect();
        let found = (1..grid.len())
            .find(|i| grid_values[i - 1] * grid_values[*i] <= 0.0 && grid_values[i - 1] != grid_values[*i])?;
        let (mut low, mut high) = (grid[found - 1], grid[found]);
        let low_value = grid_values[found - 1];
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let middle_value = value(middle);
            if middle_value == 0.0 {
                return Some(middle);
            }
            if middle_value * low_value > 0.0 { low = middle } else { high = middle }
        }
        Some(high)
    }

    /// Draws a random point: states and inputs from -1 to 1, time from 0 to 10 s.
    ///
    /// Parameters are within 30 % of their nominal values.
    fn draw_point(&self, graph: &Graph, random: &mut u64) -> Point {
        let mut next = || {
            // SplitMix64 with a fixed seed, so that the same file always compiles to the same program.
            *random = random.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (*random ^ (*random >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            (z >> 11) as f64 / (1_u64 << 53) as f64
        };
        let count = |kind: Code| {
            let indices = graph.operations().iter().filter(|o| o.code == kind).map(|o| o.a as usize + 1);
            indices.max().unwrap_or(0)
        };
        let states = (0..count(Code::State)).map(|_| 2.0 * next() - 1.0).collect();
        let inputs = (0..count(Code::Input)).map(|_| 2.0 * next() - 1.0).collect();
        let parameters = self.nominals.iter().map(|p| p * (0.7 + 0.6 * next())).collect();
        Point { states, inputs, time: 10.0 * next(), parameters }
    }

    /// Computes the values of `ids` at a point; the widths of smoothed discontinuities are 0.01.
    pub(crate) fn values(&self, graph: &Graph, point: &Point, ids: &[Id]) -> Vec<f64> {
        let operations = graph.operations();
        let needed = graph.needed_by(ids);
        let mut values = vec![0.0; needed.len()];
        for (id, operation) in operations.iter().enumerate().take(needed.len()) {
            if !needed[id] {
                continue;
            }
            let index = operation.a as usize;
            let table = || self.tables.get(operation.b as usize);
            values[id] = match operation.code {
                Code::Constant => operation.as_constant().unwrap_or(0.0),
                Code::State => point.states.get(index).copied().unwrap_or(0.0),
                Code::Input => point.inputs.get(index).copied().unwrap_or(0.0),
                Code::InputSlope => 0.0,
                Code::Time => point.time,
                Code::Parameter => point.parameters.get(index).copied().unwrap_or(0.0),
                Code::Width => 0.01,
                Code::Table => table().map_or(0.0, |t| t.value(values[index])),
                Code::TableSlope => table().map_or(0.0, |t| t.slope(values[index])),
                Code::External => {
                    let list = graph.values_of_arguments(operation.a);
                    let arguments: Vec<f64> = list.iter().map(|id| values[*id as usize]).collect();
                    let found = self.external.as_ref().map(|f| f.evaluate(1, &arguments, &[]));
                    found.and_then(|found| found.rates.get(operation.b as usize).copied()).unwrap_or(0.0)
                }
                code => {
                    let operand =
                        |i: usize, id: u32| if i < code.operands() { values[id as usize] } else { 0.0 };
                    machine::evaluate(
                        code,
                        operand(0, operation.a),
                        operand(1, operation.b),
                        operand(2, operation.c),
                    )
                }
            };
        }
        ids.iter().map(|id| values[*id as usize]).collect()
    }
}

impl Point {
    fn leaf(&mut self, code: Code, index: usize) -> &mut f64 {
        match code {
            Code::State => &mut self.states[index],
            Code::Input => &mut self.inputs[index],
            _ => &mut self.time,
        }
    }

    /// States of the point, which the caller may change.
    pub(crate) fn states(&mut self) -> &mut Vec<f64> {
        &mut self.states
    }
}

/// Lists the states, inputs and time that operation `id` depends on.
fn dependencies(graph: &Graph, id: Id) -> Vec<(Code, usize)> {
    let used = graph.needed_by(&[id]);
    let operations = graph.operations().iter().zip(used).filter(|(_, used)| *used);
    let leaf = |code| matches!(code, Code::State | Code::Input | Code::Time);
    operations.filter(|(o, _)| leaf(o.code)).map(|(o, _)| (o.code, o.a as usize)).collect()
}
