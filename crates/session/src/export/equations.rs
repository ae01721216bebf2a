//! The law of a system of equations.

use super::{Language, latex_document, latex_name, number};
use crate::Usage;
use augsim_written::Model;
use augsim_written::model::{How, Target};
use augsim_written::text::{Comparison, Function, Kind, Symbol, Tree};

/// Words that mean something in Python, in C or in the programs, and cannot name a quantity there.
const TAKEN: [&str; 30] = [
    "and", "as", "auto", "break", "case", "char", "class", "const", "def", "del", "double", "else", "float",
    "for", "from", "if", "in", "int", "is", "lambda", "long", "not", "or", "pass", "return", "t", "time",
    "while", "with", "y",
];

/// Seconds of a step of the programs.
const STEP_S: f64 = 2e-4;

/// A model with the names of a program.
struct Writer<'a> {
    model: &'a Model,
    language: Language,
}

/// The text of a system's law.
pub(super) fn export(model: &Model, language: Language) -> Result<String, Usage> {
    let w = Writer { model, language };
    if language == Language::Latex {
        return w.latex();
    }
    w.check()?;
    w.program()
}

impl Writer<'_> {
    fn refuse(&self, what: &str) -> Usage {
        Usage(format!(
            "{}: {what} cannot be written out as a program; `--as latex` writes the formulas, and `augsim simulate` runs them",
            self.model.file
        ))
    }

    /// That the model is one of rates and outputs alone.
    fn check(&self) -> Result<(), Usage> {
        let m = self.model;
        if let Some(event) = m.events.first() {
            return Err(self.refuse(&format!("the event `{}`", event.name)));
        }
        if let Some(state) = m.states.iter().find(|s| s.min.is_some() || s.max.is_some()) {
            return Err(self.refuse(&format!("the walls of `{}`", state.name)));
        }
        if m.inputs.iter().any(|i| i.delay.is_some()) {
            return Err(self.refuse("the delay of an input"));
        }
        Ok(())
    }

    fn name(&self, name: &str) -> String {
        if self.language == Language::Latex {
            return latex_name(name);
        }
        let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        if TAKEN.contains(&plain.as_str()) || Function::named(&plain).is_some() { plain + "_" } else { plain }
    }

    fn symbol(&self, symbol: Symbol) -> String {
        let m = self.model;
        match symbol {
            Symbol::State(i) => self.name(&m.states[i].name),
            Symbol::Input(i) => self.name(&m.inputs[i].name),
            Symbol::Parameter(i) => self.name(&m.parameters[i].name),
            Symbol::Let(i) => self.name(&m.lets[i].name),
            Symbol::Output(i) => self.name(&m.outputs[i].name),
            Symbol::Time => "t".to_owned(),
        }
    }

    /// An expression in the language, every operation in brackets.
    fn expression(&self, tree: &Tree) -> Result<String, Usage> {
        let latex = self.language == Language::Latex;
        let mut done: Vec<String> = Vec::with_capacity(tree.nodes.len());
        for node in &tree.nodes {
            let at = |i: &usize| done[*i].clone();
            done.push(match &node.kind {
                Kind::Number(v) => number(*v),
                Kind::Symbol(s) => self.symbol(*s),
                Kind::Negate(a) => format!("(-{})", at(a)),
                Kind::Add(a, b) => format!("({} + {})", at(a), at(b)),
                Kind::Subtract(a, b) => format!("({} - {})", at(a), at(b)),
                Kind::Multiply(a, b) if latex => format!("{} \\, {}", at(a), at(b)),
                Kind::Multiply(a, b) => format!("({} * {})", at(a), at(b)),
                Kind::Divide(a, b) if latex => format!("\\frac{{{}}}{{{}}}", at(a), at(b)),
                Kind::Divide(a, b) => format!("({} / {})", at(a), at(b)),
                Kind::Power(a, b) if latex => format!("{{{}}}^{{{}}}", at(a), at(b)),
                Kind::Power(a, b) => format!("pow({}, {})", at(a), at(b)),
                Kind::Call(f, list) => {
                    let list: Vec<String> = list.iter().map(at).collect();
                    let name =
                        if latex { format!("\\operatorname{{{}}}", f.name()) } else { called(*f).to_owned() };
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
                    let [l, r, a, b] = [left, right, then, otherwise].map(at);
                    if latex {
                        format!(
                            "\\begin{{cases}} {a} & {l} {sign} {r} \\\\ {b} & \\text{{else}} \\end{{cases}}"
                        )
                    } else {
                        format!("pick({l} {sign} {r}, {a}, {b})")
                    }
                }
                Kind::Table { table, at: x } if latex => {
                    format!("{}({})", latex_name(&self.model.tables[*table].name), at(x))
                }
                Kind::Table { .. } => return Err(self.refuse("a table")),
                Kind::Slope { .. } => return Err(self.refuse("the slope of an output")),
            });
        }
        Ok(done.pop().unwrap_or_default())
    }

    /// Lines that change a quantity in place by what was added to the model.
    fn changes(&self, target: Target, name: &str, lines: &mut Vec<String>) -> Result<(), Usage> {
        for change in self.model.additions.iter().flat_map(|a| &a.changes).filter(|c| c.target == target) {
            let value = self.expression(&change.value.tree)?;
            lines.push(match change.how {
                How::Add => format!("{name} = {name} + {value};"),
                How::Factor => format!("{name} = {name} * {value};"),
                How::Replace => format!("{name} = {value};"),
            });
        }
        Ok(())
    }

    /// Statements from states, inputs and parameters to rates `d_NAME` and outputs `o_NAME`, and the names they introduce.
    fn statements(&self) -> Result<(Vec<String>, Vec<String>), Usage> {
        let m = self.model;
        let (mut lines, mut names) = (Vec::new(), Vec::new());
        for (i, input) in m.inputs.iter().enumerate() {
            self.changes(Target::Input(i), &self.name(&input.name), &mut lines)?;
        }
        for (i, p) in m.parameters.iter().enumerate() {
            self.changes(Target::Parameter(i), &self.name(&p.name), &mut lines)?;
        }
        for l in &m.lets {
            let name = self.name(&l.name);
            lines.push(format!("{name} = {};", self.expression(&l.value.tree)?));
            names.push(name);
        }
        for (i, state) in m.states.iter().enumerate() {
            let name = format!("d_{}", self.name(&state.name));
            lines.push(format!("{name} = {};", self.expression(&state.rate.tree)?));
            self.changes(Target::Rate(i), &name, &mut lines)?;
            names.push(name);
        }
        for (i, output) in m.outputs.iter().enumerate() {
            let name = format!("o_{}", self.name(&output.name));
            lines.push(format!("{name} = {};", self.expression(&output.value.tree)?));
            self.changes(Target::Output(i), &name, &mut lines)?;
            names.push(name);
        }
        Ok((lines, names))
    }

    fn program(&self) -> Result<String, Usage> {
        let m = self.model;
        let (lines, names) = self.statements()?;
        let list = |of: Vec<String>| of.join(", ");
        let states: Vec<String> = m.states.iter().map(|s| self.name(&s.name)).collect();
        let inputs: Vec<String> = m.inputs.iter().map(|i| self.name(&i.name)).collect();
        let outputs: Vec<String> = m.outputs.iter().map(|o| format!("o_{}", self.name(&o.name))).collect();
        let (n, u, o) = (states.len(), inputs.len(), outputs.len());
        let usage = format!("usage: law {} time [time ...]", [&states[..], &inputs[..]].concat().join(" "));
        let values = m.parameters.iter().map(|p| (self.name(&p.name), number(p.nominal)));
        let rates: Vec<String> = states.iter().map(|s| format!("d_{s}")).collect();
        Ok(match self.language {
            Language::C => {
                let body: String = lines.iter().map(|l| format!("    {l}\n")).collect();
                let parameters: String =
                    values.map(|(name, v)| format!("    double {name} = {v};\n")).collect();
                let of = |list: &[String], from: &str| -> String {
                    list.iter().enumerate().map(|(i, s)| format!("    double {s} = {from}[{i}];\n")).collect()
                };
                let declared = names.iter().map(|n| format!("    double {n};\n")).collect::<String>();
                let unused: String = m
                    .parameters
                    .iter()
                    .map(|p| self.name(&p.name))
                    .chain(states.iter().chain(&inputs).cloned())
                    .chain(names.iter().cloned())
                    .map(|n| format!(" (void){n};"))
                    .collect();
                let written = |list: &[String], to: &str| -> String {
                    list.iter().enumerate().map(|(i, s)| format!("    {to}[{i}] = {s};\n")).collect()
                };
                format!(
                    "/* The law of {} as augsim wrote it. Build: cc -O2 FILE -lm. */\n#include <math.h>\n#include <stdio.h>\n\
                     #include <stdlib.h>\n\n{C_FUNCTIONS}\nenum {{ N = {n}, U = {u}, O = {o} }};\n\n\
                     static void law(double t, const double *state, const double *input, double *rate, double *out) {{\n    \
                     (void)t; (void)input;\n{parameters}{}{}{declared}{body}{}{}   {unused}\n}}\n\n{C_MAIN}",
                    m.name,
                    of(&states, "state"),
                    of(&inputs, "input"),
                    written(&rates, "rate"),
                    written(&outputs, "out"),
                )
                .replace("@USAGE@", &usage)
                .replace("@STEP@", &number(STEP_S))
            }
            _ => {
                let body: String =
                    lines.iter().map(|l| format!("    {}\n", l.trim_end_matches(';'))).collect();
                let parameters: String = values.map(|(name, v)| format!("    {name} = {v}\n")).collect();
                let unpack = |list: &[String], from: &str| -> String {
                    list.iter().enumerate().map(|(i, s)| format!("    {s} = {from}[{i}]\n")).collect()
                };
                format!(
                    "#!/usr/bin/env python3\n\"\"\"The law of {} as augsim wrote it.\"\"\"\nimport sys\nfrom math import *\n\n\
                     {PYTHON_FUNCTIONS}\nN, U = {n}, {u}\n\n\ndef law(t, state, given):\n    \"\"\"Rates and outputs.\"\"\"\n\
                     {parameters}{}{}{body}    return [{}], [{}]\n\n\n{PYTHON_MAIN}",
                    m.name,
                    unpack(&states, "state"),
                    unpack(&inputs, "given"),
                    list(rates.clone()),
                    list(outputs.clone()),
                )
                .replace("@USAGE@", &usage)
                .replace("@STEP@", &number(STEP_S))
            }
        })
    }

    fn latex(&self) -> Result<String, Usage> {
        let m = self.model;
        let mut body = String::from("\\begin{align*}\n");
        let mut line = |left: String, right: String| body += &format!("{left} &= {right} \\\\\n");
        for l in &m.lets {
            line(latex_name(&l.name), self.expression(&l.value.tree)?);
        }
        for (i, state) in m.states.iter().enumerate() {
            let right = self.changed(Target::Rate(i), self.expression(&state.rate.tree)?)?;
            line(format!("\\tfrac{{d}}{{dt}} {}", latex_name(&state.name)), right);
        }
        for (i, output) in m.outputs.iter().enumerate() {
            let right = self.changed(Target::Output(i), self.expression(&output.value.tree)?)?;
            line(latex_name(&output.name), right);
        }
        for (i, p) in m.parameters.iter().enumerate() {
            let right = self.changed(Target::Parameter(i), number(p.nominal))?;
            line(latex_name(&p.name), right);
        }
        body += "\\end{align*}\n";
        for event in &m.events {
            let when = self.expression(&event.when.tree)?;
            body +=
                &format!("\\noindent At ${when} = 0$ the state jumps (event \\verb|{}|).\n\n", event.name);
        }
        Ok(latex_document(&format!("The law of {}", m.name), &body))
    }

    /// A formula with what was added to it.
    fn changed(&self, target: Target, mut right: String) -> Result<String, Usage> {
        for change in self.model.additions.iter().flat_map(|a| &a.changes).filter(|c| c.target == target) {
            let value = self.expression(&change.value.tree)?;
            right = match change.how {
                How::Add => format!("{right} + {value}"),
                How::Factor => format!("\\left({right}\\right) \\, {value}"),
                How::Replace => value,
            };
        }
        Ok(right)
    }
}

