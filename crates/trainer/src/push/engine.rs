//! The declared model of pushing: quasi-static, ellipsoidal limit surface (Lynch, Maekawa and Tanie 1992), with the effects
//! that a discovery has added.

use super::effect::PushEffect;
use augsim_physics::model::PushModel;
use augsim_physics::push::{
    C, CONTACT_FRICTION, Instant, MASS, OBJECTS, Object, Pose, Push, ROD_RADIUS, Recorded, Run,
    SUPPORT_FRICTION, Steps, World, simulate,
};
use serde::{Deserialize, Serialize};

/// One of the built-in objects, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct ObjectName(usize);

impl ObjectName {
    /// The object of that name, if it is built in.
    pub fn new(name: &str) -> Option<Self> {
        OBJECTS.iter().position(|o| *o == name).map(ObjectName)
    }

    /// Its name.
    pub fn as_str(self) -> &'static str {
        OBJECTS[self.0]
    }
}

impl TryFrom<String> for ObjectName {
    type Error = String;
    fn try_from(name: String) -> Result<Self, String> {
        Self::new(&name)
            .ok_or_else(|| format!("no object `{name}` is built in; choose one of {}", OBJECTS.join(", ")))
    }
}

impl From<ObjectName> for String {
    fn from(name: ObjectName) -> Self {
        name.as_str().to_owned()
    }
}

/// Object and parameters of a push.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PushEngine {
    /// The object.
    pub object: ObjectName,
    /// Ratio of largest moment to largest force of the limit surface, m.
    pub c_m: f64,
    /// Friction between rod and object.
    pub contact_friction: f64,
    /// Radius of the rod, m.
    pub rod_radius_m: f64,
    /// Friction between object and support. Quasi-static motion does not depend on it; the nets read from it
    /// how far a fast object coasts.
    pub support_friction: f64,
    /// Mass, kg.
    pub mass_kg: f64,
    /// What a discovery has added; nothing in a declared model.
    #[serde(default)]
    pub effects: Vec<PushEffect>,
}

impl PushEngine {
    /// The engine of a model of a built-in object, at the nominal values of its parameters and effects; `None` for another
    /// object.
    pub fn of(model: &PushModel) -> Option<Self> {
        let value = |i: usize| model.parameters.get(i).map(|p| p.nominal);
        // An outline of a file's own may bear the name of a built-in object.
        let built_in = Object::named(&model.object.name).filter(|object| *object == model.object)?;
        Some(PushEngine {
            object: ObjectName::new(&built_in.name)?,
            c_m: value(C)?,
            contact_friction: value(CONTACT_FRICTION)?,
            rod_radius_m: value(ROD_RADIUS)?,
            support_friction: value(SUPPORT_FRICTION)?,
            mass_kg: value(MASS)?,
            effects: model.effects.iter().filter_map(PushEffect::of).collect(),
        })
    }

    /// The textbook model of a built-in object on a support of that friction; `None` if there is no such
    /// object.
    pub fn textbook(object: &str, support_friction: f64) -> Option<Self> {
        let textbook = PushModel::textbook(Object::named(object)?);
        Some(PushEngine { support_friction, ..Self::of(&textbook)? })
    }

    /// The world that the engine simulates and its parameters; `None` never, since every name is built in.
    pub(crate) fn world(&self) -> Option<(World, Vec<f64>)> {
        let mut world = World::new(Object::named(self.object.as_str())?);
        let mut p = vec![0.0; world.parameter_count()];
        p[C] = self.c_m;
        p[CONTACT_FRICTION] = self.contact_friction;
        p[ROD_RADIUS] = self.rod_radius_m;
        p[SUPPORT_FRICTION] = self.support_friction;
        p[MASS] = self.mass_kg;
        self.effects.iter().for_each(|effect| effect.enter(&mut world, &mut p));
        Some((world, p))
    }

    /// Poses and instants along rod positions `actions [time, (x, y, t)]` from pose `start`. Where measured
    /// rod and object overlap at the start, by noise or clocks that differ, the engine moves the object out.
    pub(crate) fn follow(&self, start: &[f64], actions: &[f64]) -> Vec<(Pose<f64>, Instant<f64>)> {
        let Some((world, parameters)) = self.world() else { return Vec::new() };
        let column = |j: usize| -> Vec<f64> { actions.chunks_exact(3).map(|a| a[j]).collect() };
        let (x, y, t) = (column(0), column(1), column(2));
        let first = Pose::new(start[0], start[1], start[2]);
        let mut run = Run::default();
        let done = Recorded::new(&t, &x, &y).is_some_and(|path| {
            let steps = Steps { travel_m: 1e-3, ..Steps::default() };
            let push = Push {
                world: &world,
                parameters: &parameters,
                start: first,
                path: &path,
                field: None,
                steps,
            };
            simulate(&push, &t, &mut run).is_ok()
        });
        if done {
            return run.poses.into_iter().zip(run.instants).collect();
        }
        // A start deep inside the object: one straight piece at a time, which resolves any overlap.
        step_by_step(&world, &parameters, first, actions)
    }

    /// States `[time, 3]` of the roll-out.
    pub(crate) fn poses(&self, start: &[f64], actions: &[f64]) -> Vec<f64> {
        self.follow(start, actions)
            .iter()
            .flat_map(|(p, _)| [p.position[0], p.position[1], p.angle])
            .collect()
    }
}

fn step_by_step(
    world: &World,
    parameters: &[f64],
    start: Pose<f64>,
    actions: &[f64],
) -> Vec<(Pose<f64>, Instant<f64>)> {
    let mut stepper =
        augsim_physics::push::Stepper::new(world, parameters, Steps { travel_m: 1e-3, ..Steps::default() });
    let rows: Vec<&[f64]> = actions.chunks_exact(3).collect();
    let mut out = Vec::with_capacity(rows.len());
    let (mut pose, mut twist) = (start, augsim_physics::push::Twist::zero());
    let Some(first) = rows.first() else { return out };
    out.push((pose, stepper.instant(&pose, [first[0], first[1]], [0.0; 2])));
    for w in rows.windows(2) {
        let duration = (w[1][2] - w[0][2]).max(1e-6);
        let next = stepper.step(pose, twist, [w[0][0], w[0][1]], [w[1][0], w[1][1]], duration);
        (pose, twist) = (next.pose, next.twist);
        out.push((pose, next.instant));
    }
    out
}
