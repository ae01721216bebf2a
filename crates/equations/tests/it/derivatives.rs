//! Contract: compiled rates and their Jacobians agree with those of the expressions to 1e-12.
//!
//! The oracle evaluates the tree with its own dual numbers. It has no folding, sharing or fused products, and
//! takes its functions from the standard library. Central differences of the oracle's values check the oracle
//! itself, to 1e-6.

use augsim_equations::System;
use augsim_equations::engine::Point;
use augsim_equations::model::{self, Model};
use augsim_equations::text::{Comparison, Function, Kind, Symbol, Tree};
use proptest::prelude::*;

/// Number of derivatives: with respect to the states x, y and the parameters p, q; none for input u and time.
const VARIABLES: usize = 4;

#[derive(Debug, Clone, Copy)]
struct Dual(f64, [f64; VARIABLES]);

impl Dual {
    fn of(value: f64) -> Dual {
        Dual(value, [0.0; VARIABLES])
    }
    /// Combines two dual numbers to the value of a function of both, with its partial derivatives `a` and `b`.
    fn join(self, other: Dual, value: f64, a: f64, b: f64) -> Dual {
        let part = |slope: f64, d: f64| if d == 0.0 { 0.0 } else { slope * d };
        Dual(value, std::array::from_fn(|i| part(a, self.1[i]) + part(b, other.1[i])))
    }
    fn chain(self, value: f64, slope: f64) -> Dual {
        self.join(self, value, slope, 0.0)
    }
}

fn operands(kind: &Kind) -> Vec<usize> {
    match kind {
        Kind::Negate(a) => vec![*a],
        Kind::Add(a, b)
        | Kind::Subtract(a, b)
        | Kind::Multiply(a, b)
        | Kind::Divide(a, b)
        | Kind::Power(a, b) => {
            vec![*a, *b]
        }
        Kind::Call(_, operands) => operands.clone(),
        Kind::If { left, right, then, otherwise, .. } => vec![*left, *right, *then, *otherwise],
        _ => Vec::new(),
    }
}

/// Computes value and derivatives of an expression with dual numbers, independently of the compiler.
///
/// A division by exactly 0, a negative power of 0, and `atan2` on its cut are NaN, and so is everything
/// computed from them: the compiler may fold a part of such an expression (0/0 to 0), and the sign of a zero
/// may differ.
fn oracle(model: &Model, tree: &Tree, at: &Point<'_>) -> Dual {
    let mut values: Vec<Dual> = Vec::new();
    for node in &tree.nodes {
        let v = |i: &usize| values[*i];
        let value = match &node.kind {
            Kind::Number(x) => Dual::of(*x),
            Kind::Symbol(symbol) => symbol_value(model, *symbol, at),
            Kind::Negate(a) => v(a).chain(-v(a).0, -1.0),
            Kind::Add(a, b) => v(a).join(v(b), v(a).0 + v(b).0, 1.0, 1.0),
            Kind::Subtract(a, b) => minus(v(a), v(b)),
            Kind::Multiply(a, b) => times(v(a), v(b)),
            Kind::Divide(a, b) => {
                let (x, y) = (v(a).0, v(b).0);
                let quotient = if y == 0.0 { f64::NAN } else { x / y };
                v(a).join(v(b), quotient, 1.0 / y, -x / (y * y))
            }
            Kind::Power(a, b) => {
                let (x, y) = (v(a).0, v(b).0);
                let logarithm = if v(b).1 == [0.0; VARIABLES] { 0.0 } else { x.ln() };
                let power = if x == 0.0 && y < 0.0 { f64::NAN } else { x.powf(y) };
                v(a).join(v(b), power, y * x.powf(y - 1.0), power * logarithm)
            }
            Kind::Call(function, operands) => call(*function, &operands.iter().map(v).collect::<Vec<_>>()),
            Kind::If { comparison, left, right, then, otherwise } => {
                smooth_if(*comparison, [v(left), v(right)], [v(then), v(otherwise)])
            }
            Kind::Table { .. } | Kind::Slope { .. } => Dual::of(0.0),
        };
        let is_number = operands(&node.kind).iter().all(|i| !v(i).0.is_nan());
        values.push(if is_number { value } else { Dual::of(f64::NAN) });
    }
    *values.last().expect("a tree has a node")
}

