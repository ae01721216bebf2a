//! One instant of a push: from pose and rod to contact, twist and force.

use super::contact::{ContactFriction, Mode, Response, Touch};
use super::field::Field;
use super::near::Near;
use super::planar::{Pose, Rotation, Twist, Vector, Wrench, add, cross, scale, sub};
use super::response::respond_near;
use super::setting::{Anisotropy, Friction, Setting};
use super::support::{Inertia, Support};
use super::surface::{Matrix, Surface};
use super::world::World;
use crate::Scalar;

/// Gap up to which rod and object count as touching, m.
pub(super) const TOUCHING_M: f64 = 1e-7;

/// How often the force that moves the pressure is found again.
const HEIGHT_REPETITIONS: usize = 3;

/// A push at one instant, in the world.
#[derive(Clone, Copy, Debug)]
pub struct Instant<S> {
    /// Mode of the contact.
    pub mode: Mode,
    /// The object's twist.
    pub twist: Twist<S>,
    /// Force of the rod on the object, N.
    pub force: Vector<S>,
    /// Closest point of the object to the rod, in the body, m.
    pub contact: Vector<S>,
    /// Outward unit normal there, in the body.
    pub outward: Vector<S>,
    /// Gap between rod and object, m; negative where they overlap.
    pub gap: S,
    /// Velocity of the rod relative to the object along the tangent, m/s; see [`Response::slip`].
    pub slip: S,
}

impl<S: Scalar> Instant<S> {
    /// This motion, which the next instant's is near, under a rod that moves with `velocity`, m/s.
    pub(super) fn near(&self, velocity: Vector<S>) -> Near {
        let rotation = self.twist.rotation.value();
        Near { mode: self.mode, slip: self.slip.value(), rotation, rod: velocity.map(S::value) }
    }
}

