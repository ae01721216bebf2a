//! Friction torque of a joint over its speed: the model as a curve, and the data behind it as points.

use super::{augmented_model, measured_output};
use crate::Subject;
use crate::equations::forecast::{BURN_IN, FreeRun, free_runs};
use crate::equations::records::records;
use augsim_data::Dataset;
use augsim_discovery::Discovery;
use augsim_equations::Model;
use augsim_equations::engine::Signal;
use augsim_equations::model::{Expression, Hold, How, Joint, Target};
use augsim_equations::text::{Kind, Symbol, Tree, TreeNode};
use augsim_system::Record;

/// Number of speeds at which the curve of a joint is computed.
const CURVE_POINTS: usize = 401;
/// Maximum number of plotted points of measured friction torque.
const MAX_POINTS: usize = 300;
/// Maximum number of records that the points are taken from.
const MAX_RECORDS: usize = 10;
/// Number of samples over which the slope of a measured position is computed.
const SLOPE_SAMPLES: usize = 10;

/// Friction torque of a joint over its speed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FrictionCurve {
    /// Name of the joint in expressions.
    pub joint: String,
    /// Unit of the speed.
    pub speed_unit: String,
    /// Unit of the torque.
    pub torque_unit: String,
    /// Speeds of the curve, over the range of the data; empty if the model has no friction at this joint.
    pub speed: Vec<f64>,
    /// Torque that the drive needs against friction at each speed: declared and found effects that depend on this speed alone.
    pub torque: Vec<f64>,
    /// Speeds of the points.
    pub measured_speed: Vec<f64>,
    /// Measured torque minus the torque of the rigid bodies at each point; empty in the forward formulation.
    pub measured_torque: Vec<f64>,
}

/// Computes the friction curves of all joints of the augmented model; empty for a model without `[robot]`.
///
/// The points are measured torques minus the torques of rigid bodies and rotors with the inertias of the augmented model.
/// They need outputs of the form `inverse_dynamics(joint) + ...`.
pub fn friction_curves(subject: &Subject, found: &Discovery, data: &Dataset) -> Vec<FrictionCurve> {
    let Some(model) = augmented_model(subject, found) else { return Vec::new() };
    let Some(robot) = model.robot.clone() else { return Vec::new() };
    let mut list = records(data, &model, false).unwrap_or_default();
    list.truncate(MAX_RECORDS);
    // Rigid-body torques are missing if the model cannot be simulated over the records; the curves then have no points.
    let runs = free_runs(&rigid(&model), &list, BURN_IN).unwrap_or_default();
    let curve = |(index, joint): (usize, &Joint)| {
        let is_prismatic = robot.is_prismatic(index);
        let length = if is_prismatic { "m" } else { "rad" };
        let mut curve = FrictionCurve {
            joint: joint.name.clone(),
            speed_unit: format!("{length}/s"),
            torque_unit: if is_prismatic { "N" } else { "N m" }.to_owned(),
            ..FrictionCurve::default()
        };
        if let [TreeNode { kind: Kind::Symbol(symbol), .. }] = joint.speed.tree.nodes[..] {
            curve.add_points(&model, index, symbol, (&list, &runs));
            curve.add_model(&model, index, symbol, fastest(&model, (index, joint), symbol, &list));
        }
        curve
    };
    robot.joints.iter().enumerate().map(curve).collect()
}

impl FrictionCurve {
    /// Computes the curve of the model from minus to plus `limit`.
    fn add_model(&mut self, model: &Model, joint: usize, speed: Symbol, limit: f64) {
        let terms = speed_terms(model, joint, speed);
        let depends = terms.iter().any(|(tree, _, node)| symbols_under(tree, *node).contains(&speed));
        if !depends || limit <= 0.0 {
            return;
        }
        let torque = |v: f64| -> f64 {
            let value_of = |symbol: Symbol| match symbol {
                Symbol::Parameter(index) => model.parameters[index].nominal,
                symbol if symbol == speed => v,
                _ => f64::NAN,
            };
            terms.iter().map(|(tree, sign, node)| sign * tree.node_values(&value_of)[*node]).sum()
        };
        // Cubes of equidistant numbers are dense about zero, where friction changes its sign.
        let half = (CURVE_POINTS / 2) as f64;
        self.speed = (0..CURVE_POINTS).map(|k| limit * ((k as f64 - half) / half).powi(3)).collect();
        self.torque = self.speed.iter().map(|v| torque(*v)).collect();
    }