/// Name of a function in both programs.
fn called(f: Function) -> &'static str {
    match f {
        Function::Ln => "log",
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

const C_FUNCTIONS: &str = "#define pick(condition, yes, no) ((condition) ? (yes) : (no))
#define sign_of(x) (((x) > 0.0) - ((x) < 0.0))
#define step_of(x) ((x) > 0.0 ? 1.0 : 0.0)
#define clamp_of(x, low, high) fmin(fmax(x, low), high)
#define relu_of(x) fmax(x, 0.0)
#define deadzone_of(x, w) ((x) > (w) ? (x) - (w) : (x) < -(w) ? (x) + (w) : 0.0)
#define cbrt_of(x) cbrt(x)
";

const PYTHON_FUNCTIONS: &str = "
def pick(condition, yes, no):
    return yes if condition else no


fmin, fmax = min, max


def sign_of(x):
    return (x > 0.0) - (x < 0.0)


def step_of(x):
    return 1.0 if x > 0.0 else 0.0


def clamp_of(x, low, high):
    return min(max(x, low), high)


def relu_of(x):
    return max(x, 0.0)


def deadzone_of(x, w):
    return x - w if x > w else x + w if x < -w else 0.0


def cbrt_of(x):
    return copysign(pow(fabs(x), 1.0 / 3.0), x)

";

const PYTHON_MAIN: &str = r#"def simulate(state, given, times):
    """Outputs at increasing times, s; inputs stay as given (Runge and Kutta's fourth-order step)."""
    y, t, out = list(state), 0.0, []
    for wanted in times:
        steps = max(1, int(ceil((wanted - t) / @STEP@)))
        h = (wanted - t) / steps
        for _ in range(steps if wanted > t else 0):
            k1 = law(t, y, given)[0]
            k2 = law(t + 0.5 * h, [a + 0.5 * h * b for a, b in zip(y, k1)], given)[0]
            k3 = law(t + 0.5 * h, [a + 0.5 * h * b for a, b in zip(y, k2)], given)[0]
            k4 = law(t + h, [a + h * b for a, b in zip(y, k3)], given)[0]
            y = [a + h / 6.0 * (b + 2.0 * c + 2.0 * d + e) for a, b, c, d, e in zip(y, k1, k2, k3, k4)]
            t += h
        t = wanted
        out.append(law(t, y, given)[1])
    return out


if __name__ == "__main__":
    numbers = [float(word) for word in sys.argv[1:]]
    if len(numbers) <= N + U:
        sys.exit("@USAGE@")
    for row in simulate(numbers[:N], numbers[N:N + U], numbers[N + U:]):
        print(" ".join("%.9g" % value for value in row))
"#;

const C_MAIN: &str = r#"int main(int argc, char **argv) {
    double y[N + 1], x[N + 1], k[4][N + 1], input[U + 1], out[O + 1], t = 0.0;
    if (argc < N + U + 2) { fprintf(stderr, "@USAGE@\n"); return 2; }
    for (int i = 0; i < N; i++) y[i] = atof(argv[1 + i]);
    for (int i = 0; i < U; i++) input[i] = atof(argv[1 + N + i]);
    for (int a = 1 + N + U; a < argc; a++) {
        double wanted = atof(argv[a]);
        long steps = (long)fmax(1.0, ceil((wanted - t) / @STEP@));
        double h = (wanted - t) / (double)steps;
        if (!(h > 0.0)) steps = 0;
        for (long s = 0; s < steps; s++) {
            law(t, y, input, k[0], out);
            for (int i = 0; i < N; i++) x[i] = y[i] + 0.5 * h * k[0][i];
            law(t + 0.5 * h, x, input, k[1], out);
            for (int i = 0; i < N; i++) x[i] = y[i] + 0.5 * h * k[1][i];
            law(t + 0.5 * h, x, input, k[2], out);
            for (int i = 0; i < N; i++) x[i] = y[i] + h * k[2][i];
            law(t + h, x, input, k[3], out);
            for (int i = 0; i < N; i++) y[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
            t += h;
        }
        t = wanted;
        law(t, y, input, k[0], out);
        for (int i = 0; i < O; i++) printf(i ? " %.9g" : "%.9g", out[i]);
        printf("\n");
    }
    return 0;
}
"#;