/// Value of a quantity of the model at a point, with its derivatives.
fn symbol_value(model: &Model, symbol: Symbol, at: &Point<'_>) -> Dual {
    let (value, lane) = match symbol {
        Symbol::State(i) => (at.state[i], Some(i)),
        Symbol::Parameter(i) => (at.parameters[i], Some(2 + i)),
        Symbol::Input(i) => (at.inputs[i], None),
        Symbol::Let(i) => return oracle(model, &model.lets[i].value.tree, at),
        _ => (at.time, None),
    };
    Dual(value, std::array::from_fn(|i| f64::from(u8::from(lane == Some(i)))))
}

/// Value of a function of one to three dual numbers, with its derivatives.
fn call(function: Function, operands: &[Dual]) -> Dual {
    let (a, x) = (operands[0], operands[0].0);
    let (b, y) = operands.get(1).map_or((a, 0.0), |b| (*b, b.0));
    let select = |condition: bool, yes: Dual, no: Dual| if condition { yes } else { no };
    match function {
        Function::Sin => a.chain(x.sin(), x.cos()),
        Function::Cos => a.chain(x.cos(), -x.sin()),
        Function::Tan => a.chain(x.tan(), 1.0 / x.cos().powi(2)),
        Function::Asin => a.chain(x.asin(), 1.0 / (1.0 - x * x).sqrt()),
        Function::Acos => a.chain(x.acos(), -1.0 / (1.0 - x * x).sqrt()),
        Function::Atan => a.chain(x.atan(), 1.0 / (1.0 + x * x)),
        Function::Sinh => a.chain(x.sinh(), x.cosh()),
        Function::Cosh => a.chain(x.cosh(), x.sinh()),
        Function::Tanh => a.chain(x.tanh(), 1.0 - x.tanh().powi(2)),
        Function::Exp => a.chain(x.exp(), x.exp()),
        Function::Ln => a.chain(x.ln(), 1.0 / x),
        Function::Sqrt if x > 0.0 => a.chain(x.sqrt(), 0.5 / x.max(1e-6).sqrt()),
        Function::Sqrt => a.chain(0.0, 0.0),
        Function::Cbrt => a.chain(x.cbrt(), 1.0 / (3.0 * x.cbrt().powi(2).max(1e-6))),
        Function::Atan2 => {
            let r = x * x + y * y;
            a.join(b, if x == 0.0 && y <= 0.0 { f64::NAN } else { x.atan2(y) }, y / r, -x / r)
        }
        Function::Hypot => a.join(b, x.hypot(y), x / x.hypot(y), y / x.hypot(y)),
        Function::Abs => a.chain(x.abs(), x.signum()),
        Function::Min => select(y < x, b, a),
        Function::Max => select(y > x, b, a),
        Function::Clamp => {
            let (c, above) = (operands[2], select(y > x, b, a));
            select(c.0 < above.0, c, above)
        }
        Function::Relu => select(x < 0.0, Dual::of(0.0), a),
        Function::Deadzone => {
            let low = b.chain(-y, -1.0);
            let above = select(low.0 > x, low, a);
            minus(a, select(y < above.0, b, above))
        }
        // Smoothed with width 0.01, the default of the compiler.
        Function::Sign => smooth(a),
        Function::Step => smooth_step(a),
    }
}

