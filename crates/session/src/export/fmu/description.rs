//! The description of a Functional Mock-up Unit: `modelDescription.xml` of FMI 2.0.

use super::xml::Element;
use crate::export::number;
use augsim_data::Unit;
use augsim_equations::Model;
use augsim_equations::listing::Listing;
use augsim_equations::model::{Hold, Integrator};
use std::collections::{BTreeMap, BTreeSet};

/// A unit that is described: the model, and what its source code was made with.
pub(super) struct Described<'a> {
    pub model: &'a Model,
    pub listing: &'a Listing,
    /// Identifier of the unit, which is also the name of its library.
    pub name: &'a str,
    /// Number of event indicators.
    pub indicators: usize,
    /// Whether the states may jump at events.
    pub jumps: bool,
    /// Initial value of each state, in its unit.
    pub start: &'a [f64],
}

/// Role of a variable, from which several of its attributes follow.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    State,
    /// Rate of the state with this index, from 0.
    Rate(usize),
    /// An input, and whether it keeps its value until the next sample.
    Input(bool),
    Output,
    Parameter,
}

/// A variable of the description, of type Real.
struct Variable {
    name: String,
    description: String,
    role: Role,
    unit: Option<Unit>,
    start: Option<f64>,
    bounds: [f64; 2],
}

impl Described<'_> {
    /// Writes the description with a GUID, which the library has as well.
    pub fn document(&self, guid: &str) -> String {
        let variables = self.variables();
        let real = variables.iter().enumerate().map(|(reference, v)| self.scalar(reference, v));
        let variables_element = Element::new("ModelVariables").containing(real).containing(self.settings());
        Element::new("fmiModelDescription")
            .with("fmiVersion", "2.0")
            .with("modelName", &self.model.name)
            .with("guid", guid)
            .with("generationTool", concat!("augsim ", env!("CARGO_PKG_VERSION")))
            .with("variableNamingConvention", "flat")
            .with("numberOfEventIndicators", self.indicators)
            .containing([self.kind("ModelExchange"), self.kind("CoSimulation")])
            .containing(units(&variables))
            .containing([Element::new("LogCategories").containing(
                ["logStatusWarning", "logStatusError"]
                    .map(|name| Element::new("Category").with("name", name)),
            )])
            .containing([Element::new("DefaultExperiment")
                .with("startTime", "0.0")
                .with("stopTime", "1.0")
                .with("stepSize", "0.01")])
            .containing([variables_element, self.structure(&variables)])
            .document()
    }

    /// Element of the capabilities for one kind of simulation.
    fn kind(&self, kind: &'static str) -> Element {
        let element = Element::new(kind).with("modelIdentifier", self.name);
        let element = match kind {
            "CoSimulation" => element
                .with("canHandleVariableCommunicationStepSize", true)
                .with("canInterpolateInputs", true),
            _ => element,
        };
        let files = Element::new("SourceFiles").containing([Element::new("File").with("name", "fmi2.c")]);
        element
            .with("canNotUseMemoryManagementFunctions", true)
            .with("canGetAndSetFMUstate", true)
            .with("canSerializeFMUstate", true)
            .containing([files])
    }

    /// All variables of type Real, in the order of their references.
    fn variables(&self) -> Vec<Variable> {
        let (m, free) = (self.model, [f64::NEG_INFINITY, f64::INFINITY]);
        let mut list: Vec<Variable> = Vec::new();
        for (state, start) in m.states.iter().zip(self.start) {
            let bounds = [state.min.unwrap_or(free[0]), state.max.unwrap_or(free[1])];
            list.push(Variable::new(&state.name, Role::State, state.unit, Some(*start)).within(bounds));
        }
        for (i, state) in m.states.iter().enumerate() {
            let unit = state.unit.and_then(|unit| unit.over(Unit::SECOND.dimensions()));
            list.push(Variable::new(&format!("der({})", state.name), Role::Rate(i), unit, None));
        }
        for input in &m.inputs {
            let (hold, description) = match input.hold {
                Some(Hold::Zero) => (true, "input that keeps each value until the next one"),
                Some(Hold::Spline) => (false, "input between whose samples a cubic spline is meant"),
                _ => (false, "input that is linear between its samples"),
            };
            let variable = Variable::new(&input.name, Role::Input(hold), input.unit, Some(0.0));
            list.push(variable.described(description));
        }
        for output in &m.outputs {
            let variable = Variable::new(&output.name, Role::Output, output.unit, None);
            let range = output
                .range
                .map_or(String::new(), |[low, high]| format!(" (the sensor reads from {low} to {high})"));
            list.push(variable.described(&format!("output without measurement noise{range}")));
        }
        for p in &m.parameters {
            let variable = Variable::new(&p.name, Role::Parameter, p.unit, Some(p.nominal));
            list.push(variable.within([p.min, p.max]));
        }
        for (i, d) in self.listing.discontinuities.iter().enumerate() {
            let variable =
                Variable::new(&format!("numerics.width[{}]", i + 1), Role::Parameter, None, Some(d.width));
            list.push(
                variable
                    .described(&format!("width over which the discontinuity in {} is smoothed", d.argument)),
            );
        }
        make_names_unique(&mut list);
        list
    }

    /// Element of a variable of type Real.
    fn scalar(&self, reference: usize, v: &Variable) -> Element {
        let (causality, variability, initial) = match v.role {
            Role::State => ("local", "continuous", Some("exact")),
            Role::Rate(_) => ("local", "continuous", Some("calculated")),
            Role::Input(true) => ("input", "discrete", None),
            Role::Input(false) => ("input", "continuous", None),
            Role::Output => ("output", "continuous", Some("calculated")),
            Role::Parameter => ("parameter", "tunable", Some("exact")),
        };
        let finite = |value: f64| value.is_finite().then(|| number(value));
        let symbol = v.unit.map(Unit::symbol).filter(|symbol| !symbol.is_empty());
        let mut real = Element::new("Real")
            .with_some("unit", symbol)
            .with_some("min", finite(v.bounds[0]))
            .with_some("max", finite(v.bounds[1]))
            .with_some("start", v.start.map(number));
        if let Role::Rate(state) = v.role {
            real = real.with("derivative", state + 1);
        }
        if v.role == Role::State && self.jumps {
            real = real.with("reinit", true);
        }
        let description = (!v.description.is_empty()).then(|| v.description.clone());
        Element::new("ScalarVariable")
            .with("name", &v.name)
            .with("valueReference", reference)
            .with_some("description", description)
            .with("causality", causality)
            .with("variability", variability)
            .with_some("initial", initial.map(str::to_owned))
            .containing([real])
    }

    /// Elements of the numerical settings of co-simulation.
    fn settings(&self) -> [Element; 2] {
        let numerics = &self.model.numerics;
        let setting = |name: &str, description: &str, value: Element| {
            Element::new("ScalarVariable")
                .with("name", name)
                .with("valueReference", 0)
                .with("description", description)
                .with("causality", "parameter")
                .with("variability", "tunable")
                .with("initial", "exact")
                .containing([value])
        };
        let substeps = Element::new("Integer").with("min", 0).with("start", numerics.substeps.unwrap_or(0));
        let implicit = Element::new("Boolean").with("start", numerics.integrator == Integrator::Implicit);
        [
            setting(
                "numerics.substeps",
                "integration steps in each communication step; 0: at least 8, more if the equations are fast",
                substeps,
            ),
            setting("numerics.implicit", "whether the steps are implicit, for stiff systems", implicit),
        ]
    }

    /// Element that lists the outputs, the derivatives, and what is computed at the start.
    fn structure(&self, variables: &[Variable]) -> Element {
        let unknowns = |is_listed: &dyn Fn(Role) -> bool| {
            let listed = variables.iter().enumerate().filter(|(_, v)| is_listed(v.role));
            listed.map(|(i, _)| Element::new("Unknown").with("index", i + 1)).collect::<Vec<_>>()
        };
        let is_rate = |role: Role| matches!(role, Role::Rate(_));
        let lists = [
            ("Outputs", unknowns(&|role| role == Role::Output)),
            ("Derivatives", unknowns(&is_rate)),
            ("InitialUnknowns", unknowns(&|role| role == Role::Output || is_rate(role))),
        ];
        let lists = lists.into_iter().filter(|(_, list)| !list.is_empty());
        Element::new("ModelStructure")
            .containing(lists.map(|(name, list)| Element::new(name).containing(list)))
    }
}

