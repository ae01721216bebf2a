//! Writes a routine of the compiled equations as statements of Python or C.

use super::words::identifiers;
use super::{Language, number};
use augsim_equations::Model;
use augsim_equations::listing::{Code, Routine, Value};
use std::collections::BTreeSet;

/// Maximum length of an expression that is written in place of its only use, in characters.
const MAX_INLINE: usize = 60;

/// Names of the quantities of a model in an exported program.
pub(super) struct Names {
    pub states: Vec<String>,
    pub inputs: Vec<String>,
    pub parameters: Vec<String>,
    lets: Vec<String>,
}

impl Names {
    pub fn new(model: &Model) -> Self {
        Names {
            states: identifiers("x_", model.states.iter().map(|s| s.name.as_str())),
            inputs: identifiers("u_", model.inputs.iter().map(|i| i.name.as_str())),
            parameters: identifiers("p_", model.parameters.iter().map(|p| p.name.as_str())),
            lets: identifiers("let_", model.lets.iter().map(|l| l.name.as_str())),
        }
    }
}

/// Text of an expression, with the precedence of its outermost operation.
#[derive(Clone)]
struct Term {
    text: String,
    rank: Rank,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    Choice,
    Sum,
    Product,
    Atom,
}

impl Term {
    fn atom(text: String) -> Self {
        Term { text, rank: Rank::Atom }
    }

    /// The text of the expression, in brackets if it binds less tightly than `rank`.
    fn at_least(&self, rank: Rank) -> String {
        if self.rank >= rank { self.text.clone() } else { format!("({})", self.text) }
    }
}

/// Writes routines of one model in one language.
pub(super) struct Syntax<'a> {
    pub model: &'a Model,
    pub language: Language,
    pub names: &'a Names,
}

/// Program text of statements that compute results, and the expressions of the results.
pub(super) struct Statements {
    pub text: String,
    pub results: Vec<String>,
}