/// Value of a smoothed condition that compares two dual numbers and selects one of two others.
fn smooth_if(comparison: Comparison, [left, right]: [Dual; 2], [then, otherwise]: [Dual; 2]) -> Dual {
    let (difference, yes, no) = match comparison {
        Comparison::Less => (minus(right, left), then, otherwise),
        Comparison::Greater => (minus(left, right), then, otherwise),
        Comparison::LessOrEqual => (minus(left, right), otherwise, then),
        Comparison::GreaterOrEqual => (minus(right, left), otherwise, then),
    };
    let part = times(smooth_step(difference), minus(yes, no));
    no.join(part, no.0 + part.0, 1.0, 1.0)
}

fn times(a: Dual, b: Dual) -> Dual {
    a.join(b, a.0 * b.0, b.0, a.0)
}

fn smooth_step(a: Dual) -> Dual {
    let s = smooth(a);
    s.chain(0.5 + 0.5 * s.0, 0.5)
}

fn minus(a: Dual, b: Dual) -> Dual {
    a.join(b, a.0 - b.0, 1.0, -1.0)
}

fn smooth(a: Dual) -> Dual {
    let tanh = (a.0 / 0.01).tanh();
    a.chain(tanh, (1.0 - tanh * tanh) / 0.01)
}

fn model_of(expression: &str) -> Model {
    let text = format!(
        "scenario = \"system\"\n[inputs]\nu = {{}}\n[states]\nx = {{}}\ny = {{}}\n\
         [parameters]\np = {{ nominal = 0.7, frozen = true }}\nq = {{ nominal = 1.3, frozen = true }}\n\
         [let]\nhelp = \"x * q - y\"\n[rates]\nx = \"{expression}\"\ny = \"help + u * t\"\n[outputs]\nz = {{ value = \"x\" }}\n"
    );
    model::parse(&text, "random.toml").unwrap_or_else(|e| panic!("{e}\n{expression}"))
}

/// Whether `a` and `b` agree within `tolerance`, relative to their size plus 1.
fn close(a: f64, b: f64, tolerance: f64) -> bool {
    a == b || (a - b).abs() <= tolerance * (1.0 + a.abs().max(b.abs())) || !a.is_finite() && !b.is_finite()
}

fn check(expression: &str, [x, y, p, q, u, t]: [f64; 6], tolerance: f64) -> Result<(), String> {
    let model = model_of(expression);
    let system = System::compile(&model, &[0, 1]).map_err(|e| e.to_string())?;
    let point = Point { state: &[x, y], inputs: &[u], parameters: &[p, q], time: t };
    let found = system.linearise(&point);
    for (i, state) in model.states.iter().enumerate() {
        let expected = oracle(&model, &state.rate.tree, &point);
        let d = &expected.1;
        let ours = [
            found.by_state[2 * i],
            found.by_state[2 * i + 1],
            found.by_parameter[2 * i],
            found.by_parameter[2 * i + 1],
        ];
        // Cancellation between large intermediate values is due to the expression, not to the compiler. It
        // occurs where derivatives are large, so that the tolerance is relative to these.
        let size = 1.0 + d.iter().map(|d| d.abs()).fold(0.0, f64::max);
        if !close(found.rates[i], expected.0, tolerance * size) && expected.0.is_finite() {
            return Err(format!("{expression} = {} not {}", found.rates[i], expected.0));
        }
        // Where the value itself is infinite (1/0), there is no derivative to compare.
        for k in (0..VARIABLES).filter(|_| expected.0.is_finite()) {
            if d[k].is_finite() && size < 1e6 && !close(ours[k], d[k], tolerance * size) {
                return Err(format!("{expression}: derivative {k} is {} not {}", ours[k], d[k]));
            }
        }
    }
    Ok(())
}