    /// Computes the points: measured torque minus that of the rigid bodies.
    fn add_points(
        &mut self,
        model: &Model,
        joint: usize,
        speed: Symbol,
        (list, runs): (&[Record], &[FreeRun]),
    ) {
        let is_of_joint = |tree: &Tree| tree.symbols().any(|s| s == Symbol::JointTorque(joint));
        let Some(output) = model.outputs.iter().position(|o| is_of_joint(&o.value.tree)) else { return };
        let samples: usize = list.iter().map(|record| record.times.len()).sum();
        let stride = samples.div_ceil(MAX_POINTS).max(1);
        let points = list.iter().zip(runs).flat_map(|(record, run)| {
            let speeds = speeds(model, speed, record);
            let torques: Vec<f64> = (run.measured[output].iter().zip(&run.predicted[output]))
                .map(|(measured, rigid)| measured - rigid)
                .collect();
            speeds.into_iter().zip(torques)
        });
        let points = points.step_by(stride).filter(|(v, torque)| v.is_finite() && torque.is_finite());
        (self.measured_speed, self.measured_torque) = points.unzip();
    }
}

/// The model whose outputs are the torques of the rigid bodies alone: without friction and effects on joints.
fn rigid(model: &Model) -> Model {
    let mut rigid = model.clone();
    for output in &mut rigid.outputs {
        let torque = output.value.tree.symbols().find(|s| matches!(s, Symbol::JointTorque(_)));
        if let Some(symbol) = torque {
            output.value.tree = Tree {
                text: output.value.tree.text.clone(),
                nodes: vec![TreeNode { kind: Kind::Symbol(symbol), span: 0..0 }],
            };
        }
    }
    let on_joints = rigid.additions.iter_mut().flat_map(|addition| &mut addition.changes);
    for change in on_joints.filter(|change| matches!(change.target, Target::Joint(_))) {
        (change.how, change.value.tree) = (How::Add, Tree::number(0.0));
    }
    rigid
}

/// Values of a speed that is an input, at the samples of a record; none for a state.
fn speeds(model: &Model, speed: Symbol, record: &Record) -> Vec<f64> {
    let Symbol::Input(index) = speed else { return Vec::new() };
    let Some(stream) = record.inputs.get(index) else { return Vec::new() };
    let values = stream.values.first().map_or(&[][..], Vec::as_slice);
    let signal = Signal::new(&stream.times, values, model.inputs[index].hold.unwrap_or(Hold::Linear));
    record.times.iter().map(|t| signal.at(*t)).collect()
}

/// Largest speed in the records, the limit of the curve; of a state the largest slope of the measured position.
fn fastest(model: &Model, (index, joint): (usize, &Joint), speed: Symbol, list: &[Record]) -> f64 {
    let slopes = |record: &Record| -> Vec<f64> {
        let output = measured_output(model, index, joint);
        let Some(place) = output.and_then(|(o, _)| model.outputs.iter().position(|p| p.name == o.name))
        else {
            return Vec::new();
        };
        let (times, values) = (&record.times, &record.values[place]);
        // Slopes over several samples hardly see the noise of the position.
        let step = SLOPE_SAMPLES.min(times.len().saturating_sub(1)).max(1);
        (step..times.len()).map(|k| (values[k] - values[k - step]) / (times[k] - times[k - step])).collect()
    };
    let of_record = |record: &Record| match speed {
        Symbol::Input(_) => speeds(model, speed, record),
        _ => slopes(record),
    };
    list.iter().flat_map(of_record).map(f64::abs).filter(|v| v.is_finite()).fold(0.0, f64::max)
}

/// Terms of the torque against friction at a joint that depend on its speed alone: expression, sign and node.
fn speed_terms(model: &Model, joint: usize, speed: Symbol) -> Vec<(&Tree, f64, usize)> {
    let is_of_joint = |tree: &Tree| tree.symbols().any(|s| s == Symbol::JointTorque(joint));
    // The torque of the drive is the sum of all others; in the forward formulation friction is subtracted from it.
    let output = model.outputs.iter().find(|o| is_of_joint(&o.value.tree));
    let declared: Option<(&Expression, f64)> = match output {
        Some(output) => Some((&output.value, 1.0)),
        None => {
            let robot = model.robot.as_ref();
            robot.and_then(|r| r.joints[joint].torque.as_ref()).map(|torque| (torque, -1.0))
        }
    };
    let changes = model.additions.iter().flat_map(|addition| &addition.changes);
    let added = changes
        .filter(|change| change.target == Target::Joint(joint) && change.how == How::Add)
        .map(|change| (&change.value, -1.0));
    let mut terms = Vec::new();
    for (expression, sign) in declared.into_iter().chain(added) {
        let tree = &expression.tree;
        let is_own = |node: usize| {
            let mut symbols = symbols_under(tree, node).into_iter();
            symbols.all(|s| s == speed || matches!(s, Symbol::Parameter(_)))
        };
        let of_speed = sum_terms(tree).into_iter().filter(|(_, node)| is_own(*node));
        terms.extend(of_speed.map(|(own, node)| (tree, sign * own, node)));
    }
    terms
}