impl Syntax<'_> {
    fn is_c(&self) -> bool {
        self.language == Language::C
    }

    /// Writes the statements of a routine, indented by `depth` times four blanks.
    ///
    /// `unused` names the arguments of the C function that the routine may not use: they are cast to void.
    pub fn statements(&self, routine: &Routine, depth: usize, unused: &[&str]) -> Statements {
        let indent = "    ".repeat(depth);
        let mut uses = vec![0; routine.assignments.len()];
        let operands = routine.assignments.iter().flat_map(|a| &a.operands).chain(&routine.results);
        let mut read = BTreeSet::new();
        for value in operands {
            match value {
                Value::Assignment(index) => uses[*index] += 1,
                value => drop(self.declaration(*value).map(|line| read.insert(line))),
            }
        }
        let mut terms: Vec<Term> = Vec::with_capacity(uses.len());
        let (mut body, mut taken) = (String::new(), BTreeSet::new());
        for (index, assignment) in routine.assignments.iter().enumerate() {
            let values: Vec<Term> = assignment.operands.iter().map(|v| self.value(*v, &terms)).collect();
            let term = self.operation(assignment.code, &values, assignment.table);
            let let_name = assignment.let_value.map(|l| self.names.lets[l].clone());
            if uses[index] == 1 && let_name.is_none() && term.text.len() <= MAX_INLINE {
                terms.push(term);
                continue;
            }
            // The same [let] value may occur twice, smoothed and not.
            let name =
                let_name.filter(|name| taken.insert(name.clone())).unwrap_or_else(|| format!("v{index}"));
            body += &match self.is_c() {
                true => format!("{indent}const double {name} = {};\n", term.text),
                false => format!("{indent}{name} = {}\n", term.text),
            };
            terms.push(Term::atom(name));
        }
        let results = routine.results.iter().map(|v| self.value(*v, &terms).text).collect::<Vec<_>>();
        let declared: String = read.iter().map(|line| format!("{indent}{line}\n")).collect();
        let mut text = declared + &body;
        if self.is_c() {
            let casts: Vec<String> = unused.iter().map(|name| format!("(void){name};")).collect();
            text = format!("{indent}{}\n{text}", casts.join(" "));
        }
        Statements { text, results }
    }

    /// Statement that reads a quantity into a variable; `None` if the quantity needs no variable.
    fn declaration(&self, value: Value) -> Option<String> {
        let (name, from) = match value {
            Value::State(i) => (self.names.states[i].clone(), format!("x[{i}]")),
            Value::Input(i) => (self.names.inputs[i].clone(), format!("u[{i}]")),
            Value::InputSlope(i) => (format!("d{}", self.names.inputs[i]), format!("du[{i}]")),
            Value::Parameter(i) if !self.is_c() => {
                let key = super::words::literal(&self.model.parameters[i].name, self.language);
                (self.names.parameters[i].clone(), format!("p[{key}]"))
            }
            _ => return None,
        };
        Some(if self.is_c() { format!("const double {name} = {from};") } else { format!("{name} = {from}") })
    }

    fn value(&self, value: Value, terms: &[Term]) -> Term {
        let names = self.names;
        match value {
            Value::Constant(constant) => self.constant(constant),
            Value::State(i) => Term::atom(names.states[i].clone()),
            Value::Input(i) => Term::atom(names.inputs[i].clone()),
            Value::InputSlope(i) => Term::atom(format!("d{}", names.inputs[i])),
            Value::Time => Term::atom("t".into()),
            Value::Parameter(i) if self.is_c() => Term::atom(format!("p->{}", names.parameters[i])),
            Value::Parameter(i) => Term::atom(names.parameters[i].clone()),
            Value::Width(i) if self.is_c() => Term::atom(format!("p->width[{i}]")),
            Value::Width(i) => Term::atom(format!("p[\"_widths\"][{i}]")),
            Value::Assignment(index) => terms[index].clone(),
        }
    }

    fn constant(&self, value: f64) -> Term {
        let prefix = if self.is_c() { "" } else { "math." };
        let [infinity, nan] = if self.is_c() { ["INFINITY", "NAN"] } else { ["inf", "nan"] };
        let text = match value {
            v if v.is_nan() => format!("{prefix}{nan}"),
            v if v.is_infinite() => format!("{}{prefix}{infinity}", if v < 0.0 { "-" } else { "" }),
            v => number(v),
        };
        // A negative number in brackets cannot join with a sign before it.
        Term { rank: if text.starts_with('-') { Rank::Choice } else { Rank::Atom }, text }
    }

    fn operation(&self, code: Code, z: &[Term], table: usize) -> Term {
        let sum = |text: String| Term { text, rank: Rank::Sum };
        let product =
            |a: &Term, b: &Term| format!("{} * {}", a.at_least(Rank::Product), b.at_least(Rank::Atom));
        let call = |name: &str| {
            let list: Vec<&str> = z.iter().map(|term| term.text.as_str()).collect();
            Term::atom(format!("{name}({})", list.join(", ")))
        };
        match code {
            Code::Add => sum(format!("{} + {}", z[0].at_least(Rank::Sum), z[1].at_least(Rank::Product))),
            Code::Subtract => sum(format!("{} - {}", z[0].at_least(Rank::Sum), z[1].at_least(Rank::Product))),
            Code::Multiply => Term { text: product(&z[0], &z[1]), rank: Rank::Product },
            Code::Divide if self.is_c() => {
                let text = format!("{} / {}", z[0].at_least(Rank::Product), z[1].at_least(Rank::Atom));
                Term { text, rank: Rank::Product }
            }
            // A sign in brackets cannot join with one before it: `--` is another operation in C.
            Code::Negate => Term { text: format!("-{}", z[0].at_least(Rank::Atom)), rank: Rank::Choice },
            Code::MultiplyAdd => sum(format!("{} + {}", product(&z[0], &z[1]), z[2].at_least(Rank::Product))),
            Code::MultiplySubtract => {
                sum(format!("{} - {}", product(&z[0], &z[1]), z[2].at_least(Rank::Product)))
            }
            Code::SubtractProduct => sum(format!("{} - {}", z[2].at_least(Rank::Sum), product(&z[0], &z[1]))),
            Code::Select => {
                let [a, b, c] = [&z[0], &z[1], &z[2]].map(|term| term.at_least(Rank::Sum));
                let text = match self.is_c() {
                    true => format!("{a} > 0.0 ? {b} : {c}"),
                    false => return Term::atom(format!("choose({a} > 0.0, {b}, {c})")),
                };
                Term { text, rank: Rank::Choice }
            }
            Code::Table | Code::TableSlope => {
                let function = if code == Code::Table { "table" } else { "table_slope" };
                let (argument, model_table) = (&z[0].text, &self.model.tables[table]);
                Term::atom(match self.is_c() {
                    true => format!(
                        "law_{function}({argument}, {}, law_knots_{table}, law_values_{table})",
                        model_table.at.len()
                    ),
                    false => format!("{function}({argument}, KNOTS_{table}, VALUES_{table})"),
                })
            }
            code => call(function_name(code, self.is_c())),
        }
    }
}

/// Name of the Python or C function that computes an operation.
fn function_name(code: Code, is_c: bool) -> &'static str {
    let choose = |c: &'static str, python: &'static str| if is_c { c } else { python };
    match code {
        Code::Divide => "divide",
        Code::Minimum => choose("law_min", "minimum"),
        Code::Maximum => choose("law_max", "maximum"),
        Code::Absolute => choose("fabs", "abs"),
        Code::Sqrt => choose("law_sqrt", "sqrt"),
        Code::Cbrt => "cbrt",
        Code::Exp => "exp",
        Code::Ln => "log",
        Code::Sin => "sin",
        Code::Cos => "cos",
        Code::Tan => "tan",
        Code::Asin => "asin",
        Code::Acos => "acos",
        Code::Atan => "atan",
        Code::Sinh => "sinh",
        Code::Cosh => "cosh",
        Code::Tanh => "tanh",
        Code::Atan2 => "atan2",
        Code::Hypot => "hypot",
        _ => choose("pow", "power"),
    }
}
