//! Mechanics of a push at one instant: contact, twist and force from the poses of object and rod.

use super::contact::{ContactFriction, Mode, Response, Touch};
use super::field::Field;
use super::planar::{Pose, Rotation, Twist, Vector, Wrench, add, cross, scale, sub};
use super::response::respond_from;
use super::setting::{Anisotropy, Friction, Setting};
use super::support::{Inertia, Support};
use super::surface::{Matrix, Surface};
use super::warm_start::WarmStart;
use super::world::World;
use crate::Scalar;

/// Largest gap at which rod and object count as touching, m.
pub(super) const MAX_TOUCHING_GAP_M: f64 = 1e-7;

/// Number of fixed-point iterations for the contact force that shifts the centre of pressure.
const PRESSURE_ITERATIONS: usize = 3;

/// State of a push at one instant: contact, twist, force, gap; world frame unless stated otherwise.
#[derive(Clone, Copy, Debug)]
pub struct Instant<S> {
    /// Mode of the contact: free, sticking, sliding or separating.
    pub mode: Mode,
    /// Velocity and angular velocity of the object.
    pub twist: Twist<S>,
    /// Force of the rod on the object, N.
    pub force: Vector<S>,
    /// Point of the object that is closest to the rod, body frame, m.
    pub contact: Vector<S>,
    /// Outward unit normal of the object at the contact point, body frame.
    pub outward: Vector<S>,
    /// Gap between rod and object, m; negative where they overlap.
    pub gap: S,
    /// Velocity of the rod relative to the object along the contact tangent, m/s.
    pub slip: S,
}

impl<S: Scalar> Instant<S> {
    /// Initial guess of the contact solver at the next instant; `velocity` is that of the rod, m/s.
    pub(super) fn warm_start(&self, velocity: Vector<S>) -> WarmStart {
        let rotation = self.twist.rotation.value();
        WarmStart { mode: self.mode, slip: self.slip.value(), rotation, rod_velocity: velocity.map(S::value) }
    }
}

/// A pushed object with given parameter values, ready to be evaluated at any pose.
#[derive(Clone, Debug)]
pub(super) struct Scene<'a, S> {
    pub world: &'a World,
    pub setting: Setting<S>,
    pub field: Option<&'a Field>,
    /// Relative friction of each patch of the object at the last pose of [`Scene::read_friction_map`].
    weights: Vec<f64>,
}

/// Contact geometry at one instant, in the body frame.
struct Geometry<S> {
    rotation: Rotation<S>,
    contact: Vector<S>,
    outward: Vector<S>,
    gap: S,
}

impl<'a, S: Scalar> Scene<'a, S> {
    /// Fills the parameters into the effects of `world`.
    ///
    /// With a friction map the limit surface is the sum over patches.
    pub fn new(world: &'a World, parameters: &[S], field: Option<&'a Field>) -> Self {
        let mut setting = world.setting(parameters);
        if field.is_some() {
            setting.friction = Friction::Patches;
        }
        Self { world, setting, field, weights: Vec::new() }
    }

    /// Whether the object has inertia.
    pub fn has_inertia(&self) -> bool {
        self.setting.inertia.is_some()
    }

    /// Evaluates the friction map at the patches of the object at `pose`, for the following calls.
    ///
    /// Within a sub-step the values are kept, as if the map moved with the object.
    pub fn read_friction_map(&mut self, pose: &Pose<S>) {
        if let Some(field) = self.field {
            self.world.patch_weights(field, &pose.value(), &mut self.weights);
        }
    }

    /// True position of the rod for a reported one, m: without errors of registration and tip offset.
    pub fn true_rod(&self, reported: Vector<S>) -> Vector<S> {
        let registered = self.setting.registration.map_or(reported, |r| r.position(reported));
        self.setting.tip_offset_m.map_or(registered, |offset| add(registered, offset))
    }

    /// True velocity of the rod for a reported one, m/s: without errors of the frame registration.
    pub fn true_velocity(&self, reported: Vector<S>) -> Vector<S> {
        self.setting.registration.map_or(reported, |r| r.velocity(reported))
    }

    /// Contact geometry of an object at `pose` and a rod at `rod`.
    fn geometry(&self, pose: &Pose<S>, rod: Vector<S>) -> Geometry<S> {
        let rotation = Rotation::new(pose.angle);
        let nearest = self.world.object().outline.nearest(rotation.to_body(sub(rod, pose.position)));
        Geometry {
            rotation,
            contact: nearest.point,
            outward: nearest.outward,
            gap: nearest.distance - self.setting.rod_radius_m,
        }
    }