/// Terms of an expression that is a sum: sign and node of each.
fn sum_terms(tree: &Tree) -> Vec<(f64, usize)> {
    let (mut open, mut terms) = (vec![(1.0, tree.root())], Vec::new());
    while let Some((sign, node)) = open.pop() {
        match tree.nodes.get(node).map(|n| &n.kind) {
            Some(Kind::Add(a, b)) => open.extend([(sign, *a), (sign, *b)]),
            Some(Kind::Subtract(a, b)) => open.extend([(sign, *a), (-sign, *b)]),
            Some(Kind::Negate(a)) => open.push((-sign, *a)),
            Some(_) => terms.push((sign, node)),
            None => {}
        }
    }
    terms
}

/// All quantities that a part of an expression uses.
fn symbols_under(tree: &Tree, node: usize) -> Vec<Symbol> {
    let (mut open, mut symbols) = (vec![node], Vec::new());
    while let Some(node) = open.pop() {
        match tree.nodes.get(node).map(|n| &n.kind) {
            Some(Kind::Symbol(symbol)) => symbols.push(*symbol),
            Some(Kind::Negate(a)) => open.push(*a),
            Some(
                Kind::Add(a, b)
                | Kind::Subtract(a, b)
                | Kind::Multiply(a, b)
                | Kind::Divide(a, b)
                | Kind::Power(a, b),
            ) => open.extend([*a, *b]),
            Some(Kind::Call(_, arguments)) => open.extend(arguments),
            Some(Kind::If { left, right, then, otherwise, .. }) => {
                open.extend([*left, *right, *then, *otherwise]);
            }
            Some(Kind::Table { at, .. }) => open.push(*at),
            Some(Kind::Slope { output }) => symbols.push(Symbol::Output(*output)),
            Some(Kind::Number(_)) | None => {}
        }
    }
    symbols
}

#[cfg(test)]
mod tests {
    //! Contract: in the forward formulation friction has the sign that opposes motion, positions are compared, and terms
    //! of other quantities are left out.
    use super::*;
    use crate::joints::Quantity;

    const FORWARD: &str = "scenario = \"system\"\n[robot]\nfile = \"FILE\"\njoints = [\"shoulder\", \"elbow\"]\n\
        position = [\"q1_rad\", \"q2_rad\"]\nspeed = [\"w1_rad_s\", \"w2_rad_s\"]\n\
        torque = [\"tau1_N_m - (c * w1_rad_s + f * tanh(w1_rad_s / 0.1) + c * (w1_rad_s + w2_rad_s))\", \"tau2_N_m\"]\n\
        [inputs]\ntau1_N_m = { hold = \"zero\" }\ntau2_N_m = { hold = \"zero\" }\n[parameters]\n\
        c = { nominal = 0.5, unit = \"N m s\" }\nf = { nominal = 2.0, unit = \"N m\" }\n[states]\n\
        q1_rad = { start = \"measured1_rad\" }\nw1_rad_s = { start = \"slope(measured1_rad)\" }\n\
        q2_rad = { start = \"measured2_rad\" }\nw2_rad_s = { start = \"slope(measured2_rad)\" }\n[rates]\nq1_rad = \"w1_rad_s\"\n\
        w1_rad_s = \"forward_dynamics(shoulder)\"\nq2_rad = \"w2_rad_s\"\nw2_rad_s = \"forward_dynamics(elbow)\"\n[outputs]\n\
        measured1_rad = { value = \"q1_rad\", sd = \"estimate\" }\nmeasured2_rad = { value = \"q2_rad\", sd = \"estimate\" }\n";

    #[test]
    fn friction_of_the_forward_formulation_opposes_motion() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/robots/two-link-planar.urdf");
        let model =
            augsim_equations::model::parse(&FORWARD.replace("FILE", file), "arm.toml").expect("a model");
        let robot = model.robot.clone().expect("a robot");
        let (output, quantity) = measured_output(&model, 1, &robot.joints[1]).expect("an output");
        assert_eq!((output.name.as_str(), quantity), ("measured2_rad", Quantity::Position));
        let speed = Symbol::State(model.states.iter().position(|s| s.name == "w1_rad_s").expect("a state"));
        let mut curve = FrictionCurve::default();
        curve.add_model(&model, 0, speed, 3.0);
        let (v, torque) = (curve.speed.last().expect("a speed"), curve.torque.last().expect("a torque"));
        assert!((v - 3.0).abs() < 1e-12 && (torque - 3.5).abs() < 1e-6, "{torque} N m at {v} rad/s");
        assert!((curve.torque[0] + 3.5).abs() < 1e-6, "odd in speed");
        let elbow = Symbol::State(model.states.iter().position(|s| s.name == "w2_rad_s").expect("a state"));
        let mut curve = FrictionCurve::default();
        curve.add_model(&model, 1, elbow, 3.0);
        assert!(curve.speed.is_empty(), "the elbow has no friction");
    }
}