#[test]
fn every_function_has_an_exact_derivative() {
    for expression in [
        "sin(x*p)",
        "cos(x*q)",
        "tan(0.3*x)",
        "asin(0.4*x)",
        "acos(0.4*x*p)",
        "atan(x*y)",
        "sinh(x)",
        "cosh(y*p)",
        "tanh(x*q)",
        "exp(x*p)",
        "ln(x*x + q)",
        "sqrt(x*x + p)",
        "sqrt(x - 5)",
        "cbrt(x + 3)",
        "atan2(x*p, y + 3)",
        "hypot(x, y*q)",
        "abs(x*p)",
        "min(x*p, y)",
        "max(x, y*q)",
        "clamp(x*q, -p, p)",
        "relu(x*p)",
        "relu(-x)",
        "deadzone(x*q, 0.1*p)",
        "sign(0.01*x)",
        "step(0.01*x*p)",
        "if(x < y*p, q, x*x)",
        "if(x >= 0.5, 2*q, u)",
        "x^2",
        "x^3*p",
        "x^-2",
        "x^-1",
        "x^0",
        "abs(x)^q",
        "(x*x + 1)^2.5",
        "(p*q)^1.5",
        "2^x",
        "x/p",
        "p/x",
        "-x/(q*y)",
        "x*p + y*q",
        "x*p - y*q",
        "q - x*y",
        "x*x*x - (x - y)*(x + y)",
        "help^2/(1 + help^2)",
        "-(-x)",
        "x - x",
        "0*x + 1*y",
        "(x - 1)*(x - 1) + p*p",
        "x*p*(-1)",
        "p*q*x*y*u*t",
        "pi*x",
        "x/4",
    ] {
        for point in [[0.6, -0.4, 0.7, 1.3, 0.2, 2.0], [-0.9, 1.1, 0.5, 0.8, -0.3, 0.1]] {
            check(expression, point, 1e-12).unwrap_or_else(|e| panic!("{e} at {point:?}"));
        }
    }
}

#[test]
fn the_oracle_agrees_with_differences() {
    let expression =
        "sin(x*p)*exp(-y*q) + tanh(x/q)/(1 + y*y) + sqrt(x*x + p)^1.5 - atan2(x, 2 + y)*ln(3 + x*q)";
    let (model, base) = (model_of(expression), [0.6, -0.4, 0.7, 1.3]);
    let at = |v: [f64; 4]| {
        oracle(
            &model,
            &model.states[0].rate.tree,
            &Point { state: &v[..2], inputs: &[0.2], parameters: &v[2..], time: 1.0 },
        )
    };
    let exact = at(base);
    for lane in 0..VARIABLES {
        let moved = |h: f64| {
            let mut v = base;
            v[lane] += h;
            at(v).0
        };
        let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
        assert!((exact.1[lane] - difference).abs() < 1e-6, "{lane}: {} {difference}", exact.1[lane]);
    }
}

fn expression() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        Just("x".to_owned()),
        Just("y".to_owned()),
        Just("p".to_owned()),
        Just("q".to_owned()),
        Just("u".to_owned()),
        Just("(t*1)".to_owned()),
        Just("help".to_owned()),
        (-3.0..3.0_f64).prop_map(|v| format!("({v:.2})")),
        (0..4_i32).prop_map(|v| v.to_string()),
    ];
    leaf.prop_recursive(5, 40, 3, |inner| {
        prop_oneof![
            (inner.clone(), inner.clone(), "[-+*/]").prop_map(|(a, b, sign)| format!("({a}) {sign} ({b})")),
            (inner.clone(), -2..4_i32).prop_map(|(a, n)| format!("({a})^{n}")),
            (inner.clone(), "(sin|cos|tanh|atan|abs|relu|sqrt|exp)").prop_map(|(a, f)| format!("{f}({a})")),
            (inner.clone(), inner.clone(), "(min|max|hypot|atan2)")
                .prop_map(|(a, b, f)| format!("{f}({a}, {b})")),
            inner.prop_map(|a| format!("-({a})")),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn random_expressions_have_exact_values_and_derivatives(
        text in expression(),
        point in prop::array::uniform6(0.1..1.5_f64),
    ) {
        // 1e-9, because random expressions cancel, and fused products then differ from separate ones by more
        // than the last bit.
        check(&text, point, 1e-9).map_err(TestCaseError::fail)?;
    }
}
