//! Export of a system of equations: writes its expressions, and the LaTeX document.

use super::routine::Names;
use super::words::latex as latex_text;
use super::{Language, latex_document, latex_name, latex_number, latex_unit, number};
use augsim_equations::Model;
use augsim_equations::model::{Direction, Event, How, Target};
use augsim_equations::text::{Comparison, Function, Kind, Symbol, Tree};

/// The place in the exported text where an expression is written, which decides how symbols are named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Use {
    /// In a formula of a LaTeX document.
    Formula,
    /// In the initial state of a program, where outputs stand for their first measured values.
    Start,
}

/// Writes the expressions of a model file as LaTeX, Python or C.
pub(super) struct Writer<'a> {
    pub model: &'a Model,
    pub language: Language,
    /// Names of the model's quantities in a program; `None` in a LaTeX document.
    pub names: Option<&'a Names>,
    pub purpose: Use,
}

/// Exports an equation model as a LaTeX document.
pub(super) fn document(model: &Model) -> String {
    Writer { model, language: Language::Latex, names: None, purpose: Use::Formula }.document()
}

impl Writer<'_> {
    fn symbol(&self, symbol: Symbol) -> String {
        let m = self.model;
        if self.purpose == Use::Formula {
            return match symbol {
                Symbol::State(i) => latex_name(&m.states[i].name),
                Symbol::Input(i) => latex_name(&m.inputs[i].name),
                Symbol::Parameter(i) => latex_name(&m.parameters[i].name),
                Symbol::Let(i) => latex_name(&m.lets[i].name),
                Symbol::Output(i) => latex_name(&m.outputs[i].name),
                Symbol::Time => "t".to_owned(),
                Symbol::JointTorque(i) => self.joint("\\tau", i),
                Symbol::JointAcceleration(i) => self.joint("\\ddot{q}", i),
                Symbol::ExternalRate(i) => self.external_rate(i),
            };
        }
        let is_c = self.language == Language::C;
        match (symbol, self.names) {
            (Symbol::Output(i), _) if is_c => format!("law_first(series, {i})"),
            (Symbol::Output(i), _) => format!("first({i})"),
            (Symbol::Input(i), _) => format!("u[{i}]"),
            (Symbol::Parameter(i), Some(names)) if is_c => format!("p->{}", names.parameters[i]),
            (Symbol::Parameter(i), _) => {
                format!("p[{}]", super::words::literal(&m.parameters[i].name, self.language))
            }
            // The states of an effect may start as declared states do.
            (Symbol::State(i), _) => format!("x[{i}]"),
            _ => self.nan(),
        }
    }

    /// A quantity of a joint of the robot, by the dynamics of its rigid bodies.
    fn joint(&self, symbol: &str, joint: usize) -> String {
        let name = self.model.robot.as_ref().and_then(|robot| robot.joint_names().nth(joint));
        format!("{symbol}_{{\\mathrm{{rigid}}}}({})", latex_name(&name.unwrap_or_default()))
    }

    /// The rate of a state by the external function of the model.
    fn external_rate(&self, state: usize) -> String {
        let function = self.model.external.as_ref().map(|external| external.function.as_str());
        let (function, state) = (function.unwrap_or_default(), &self.model.states[state].name);
        format!("\\operatorname{{{}}}_{{{}}}(t, x, u, p)", latex_name(function), latex_name(state))
    }

    fn nan(&self) -> String {
        if self.language == Language::C { "NAN".to_owned() } else { "math.nan".to_owned() }
    }

    /// Writes an expression, every operation in brackets.
    pub fn expression(&self, tree: &Tree) -> String {
        let mut done: Vec<String> = Vec::with_capacity(tree.nodes.len());
        for node in &tree.nodes {
            let text = match self.purpose {
                Use::Formula => self.formula_node(&node.kind, &done),
                Use::Start => self.start_node(&node.kind, &done),
            };
            done.push(text);
        }
        done.pop().unwrap_or_default()
    }

    /// Writes one node of an expression in LaTeX; `done` has the texts of the nodes before it.
    fn formula_node(&self, kind: &Kind, done: &[String]) -> String {
        let text_of = |i: &usize| done[*i].as_str();
        match kind {
            Kind::Number(v) => latex_number(*v),
            Kind::Symbol(s) => self.symbol(*s),
            Kind::Negate(a) => format!("(-{})", text_of(a)),
            Kind::Add(a, b) => format!("({} + {})", text_of(a), text_of(b)),
            Kind::Subtract(a, b) => format!("({} - {})", text_of(a), text_of(b)),
            Kind::Multiply(a, b) => format!("{} \\, {}", text_of(a), text_of(b)),
            Kind::Divide(a, b) => format!("\\frac{{{}}}{{{}}}", text_of(a), text_of(b)),
            Kind::Power(a, b) => format!("{{{}}}^{{{}}}", text_of(a), text_of(b)),
            Kind::Call(f, list) => {
                let list: Vec<&str> = list.iter().map(text_of).collect();
                format!("\\operatorname{{{}}}({})", f.name(), list.join(", "))
            }
            Kind::If { comparison, left, right, then, otherwise } => {
                let sign = match comparison {
                    Comparison::Less => "<",
                    Comparison::LessOrEqual => "\\le",
                    Comparison::Greater => ">",
                    Comparison::GreaterOrEqual => "\\ge",
                };
                let [l, r, a, b] = [left, right, then, otherwise].map(text_of);
                format!("\\begin{{cases}} {a} & {l} {sign} {r} \\\\ {b} & \\text{{else}} \\end{{cases}}")
            }
            Kind::Table { table, at } => {
                format!("{}({})", latex_name(&self.model.tables[*table].name), text_of(at))
            }
            Kind::Slope { output } => {
                format!("\\tfrac{{d}}{{dt}} {}", latex_name(&self.model.outputs[*output].name))
            }
        }
    }

    /// Writes one node of an initial-state expression in Python or C; `done` has the texts of the nodes before it.
    fn start_node(&self, kind: &Kind, done: &[String]) -> String {
        let text_of = |i: &usize| done[*i].as_str();
        let is_c = self.language == Language::C;
        let prefix = if is_c { "law_" } else { "" };
        match kind {
            Kind::Number(v) => number(*v),
            Kind::Symbol(s) => self.symbol(*s),
            Kind::Negate(a) => format!("(-{})", text_of(a)),
            Kind::Add(a, b) => format!("({} + {})", text_of(a), text_of(b)),
            Kind::Subtract(a, b) => format!("({} - {})", text_of(a), text_of(b)),
            Kind::Multiply(a, b) => format!("({} * {})", text_of(a), text_of(b)),
            Kind::Divide(a, b) if is_c => format!("({} / {})", text_of(a), text_of(b)),
            Kind::Divide(a, b) => format!("divide({}, {})", text_of(a), text_of(b)),
            Kind::Power(a, b) => {
                format!("{}({}, {})", if is_c { "pow" } else { "power" }, text_of(a), text_of(b))
            }
            Kind::Call(f, list) => {
                let list: Vec<&str> = list.iter().map(text_of).collect();
                format!("{}({})", start_function(*f, is_c), list.join(", "))
            }
            Kind::If { comparison, left, right, then, otherwise } => {
                let sign = match comparison {
                    Comparison::Less => "<",
                    Comparison::LessOrEqual => "<=",
                    Comparison::Greater => ">",
                    Comparison::GreaterOrEqual => ">=",
                };
                let [l, r, a, b] = [left, right, then, otherwise].map(text_of);
                if is_c {
                    format!("({l} {sign} {r} ? {a} : {b})")
                } else {
                    format!("({a} if {l} {sign} {r} else {b})")
                }
            }
            Kind::Table { .. } => self.nan(),
            Kind::Slope { output } if is_c => format!("{prefix}first_slope(series, {output})"),
            Kind::Slope { output } => format!("slope({output})"),
        }
    }

    /// Writes the complete LaTeX document of the model.
    fn document(&self) -> String {
        let m = self.model;
        let mut body = String::from("Numbers are rounded to six digits.\n\\begin{align*}\n");
        let mut line = |left: String, right: String| body += &format!("{left} &= {right} \\\\\n");
        for l in &m.lets {
            line(latex_name(&l.name), self.expression(&l.value.tree));
        }
        for (i, state) in m.states.iter().enumerate() {
            let right = self.with_changes(Target::Rate(i), self.expression(&state.rate.tree));
            line(format!("\\tfrac{{d}}{{dt}} {}", latex_name(&state.name)), right);
        }
        for (i, input) in m.inputs.iter().enumerate() {
            let name = latex_name(&input.name);
            let right = self.with_changes(Target::Input(i), name.clone());
            if right != name {
                line(format!("{name}^{{\\mathrm{{used}}}}"), right);
            }
        }
        for (i, output) in m.outputs.iter().enumerate() {
            let right = self.with_changes(Target::Output(i), self.expression(&output.value.tree));
            line(latex_name(&output.name), right);
        }
        for (i, p) in m.parameters.iter().enumerate() {
            let value = latex_number(p.nominal) + &latex_unit(p.unit);
            line(latex_name(&p.name), self.with_changes(Target::Parameter(i), value));
        }
        body += "\\end{align*}\n";
        body += &self.bounds();
        body += &m.events.iter().map(|event| self.event(event)).collect::<String>();
        body += &self.tables();
        latex_document(&format!("Equations of {}", m.name), &body)
    }

    fn bounds(&self) -> String {
        let mut text = String::new();
        for state in &self.model.states {
            let name = latex_name(&state.name);
            for (bound, sign) in [(state.min, "\\ge"), (state.max, "\\le")] {
                if let Some(bound) = bound {
                    text += &format!("\\noindent State bound: ${name} {sign} {}$.\n\n", latex_number(bound));
                }
            }
        }
        text
    }

    fn event(&self, event: &Event) -> String {
        let way = match event.direction {
            Direction::Rising => "rises through 0",
            Direction::Falling => "falls through 0",
            Direction::Both => "passes 0",
        };
        let when = self.expression(&event.when.tree);
        let mut text = format!(
            "\\noindent Where ${when}$ {way} (\\texttt{{{}}}):\n\\begin{{align*}}\n",
            latex_text(&event.name)
        );
        for (state, value) in &event.set {
            let name = latex_name(&self.model.states[*state].name);
            text += &format!("{name}^+ &= {} \\\\\n", self.expression(&value.tree));
        }
        text += "\\end{align*}\n";
        if let Some(rest) = &event.rest {
            let until = match &rest.until {
                Some(until) => format!(" until ${}$ is 1", self.expression(&until.tree)),
                None => String::new(),
            };
            let below = latex_number(rest.below);
            text += &format!(
                "\\noindent It rests{until} where that passes more slowly than ${below}$ per second.\n\n"
            );
        }
        text
    }

    fn tables(&self) -> String {
        let mut text = String::new();
        for table in &self.model.tables {
            let knots = table.at.iter().zip(&table.values);
            let rows = knots.map(|(x, y)| format!("${}$ & ${}$\\\\\n", latex_number(*x), latex_number(*y)));
            text += &format!(
                "\\noindent ${}(z)$, linear between its knots:\n\n\\begin{{tabular}}{{rr}}\n$z$ & value\\\\\n{}\\end{{tabular}}\n\n",
                latex_name(&table.name),
                rows.collect::<String>()
            );
        }
        text
    }

    /// Adds to the formula `right` of `target` the changes that the added effects make to it.
    fn with_changes(&self, target: Target, mut right: String) -> String {
        for change in self.model.additions.iter().flat_map(|a| &a.changes).filter(|c| c.target == target) {
            let value = self.expression(&change.value.tree);
            right = match change.how {
                How::Add => format!("{right} + {value}"),
                How::Factor => format!("\\left({right}\\right) \\, {value}"),
                How::Replace => value,
            };
        }
        right
    }
}

/// Name of a mathematical function in the initial-state expressions of a Python or C program.
fn start_function(f: Function, is_c: bool) -> &'static str {
    let choose = |c: &'static str, python: &'static str| if is_c { c } else { python };
    match f {
        Function::Ln => "log",
        Function::Sqrt => choose("law_sqrt", "sqrt"),
        Function::Abs => choose("fabs", "abs"),
        Function::Min => choose("law_min", "min"),
        Function::Max => choose("law_max", "max"),
        Function::Sign => choose("law_sign_of", "sign_of"),
        Function::Step => choose("law_step_of", "step_of"),
        Function::Clamp => choose("law_clamp", "clamp"),
        Function::Relu => choose("law_relu", "relu"),
        Function::Deadzone => choose("law_deadzone", "deadzone"),
        Function::Atan => choose("atan", "math.atan"),
        Function::Tanh => choose("tanh", "math.tanh"),
        Function::Atan2 => choose("atan2", "math.atan2"),
        other => other.name(),
    }
}