    /// Gap between object and rod, m, and the object's outward normal at the gap, in the world frame.
    pub fn gap(&self, pose: &Pose<S>, rod: Vector<S>) -> (S, Vector<S>) {
        let g = self.geometry(pose, rod);
        (g.gap, g.rotation.to_world(g.outward))
    }

    /// Limit surface that the parameters and effects select.
    fn surface(&self) -> Surface<'_, S> {
        let s = &self.setting;
        let footprint_scale = || s.c_m * (1.0 / self.world.mean_radius_m);
        match s.friction {
            Friction::Ellipsoid => Surface::Ellipsoid { c: s.c_m },
            Friction::Superellipsoid(exponent) => Surface::Superellipsoid { c: s.c_m, exponent },
            Friction::Uniform => {
                Surface::Uniform { footprint: &self.world.uniform, scale: footprint_scale() }
            }
            Friction::Patches => Surface::Patches {
                patches: &self.world.patches,
                weights: if self.field.is_some() { &self.weights } else { &self.world.shares },
                scale: footprint_scale(),
                speed: s.speed,
            },
        }
    }

    /// Map `H` of velocities for anisotropic friction, body frame; `None` if friction is isotropic.
    fn metric(&self, rotation: Rotation<S>) -> Option<Matrix<S>> {
        let s = &self.setting;
        if s.table_anisotropy.is_none() && s.object_anisotropy.is_none() {
            return None;
        }
        let on_table = s.table_anisotropy.map(|a| {
            // The table's map in the body frame: R(-θ) H R(θ).
            let h = anisotropy_map(&a);
            let column = |e: Vector<S>| rotation.to_body(super::surface::apply(&h, rotation.to_world(e)));
            let (zero, one) = (S::zero(), S::constant(1.0));
            let (x, y) = (column([one, zero]), column([zero, one]));
            [[x[0], y[0]], [x[1], y[1]]]
        });
        let on_object = s.object_anisotropy.map(|a| anisotropy_map(&a));
        match (on_table, on_object) {
            (Some(t), Some(o)) => Some(product(&t, &o)),
            (t, o) => t.or(o),
        }
    }

    /// Limit surface, loads and inertia of the object at one instant, in the body frame.
    ///
    /// `rod_force` is an estimate of the force of the rod in the body frame, in units of the sliding force;
    /// `inertia` is the length of the step and the twist before it.
    fn support(
        &self,
        rotation: Rotation<S>,
        rod_force: Option<Vector<S>>,
        inertia: Option<(S, Twist<S>)>,
    ) -> Support<'_, S> {
        let s = &self.setting;
        let mut support = Support::plain(self.surface());
        support.metric = self.metric(rotation);
        let mut centre_of_pressure = s.pressure_offset_m.unwrap_or([S::zero(); 2]);
        if let (Some(height), Some(force)) = (s.push_height_m, rod_force) {
            centre_of_pressure = add(centre_of_pressure, scale(force, height * s.support_friction));
        }
        support.centre = centre_of_pressure;
        if let Some(gradient) = s.friction_gradient_per_m {
            let g = rotation.to_body(gradient);
            let [xx, xy, yy] = self.world.moments.second_m2;
            support.centre = add(support.centre, [g[0] * xx + g[1] * xy, g[0] * xy + g[1] * yy]);
        }
        if let Some(downhill) = s.downhill {
            let force = scale(rotation.to_body(downhill), S::constant(1.0) / s.support_friction);
            support.load = Wrench { force, moment: cross(centre_of_pressure, force) };
            support.loaded = true;
        }
        if let (Some(share), Some((h, previous))) = (s.inertia, inertia) {
            let mass = share * s.mass_kg / (h * s.sliding_force_n());
            let previous =
                Twist { velocity: rotation.to_body(previous.velocity), rotation: previous.rotation };
            let moment = mass * self.world.moments.mean_square_radius();
            support.inertia = Some(Inertia { mass, moment, previous });
        }
        support
    }

    /// Response of an object that the rod touches: mode, twist, force and slip.
    ///
    /// If the contact force shifts the centre of pressure, force and response are found by fixed-point
    /// iteration, which converges fast because the shift is small.
    fn response(
        &self,
        g: &Geometry<S>,
        velocity: Vector<S>,
        inertia: Option<(S, Twist<S>)>,
        warm_start: Option<WarmStart>,
    ) -> Response<S> {
        let touch = Touch { point: g.contact, normal: g.outward.map(|x| -x), velocity };
        let s = &self.setting;
        let friction = ContactFriction { at_rest: s.contact_friction, rise_s_per_m: s.slip_rise_s_per_m };
        let mut response =
            respond_from(&self.support(g.rotation, None, inertia), &touch, &friction, warm_start);
        if s.push_height_m.is_some() {
            for _ in 0..PRESSURE_ITERATIONS {
                if response.mode == Mode::Separate {
                    break;
                }
                response = respond_from(
                    &self.support(g.rotation, Some(response.force), inertia),
                    &touch,
                    &friction,
                    warm_start,
                );
            }
        }
        response
    }

    /// Contact, twist and force with the object at `pose` and the rod at `rod`, moving with `velocity`.
    ///
    /// With `touching` the pair is in contact whatever the gap; otherwise the gap decides.
    #[inline]
    pub fn instant_at(
        &self,
        pose: &Pose<S>,
        rod: Vector<S>,
        velocity: Vector<S>,
        touching: bool,
        warm_start: Option<WarmStart>,
    ) -> Instant<S> {
        let g = self.geometry(pose, rod);
        if !touching && g.gap.value() > MAX_TOUCHING_GAP_M {
            return self.instant_from(&g, Response::without_force(Mode::Free, Twist::zero()));
        }
        let response = self.response(&g, g.rotation.to_body(velocity), None, warm_start);
        self.instant_from(&g, response)
    }

    /// Contact, twist and force at the end of an implicit Euler step of length `h`, s, from `pose`.
    ///
    /// `previous` is the twist before the step. The rod moves with `velocity`. An open gap adds `gap / h` to
    /// the rod's velocity along the outward normal in the contact condition, so that the rod acts only once
    /// the gap has closed.
    pub fn implicit_euler_step(
        &self,
        pose: &Pose<S>,
        rod: Vector<S>,
        velocity: Vector<S>,
        h: S,
        previous: Twist<S>,
        warm_start: Option<WarmStart>,
    ) -> Instant<S> {
        let g = self.geometry(pose, rod);
        let u = g.rotation.to_body(velocity);
        let closing = if g.gap.value() > 0.0 { g.gap / h } else { S::zero() };
        let response = self.response(&g, add(u, scale(g.outward, closing)), Some((h, previous)), warm_start);
        let mut instant = self.instant_from(&g, response);
        if instant.mode == Mode::Separate && g.gap.value() > MAX_TOUCHING_GAP_M {
            instant.mode = Mode::Free;
        }
        instant
    }

    /// Converts a contact response in the body frame to an [`Instant`] in the world frame.
    fn instant_from(&self, g: &Geometry<S>, response: Response<S>) -> Instant<S> {
        let to_world = |a: Vector<S>| g.rotation.to_world(a);
        Instant {
            mode: response.mode,
            twist: Twist { velocity: to_world(response.twist.velocity), rotation: response.twist.rotation },
            force: scale(to_world(response.force), self.setting.sliding_force_n()),
            contact: g.contact,
            outward: g.outward,
            gap: g.gap,
            slip: response.slip,
        }
    }
}

/// Map `H = A^½ = R diag(√ratio, 1/√ratio) Rᵀ` of velocities, R the rotation by the angle of anisotropy.
fn anisotropy_map<S: Scalar>(a: &Anisotropy<S>) -> Matrix<S> {
    let along = a.ratio.sqrt();
    let across = S::constant(1.0) / along;
    let (c, s) = (a.angle_rad.cos(), a.angle_rad.sin());
    let off = (along - across) * c * s;
    [[along * c * c + across * s * s, off], [off, along * s * s + across * c * c]]
}

/// Product of two 2 x 2 matrices.
fn product<S: Scalar>(a: &Matrix<S>, b: &Matrix<S>) -> Matrix<S> {
    let element = |i: usize, j: usize| a[i][0] * b[0][j] + a[i][1] * b[1][j];
    [[element(0, 0), element(0, 1)], [element(1, 0), element(1, 1)]]
}
