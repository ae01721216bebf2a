//! Vectors, poses, twists and wrenches of the plane, over any scalar.

use crate::Scalar;

/// A vector of the plane, or a matrix row.
pub type Vector<S> = [S; 2];

/// Scalar product.
#[inline(always)]
pub fn dot<S: Scalar>(a: Vector<S>, b: Vector<S>) -> S {
    a[0] * b[0] + a[1] * b[1]
}

/// The component of `a × b` out of the plane.
#[inline(always)]
pub fn cross<S: Scalar>(a: Vector<S>, b: Vector<S>) -> S {
    a[0] * b[1] - a[1] * b[0]
}

/// `a` turned by +90 degrees: `(-a_y, a_x)`.
///
/// ```
/// use augsim_physics::push::planar::rot90;
/// assert_eq!(rot90([1.0, 2.0]), [-2.0, 1.0]);
/// ```
#[inline(always)]
pub fn rot90<S: Scalar>(a: Vector<S>) -> Vector<S> {
    [-a[1], a[0]]
}

/// `a + b`.
#[inline(always)]
pub fn add<S: Scalar>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] + b[0], a[1] + b[1]]
}

/// `a - b`.
#[inline(always)]
pub fn sub<S: Scalar>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] - b[0], a[1] - b[1]]
}

/// `a s`.
#[inline(always)]
pub fn scale<S: Scalar>(a: Vector<S>, s: S) -> Vector<S> {
    [a[0] * s, a[1] * s]
}

/// Length.
#[inline(always)]
pub fn norm<S: Scalar>(a: Vector<S>) -> S {
    dot(a, a).sqrt()
}

/// A constant vector: derivatives zero.
#[inline(always)]
pub fn constant<S: Scalar>(a: Vector<f64>) -> Vector<S> {
    a.map(S::constant)
}

/// A rotation, kept as cosine and sine.
#[derive(Clone, Copy, Debug)]
pub struct Rotation<S> {
    /// Cosine of the angle.
    pub cos: S,
    /// Sine of the angle.
    pub sin: S,
}

impl<S: Scalar> Rotation<S> {
    /// Rotation by `angle`, rad, counter-clockwise.
    #[inline(always)]
    pub fn new(angle: S) -> Self {
        Self { cos: angle.cos(), sin: angle.sin() }
    }

    /// Turns a vector of the body's frame into one of the world's.
    #[inline(always)]
    pub fn to_world(self, a: Vector<S>) -> Vector<S> {
        [self.cos * a[0] - self.sin * a[1], self.sin * a[0] + self.cos * a[1]]
    }

    /// Turns a vector of the world's frame into one of the body's.
    #[inline(always)]
    pub fn to_body(self, a: Vector<S>) -> Vector<S> {
        [self.cos * a[0] + self.sin * a[1], self.cos * a[1] - self.sin * a[0]]
    }
}

/// Where the object is: the area centroid in the world, m, and the angle, rad, counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<S> {
    /// Position of the area centroid, m.
    pub position: Vector<S>,
    /// Angle, rad; not wrapped.
    pub angle: S,
}

impl<S: Scalar> Pose<S> {
    /// A pose from `x` and `y`, m, and the angle, rad.
    pub fn new(x: S, y: S, angle: S) -> Self {
        Self { position: [x, y], angle }
    }

    /// Where a point of the body is in the world, m.
    pub fn to_world(&self, point: Vector<S>) -> Vector<S> {
        add(self.position, Rotation::new(self.angle).to_world(point))
    }

    /// Where a point of the world is in the body, m.
    ///
    /// ```
    /// use augsim_physics::push::Pose;
    /// let pose = Pose::new(1.0, 0.0, std::f64::consts::FRAC_PI_2);
    /// let seen = pose.to_body([1.0, 2.0]);
    /// assert!((seen[0] - 2.0).abs() < 1e-15 && seen[1].abs() < 1e-15);
    /// let back = pose.to_world(seen);
    /// assert!((back[0] - 1.0).abs() < 1e-15 && (back[1] - 2.0).abs() < 1e-15);
    /// ```
    pub fn to_body(&self, point: Vector<S>) -> Vector<S> {
        Rotation::new(self.angle).to_body(sub(point, self.position))
    }

    /// Copies the pose without derivatives.
    pub fn value(&self) -> Pose<f64> {
        Pose { position: self.position.map(S::value), angle: self.angle.value() }
    }

    /// Copies the pose in another scalar, as a constant.
    pub fn lift<T: Scalar>(&self) -> Pose<T> {
        let v = self.value();
        Pose { position: constant(v.position), angle: T::constant(v.angle) }
    }

    /// The pose after moving by `twist` for `h`.
    #[inline(always)]
    pub(super) fn advanced(&self, twist: &Twist<S>, h: S) -> Self {
        Self {
            position: add(self.position, scale(twist.velocity, h)),
            angle: self.angle + twist.rotation * h,
        }
    }
}

/// Velocity of the body's origin, m/s, and angular velocity, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist<S> {
    /// Velocity of the origin, m/s.
    pub velocity: Vector<S>,
    /// Angular velocity, rad/s.
    pub rotation: S,
}

impl<S: Scalar> Twist<S> {
    /// No motion.
    pub fn zero() -> Self {
        Self { velocity: [S::zero(); 2], rotation: S::zero() }
    }

    /// Velocity of the body's point `r`, m/s.
    #[inline(always)]
    pub fn at(&self, r: Vector<S>) -> Vector<S> {
        add(self.velocity, scale(rot90(r), self.rotation))
    }
}

/// Force, and moment about the body's origin; in units of the sliding force `mu_s m g` where not said otherwise, so that the
/// moment is in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrench<S> {
    /// Force.
    pub force: Vector<S>,
    /// Moment about the origin.
    pub moment: S,
}

impl<S: Scalar> Wrench<S> {
    /// No force.
    pub fn zero() -> Self {
        Self { force: [S::zero(); 2], moment: S::zero() }
    }
}
