//! A piecewise-linear function of one feature, for effects that the library does not have.

use super::{Flight, Law, Measurement};
use crate::Scalar;
use crate::ball::impact::Impact;
use crate::library::Location;
use crate::scalar::{axpy, cross, dot};

/// Kind of effect by which model files name a table.
pub const TABLE_KIND: &str = "table";

/// Quantity to which a table adds its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// The table adds to the coefficient of restitution.
    Restitution,
    /// The table adds to the quadratic drag coefficient, 1/m.
    Drag,
    /// The table adds to the acceleration along x, m/s².
    AccelerationX,
    /// The table adds to the acceleration along y, m/s².
    AccelerationY,
    /// The table adds to the acceleration along z, m/s².
    AccelerationZ,
    /// The table adds to the Magnus coefficient.
    Magnus,
    /// The table adds to the change of the tangential velocity along x at an impact, m/s.
    TangentialJump,
    /// The table adds to the measured x, m.
    SensorX,
    /// The table adds to the measured z, m.
    SensorZ,
}

/// Feature (independent variable) of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    /// Time since the release, s.
    Time,
    /// Session time, s, relative to the reference time of the session clock.
    Clock,
    /// Number of preceding bounces, 0 at the first.
    Bounce,
    /// Approach speed of an impact along the ground's normal, m/s.
    NormalSpeed,
    /// Tangential velocity of the ball at the impact along x, m/s.
    TangentialSpeed,
    /// Slip velocity of the contact point along x, m/s.
    Slip,
    /// Magnitude of the ball's spin, rad/s.
    Spin,
    /// Speed of the ball in flight, m/s.
    Speed,
    /// Position of the ball along x, m.
    X,
    /// Position of the ball along y, m.
    Y,
    /// Height of the ball, m.
    Z,
    /// Velocity of the ball along x, m/s.
    VelocityX,
    /// Velocity of the ball along z, m/s.
    VelocityZ,
}

/// Implements `ALL`, `name` and `from_name` for an enum without fields.
macro_rules! names {
    ($type:ident: $($variant:ident = $name:literal),* $(,)?) => {
        impl $type {
            /// All variants of this enum, in order.
            pub const ALL: &'static [$type] = &[$($type::$variant),*];
            /// Name of this variant in model files and results.
            pub fn name(self) -> &'static str {
                match self { $($type::$variant => $name),* }
            }
            /// The variant with this name; `None` if there is none.
            pub fn from_name(name: &str) -> Option<Self> {
                match name { $($name => Some($type::$variant),)* _ => None }
            }
        }
    };
}
names!(Target: Restitution = "restitution", Drag = "drag", AccelerationX = "acceleration-x", AccelerationY = "acceleration-y",
    AccelerationZ = "acceleration-z", Magnus = "magnus", TangentialJump = "tangential-jump", SensorX = "sensor-x", SensorZ = "sensor-z");
names!(Feature: Time = "time", Clock = "clock", Bounce = "bounce", NormalSpeed = "impact-speed", TangentialSpeed = "tangential-speed",
    Slip = "slip", Spin = "spin", Speed = "speed", X = "x", Y = "y", Z = "height", VelocityX = "velocity-x", VelocityZ = "velocity-z");

impl Feature {
    /// Unit of the feature in reports.
    pub fn unit(self) -> &'static str {
        match self {
            Feature::Time | Feature::Clock => "s",
            Feature::Bounce => "",
            Feature::Spin => "rad/s",
            Feature::X | Feature::Y | Feature::Z => "m",
            _ => "m/s",
        }
    }
}

impl Target {
    /// Part of the simulation in which the target acts: flight, impact or sensor.
    pub fn location(self) -> Location {
        match self {
            Target::Restitution | Target::TangentialJump => Location::Impact,
            Target::SensorX | Target::SensorZ => Location::Sensor,
            _ => Location::Flight,
        }
    }

    /// Unit of the table's values; empty for a dimensionless number.
    pub fn unit(self) -> &'static str {
        match self {
            Target::Restitution | Target::Magnus => "",
            Target::Drag => "1/m",
            Target::AccelerationX | Target::AccelerationY | Target::AccelerationZ => "m/s²",
            Target::TangentialJump => "m/s",
            Target::SensorX | Target::SensorZ => "m",
        }
    }
}

