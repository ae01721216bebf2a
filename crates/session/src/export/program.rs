//! Export of a system of equations as a Python or C program that runs without augsim.

use super::equations::{Use, Writer};
use super::routine::{Names, Statements, Syntax};
use super::templates;
use super::words::{comment, fill, literal, with_prefix};
use super::{Language, number};
use augsim_equations::listing::{Derivatives, Listing, Routine, Variable};
use augsim_equations::model::{Direction, Event, Hold, Integrator, State};
use augsim_equations::{Model, ModelError};

/// An equation model with all that is needed to write it as a program.
struct Program<'a> {
    model: &'a Model,
    language: Language,
    names: Names,
    listing: Listing,
}

/// Exports an equation model as a Python or C program.
///
/// # Errors
/// [`ModelError`]: the model cannot be compiled.
pub(super) fn program(model: &Model, language: Language) -> Result<String, ModelError> {
    let program = Program::new(model, language)?;
    let (header, values) = program.header_and_values();
    Ok(program.text(header, values))
}

/// An equation model as C code: a header and a source file that includes it.
pub(super) struct CFiles {
    pub header: String,
    pub source: String,
}

/// Exports an equation model as a source file in C and the header `NAME.h`, which it includes.
///
/// All names begin with `name`, which is an identifier, so that several models can be in one program.
///
/// # Errors
/// [`ModelError`]: the model cannot be compiled.
pub(super) fn c_files(model: &Model, name: &str) -> Result<CFiles, ModelError> {
    let program = Program::new(model, Language::C)?;
    let (header, values) = program.header_and_values();
    let source = program.text(format!("#include \"{name}.h\"\n"), values);
    Ok(CFiles { header: with_prefix(&header, name), source: with_prefix(&source, name) })
}

/// Whether a model has events or bounds of states, at which its states may jump.
pub(super) fn has_events(model: &Model) -> bool {
    !model.events.is_empty() || model.states.iter().any(|s| s.min.is_some() || s.max.is_some())
}

impl<'a> Program<'a> {
    fn new(model: &'a Model, language: Language) -> Result<Self, ModelError> {
        Ok(Program { model, language, names: Names::new(model), listing: Listing::new(model)? })
    }

    fn is_c(&self) -> bool {
        self.language == Language::C
    }

    /// Joins the elements of a list; in C each has a comma after it, as the template ends the array.
    fn list(&self, elements: impl Iterator<Item = String>) -> String {
        let list: Vec<String> = elements.collect();
        match (list.is_empty(), self.is_c()) {
            (true, _) => String::new(),
            (false, true) => list.join(", ") + ", ",
            (false, false) => list.join(", "),
        }
    }

    fn flag(&self, flag: bool) -> String {
        match (self.is_c(), flag) {
            (true, flag) => u8::from(flag).to_string(),
            (false, true) => "True".to_owned(),
            (false, false) => "False".to_owned(),
        }
    }

