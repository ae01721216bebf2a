//! A pushed object with the effects that act on it, and the layout of the parameter vector.

use super::effects;
use super::field::Field;
use super::moments::{Moments, mean_radius};
use super::object::Object;
use super::setting::{Friction, Setting};
use super::surface::patches::{Patch, cut};
use super::surface::uniform::UniformPolygon;
use crate::Scalar;

/// Names of the base parameters of every pushed object, in the order of the parameter vector.
///
/// Those of the effects follow.
pub const BASE_PARAMETERS: [&str; 5] =
    ["c_m", "contact_friction", "rod_radius_m", "support_friction", "mass_kg"];
/// Index of the length `c` of the limit surface, m, in the parameter vector.
pub const C_INDEX: usize = 0;
/// Index of the friction between rod and object in the parameter vector.
pub const CONTACT_FRICTION_INDEX: usize = 1;
/// Index of the rod's radius, m, in the parameter vector.
pub const ROD_RADIUS_INDEX: usize = 2;
/// Index of the friction between object and support in the parameter vector.
pub const SUPPORT_FRICTION_INDEX: usize = 3;
/// Index of the object's mass, kg, in the parameter vector.
pub const MASS_INDEX: usize = 4;

/// Number of sides of the polygon that replaces an ellipse in the surface of uniform pressure.
const ELLIPSE_SIDES: usize = 48;
/// Number of patches across the object for the friction that is summed over patches.
const PATCHES_ACROSS: usize = 10;

/// An active effect and the place of its parameters in the parameter vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Term {
    /// Index of the effect in [`effects::all`].
    pub effect: usize,
    /// Index of the effect's first parameter in the parameter vector.
    pub first: usize,
    /// Number of parameters of the effect.
    pub count: usize,
}

/// A pushed object and the effects that act on it, with the layout of their parameter vector.
///
/// Parameter values are not stored here but passed as a flat vector, so that one `World` serves many fits.
#[derive(Clone, Debug)]
pub struct World {
    object: Object,
    terms: Vec<Term>,
    parameter_count: usize,
    pub(super) moments: Moments,
    pub(super) mean_radius_m: f64,
    pub(super) uniform: UniformPolygon,
    pub(super) patches: Vec<Patch>,
    pub(super) shares: Vec<f64>,
}

impl World {
    /// An object with the ellipsoidal limit surface and no effects.
    pub fn new(object: Object) -> Self {
        let patches = cut(&object.outline, PATCHES_ACROSS);
        Self {
            moments: Moments::of_outline(&object.outline),
            mean_radius_m: mean_radius(&object.outline),
            uniform: UniformPolygon::new(&object.outline.polygon(ELLIPSE_SIDES)),
            shares: patches.iter().map(|p| p.share).collect(),
            patches,
            object,
            terms: Vec::new(),
            parameter_count: BASE_PARAMETERS.len(),
        }
    }

    /// Replaces the patches by a grid with `across` cells, weighted by `pressure`.
    ///
    /// `pressure` is evaluated at points of the body, m; its unit does not matter because the weights are
    /// normalised.
    pub fn with_patches(mut self, across: usize, pressure: impl Fn([f64; 2]) -> f64) -> Self {
        self.patches = cut(&self.object.outline, across);
        self.shares = self.patches.iter().map(|p| p.share * pressure(p.position)).collect();
        let total: f64 = self.shares.iter().sum();
        self.shares.iter_mut().for_each(|s| *s /= total);
        self
    }

    /// The object that the rod pushes.
    pub fn object(&self) -> &Object {
        &self.object
    }

    /// Nominal parameter values of the base parameters and the effects.
    ///
    /// Uniform pressure, friction of steel on steel, the rod of the MIT set, a support of ABS; effects have
    /// their typical values.
    pub fn nominal(&self) -> Vec<f64> {
        let mass = self.object.mass_kg.unwrap_or(1.0);
        let mut values = vec![self.mean_radius_m, 0.25, 0.00475, 0.15, mass];
        for term in &self.terms {
            if let Some(effect) = effects::all::<f64>().get(term.effect) {
                values.extend(effect.spec().parameters.iter().map(|p| p.typical));
            }
        }
        values
    }

    /// Number of parameters in the parameter vector.
    pub fn parameter_count(&self) -> usize {
        self.parameter_count
    }

    /// Adds an effect by its position in the registry and returns the index of its first parameter.
    ///
    /// Its parameters are appended to the parameter vector. Returns `None` if there is no such effect.
    pub fn add(&mut self, effect: usize) -> Option<usize> {
        let count = effects::all::<f64>().get(effect)?.spec().parameters.len();
        let first = self.parameter_count;
        self.parameter_count += count;
        self.terms.push(Term { effect, first, count });
        Some(first)
    }

    /// Adds an effect by kind; returns the index of its first parameter.
    ///
    /// `None` if there is no such effect, or if it is not simulated (scatter).
    pub fn add_kind(&mut self, kind: &str) -> Option<usize> {
        self.add(effects::index_of(kind)?)
    }

    /// Active effects, in the order of their parameters in the parameter vector.
    pub fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// Mechanics of a push with these parameter values and the effects of the world.
    ///
    /// Missing base parameters have the value of [`nominal`](Self::nominal).
    pub fn setting<S: Scalar>(&self, parameters: &[S]) -> Setting<S> {
        let base = |i: usize| {
            parameters
                .get(i)
                .copied()
                .unwrap_or_else(|| S::constant(self.nominal().get(i).copied().unwrap_or(0.0)))
        };
        let mut setting = Setting::plain(
            base(C_INDEX),
            base(CONTACT_FRICTION_INDEX),
            base(ROD_RADIUS_INDEX),
            base(SUPPORT_FRICTION_INDEX),
            base(MASS_INDEX),
        );
        let library = effects::all::<S>();
        for term in &self.terms {
            if let (Some(effect), Some(p)) =
                (library.get(term.effect), parameters.get(term.first..term.first + term.count))
            {
                effect.apply(p, &mut setting);
            }
        }
        if setting.speed.is_some() {
            // Only the sum over patches can represent a surface whose shape depends on speed.
            setting.friction = Friction::Patches;
        }
        setting
    }

    /// Writes the friction of each patch of the object at `pose`, from a map of the table, to `weights`.
    pub(super) fn patch_weights(&self, field: &Field, pose: &super::Pose<f64>, weights: &mut Vec<f64>) {
        let rotation = super::planar::Rotation::new(pose.angle);
        weights.clear();
        weights.extend(self.patches.iter().zip(&self.shares).map(|(patch, share)| {
            let position = super::planar::add(pose.position, rotation.to_world(patch.position));
            share * field.factor(position)
        }));
    }
}
