//! Export of a system of equations: names, expressions, and the LaTeX document.

use super::{Language, latex_document, latex_name, number};
use crate::Usage;
use crate::usage::ModelFault;
use augsim_equations::Model;
use augsim_equations::model::{Direction, How, Target};
use augsim_equations::text::{Comparison, Function, Kind, Symbol, Tree};

/// Reserved words of Python, C or the generated programs, which cannot name a quantity.
const RESERVED_WORDS: [&str; 74] = [
    "False",
    "None",
    "True",
    "and",
    "as",
    "assert",
    "async",
    "auto",
    "await",
    "break",
    "case",
    "char",
    "class",
    "const",
    "continue",
    "def",
    "default",
    "del",
    "do",
    "double",
    "elif",
    "else",
    "ends",
    "enum",
    "event",
    "except",
    "extern",
    "finally",
    "float",
    "for",
    "from",
    "given",
    "global",
    "goto",
    "if",
    "import",
    "in",
    "inline",
    "int",
    "is",
    "lambda",
    "long",
    "next_state",
    "nonlocal",
    "not",
    "or",
    "out",
    "pass",
    "raise",
    "rate",
    "register",
    "restrict",
    "return",
    "short",
    "signed",
    "sizeof",
    "state",
    "static",
    "struct",
    "switch",
    "t",
    "time",
    "try",
    "typedef",
    "union",
    "unsigned",
    "void",
    "volatile",
    "when",
    "while",
    "with",
    "y",
    "yield",
    "_",
];

/// How discontinuous functions (`sign`, `step`, `if`) are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Jump {
    /// Discontinuous, as in outputs, events and tables.
    Sharp,
    /// Smoothed by a tanh of the width that the model file declares, as the engine evaluates rates.
    Smooth,
}

/// Writes a model in one language.
pub(super) struct Writer<'a> {
    pub model: &'a Model,
    pub language: Language,
}

/// The text of the model in the language.
pub(super) fn export(model: &Model, language: Language) -> Result<String, Usage> {
    let w = Writer { model, language };
    if language == Language::Latex {
        return w.latex();
    }
    w.program()
}

