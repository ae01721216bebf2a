//! A system of equations as a program that runs without augsim.

use super::equations::{Jump, Writer};
use super::{Language, number};
use crate::Usage;
use augsim_written::model::{Direction, Event, How, Target};
use augsim_written::text::Tree;

const PYTHON: &str = include_str!("system.py.txt");
const PYTHON_SUDDEN: &str = include_str!("sudden.py.txt");
const C: &str = include_str!("system.c.txt");
const C_SUDDEN: &str = include_str!("sudden.c.txt");

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

/// Seconds of a step of the programs.
const STEP_S: f64 = 2e-4;

/// A statement of a program.
enum Statement {
    /// A new variable: name, value.
    New(String, String),
    /// A new value of one that is there.
    Again(String, String),
}

use Statement::{Again, New};

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
        let walls = m.states.iter().any(|s| s.min.is_some() || s.max.is_some());
        let is_sudden = walls || !m.events.is_empty();
        let (form, sudden, begin, advance) = match (self.is_c(), is_sudden) {
            (false, false) => (PYTHON, "", "", "advance(t, y, h, given)"),
            (false, true) => (PYTHON, PYTHON_SUDDEN, PYTHON_BEGIN, "sudden.step(t, y, h)"),
            (true, false) => (C, "", "", "advance(t, y, h, given, NULL, end)"),
            (true, true) => (C, C_SUDDEN, "    begin(y, given);\n", "step(t, y, h, given, end)"),
        };
        let mut text = form.to_owned();
        for (mark, value) in [
            ("@SUDDEN@\n", sudden),
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
        if is_sudden { self.with_sudden(text) } else { Ok(text) }
    }

    /// Knots and values of the tables, and what reads them.
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

    /// Appends the statements that change a quantity in place by what was added to the model.
    fn changes(&self, target: Target, name: &str, jump: Jump, to: &mut Vec<Statement>) -> Result<(), Usage> {
        for change in self.model.additions.iter().flat_map(|a| &a.changes).filter(|c| c.target == target) {
            let value = self.expression(&change.value.tree, jump)?;
            let value = match change.how {
                How::Add => format!("{name} + {value}"),
                How::Factor => format!("{name} * {value}"),
                How::Replace => value,
            };
            to.push(Again(name.to_owned(), value));
        }
        Ok(())
    }

    /// Names of parameters, states, inputs and intermediate values.
    fn names(&self, jump: Jump) -> Result<Vec<Statement>, Usage> {
        let m = self.model;
        let mut list = Vec::new();
        list.extend(m.parameters.iter().map(|p| New(self.name(&p.name), number(p.nominal))));
        list.extend(m.states.iter().enumerate().map(|(i, s)| New(self.name(&s.name), format!("state[{i}]"))));
        list.extend(m.inputs.iter().enumerate().map(|(i, u)| New(self.name(&u.name), format!("given[{i}]"))));
        for (i, input) in m.inputs.iter().enumerate() {
            self.changes(Target::Input(i), &self.name(&input.name), jump, &mut list)?;
        }
        for (i, p) in m.parameters.iter().enumerate() {
            self.changes(Target::Parameter(i), &self.name(&p.name), jump, &mut list)?;
        }
        for l in &m.lets {
            list.push(New(self.name(&l.name), self.expression(&l.value.tree, jump)?));
        }
        Ok(list)
    }

    /// Statements in the language; those that no line uses count as used in C.
    fn lines(&self, list: &[Statement]) -> String {
        let mut text = String::new();
        let mut used = String::new();
        for statement in list {
            text += &match (statement, self.is_c()) {
                (New(name, value), true) => {
                    used += &format!(" (void){name};");
                    format!("    double {name} = {value};\n")
                }
                (Again(name, value), true) => format!("    {name} = {value};\n"),
                (New(name, value) | Again(name, value), false) => format!("    {name} = {value}\n"),
            };
        }
        if self.is_c() { format!("{text}    (void)t; (void)state; (void)given;{used}\n") } else { text }
    }

    /// The lines that hand out values: `to[0] = …` in C, `return […]` in Python.
    fn handed_out(&self, values: &[String], to: &str) -> String {
        match self.is_c() {
            true => values.iter().enumerate().map(|(i, v)| format!("    {to}[{i}] = {v};\n")).collect(),
            false => format!("    return [{}]\n", values.join(", ")),
        }
    }

    fn rates(&self) -> Result<String, Usage> {
        let mut list = self.names(Jump::Smooth)?;
        let mut handed = Vec::new();
        for (i, state) in self.model.states.iter().enumerate() {
            let name = format!("d_{}", self.name(&state.name));
            list.push(New(name.clone(), self.expression(&state.rate.tree, Jump::Smooth)?));
            self.changes(Target::Rate(i), &name, Jump::Smooth, &mut list)?;
            handed.push(name);
        }
        Ok(self.lines(&list) + &self.handed_out(&handed, "rate"))
    }

    fn outputs(&self) -> Result<String, Usage> {
        let mut list = self.names(Jump::Sharp)?;
        let mut handed = Vec::new();
        for (i, output) in self.model.outputs.iter().enumerate() {
            let name = self.output(i);
            list.push(New(name.clone(), self.expression(&output.value.tree, Jump::Sharp)?));
            self.changes(Target::Output(i), &name, Jump::Sharp, &mut list)?;
            handed.push(name);
        }
        Ok(self.lines(&list) + &self.handed_out(&handed, "out"))
    }

    /// The program with its events and walls.
    fn with_sudden(&self, mut text: String) -> Result<String, Usage> {
        let m = self.model;
        let names = self.lines(&self.names(Jump::Sharp)?);
        let all = |of: &dyn Fn(&Event) -> String| m.events.iter().map(of).collect::<String>();
        let list = |of: &[usize]| of.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
        let sets = |e: &Event| e.set.iter().map(|(state, _)| *state).collect::<Vec<_>>();
        let holds = |e: &Event| e.rest.as_ref().map_or(Vec::new(), |r| r.hold.clone());
        let below = |e: &Event| number(e.rest.as_ref().map_or(0.0, |r| r.below));
        let flags = |of: Vec<usize>| {
            let each = (0..m.states.len()).map(|i| if of.contains(&i) { "1" } else { "0" });
            format!("{{{}}}, ", each.collect::<Vec<_>>().join(", "))
        };
        let infinity = if self.is_c() { "INFINITY" } else { "inf" };
        let least = |bound: Option<f64>| bound.map_or(format!("-{infinity}"), number);
        let largest = |bound: Option<f64>| bound.map_or(infinity.to_owned(), number);
        let events = all(&|e: &Event| {
            format!("({}, [{}], [{}], {}), ", direction(e), list(&sets(e)), list(&holds(e)), below(e))
        });
        let walls: Vec<String> =
            m.states.iter().map(|s| format!("({}, {})", least(s.min), largest(s.max))).collect();
        let bounds =
            |of: &dyn Fn(usize) -> String| (0..m.states.len()).map(|i| of(i) + ", ").collect::<String>();
        for (mark, value) in [
            ("@EVENTS@", events.trim_end_matches(", ").to_owned()),
            ("@WALLS@", walls.join(", ")),
            ("@DIRECTIONS@", all(&|e: &Event| format!("{}, ", direction(e)))),
            ("@SETS@", all(&|e: &Event| flags(sets(e)))),
            ("@HOLDS@", all(&|e: &Event| flags(holds(e)))),
            ("@BELOW@", all(&|e: &Event| below(e) + ", ")),
            ("@LEAST@", bounds(&|i| least(m.states[i].min))),
            ("@LARGEST@", bounds(&|i| largest(m.states[i].max))),
            ("@CONDITIONS@\n", names.clone() + &self.conditions()?),
            ("@RESETS@\n", names + &self.resets()?),
        ] {
            text = text.replace(mark, &value);
        }
        Ok(text)
    }

    /// The lines that hand out each event's condition and whether the rest after it ends.
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
                self.handed_out(&when, "when") + &self.handed_out(&ends, "ends") + unused
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

/// The sense in which the condition of an event passes 0, as the programs write it.
fn direction(event: &Event) -> &'static str {
    match event.direction {
        Direction::Rising => "1",
        Direction::Falling => "-1",
        Direction::Both => "0",
    }
}
