//! Export of a system of equations as a Python or C program that runs without augsim.

use super::equations::{Jump, Writer};
use super::{Language, number};
use crate::Usage;
use augsim_equations::model::{Direction, Event, How, Target};
use augsim_equations::text::Tree;

const PYTHON: &str = include_str!("system.py.txt");
const PYTHON_EVENTS: &str = include_str!("sudden.py.txt");
const C: &str = include_str!("system.c.txt");
const C_EVENTS: &str = include_str!("sudden.c.txt");

const PYTHON_INTERPOLATE: &str = "

def interpolate(x, knots, values):
    for k in range(1, len(knots)):
        if x < knots[k]:
            share = max(x - knots[k - 1], 0.0) / (knots[k] - knots[k - 1])
            return values[k - 1] + (values[k] - values[k - 1]) * share
    return values[-1]
";

const C_INTERPOLATE: &str = "
static double interpolate(double x, int n, const double *knots, const double *values) {
    for (int k = 1; k < n; k++)
        if (x < knots[k])
            return values[k - 1] + (values[k] - values[k - 1]) * fmax(x - knots[k - 1], 0.0) / (knots[k] - knots[k - 1]);
    return values[n - 1];
}
";

/// Integration step of the programs, s.
const STEP_S: f64 = 2e-4;

/// A statement of a program: name and value.
enum Statement {
    /// Declares a variable.
    Declare(String, String),
    /// Assigns to a declared variable.
    Assign(String, String),
}

use Statement::{Assign, Declare};