/// A world with its numbers filled in, ready to be asked about instants.
#[derive(Clone, Debug)]
pub(super) struct Scene<'a, S> {
    pub world: &'a World,
    pub setting: Setting<S>,
    pub field: Option<&'a Field>,
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
    pub fn new(world: &'a World, parameters: &[S], field: Option<&'a Field>) -> Self {
        let mut setting = world.setting(parameters);
        if field.is_some() {
            setting.friction = Friction::Patches;
        }
        Self { world, setting, field, weights: Vec::new() }
    }

    /// Whether objects coast.
    pub fn has_inertia(&self) -> bool {
        self.setting.inertia.is_some()
    }

    /// Reads the friction map where the object is. Within a sub-step the map counts as moving with the object.
    pub fn place(&mut self, pose: &Pose<S>) {
        if let Some(field) = self.field {
            self.world.weigh(field, &pose.value(), &mut self.weights);
        }
    }

    /// Where the rod really is.
    pub fn true_rod(&self, reported: Vector<S>) -> Vector<S> {
        let registered = self.setting.registration.map_or(reported, |r| r.position(reported));
        self.setting.tip_offset_m.map_or(registered, |offset| add(registered, offset))
    }

    /// How fast the rod really moves.
    pub fn true_velocity(&self, reported: Vector<S>) -> Vector<S> {
        self.setting.registration.map_or(reported, |r| r.velocity(reported))
    }

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

    /// Gap between the object and a rod that is not bent, m, and the outward normal in the world.
    pub fn gap(&self, pose: &Pose<S>, rod: Vector<S>) -> (S, Vector<S>) {
        let g = self.geometry(pose, rod);
        (g.gap, g.rotation.to_world(g.outward))
    }

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

    fn metric(&self, rotation: Rotation<S>) -> Option<Matrix<S>> {
        let s = &self.setting;
        if s.table_anisotropy.is_none() && s.object_anisotropy.is_none() {
            return None;
        }
        let on_table = s.table_anisotropy.map(|a| {
            // R(-θ) H R(θ)
            let h = stretch(&a);
            let column = |e: Vector<S>| rotation.to_body(super::surface::apply(&h, rotation.to_world(e)));
            let (zero, one) = (S::zero(), S::constant(1.0));
            let (x, y) = (column([one, zero]), column([zero, one]));
            [[x[0], y[0]], [x[1], y[1]]]
        });
        let on_object = s.object_anisotropy.map(|a| stretch(&a));
        match (on_table, on_object) {
            (Some(t), Some(o)) => Some(product(&t, &o)),
            (t, o) => t.or(o),
        }
    }

    /// Everything that resists the object, in the body frame; `pushed` is the force of the rod in the body, in sliding forces, as far as
    /// it is known.
    fn support(
        &self,
        rotation: Rotation<S>,
        pushed: Option<Vector<S>>,
        inertia: Option<(S, Twist<S>)>,
    ) -> Support<'_, S> {
        let s = &self.setting;
        let mut support = Support::plain(self.surface());
        support.metric = self.metric(rotation);
        let mut pressed = s.pressure_offset_m.unwrap_or([S::zero(); 2]);
        if let (Some(height), Some(force)) = (s.push_height_m, pushed) {
            pressed = add(pressed, scale(force, height * s.support_friction));
        }
        support.centre = pressed;
        if let Some(gradient) = s.friction_gradient_per_m {
            let g = rotation.to_body(gradient);
            let [xx, xy, yy] = self.world.moments.second_m2;
            support.centre = add(support.centre, [g[0] * xx + g[1] * xy, g[0] * xy + g[1] * yy]);
        }
        if let Some(downhill) = s.downhill {
            let force = scale(rotation.to_body(downhill), S::constant(1.0) / s.support_friction);
            support.load = Wrench { force, moment: cross(pressed, force) };
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

    /// The response of an object that the rod touches. Where the force moves the pressure it is found by repetition: the
    /// effect on the response is small.
    fn response(
        &self,
        g: &Geometry<S>,
        velocity: Vector<S>,
        inertia: Option<(S, Twist<S>)>,
        near: Option<Near>,
    ) -> Response<S> {
        let touch = Touch { point: g.contact, normal: g.outward.map(|x| -x), velocity };
        let s = &self.setting;
        let friction = ContactFriction { at_rest: s.contact_friction, rise_s_per_m: s.slip_rise_s_per_m };
        let mut response = respond_near(&self.support(g.rotation, None, inertia), &touch, &friction, near);
        if s.push_height_m.is_some() {
            for _ in 0..HEIGHT_REPETITIONS {
                if response.mode == Mode::Separate {
                    break;
                }
                response = respond_near(
                    &self.support(g.rotation, Some(response.force), inertia),
                    &touch,
                    &friction,
                    near,
                );
            }
        }
        response
    }

    /// The instant at which the object is at `pose` and the (unbent) rod at `rod`, moving with `velocity`. `touching` treats
    /// the pair as touching whatever the gap; otherwise the gap decides.
    #[inline]
    pub fn at(
        &self,
        pose: &Pose<S>,
        rod: Vector<S>,
        velocity: Vector<S>,
        touching: bool,
        near: Option<Near>,
    ) -> Instant<S> {
        let g = self.geometry(pose, rod);
        if !touching && g.gap.value() > TOUCHING_M {
            return self.instant(&g, Response::without_force(Mode::Free, Twist::zero()));
        }
        let response = self.response(&g, g.rotation.to_body(velocity), None, near);
        self.instant(&g, response)
    }

    /// The twist at the end of an implicit Euler step of `h` that begins at `pose` with `previous`: the rod, which moves with
    /// `velocity`, is not passed.
    pub fn after(
        &self,
        pose: &Pose<S>,
        rod: Vector<S>,
        velocity: Vector<S>,
        h: S,
        previous: Twist<S>,
        near: Option<Near>,
    ) -> Instant<S> {
        let g = self.geometry(pose, rod);
        let u = g.rotation.to_body(velocity);
        let closing = if g.gap.value() > 0.0 { g.gap / h } else { S::zero() };
        let response = self.response(&g, add(u, scale(g.outward, closing)), Some((h, previous)), near);
        let mut instant = self.instant(&g, response);
        if instant.mode == Mode::Separate && g.gap.value() > TOUCHING_M {
            instant.mode = Mode::Free;
        }
        instant
    }

    fn instant(&self, g: &Geometry<S>, response: Response<S>) -> Instant<S> {
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

/// `H = A^½ = R diag(√ratio, 1/√ratio) Rᵀ`.
fn stretch<S: Scalar>(a: &Anisotropy<S>) -> Matrix<S> {
    let along = a.ratio.sqrt();
    let across = S::constant(1.0) / along;
    let (c, s) = (a.angle_rad.cos(), a.angle_rad.sin());
    let off = (along - across) * c * s;
    [[along * c * c + across * s * s, off], [off, along * s * s + across * c * c]]
}

fn product<S: Scalar>(a: &Matrix<S>, b: &Matrix<S>) -> Matrix<S> {
    let at = |i: usize, j: usize| a[i][0] * b[0][j] + a[i][1] * b[1][j];
    [[at(0, 0), at(0, 1)], [at(1, 0), at(1, 1)]]
}