impl Writer<'_> {
    /// The name of a quantity in the language.
    pub fn name(&self, name: &str) -> String {
        if self.language == Language::Latex {
            return latex_name(name);
        }
        let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        if RESERVED_WORDS.contains(&plain.as_str()) || Function::named(&plain).is_some() {
            plain + "_"
        } else {
            plain
        }
    }

    fn symbol(&self, symbol: Symbol) -> String {
        let m = self.model;
        match symbol {
            Symbol::State(i) => self.name(&m.states[i].name),
            Symbol::Input(i) => self.name(&m.inputs[i].name),
            Symbol::Parameter(i) => self.name(&m.parameters[i].name),
            Symbol::Let(i) => self.name(&m.lets[i].name),
            // An effect on an output reads its value before the change.
            Symbol::Output(i) if self.language == Language::Latex => self.name(&m.outputs[i].name),
            Symbol::Output(i) => self.output(i),
            Symbol::Time => "t".to_owned(),
        }
    }

    /// The variable of an output in a program.
    pub fn output(&self, index: usize) -> String {
        format!("o_{}", self.name(&self.model.outputs[index].name))
    }

    /// The smoothing width that the file declares for a discontinuity where this subexpression passes 0.
    fn width(&self, tree: &Tree, argument: usize) -> Option<String> {
        self.model.numerics.widths.get(tree.text_of(argument)).map(|width| number(*width))
    }

    /// Writes an expression in the language, every operation in brackets.
    ///
    /// # Errors
    /// A program cannot contain the slope of an output.
    pub fn expression(&self, tree: &Tree, jump: Jump) -> Result<String, Usage> {
        let latex = self.language == Language::Latex;
        let mut done: Vec<String> = Vec::with_capacity(tree.nodes.len());
        // Smoothing width of a discontinuity, if it has one and `jump` asks for smoothing.
        let width_of = |kind: &Kind| match kind {
            _ if latex || jump == Jump::Sharp => None,
            Kind::Call(_, list) => self.width(tree, *list.first()?),
            Kind::If { left, .. } => self.width(tree, *left),
            _ => None,
        };
        for node in &tree.nodes {
            let text_of = |i: &usize| done[*i].clone();
            done.push(match &node.kind {
                Kind::Number(v) => number(*v),
                Kind::Symbol(s) => self.symbol(*s),
                Kind::Negate(a) => format!("(-{})", text_of(a)),
                Kind::Add(a, b) => format!("({} + {})", text_of(a), text_of(b)),
                Kind::Subtract(a, b) => format!("({} - {})", text_of(a), text_of(b)),
                Kind::Multiply(a, b) if latex => format!("{} \\, {}", text_of(a), text_of(b)),
                Kind::Multiply(a, b) => format!("({} * {})", text_of(a), text_of(b)),
                Kind::Divide(a, b) if latex => format!("\\frac{{{}}}{{{}}}", text_of(a), text_of(b)),
                Kind::Divide(a, b) => format!("({} / {})", text_of(a), text_of(b)),
                Kind::Power(a, b) if latex => format!("{{{}}}^{{{}}}", text_of(a), text_of(b)),
                Kind::Power(a, b) => format!("pow_of({}, {})", text_of(a), text_of(b)),
                Kind::Call(f @ (Function::Sign | Function::Step), list) if width_of(&node.kind).is_some() => {
                    let (z, width) = (list.first().map(text_of).unwrap_or_default(), width_of(&node.kind));
                    let sign = format!("tanh({z} / {})", width.unwrap_or_default());
                    if *f == Function::Sign { sign } else { format!("(0.5 + 0.5 * {sign})") }
                }
                Kind::Call(f, list) => {
                    let list: Vec<String> = list.iter().map(text_of).collect();
                    let name = if latex {
                        format!("\\operatorname{{{}}}", f.name())
                    } else {
                        program_name(*f).to_owned()
                    };
                    format!("{name}({})", list.join(", "))
                }
                Kind::If { comparison, left, right, then, otherwise } => {
                    let sign = match comparison {
                        Comparison::Less => "<",
                        Comparison::LessOrEqual if latex => "\\le",
                        Comparison::LessOrEqual => "<=",
                        Comparison::Greater => ">",
                        Comparison::GreaterOrEqual if latex => "\\ge",
                        Comparison::GreaterOrEqual => ">=",
                    };
                    let [l, r, a, b] = [left, right, then, otherwise].map(text_of);
                    let rises = matches!(comparison, Comparison::Greater | Comparison::GreaterOrEqual);
                    if let Some(width) = width_of(&node.kind) {
                        let above = if rises { format!("({l} - {r})") } else { format!("({r} - {l})") };
                        format!("({b} + ({a} - {b}) * (0.5 + 0.5 * tanh({above} / {width})))")
                    } else if latex {
                        format!(
                            "\\begin{{cases}} {a} & {l} {sign} {r} \\\\ {b} & \\text{{else}} \\end{{cases}}"
                        )
                    } else {
                        format!("pick({l} {sign} {r}, {a}, {b})")
                    }
                }
                Kind::Table { table, at: x } if latex => {
                    format!("{}({})", latex_name(&self.model.tables[*table].name), text_of(x))
                }
                Kind::Table { table, at: x } => {
                    let (at_knots, values) = (format!("KNOTS_{table}"), format!("VALUES_{table}"));
                    match self.language {
                        Language::C => {
                            let count = self.model.tables[*table].at.len();
                            format!("interpolate({}, {count}, {at_knots}, {values})", text_of(x))
                        }
                        _ => format!("interpolate({}, {at_knots}, {values})", text_of(x)),
                    }
                }
                Kind::Slope { output } if latex => {
                    format!("\\tfrac{{d}}{{dt}} {}", latex_name(&self.model.outputs[*output].name))
                }
                Kind::Slope { .. } => {
                    return Err(Usage::model(&self.model.file, ModelFault::SlopeExported));
                }
            });
        }
        Ok(done.pop().unwrap_or_default())
    }

    fn latex(&self) -> Result<String, Usage> {
        let m = self.model;
        let expression = |tree: &Tree| self.expression(tree, Jump::Sharp);
        let mut body = String::from("\\begin{align*}\n");
        let mut line = |left: String, right: String| body += &format!("{left} &= {right} \\\\\n");
        for l in &m.lets {
            line(latex_name(&l.name), expression(&l.value.tree)?);
        }
        for (i, state) in m.states.iter().enumerate() {
            let right = self.with_changes(Target::Rate(i), expression(&state.rate.tree)?)?;
            line(format!("\\tfrac{{d}}{{dt}} {}", latex_name(&state.name)), right);
        }
        for (i, output) in m.outputs.iter().enumerate() {
            let right = self.with_changes(Target::Output(i), expression(&output.value.tree)?)?;
            line(latex_name(&output.name), right);
        }
        for (i, p) in m.parameters.iter().enumerate() {
            let right = self.with_changes(Target::Parameter(i), number(p.nominal))?;
            line(latex_name(&p.name), right);
        }
        body += "\\end{align*}\n";
        for state in &m.states {
            let name = latex_name(&state.name);
            for (bound, sign) in [(state.min, "\\ge"), (state.max, "\\le")] {
                if let Some(bound) = bound {
                    body += &format!("\\noindent State bound: ${name} {sign} {}$.\n\n", number(bound));
                }
            }
        }
        for event in &m.events {
            let way = match event.direction {
                Direction::Rising => "rises through 0",
                Direction::Falling => "falls through 0",
                Direction::Both => "passes 0",
            };
            let when = expression(&event.when.tree)?;
            body +=
                &format!("\\noindent Where ${when}$ {way} (\\verb|{}|):\n\\begin{{align*}}\n", event.name);
            for (state, value) in &event.set {
                let name = latex_name(&m.states[*state].name);
                body += &format!("{name}^+ &= {} \\\\\n", expression(&value.tree)?);
            }
            body += "\\end{align*}\n";
            if let Some(rest) = &event.rest {
                let until = match &rest.until {
                    Some(until) => format!(" until ${}$ is 1", expression(&until.tree)?),
                    None => String::new(),
                };
                let below = number(rest.below);
                body += &format!(
                    "\\noindent It rests{until} where that passes more slowly than {below} per second.\n\n"
                );
            }
        }
        for table in &m.tables {
            let knots = table
                .at
                .iter()
                .zip(&table.values)
                .map(|(x, y)| format!("{} & {}\\\\\n", number(*x), number(*y)));
            body += &format!(
                "\\noindent ${}(z)$, linear between its knots:\n\n\\begin{{tabular}}{{rr}}\n$z$ & value\\\\\n{}\\end{{tabular}}\n\n",
                latex_name(&table.name),
                knots.collect::<String>()
            );
        }
        Ok(latex_document(&format!("Equations of {}", m.name), &body))
    }

    /// A formula with the changes by the added effects.
    fn with_changes(&self, target: Target, mut right: String) -> Result<String, Usage> {
        for change in self.model.additions.iter().flat_map(|a| &a.changes).filter(|c| c.target == target) {
            let value = self.expression(&change.value.tree, Jump::Sharp)?;
            right = match change.how {
                How::Add => format!("{right} + {value}"),
                How::Factor => format!("\\left({right}\\right) \\, {value}"),
                How::Replace => value,
            };
        }
        Ok(right)
    }
}

/// Name of a function in the generated programs.
fn program_name(f: Function) -> &'static str {
    match f {
        Function::Ln => "log_of",
        Function::Sqrt => "sqrt_of",
        Function::Abs => "fabs",
        Function::Min => "fmin",
        Function::Max => "fmax",
        Function::Sign => "sign_of",
        Function::Step => "step_of",
        Function::Clamp => "clamp_of",
        Function::Relu => "relu_of",
        Function::Deadzone => "deadzone_of",
        Function::Cbrt => "cbrt_of",
        other => other.name(),
    }
}