    fn strings<'n>(&self, names: impl Iterator<Item = &'n str>) -> String {
        self.list(names.map(|name| literal(name, self.language)))
    }

    /// Values for the marks of the templates, and the header of a C program.
    fn header_and_values(&self) -> (String, Vec<(&'static str, String)>) {
        let mut values = self.descriptions();
        values.extend(self.parameters());
        values.extend(self.settings());
        values.extend(self.equations());
        (fill(templates::C_HEADER, &values), values)
    }

    /// The whole program; one in C begins with its `header`.
    fn text(&self, header: String, mut values: Vec<(&'static str, String)>) -> String {
        let has_events = has_events(self.model);
        let events = match (self.is_c(), has_events) {
            (true, true) => fill(templates::C_EVENTS, &self.events()),
            (true, false) => templates::C_PLAIN_STEP.to_owned(),
            (false, true) => fill(templates::PYTHON_EVENTS, &self.events()),
            (false, false) => templates::PYTHON_PLAIN_STEP.to_owned(),
        };
        values.push(("EVENT_CODE", events));
        let begin = if has_events { "    law_begin_events(state, signal, p);\n" } else { "" };
        values.push(("BEGIN_EVENTS", begin.to_owned()));
        let (form, main) = match self.is_c() {
            true => (templates::C, templates::C_MAIN),
            false => (templates::PYTHON, templates::PYTHON_MAIN),
        };
        values.push(("HEADER", header));
        values.push(("MAIN", fill(main, &values)));
        fill(form, &values)
    }

    /// Template values for the program's title, its usage, and its lists of quantities in comments.
    fn descriptions(&self) -> Vec<(&'static str, String)> {
        let m = self.model;
        let states = m.states.iter().map(|s| comment(&s.name));
        let inputs = || m.inputs.iter().map(|i| comment(&i.name));
        let outputs = || m.outputs.iter().map(|o| comment(&o.name));
        let columns = |names: Vec<String>| names.iter().map(|n| format!(", {n}")).collect::<String>();
        let words = |names: Vec<String>| names.iter().map(|n| format!(" {n}")).collect::<String>();
        let of = |names: Vec<String>| {
            if names.is_empty() { String::new() } else { format!(": {}", names.join("; ")) }
        };
        let widths = self.listing.discontinuities.iter().map(|d| comment(&d.argument)).collect();
        vec![
            ("TITLE", comment(&m.name)),
            ("CROSSINGS_TEXT", if m.events.is_empty() { "" } else { templates::PYTHON_CROSSINGS }.to_owned()),
            (
                "USAGE",
                format!(
                    "law{} TIME [TIME ...]",
                    words(m.states.iter().map(|s| comment(&s.name)).chain(inputs()).collect())
                ),
            ),
            ("INPUT_COLUMNS", columns(inputs().collect())),
            ("OUTPUT_COLUMNS", columns(outputs().collect())),
            ("STATE_TEXTS", words(states.collect())),
            ("INPUT_TEXTS", words(inputs().collect())),
            ("OUTPUT_TEXTS", words(outputs().collect())),
            ("WIDTH_TEXTS", of(widths)),
        ]
    }

    /// Template values for the parameters, and for the widths of smoothed discontinuities.
    fn parameters(&self) -> Vec<(&'static str, String)> {
        let (l, is_c) = (&self.listing, self.is_c());
        let parameters = || self.names.parameters.iter().zip(&self.model.parameters);
        let fields = parameters().map(|(field, p)| {
            let unit = p.unit.map_or_else(String::new, |unit| format!(" {}", unit.symbol()));
            format!("    double {field}; /* {}{unit} */\n", comment(&p.name))
        });
        let set = parameters().map(|(field, p)| match is_c {
            true => format!("    p.{field} = {};\n", number(p.nominal)),
            false => format!("    {}: {},\n", literal(&p.name, self.language), number(p.nominal)),
        });
        let widths = l.discontinuities.iter().enumerate();
        let set_widths = widths.map(|(i, d)| match is_c {
            true => format!("    p.width[{i}] = {};\n", number(d.width)),
            false => String::new(),
        });
        let lookup = parameters().map(|(field, p)| {
            format!("    if (strcmp(name, {}) == 0) return &p->{field};\n", literal(&p.name, self.language))
        });
        vec![
            ("PARAMETER_FIELDS", fields.collect::<String>().trim_end_matches('\n').to_owned()),
            ("PARAMETER_VALUES", set.chain(set_widths).collect()),
            ("PARAMETER_LOOKUP", lookup.collect()),
            ("WIDTHS", self.list(l.discontinuities.iter().map(|d| number(d.width)))),
            ("DECLARED_WIDTHS", self.list(l.discontinuities.iter().map(|d| self.flag(d.is_declared)))),
        ]
    }

    /// Template values for sizes, names and numerical settings.
    fn settings(&self) -> Vec<(&'static str, String)> {
        let (m, l) = (self.model, &self.listing);
        let numerics = &m.numerics;
        let hold = |hold: Option<Hold>| match hold.unwrap_or(Hold::Linear) {
            Hold::Zero => "0".to_owned(),
            Hold::Linear => "1".to_owned(),
            Hold::Spline => "2".to_owned(),
        };
        let range = |o: &augsim_equations::model::Output| {
            let [low, high] = o.range.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
            let (low, high) = (self.bound(low), self.bound(high));
            if self.is_c() { format!("{{{low}, {high}}}") } else { format!("({low}, {high})") }
        };
        let has_delays = m.inputs.iter().any(|input| input.delay.is_some());
        let history = |with: &str, without: &str| (if has_delays { with } else { without }).to_owned();
        vec![
            ("N", m.states.len().to_string()),
            ("U", m.inputs.len().to_string()),
            ("O", m.outputs.len().to_string()),
            ("E", m.events.len().to_string()),
            ("C", l.conditions.results.len().to_string()),
            ("W", l.discontinuities.len().to_string()),
            ("STATE_NAMES", self.strings(m.states.iter().map(|s| s.name.as_str()))),
            ("INPUT_NAMES", self.strings(m.inputs.iter().map(|i| i.name.as_str()))),
            ("OUTPUT_NAMES", self.strings(m.outputs.iter().map(|o| o.name.as_str()))),
            ("SUBSTEPS", numerics.substeps.unwrap_or(0).to_string()),
            ("IMPLICIT", self.flag(numerics.integrator == Integrator::Implicit)),
            ("DECLARED_METHOD", self.flag(numerics.integrator != Integrator::Automatic)),
            ("HOLD_KINDS", self.list(m.inputs.iter().map(|i| hold(i.hold)))),
            ("NOISE", self.list(m.outputs.iter().map(|o| number(o.sd.unwrap_or(0.0))))),
            ("RANGES", self.list(m.outputs.iter().map(range))),
            ("DELAYS", self.delays()),
            ("DELAY_CODE", history(templates::C_DELAYED, templates::C_UNDELAYED)),
            ("HISTORY_LENGTH", history(templates::C_HISTORY_LENGTH, "")),
            ("HISTORY_FIELDS", history(templates::C_HISTORY_FIELDS, "")),
            ("GUESSES", self.guesses()),
            ("GUESSES_OF_EFFECTS", self.guesses_of_effects()),
            ("TABLES", self.tables()),
        ]
    }

    /// Writes a bound, which may be infinite, in the language of the program.
    fn bound(&self, value: f64) -> String {
        let infinity = if self.is_c() { "INFINITY" } else { "math.inf" };
        match value {
            v if v == f64::INFINITY => infinity.to_owned(),
            v if v == f64::NEG_INFINITY => format!("-{infinity}"),
            v => number(v),
        }
    }

    fn delays(&self) -> String {
        let delay = |i: &augsim_equations::model::Input| {
            i.delay.map(|p| match self.is_c() {
                true => format!("p->{}", self.names.parameters[p]),
                false => format!("p[{}]", literal(&self.model.parameters[p].name, self.language)),
            })
        };
        let delays = self.model.inputs.iter().map(delay);
        if !self.is_c() {
            return self.list(delays.map(|delay| delay.unwrap_or_else(|| "0.0".to_owned())));
        }
        let cases = delays.enumerate().filter_map(|(i, delay)| Some((i, delay?)));
        cases.map(|(i, delay)| format!("    case {i}: return {delay};\n")).collect()
    }

    /// Writer of the expressions of initial states.
    fn writer_of_starts(&self) -> Writer<'_> {
        Writer { model: self.model, language: self.language, names: Some(&self.names), purpose: Use::Start }
    }

    /// Writes statements that compute the initial states.
    fn guesses(&self) -> String {
        let writer = self.writer_of_starts();
        let (declared, of_effects) = self.model.states.split_at(self.model.declared_states());
        let start = |s: &State| writer.expression(&s.start.tree);
        if self.is_c() {
            let lines = declared.iter().enumerate();
            return lines.map(|(i, s)| format!("    x[{i}] = finite_or_zero({});\n", start(s))).collect();
        }
        let first: Vec<String> = declared.iter().map(start).collect();
        let mut text = format!(
            "    x = [start.get(name, finite(value)) for name, value in zip(STATES, [{}])]\n",
            first.join(", ")
        );
        for (i, s) in (declared.len()..).zip(of_effects) {
            text += &format!("    x.append(start.get(STATES[{i}], finite({})))\n", start(s));
        }
        text
    }

    /// Writes statements in C that compute the initial states of effects from those of the declared states.
    fn guesses_of_effects(&self) -> String {
        let writer = self.writer_of_starts();
        let declared = self.model.declared_states();
        let of_effects = self.model.states.iter().enumerate().skip(declared);
        let line = |(i, s): (usize, &State)| {
            format!("    if (isnan(x[{i}])) x[{i}] = finite_or_zero({});\n", writer.expression(&s.start.tree))
        };
        of_effects.map(line).collect()
    }

    /// Writes the knots and values of the model's tables, and the functions that interpolate them.
    fn tables(&self) -> String {
        let list = |values: &[f64]| values.iter().map(|v| number(*v)).collect::<Vec<_>>().join(", ");
        let mut text = String::new();
        for (i, table) in self.model.tables.iter().enumerate() {
            text += &match self.is_c() {
                true => format!(
                    "static const double law_knots_{i}[] = {{{}}}, law_values_{i}[] = {{{}}};\n",
                    list(&table.at),
                    list(&table.values)
                ),
                false => {
                    format!("KNOTS_{i}, VALUES_{i} = [{}], [{}]\n", list(&table.at), list(&table.values))
                }
            };
        }
        match (text.is_empty(), self.is_c()) {
            (true, _) => String::new(),
            (false, true) => templates::C_TABLES.to_owned() + &text,
            (false, false) => format!("{}{text}", templates::PYTHON_TABLES),
        }
    }

    fn statements(&self, routine: &Routine, depth: usize, arguments: &[&str]) -> Statements {
        let syntax = Syntax { model: self.model, language: self.language, names: &self.names };
        syntax.statements(routine, depth, arguments)
    }

    /// Writes a function body that computes all results: `to[0] = ...` in C, `return [...]` in Python.
    fn body(&self, routine: &Routine, to: &str, depth: usize, arguments: &[&str]) -> String {
        let Statements { mut text, results } = self.statements(routine, depth, arguments);
        let indent = "    ".repeat(depth);
        match self.is_c() {
            true => {
                let line = |(i, result): (usize, &String)| format!("{indent}{to}[{i}] = {result};\n");
                text += &results.iter().enumerate().map(line).collect::<String>();
                if results.is_empty() { format!("{indent}(void){to};\n{text}") } else { text }
            }
            false => text + &format!("{indent}return stacked([{}], x)\n", results.join(", ")),
        }
    }

    /// Writes statements that assign derivatives of `rows`; `place` names the target of each.
    fn derivatives(
        &self,
        derivatives: &Derivatives,
        depth: usize,
        arguments: &[&str],
        place: impl Fn(usize, Variable) -> String,
    ) -> String {
        let Statements { mut text, results } = self.statements(&derivatives.routine, depth, arguments);
        let (indent, end) = ("    ".repeat(depth), if self.is_c() { ";" } else { "" });
        for ((row, variable), result) in derivatives.entries.iter().zip(results) {
            text += &format!("{indent}{} = {result}{end}\n", place(*row, *variable));
        }
        text
    }

    fn equations(&self) -> Vec<(&'static str, String)> {
        let (l, n) = (&self.listing, self.model.states.len());
        let arguments = ["t", "x", "u", "p"];
        let element = |row: usize, variable: Variable| {
            let column = match variable {
                Variable::State(i) => i,
                Variable::Time => n,
            };
            if self.is_c() {
                format!("jacobian[{}]", row * n + column)
            } else {
                format!("j[{row}][{column}]")
            }
        };
        let arguments_body = self.body(&l.discontinuity_arguments, "z", 1, &arguments);
        let arguments_function = match self.is_c() {
            true => format!(
                "\n/* Arguments of the smoothed discontinuities. */\nstatic void law_arguments(double t, const double *x, \
                 const double *u, const law_parameters *p, double *z) {{\n{arguments_body}}}\n"
            ),
            false => String::new(),
        };
        let mut values = vec![
            ("RATES", self.body(&l.rates, "rate", 1, &arguments)),
            ("JACOBIAN", self.derivatives(&l.jacobian, 1, &arguments, element)),
            ("OUTPUTS", self.body(&l.outputs, "y", 1, &["t", "x", "u", "du", "p"])),
            ("ARGUMENTS", arguments_body),
        ];
        values.push(("ARGUMENTS_FUNCTION", arguments_function));
        values
    }

    /// Template values for the tables and functions of the events and state bounds.
    fn events(&self) -> Vec<(&'static str, String)> {
        let (m, l, is_c) = (self.model, &self.listing, self.is_c());
        let states = |chosen: &dyn Fn(&Event) -> Vec<usize>| {
            self.list(m.events.iter().map(|event| {
                let chosen = chosen(event);
                match is_c {
                    true => {
                        let flags = (0..m.states.len()).map(|i| u8::from(chosen.contains(&i)).to_string());
                        format!("{{{}0}}", flags.map(|f| f + ", ").collect::<String>())
                    }
                    false => {
                        format!("[{}]", chosen.iter().map(usize::to_string).collect::<Vec<_>>().join(", "))
                    }
                }
            }))
        };
        let none = if is_c { "-1" } else { "None" };
        let rest_end = |end: &Option<usize>| end.map_or(none.to_owned(), |index| index.to_string());
        let below = |e: &Event| number(e.rest.as_ref().map_or(0.0, |rest| rest.below));
        let lower = m.states.iter().map(|s| self.bound(s.min.unwrap_or(f64::NEG_INFINITY)));
        let upper = m.states.iter().map(|s| self.bound(s.max.unwrap_or(f64::INFINITY)));
        vec![
            ("E", m.events.len().to_string()),
            ("DIRECTIONS", self.list(m.events.iter().map(|e| direction(e).to_owned()))),
            ("SETS", states(&|e| e.set.iter().map(|(state, _)| *state).collect())),
            ("HOLDS", states(&|e| e.rest.as_ref().map_or(Vec::new(), |rest| rest.hold.clone()))),
            ("BELOW", self.list(m.events.iter().map(below))),
            ("REST_ENDS", self.list(l.rest_ends.iter().map(rest_end))),
            ("LOWER", self.list(lower)),
            ("UPPER", self.list(upper)),
            ("CONDITIONS", self.body(&l.conditions, "condition", 1, &["t", "x", "u", "p"])),
            ("CONDITION_SLOPES", self.condition_slopes()),
            ("RESETS", self.resets()),
        ]
    }

    fn condition_slopes(&self) -> String {
        let n = self.model.states.len();
        let place = |_row: usize, variable: Variable| match variable {
            Variable::State(i) => format!("slope[{i}]"),
            Variable::Time => format!("slope[{n}]"),
        };
        let all = ["t", "x", "u", "du", "p"];
        let branch = |d: &Derivatives| self.derivatives(d, 2, &all, place);
        self.branches(self.listing.condition_derivatives.iter().map(branch), &all)
    }

    fn resets(&self) -> String {
        let all = ["t", "x", "u", "p"];
        let text =
            self.branches(self.listing.resets.iter().map(|reset| self.body(reset, "next", 2, &all)), &all);
        if self.is_c() { format!("    (void)next;\n{text}") } else { text + "    return list(x)\n" }
    }

    /// Writes one branch, `if event == i`, for each event; `bodies` are the statements in the branches.
    fn branches(&self, bodies: impl Iterator<Item = String>, arguments: &[&str]) -> String {
        if self.is_c() {
            let casts: String = arguments.iter().map(|name| format!("(void){name}; ")).collect();
            let branch = |(i, body): (usize, String)| format!("    if (event == {i}) {{\n{body}    }}\n");
            let branches: String = bodies.enumerate().map(branch).collect();
            return format!("    {casts}(void)event;\n{branches}");
        }
        let branch = |(i, body): (usize, String)| {
            let body = if body.is_empty() { "        pass\n".to_owned() } else { body };
            format!("    if event == {i}:\n{body}")
        };
        bodies.enumerate().map(branch).collect()
    }
}

/// Name of the direction in which an event's condition crosses zero, as the programs write it.
fn direction(event: &Event) -> &'static str {
    match event.direction {
        Direction::Rising => "1",
        Direction::Falling => "-1",
        Direction::Both => "0",
    }
}
