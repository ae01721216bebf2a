//! Values by group in the programs of balls and pushes: the user of a program chooses the group.

use super::words::{comment, literal};
use super::{Language, number};
use augsim_system::Parameter;

/// The parameters of a model that have values by group, as an exported program lists them.
pub(super) struct Groups {
    language: Language,
    /// Names of all groups, in the order of the model file.
    names: Vec<String>,
    /// Values of each parameter that has values by group, in the order of the groups.
    values: Vec<Vec<f64>>,
}

impl Groups {
    pub fn new<'p>(language: Language, parameters: impl Iterator<Item = &'p Parameter>) -> Self {
        let mut names: Vec<String> = Vec::new();
        for (name, _) in parameters.flat_map(|p| &p.groups) {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        Groups { language, names, values: Vec::new() }
    }

    /// Writes the value of a parameter as an expression of the program: that of the chosen group if it has several.
    pub fn value(&mut self, p: &Parameter) -> String {
        if p.groups.is_empty() {
            return number(p.nominal);
        }
        let values = p.values_of(&self.names);
        let index = self.values.iter().position(|known| *known == values).unwrap_or_else(|| {
            self.values.push(values);
            self.values.len() - 1
        });
        if self.language == Language::C {
            format!("BY_GROUP[{index}][group]")
        } else {
            format!("BY_GROUP[{index}][GROUP]")
        }
    }

    /// Declarations of a program's constants, some of which depend on the chosen group.
    pub fn constants(&self, constants: &[(&str, String)]) -> String {
        let list = |separator: &str, values: &mut dyn Iterator<Item = String>| {
            values.collect::<Vec<_>>().join(separator)
        };
        let has_groups = !self.names.is_empty();
        let names = list(", ", &mut self.names.iter().map(|name| literal(name, self.language)));
        let row = |row: &Vec<f64>| list(", ", &mut row.iter().map(|v| number(*v)));
        if self.language == Language::C {
            let define = |(name, value): &(&str, String)| match value.contains('[') {
                true => format!("#define {name} {value}"),
                false => format!("static const double {name} = {value};"),
            };
            let constants = list("\n", &mut constants.iter().map(define));
            let rows = list(", ", &mut self.values.iter().map(|values| format!("{{{}}}", row(values))));
            let (count, parameters) = (self.names.len(), self.values.len());
            return match has_groups {
                true => format!(
                    "/* Values by group: one row for each parameter. */\nenum {{ GROUPS = {count} }};\n\
                     static const char *const GROUP_NAMES[GROUPS] = {{{names}}};\n\
                     static const double BY_GROUP[{parameters}][GROUPS] = {{{rows}}};\nstatic int group = -1;\n{constants}"
                ),
                false => format!(
                    "enum {{ GROUPS = 0 }};\nstatic const char *const GROUP_NAMES[1] = {{0}};\nstatic int group = -1;\n{constants}"
                ),
            };
        }
        let rows = list(", ", &mut self.values.iter().map(|values| format!("[{}]", row(values))));
        let set = list("\n", &mut constants.iter().map(|(name, value)| format!("{name} = {value}")));
        if !has_groups {
            return format!(
                "GROUPS = []\n{set}\n\n\ndef choose_group(name):\n    sys.exit(\"this model has no groups\")\n"
            );
        }
        let all = list(", ", &mut constants.iter().map(|(name, _)| (*name).to_owned()));
        let set = list("\n", &mut constants.iter().map(|(name, value)| format!("    {name} = {value}")));
        format!(
            "# Values by group: one row for each parameter.\nGROUPS = [{names}]\nBY_GROUP = [{rows}]\nGROUP = None\n\n\n\
             def choose_group(name):\n    \"\"\"Uses the values of a group; call it before `simulate`.\"\"\"\n    \
             global GROUP, {all}\n    if name not in GROUPS:\n        sys.exit(\"choose a group: --group \" + \" or \".join(GROUPS))\n    \
             GROUP = GROUPS.index(name)\n{set}\n"
        )
    }

    /// Clause for the title of a program: that its values are those of the chosen group.
    pub fn title(&self) -> String {
        match self.names.is_empty() {
            true => String::new(),
            false => format!("; values by group: {}", comment(&self.names.join(", "))),
        }
    }
}
