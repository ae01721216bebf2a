//! Questions about a model that its form does not answer, asked at a few points where a quantity passes 0: do the
//! branches of an `if` agree there, does an event move its own condition away.

use super::{Code, Graph, Id};
use crate::machine;
use crate::model::{Model, Table};

/// Operations that all questions to one model may cost together. Beyond them the careful answer is given, so that no
/// file can make the compiler slow: 1e7 are about 0.1 s.
const BUDGET: usize = 10_000_000;
/// Points of the switch that are looked at.
const POINTS: usize = 6;
/// Trials to find such a point.
const TRIALS: usize = 24;

/// Evaluates operations at points of its own choice, always the same.
#[derive(Debug)]
pub(crate) struct Probe {
    nominals: Vec<f64>,
    tables: Vec<Table>,
    left: usize,
}

/// Values of the leaves.
#[derive(Debug, Clone)]
pub(crate) struct Point {
    states: Vec<f64>,
    inputs: Vec<f64>,
    time: f64,
    parameters: Vec<f64>,
}

impl Probe {
    pub(crate) fn new(model: &Model) -> Self {
        Self { nominals: model.nominals(), tables: model.tables.clone(), left: BUDGET }
    }

    /// Whether `branches` have the same value wherever `difference` is 0, as far as can be seen.
    pub(crate) fn branches_agree(&mut self, graph: &Graph, difference: Id, branches: [Id; 2]) -> bool {
        let points = self.zeros(graph, difference);
        let agree = |point: &Point| {
            let values = self.values(graph, point, &branches);
            let (a, b) = (values[0], values[1]);
            (a - b).abs() <= 1e-7 * (a.abs() + b.abs()) + 1e-9
        };
        points.len() == POINTS && points.iter().all(agree)
    }

    /// Points where `id` is 0; none if the budget is spent or none is found.
    pub(crate) fn zeros(&mut self, graph: &Graph, id: Id) -> Vec<Point> {
        let leaves = leaves(graph, id);
        let cost = needed(graph, &[id]).iter().filter(|n| **n).count();
        let mut random = 0x9e37_79b9_7f4a_7c15_u64;
        let mut points = Vec::new();
        for trial in 0..TRIALS {
            // 60 halvings and 16 points of the scan for one zero.
            if leaves.is_empty() || self.left < 80 * cost || points.len() == POINTS {
                break;
            }
            self.left -= 80 * cost;
            let mut point = self.point(graph, &mut random);
            let (code, index) = leaves[trial % leaves.len()];
            if let Some(value) = self.zero_along(graph, id, &point, (code, index)) {
                *point.leaf(code, index) = value;
                points.push(point);
            }
        }
        points
    }

    /// A value of one leaf at which `id` is 0, the others being those of `point`.
    fn zero_along(&self, graph: &Graph, id: Id, point: &Point, (code, index): (Code, usize)) -> Option<f64> {
        let mut at = point.clone();
        let mut value = |x: f64| {
            *at.leaf(code, index) = x;
            self.values(graph, &at, &[id])[0]
        };
        let middle = *point.clone().leaf(code, index);
        let scan: Vec<f64> =
            [-100.0, -10.0, -3.0, -1.0, -0.3, -0.1, -0.01, 0.0, 0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0]
                .iter()
                .map(|x| x * (1.0 + 0.3 * middle))
                .collect();
        let signs: Vec<f64> = scan.iter().map(|x| value(*x)).collect();
        let found = (1..scan.len()).find(|i| signs[i - 1] * signs[*i] <= 0.0 && signs[i - 1] != signs[*i])?;
        let (mut low, mut high) = (scan[found - 1], scan[found]);
        let below = signs[found - 1];
        for _ in 0..60 {
            let half = 0.5 * (low + high);
            let side = value(half);
            if side == 0.0 {
                return Some(half);
            }
            if side * below > 0.0 { low = half } else { high = half }
        }
        Some(high)
    }

    fn point(&self, graph: &Graph, random: &mut u64) -> Point {
        let mut next = || {
            // SplitMix64: a fixed sequence, so that the same file always compiles to the same program.
            *random = random.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (*random ^ (*random >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            (z >> 11) as f64 / (1_u64 << 53) as f64
        };
        let count = |of: Code| {
            let indices = graph.operations().iter().filter(|o| o.code == of).map(|o| o.a as usize + 1);
            indices.max().unwrap_or(0)
        };
        let states = (0..count(Code::State)).map(|_| 2.0 * next() - 1.0).collect();
        let inputs = (0..count(Code::Input)).map(|_| 2.0 * next() - 1.0).collect();
        let parameters = self.nominals.iter().map(|p| p * (0.7 + 0.6 * next())).collect();
        Point { states, inputs, time: 10.0 * next(), parameters }
    }

    /// Values of `ids` at a point. A smoothed jump has width 0.01 there.
    pub(crate) fn values(&self, graph: &Graph, point: &Point, ids: &[Id]) -> Vec<f64> {
        let operations = graph.operations();
        let needed = needed(graph, ids);
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
                code => {
                    let at = |i: usize, id: u32| if i < code.operands() { values[id as usize] } else { 0.0 };
                    machine::evaluate(code, at(0, operation.a), at(1, operation.b), at(2, operation.c))
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

    /// States of the point, to be changed.
    pub(crate) fn states(&mut self) -> &mut Vec<f64> {
        &mut self.states
    }
}

/// Which operations up to the last of `ids` they need.
fn needed(graph: &Graph, ids: &[Id]) -> Vec<bool> {
    let last = ids.iter().max().map_or(0, |id| *id as usize);
    let mut needed = vec![false; last + 1];
    ids.iter().for_each(|id| needed[*id as usize] = true);
    for id in (0..=last).rev() {
        if needed[id] {
            graph.get(id as Id).used().for_each(|used| needed[used as usize] = true);
        }
    }
    needed
}

/// States, inputs and time that `id` depends on.
fn leaves(graph: &Graph, id: Id) -> Vec<(Code, usize)> {
    let used = needed(graph, &[id]);
    let operations = graph.operations().iter().zip(used).filter(|(_, used)| *used);
    let leaf = |code| matches!(code, Code::State | Code::Input | Code::Time);
    operations.filter(|(o, _)| leaf(o.code)).map(|(o, _)| (o.code, o.a as usize)).collect()
}
