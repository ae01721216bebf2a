//! Vectors, rotations, poses, twists and wrenches in the plane, generic over the scalar.

use crate::Scalar;

/// A vector in the plane, or a row of a 2 x 2 matrix.
pub type Vector<S> = [S; 2];

/// Dot product of two vectors.
#[inline(always)]
pub fn dot<S: Scalar>(a: Vector<S>, b: Vector<S>) -> S {
    a[0] * b[0] + a[1] * b[1]
}

/// The out-of-plane component of the cross product `a × b`.
#[inline(always)]
pub fn cross<S: Scalar>(a: Vector<S>, b: Vector<S>) -> S {
    a[0] * b[1] - a[1] * b[0]
}

/// `a` rotated by +90 degrees: `(-a_y, a_x)`.
///
/// ```
/// use augsim_physics::push::planar::rot90;
/// assert_eq!(rot90([1.0, 2.0]), [-2.0, 1.0]);
/// ```
#[inline(always)]
pub fn rot90<S: Scalar>(a: Vector<S>) -> Vector<S> {
    [-a[1], a[0]]
}

/// Vector sum `a + b`.
#[inline(always)]
pub fn add<S: Scalar>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] + b[0], a[1] + b[1]]
}

/// Vector difference `a - b`.
#[inline(always)]
pub fn sub<S: Scalar>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] - b[0], a[1] - b[1]]
}

/// The vector `a` times the number `s`.
#[inline(always)]
pub fn scale<S: Scalar>(a: Vector<S>, s: S) -> Vector<S> {
    [a[0] * s, a[1] * s]
}

/// Euclidean length of a vector.
#[inline(always)]
pub fn norm<S: Scalar>(a: Vector<S>) -> S {
    dot(a, a).sqrt()
}

/// Lifts a vector of plain numbers to the scalar `S`, with zero derivatives.
#[inline(always)]
pub fn constant<S: Scalar>(a: Vector<f64>) -> Vector<S> {
    a.map(S::constant)
}

/// A rotation in the plane, stored as cosine and sine.
#[derive(Clone, Copy, Debug)]
pub struct Rotation<S> {
    /// Cosine of the rotation angle.
    pub cos: S,
    /// Sine of the rotation angle.
    pub sin: S,
}

impl<S: Scalar> Rotation<S> {
    /// The rotation by `angle`, rad, counter-clockwise.
    #[inline(always)]
    pub fn new(angle: S) -> Self {
        Self { cos: angle.cos(), sin: angle.sin() }
    }

    /// Converts a vector from the body frame to the world frame.
    #[inline(always)]
    pub fn to_world(self, a: Vector<S>) -> Vector<S> {
        [self.cos * a[0] - self.sin * a[1], self.sin * a[0] + self.cos * a[1]]
    }

    /// Converts a vector from the world frame to the body frame.
    #[inline(always)]
    pub fn to_body(self, a: Vector<S>) -> Vector<S> {
        [self.cos * a[0] + self.sin * a[1], self.cos * a[1] - self.sin * a[0]]
    }
}

/// Pose of the object in the world: area centroid, m, and counter-clockwise angle, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<S> {
    /// Position of the area centroid, m.
    pub position: Vector<S>,
    /// Angle of the object, rad, counter-clockwise; not wrapped.
    pub angle: S,
}

impl<S: Scalar> Pose<S> {
    /// A pose from `x` and `y`, m, and the angle, rad.
    pub fn new(x: S, y: S, angle: S) -> Self {
        Self { position: [x, y], angle }
    }

    /// World coordinates of a point given in the body frame, m.
    pub fn to_world(&self, point: Vector<S>) -> Vector<S> {
        add(self.position, Rotation::new(self.angle).to_world(point))
    }

    /// Body-frame coordinates of a point given in the world frame, m.
    ///
    /// ```
    /// use augsim_physics::push::Pose;
    /// let pose = Pose::new(1.0, 0.0, std::f64::consts::FRAC_PI_2);
    /// let in_body = pose.to_body([1.0, 2.0]);
    /// assert!((in_body[0] - 2.0).abs() < 1e-15 && in_body[1].abs() < 1e-15);
    /// let back = pose.to_world(in_body);
    /// assert!((back[0] - 1.0).abs() < 1e-15 && (back[1] - 2.0).abs() < 1e-15);
    /// ```
    pub fn to_body(&self, point: Vector<S>) -> Vector<S> {
        Rotation::new(self.angle).to_body(sub(point, self.position))
    }

    /// Copy of the pose as plain numbers, without derivatives.
    pub fn value(&self) -> Pose<f64> {
        Pose { position: self.position.map(S::value), angle: self.angle.value() }
    }

    /// Copy of the pose as constants of another scalar.
    pub fn lift<T: Scalar>(&self) -> Pose<T> {
        let v = self.value();
        Pose { position: constant(v.position), angle: T::constant(v.angle) }
    }

    /// Pose of the object after moving with `twist` for a time `h`, s.
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
    /// Velocity of the body's origin, m/s.
    pub velocity: Vector<S>,
    /// Angular velocity of the body, rad/s.
    pub rotation: S,
}

impl<S: Scalar> Twist<S> {
    /// The twist of a body at rest.
    pub fn zero() -> Self {
        Self { velocity: [S::zero(); 2], rotation: S::zero() }
    }

    /// Velocity of the body's point `r` (relative to its origin, m), m/s.
    #[inline(always)]
    pub fn at(&self, r: Vector<S>) -> Vector<S> {
        add(self.velocity, scale(rot90(r), self.rotation))
    }
}

/// Force, and moment about the origin of the body.
///
/// Both are in units of the sliding force `mu_s m g` unless stated otherwise, so that the moment is in
/// metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrench<S> {
    /// Force of the wrench.
    pub force: Vector<S>,
    /// Moment of the wrench about the origin of the body.
    pub moment: S,
}

impl<S: Scalar> Wrench<S> {
    /// The zero wrench.
    pub fn zero() -> Self {
        Self { force: [S::zero(); 2], moment: S::zero() }
    }
}