impl Variable {
    fn new(name: &str, role: Role, unit: Option<Unit>, start: Option<f64>) -> Self {
        let bounds = [f64::NEG_INFINITY, f64::INFINITY];
        Variable { name: name.to_owned(), description: String::new(), role, unit, start, bounds }
    }

    fn described(mut self, description: &str) -> Self {
        self.description = description.to_owned();
        self
    }

    fn within(mut self, bounds: [f64; 2]) -> Self {
        self.bounds = bounds;
        self
    }
}

/// Appends underscores to names that occur before, because FMI has one list of names for all variables.
fn make_names_unique(variables: &mut [Variable]) {
    let mut taken: BTreeSet<String> =
        ["numerics.substeps", "numerics.implicit"].into_iter().map(str::to_owned).collect();
    for variable in variables {
        while !taken.insert(variable.name.clone()) {
            variable.name.push('_');
        }
    }
}

/// Element of the units of the variables, with their exponents of the SI base units.
fn units(variables: &[Variable]) -> Option<Element> {
    let used: BTreeMap<String, Unit> =
        variables.iter().filter_map(|v| v.unit).map(|unit| (unit.symbol(), unit)).collect();
    let elements: Vec<Element> =
        used.into_iter().filter(|(symbol, _)| !symbol.is_empty()).map(unit).collect();
    (!elements.is_empty()).then(|| Element::new("UnitDefinitions").containing(elements))
}

/// Element of one unit; FMI has only whole exponents, so others are left out.
fn unit((symbol, unit): (String, Unit)) -> Element {
    let element = Element::new("Unit").with("name", symbol);
    let exponents = unit.dimensions().exponents();
    if exponents.iter().any(|exponent| exponent.fract() != 0.0) {
        return element;
    }
    let named = ["kg", "m", "s", "A", "K", "mol"].into_iter().zip(exponents);
    let base = named
        .filter(|(_, exponent)| *exponent != 0.0)
        .fold(Element::new("BaseUnit"), |base, (name, exponent)| base.with(name, exponent as i64));
    element.containing([base])
}
