//! Rotation matrices by rows, and inertia tensors along other axes.

use crate::description::{Inertia, Placement};

/// A matrix by rows.
pub(crate) type Matrix = [[f64; 3]; 3];

/// The matrix that rotates nothing.
pub(crate) const IDENTITY: Matrix = Placement::IDENTITY.rotation;

/// The product of two matrices.
pub(crate) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// The transposed matrix; for a rotation, its inverse.
pub(crate) fn transpose(a: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// The product of a matrix and a vector.
pub(crate) fn apply(a: &Matrix, v: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| (0..3).map(|k| a[i][k] * v[k]).sum())
}

/// The sum of two vectors.
pub(crate) fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + b[i])
}

/// The difference of two vectors.
pub(crate) fn subtract(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

/// The inner product of two vectors.
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

/// The vector product.
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The vector with length 1; `None` if its length is below 1e-10 or not finite.
///
/// The vector is scaled by its largest component first, so that squares neither overflow nor vanish.
pub(crate) fn normalize<const N: usize>(v: [f64; N]) -> Option<[f64; N]> {
    let largest = v.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    if !(1e-10..=f64::MAX).contains(&largest) {
        return None;
    }
    let scaled = v.map(|x| x / largest);
    let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
    Some(scaled.map(|x| x / length))
}

/// The rotation by `angle` rad about an axis of length 1.
pub(crate) fn about_axis(axis: [f64; 3], angle: f64) -> Matrix {
    let (sin, cos) = angle.sin_cos();
    let [x, y, z] = axis;
    let turned = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    std::array::from_fn(|i| {
        std::array::from_fn(|j| cos * IDENTITY[i][j] + sin * turned[i][j] + (1.0 - cos) * axis[i] * axis[j])
    })
}

/// The rotation by roll, pitch and yaw of a URDF file: about the fixed axes x, then y, then z, rad.
pub(crate) fn from_roll_pitch_yaw(angles: [f64; 3]) -> Matrix {
    let turn = |k: usize| about_axis(IDENTITY[k], angles[k]);
    product(&turn(2), &product(&turn(1), &turn(0)))
}

/// Roll, pitch and yaw of a rotation, rad: the inverse of [`from_roll_pitch_yaw`].
pub(crate) fn to_roll_pitch_yaw(r: &Matrix) -> [f64; 3] {
    let cos_pitch = r[0][0].hypot(r[1][0]);
    let pitch = (-r[2][0]).atan2(cos_pitch);
    // At a pitch of a quarter turn, roll and yaw turn about the same axis: the yaw is chosen as 0.
    if cos_pitch < 1e-9 {
        return [(-r[1][2]).atan2(r[1][1]), pitch, 0.0];
    }
    [r[2][1].atan2(r[2][2]), pitch, r[1][0].atan2(r[0][0])]
}

/// The rotation of a quaternion w, x, y, z of length 1.
pub(crate) fn from_quaternion([w, x, y, z]: [f64; 4]) -> Matrix {
    [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
}

/// The quaternion w, x, y, z of a rotation, with the largest component positive.
pub(crate) fn to_quaternion(r: &Matrix) -> [f64; 4] {
    // 4 times the square of each component (Shepperd 1978); the largest one loses no digits.
    let squares = [
        1.0 + r[0][0] + r[1][1] + r[2][2],
        1.0 + r[0][0] - r[1][1] - r[2][2],
        1.0 - r[0][0] + r[1][1] - r[2][2],
        1.0 - r[0][0] - r[1][1] + r[2][2],
    ];
    let largest = (1..4).fold(0, |best, k| if squares[k] > squares[best] { k } else { best });
    let (a, b, c) = (r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]);
    let (d, e, f) = (r[0][1] + r[1][0], r[0][2] + r[2][0], r[1][2] + r[2][1]);
    let s = squares[largest];
    let raw = [[s, a, b, c], [a, s, d, e], [b, d, s, f], [c, e, f, s]][largest];
    normalize(raw).unwrap_or([1.0, 0.0, 0.0, 0.0])
}

/// The symmetric matrix of moments xx, yy, zz and products xy, xz, yz.
pub(crate) fn tensor([xx, yy, zz, xy, xz, yz]: [f64; 6]) -> Matrix {
    [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
}

/// Moments xx, yy, zz and products xy, xz, yz of a symmetric matrix.
pub(crate) fn moments(t: &Matrix) -> [f64; 6] {
    [t[0][0], t[1][1], t[2][2], t[0][1], t[0][2], t[1][2]]
}

/// A tensor that is given along the axes of a frame, along the axes in which the frame has the orientation `rotation`.
///
/// An orientation that rotates nothing keeps every bit.
pub(crate) fn rotate_tensor(rotation: &Matrix, values: [f64; 6]) -> [f64; 6] {
    if *rotation == IDENTITY {
        return values;
    }
    moments(&product(rotation, &product(&tensor(values), &transpose(rotation))))
}

/// The placement of a frame in a third one: `outer` places the second frame in the first, `inner` the third in the second.
pub(crate) fn compose(outer: &Placement, inner: &Placement) -> Placement {
    Placement {
        rotation: product(&outer.rotation, &inner.rotation),
        translation_m: add(outer.translation_m, apply(&outer.rotation, inner.translation_m)),
    }
}

/// The inertia of several bodies together, in their common frame; `None` for no mass.
pub(crate) fn total_inertia(parts: &[Inertia]) -> Option<Inertia> {
    let mass_kg: f64 = parts.iter().map(|part| part.mass_kg).sum();
    if mass_kg <= 0.0 || parts.is_empty() {
        return None;
    }
    let centre_m = std::array::from_fn(|i| {
        parts.iter().map(|part| part.mass_kg * part.centre_m[i]).sum::<f64>() / mass_kg
    });
    let mut inertia_kg_m2 = [0.0; 6];
    for part in parts {
        // Parallel axes: I += m (|d|^2 1 - d d^T).
        let d = subtract(part.centre_m, centre_m);
        let shift: Matrix =
            std::array::from_fn(|i| std::array::from_fn(|j| dot(d, d) * IDENTITY[i][j] - d[i] * d[j]));
        let moved = moments(&shift);
        for k in 0..6 {
            inertia_kg_m2[k] += part.inertia_kg_m2[k] + part.mass_kg * moved[k];
        }
    }
    Some(Inertia { mass_kg, centre_m, inertia_kg_m2 })
}
