//! Parameter values by group: checks and selects the groups of a model file by those of the data.

use super::{Model, ModelFile, PushModel};
use augsim_system::{Parameter, Per, UnknownGroup, unknown_group};

impl Model {
    /// First group-specific parameter value whose group is not in `groups`, which are those of the data.
    pub fn unknown_group(&self, groups: &[&str]) -> Option<UnknownGroup> {
        unknown_group(self.parameters.iter().chain(self.effects.iter().flat_map(|b| &b.parameters)), groups)
    }
}

impl PushModel {
    /// First group-specific parameter value whose group is not in `groups`, which are those of the data.
    pub fn unknown_group(&self, groups: &[&str]) -> Option<UnknownGroup> {
        unknown_group(self.parameters.iter().chain(self.effects.iter().flat_map(|b| &b.parameters)), groups)
    }
}

impl ModelFile {
    /// First group-specific parameter value whose group is not in `groups`, which are those of the data.
    pub fn unknown_group(&self, groups: &[&str]) -> Option<UnknownGroup> {
        match self {
            ModelFile::Ball(model) => model.unknown_group(groups),
            ModelFile::Push(model) => model.unknown_group(groups),
        }
    }

    /// All parameters of the model: base parameters, then those of the effects.
    pub fn parameters(&self) -> impl Iterator<Item = &Parameter> {
        let (parameters, effects) = match self {
            ModelFile::Ball(model) => (&model.parameters, &model.effects),
            ModelFile::Push(model) => (&model.parameters, &model.effects),
        };
        parameters.iter().chain(effects.iter().flat_map(|b| &b.parameters))
    }

    /// All parameters of the model, mutable, in the order of [`parameters`](Self::parameters).
    fn parameters_mut(&mut self) -> impl Iterator<Item = &mut Parameter> {
        let (parameters, effects) = match self {
            ModelFile::Ball(model) => (&mut model.parameters, &mut model.effects),
            ModelFile::Push(model) => (&mut model.parameters, &mut model.effects),
        };
        parameters.iter_mut().chain(effects.iter_mut().flat_map(|b| &mut b.parameters))
    }

    /// Drops the parameter values of all groups except `groups`, for data that contain only these.
    pub fn keep_groups(&mut self, groups: &[String]) {
        self.parameters_mut().for_each(|p| p.groups.retain(|(name, _)| groups.contains(name)));
    }

    /// The model of one group: the group's value of each parameter becomes the value for all trajectories.
    pub fn of_group(mut self, group: &str) -> Self {
        for p in self.parameters_mut() {
            if let Some((_, value)) = p.groups.iter().find(|(name, _)| name == group) {
                (p.nominal, p.per) = (*value, Per::All);
                p.groups.clear();
            }
        }
        self
    }
}