impl Writer<'_> {
    fn is_c(&self) -> bool {
        self.language == Language::C
    }

    /// The whole program.
    pub fn program(&self) -> Result<String, Usage> {
        let m = self.model;
        let names: Vec<String> = (m.states.iter().map(|s| self.name(&s.name)))
            .chain(m.inputs.iter().map(|i| self.name(&i.name)))
            .collect();
        let usage = format!("usage: law {} time [time ...]", names.join(" "));
        let has_bounds = m.states.iter().any(|s| s.min.is_some() || s.max.is_some());
        let has_events = has_bounds || !m.events.is_empty();
        let (form, event_code, begin, advance) = match (self.is_c(), has_events) {
            (false, false) => (PYTHON, "", "", "advance(t, y, h, given)"),
            (false, true) => (PYTHON, PYTHON_EVENTS, PYTHON_BEGIN, "sudden.step(t, y, h)"),
            (true, false) => (C, "", "", "advance(t, y, h, given, NULL, end)"),
            (true, true) => (C, C_EVENTS, "    begin(y, given);\n", "step(t, y, h, given, end)"),
        };
        let mut text = form.to_owned();
        for (mark, value) in [
            ("@SUDDEN@\n", event_code),
            ("@BEGIN@", begin),
            ("@ADVANCE@", advance),
            ("@TITLE@", &m.name),
            ("@USAGE@", &usage),
            ("@STEP@", &number(STEP_S)),
            ("@N@", &m.states.len().to_string()),
            ("@U@", &m.inputs.len().to_string()),
            ("@O@", &m.outputs.len().to_string()),
            ("@E@", &m.events.len().to_string()),
            ("@INTERPOLATE@\n", &self.tables()),
            ("@RATES@\n", &self.rates()?),
            ("@OUTPUTS@\n", &self.outputs()?),
        ] {
            text = text.replace(mark, value);
        }
        if has_events { self.with_events(text) } else { Ok(text) }
    }

    /// Knots and values of the tables, and the function that interpolates them.
    fn tables(&self) -> String {
        let tables = &self.model.tables;
        let list = |values: &[f64]| values.iter().map(|v| number(*v)).collect::<Vec<_>>().join(", ");
        let mut text = String::new();
        for (i, table) in tables.iter().enumerate() {
            for (what, values) in [("KNOTS", &table.at), ("VALUES", &table.values)] {
                text += &match self.is_c() {
                    true => format!("static const double {what}_{i}[] = {{{}}};\n", list(values)),
                    false => format!("{what}_{i} = [{}]\n", list(values)),
                };
            }
        }
        match (tables.is_empty(), self.is_c()) {
            (true, true) => String::new(),
            (true, false) => "\n".to_owned(),
            (false, true) => C_INTERPOLATE.to_owned() + &text,
            (false, false) => format!("{PYTHON_INTERPOLATE}\n\n{text}\n"),
        }
    }

    /// Appends the statements by which the added effects change a quantity.
    fn changes(&self, target: Target, name: &str, jump: Jump, to: &mut Vec<Statement>) -> Result<(), Usage> {
        for change in self.model.additions.iter().flat_map(|a| &a.changes).filter(|c| c.target == target) {
            let value = self.expression(&change.value.tree, jump)?;
            let value = match change.how {
                How::Add => format!("{name} + {value}"),
                How::Factor => format!("{name} * {value}"),
                How::Replace => value,
            };
            to.push(Assign(name.to_owned(), value));
        }
        Ok(())
    }

    /// Declarations of parameters, states, inputs and intermediate values.
    fn names(&self, jump: Jump) -> Result<Vec<Statement>, Usage> {
        let m = self.model;
        let mut list = Vec::new();
        list.extend(m.parameters.iter().map(|p| Declare(self.name(&p.name), number(p.nominal))));
        list.extend(
            m.states.iter().enumerate().map(|(i, s)| Declare(self.name(&s.name), format!("state[{i}]"))),
        );
        list.extend(
            m.inputs.iter().enumerate().map(|(i, u)| Declare(self.name(&u.name), format!("given[{i}]"))),
        );
        for (i, input) in m.inputs.iter().enumerate() {
            self.changes(Target::Input(i), &self.name(&input.name), jump, &mut list)?;
        }
        for (i, p) in m.parameters.iter().enumerate() {
            self.changes(Target::Parameter(i), &self.name(&p.name), jump, &mut list)?;
        }
        for l in &m.lets {
            list.push(Declare(self.name(&l.name), self.expression(&l.value.tree, jump)?));
        }
        Ok(list)
    }

    /// Writes statements in the language.
    ///
    /// In C every variable is cast to void, so that unused ones give no warning.
    fn lines(&self, list: &[Statement]) -> String {
        let mut text = String::new();
        let mut used = String::new();
        for statement in list {
            text += &match (statement, self.is_c()) {
                (Declare(name, value), true) => {
                    used += &format!(" (void){name};");
                    format!("    double {name} = {value};\n")
                }
                (Assign(name, value), true) => format!("    {name} = {value};\n"),
                (Declare(name, value) | Assign(name, value), false) => format!("    {name} = {value}\n"),
            };
        }
        if self.is_c() { format!("{text}    (void)t; (void)state; (void)given;{used}\n") } else { text }
    }

    /// The lines that return values: `to[0] = …` in C, `return […]` in Python.
    fn return_values(&self, values: &[String], to: &str) -> String {
        match self.is_c() {
            true => values.iter().enumerate().map(|(i, v)| format!("    {to}[{i}] = {v};\n")).collect(),
            false => format!("    return [{}]\n", values.join(", ")),
        }
    }

    fn rates(&self) -> Result<String, Usage> {
        let mut list = self.names(Jump::Smooth)?;
        let mut results = Vec::new();
        for (i, state) in self.model.states.iter().enumerate() {
            let name = format!("d_{}", self.name(&state.name));
            list.push(Declare(name.clone(), self.expression(&state.rate.tree, Jump::Smooth)?));
            self.changes(Target::Rate(i), &name, Jump::Smooth, &mut list)?;
            results.push(name);
        }
        Ok(self.lines(&list) + &self.return_values(&results, "rate"))
    }

    fn outputs(&self) -> Result<String, Usage> {
        let mut list = self.names(Jump::Sharp)?;
        let mut results = Vec::new();
        for (i, output) in self.model.outputs.iter().enumerate() {
            let name = self.output(i);
            list.push(Declare(name.clone(), self.expression(&output.value.tree, Jump::Sharp)?));
            self.changes(Target::Output(i), &name, Jump::Sharp, &mut list)?;
            results.push(name);
        }
        Ok(self.lines(&list) + &self.return_values(&results, "out"))
    }

    /// Fills in the events and state bounds.
    fn with_events(&self, mut text: String) -> Result<String, Usage> {
        let m = self.model;
        let names = self.lines(&self.names(Jump::Sharp)?);
        let join_events = |text: &dyn Fn(&Event) -> String| m.events.iter().map(text).collect::<String>();
        let list = |states: &[usize]| states.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
        let sets = |e: &Event| e.set.iter().map(|(state, _)| *state).collect::<Vec<_>>();
        let holds = |e: &Event| e.rest.as_ref().map_or(Vec::new(), |r| r.hold.clone());
        let below = |e: &Event| number(e.rest.as_ref().map_or(0.0, |r| r.below));
        let flags = |states: Vec<usize>| {
            let flags = (0..m.states.len()).map(|i| if states.contains(&i) { "1" } else { "0" });
            format!("{{{}}}, ", flags.collect::<Vec<_>>().join(", "))
        };
        let infinity = if self.is_c() { "INFINITY" } else { "inf" };
        let lower = |bound: Option<f64>| bound.map_or(format!("-{infinity}"), number);
        let upper = |bound: Option<f64>| bound.map_or(infinity.to_owned(), number);
        let events = join_events(&|e: &Event| {
            format!("({}, [{}], [{}], {}), ", direction(e), list(&sets(e)), list(&holds(e)), below(e))
        });
        let state_bounds: Vec<String> =
            m.states.iter().map(|s| format!("({}, {})", lower(s.min), upper(s.max))).collect();
        let bounds =
            |text: &dyn Fn(usize) -> String| (0..m.states.len()).map(|i| text(i) + ", ").collect::<String>();
        for (mark, value) in [
            ("@EVENTS@", events.trim_end_matches(", ").to_owned()),
            ("@WALLS@", state_bounds.join(", ")),
            ("@DIRECTIONS@", join_events(&|e: &Event| format!("{}, ", direction(e)))),
            ("@SETS@", join_events(&|e: &Event| flags(sets(e)))),
            ("@HOLDS@", join_events(&|e: &Event| flags(holds(e)))),
            ("@BELOW@", join_events(&|e: &Event| below(e) + ", ")),
            ("@LEAST@", bounds(&|i| lower(m.states[i].min))),
            ("@LARGEST@", bounds(&|i| upper(m.states[i].max))),
            ("@CONDITIONS@\n", names.clone() + &self.conditions()?),
            ("@RESETS@\n", names + &self.resets()?),
        ] {
            text = text.replace(mark, &value);
        }
        Ok(text)
    }

    /// The lines that return each event's condition and whether the rest state after it ends.
    fn conditions(&self) -> Result<String, Usage> {
        let (mut when, mut ends) = (Vec::new(), Vec::new());
        for event in &self.model.events {
            when.push(self.expression(&event.when.tree, Jump::Sharp)?);
            let until = event.rest.as_ref().and_then(|rest| rest.until.as_ref());
            let holds = |tree: &Tree| Ok(format!("({}) > 0.0", self.expression(tree, Jump::Sharp)?));
            let never = if self.is_c() { "0" } else { "False" };
            ends.push(until.map_or(Ok(never.to_owned()), |until| holds(&until.tree))?);
        }
        Ok(match self.is_c() {
            true => {
                let unused = if when.is_empty() { "    (void)when; (void)ends;\n" } else { "" };
                self.return_values(&when, "when") + &self.return_values(&ends, "ends") + unused
            }
            false => format!("    return [{}], [{}]\n", when.join(", "), ends.join(", ")),
        })
    }

    /// The lines that set states at each event.
    fn resets(&self) -> Result<String, Usage> {
        let (m, is_c) = (self.model, self.is_c());
        let mut text = match is_c {
            true => {
                "    for (int i = 0; i < N; i++) next_state[i] = state[i];\n    (void)event;\n".to_owned()
            }
            false => "    next_state = list(state)\n".to_owned(),
        };
        for (number, event) in m.events.iter().enumerate() {
            text += &if is_c {
                format!("    if (event == {number}) {{\n")
            } else {
                format!("    if event == {number}:\n")
            };
            if event.set.is_empty() && !is_c {
                text += "        pass\n";
            }
            for (state, value) in &event.set {
                let value = self.expression(&value.tree, Jump::Sharp)?;
                text += &format!("        next_state[{state}] = {value}{}\n", if is_c { ";" } else { "" });
            }
            text += if is_c { "    }\n" } else { "" };
        }
        Ok(if is_c { text } else { text + "    return next_state\n" })
    }
}

const PYTHON_BEGIN: &str = "    y = [min(max(value, low), high) for value, (low, high) in zip(y, WALLS)]
    sudden = Sudden(y, given)
";

/// Direction of the zero crossing of an event, as the programs write it.
fn direction(event: &Event) -> &'static str {
    match event.direction {
        Direction::Rising => "1",
        Direction::Falling => "-1",
        Direction::Both => "0",
    }
}