/// A piecewise-linear function of one feature with uniform knots, constant outside them.
///
/// The values at the knots are its parameters, in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Quantity to which the table adds its values.
    pub target: Target,
    /// Feature (independent variable) of the table.
    pub feature: Feature,
    /// Position of the first knot, in the unit of the feature.
    pub first: f64,
    /// Position of the last knot, in the unit of the feature.
    pub last: f64,
}

impl Table {
    /// Value of the table at the feature value `x`, given its values `p` at the knots; 0 without knots.
    pub fn interpolate<S: Scalar>(&self, p: &[S], x: S) -> S {
        let Some(last) = p.len().checked_sub(1) else {
            return S::zero();
        };
        let scale = last as f64 / (self.last - self.first).max(1e-300);
        let u = (x - self.first) * scale;
        if last == 0 || u.value() <= 0.0 {
            p[0]
        } else if u.value() >= last as f64 {
            p[last]
        } else {
            let i = u.value() as usize;
            p[i] + (p[i + 1] - p[i]) * (u - i as f64)
        }
    }

    /// Value of the table's feature in flight.
    fn flight_feature<S: Scalar>(&self, f: &Flight<'_, S>) -> S {
        match self.feature {
            Feature::Time => f.time,
            Feature::Clock => f.time + f.covariates.clock_s,
            Feature::X => f.position[0],
            Feature::Y => f.position[1],
            Feature::Z => f.position[2],
            Feature::VelocityX => f.velocity[0],
            Feature::VelocityZ => f.velocity[2],
            Feature::Spin => dot(&f.spin, &f.spin).sqrt(),
            _ => dot(&f.airspeed, &f.airspeed).sqrt(),
        }
    }

    /// Value of the table's feature at an impact.
    fn impact_feature<S: Scalar>(&self, i: &Impact<'_, S>) -> S {
        match self.feature {
            Feature::Time => i.time,
            Feature::Clock => i.clock(),
            Feature::Bounce => S::constant(i.index as f64),
            Feature::TangentialSpeed | Feature::VelocityX => i.tangential[0],
            Feature::Slip => i.slip[0],
            Feature::Spin => dot(&i.spin, &i.spin).sqrt(),
            Feature::X => i.position[0],
            Feature::Y => i.position[1],
            _ => i.normal_speed,
        }
    }

    /// Value of the table's feature at a measurement, from true positions instead of measured ones.
    fn sensor_feature<S: Scalar>(&self, s: &Measurement<S>) -> S {
        match self.feature {
            Feature::X => s.truth[0],
            Feature::Y => s.truth[1],
            Feature::VelocityX => s.velocity[0],
            Feature::VelocityZ => s.velocity[2],
            Feature::Speed => dot(&s.velocity, &s.velocity).sqrt(),
            _ => s.truth[2],
        }
    }
}

impl<S: Scalar> Law<S> for Table {
    fn changes_flight(&self) -> bool {
        self.target.location() == Location::Flight
    }
    fn acceleration(&self, p: &[S], flight: &Flight<'_, S>, a: &mut [S; 3]) {
        let value = self.interpolate(p, self.flight_feature(flight));
        match self.target {
            Target::Drag => {
                let u = &flight.airspeed;
                *a = axpy(a, u, -(value * dot(u, u).sqrt()));
            }
            Target::Magnus => *a = axpy(a, &cross(&flight.spin, &flight.velocity), value),
            Target::AccelerationX => a[0] += value,
            Target::AccelerationY => a[1] += value,
            Target::AccelerationZ => a[2] += value,
            _ => {}
        }
    }
    fn restitution(&self, p: &[S], impact: &Impact<'_, S>, e: S) -> S {
        match self.target {
            Target::Restitution => e + self.interpolate(p, self.impact_feature(impact)),
            _ => e,
        }
    }
    fn tangential(&self, p: &[S], impact: &Impact<'_, S>, j: &mut [S; 3]) {
        if self.target == Target::TangentialJump {
            j[0] += self.interpolate(p, self.impact_feature(impact));
        }
    }
    fn changes_measurement(&self) -> bool {
        self.target.location() == Location::Sensor
    }
    fn uses_velocity(&self) -> bool {
        let velocity = [Feature::VelocityX, Feature::VelocityZ, Feature::Speed];
        self.target.location() == Location::Sensor && velocity.contains(&self.feature)
    }
    fn observe(&self, p: &[S], sight: &mut Measurement<S>) {
        match self.target {
            Target::SensorX => sight.position[0] += self.interpolate(p, self.sensor_feature(sight)),
            Target::SensorZ => sight.position[2] += self.interpolate(p, self.sensor_feature(sight)),
            _ => {}
        }
    }
}
