//! Physical consistency of inertial parameters: a body with these parameters can exist.
//!
//! The ten parameters of a body are `[m, m cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz]`: mass, first moments, and the inertia
//! tensor about the origin of the frame, with tensor elements (`Ixy` is minus the integral of x y dm). With the second moments
//! `S = 1/2 trace(I) 1 - I`, which are the integrals of x x^T dm, the pseudo-inertia is
//!
//! ```text
//!     J = [ S    h ]        h = m c        (1)
//!         [ h^T  m ]
//! ```
//!
//! A distribution of mass with these parameters exists if and only if J is positive definite (Wensing, Kim and Slotine, "Linear
//! matrix inequalities for physically consistent inertial parameter identification", RA-L 2018). It is, by construction, for
//!
//! ```text
//!     J = U U^T,   U = e^a [ e^d1  s12   s13   t1 ]
//!                          [       e^d2  s23   t2 ]        (2)
//!                          [             e^d3  t3 ]
//!                          [                   1  ]
//! ```
//!
//! for any real log-Cholesky coordinates `[a, d1, d2, d3, s12, s23, s13, t1, t2, t3]` (Rucker and Wensing, "Smooth
//! parameterization of rigid-body inertia", RA-L 2022).

mod nearest;

pub use nearest::{BaseEstimate, ConsistencyError, Consistent, nearest_consistent};

use augsim_linear::{Mat, symmetric_eigen};

/// Ten inertial parameters of a body.
pub type Parameters = [f64; 10];

/// Ten log-Cholesky coordinates of a body.
pub type LogCholesky = [f64; 10];

type Matrix4 = [[f64; 4]; 4];

/// Pseudo-inertia (1) of a body.
pub fn pseudo_inertia(parameters: &Parameters) -> Matrix4 {
    let [m, hx, hy, hz, xx, xy, xz, yy, yz, zz] = *parameters;
    let half_trace = 0.5 * (xx + yy + zz);
    [
        [half_trace - xx, -xy, -xz, hx],
        [-xy, half_trace - yy, -yz, hy],
        [-xz, -yz, half_trace - zz, hz],
        [hx, hy, hz, m],
    ]
}

/// Parameters with this pseudo-inertia (1); the map is linear.
pub fn from_pseudo_inertia(j: &Matrix4) -> Parameters {
    let trace = j[0][0] + j[1][1] + j[2][2];
    [
        j[3][3],
        j[0][3],
        j[1][3],
        j[2][3],
        trace - j[0][0],
        -j[0][1],
        -j[0][2],
        trace - j[1][1],
        -j[1][2],
        trace - j[2][2],
    ]
}

/// Whether a body with these parameters can exist: its pseudo-inertia is positive definite.
///
/// A point mass, a thin rod and a thin plate are limits that are not consistent.
pub fn is_consistent(parameters: &Parameters) -> bool {
    log_cholesky(parameters).is_some()
}

/// Log-Cholesky coordinates (2) of a body; `None` if its parameters are not consistent.
pub fn log_cholesky(parameters: &Parameters) -> Option<LogCholesky> {
    let j = pseudo_inertia(parameters);
    let m = j[3][3];
    // A comparison with NaN is false, so that parameters that are not numbers give `None`.
    let root = |square: f64| (square > 0.0 && square.is_finite()).then(|| square.sqrt());
    let scale = root(m)?;
    let t = [j[0][3] / m, j[1][3] / m, j[2][3] / m];
    // Second moments about the centre of mass for a mass of 1: V V^T, with V the upper left part of U / e^a.
    let s = |i: usize, k: usize| j[i][k] / m - t[i] * t[k];
    let v33 = root(s(2, 2))?;
    let (s13, s23) = (s(0, 2) / v33, s(1, 2) / v33);
    let v22 = root(s(1, 1) - s23 * s23)?;
    let s12 = (s(0, 1) - s13 * s23) / v22;
    let v11 = root(s(0, 0) - s12 * s12 - s13 * s13)?;
    let coordinates = [scale.ln(), v11.ln(), v22.ln(), v33.ln(), s12, s23, s13, t[0], t[1], t[2]];
    coordinates.iter().all(|value| value.is_finite()).then_some(coordinates)
}

/// Upper triangular factor U of (2).
fn factor(coordinates: &LogCholesky) -> Matrix4 {
    let [a, d1, d2, d3, s12, s23, s13, t1, t2, t3] = *coordinates;
    let scale = a.exp();
    let u =
        [[d1.exp(), s12, s13, t1], [0.0, d2.exp(), s23, t2], [0.0, 0.0, d3.exp(), t3], [0.0, 0.0, 0.0, 1.0]];
    u.map(|row| row.map(|value| scale * value))
}

/// Parameters with these log-Cholesky coordinates (2).
pub fn from_log_cholesky(coordinates: &LogCholesky) -> Parameters {
    let u = factor(coordinates);
    let mut j = [[0.0; 4]; 4];
    for (i, row) in j.iter_mut().enumerate() {
        for (k, value) in row.iter_mut().enumerate() {
            *value = (0..4).map(|n| u[i][n] * u[k][n]).sum();
        }
    }
    from_pseudo_inertia(&j)
}

/// Derivatives of the pseudo-inertia with respect to each log-Cholesky coordinate: `dU U^T + U dU^T`.
fn pseudo_inertia_derivatives(coordinates: &LogCholesky) -> [Matrix4; 10] {
    let u = factor(coordinates);
    let scale = coordinates[0].exp();
    // Coordinate k changes one element of U; the first one scales all.
    let elements = [(0, 0), (0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)];
    std::array::from_fn(|k| {
        let mut du = [[0.0; 4]; 4];
        let (row, column) = elements[k];
        match k {
            0 => du = u,
            1..=3 => du[row][column] = u[row][column],
            _ => du[row][column] = scale,
        }
        let product = |i: usize, j: usize| (0..4).map(|n| du[i][n] * u[j][n]).sum::<f64>();
        std::array::from_fn(|i| std::array::from_fn(|j| product(i, j) + product(j, i)))
    })
}

/// Derivatives of the parameters with respect to the log-Cholesky coordinates: `[parameter][coordinate]`.
pub fn parameter_derivatives(coordinates: &LogCholesky) -> [[f64; 10]; 10] {
    let columns = pseudo_inertia_derivatives(coordinates).map(|j| from_pseudo_inertia(&j));
    std::array::from_fn(|i| std::array::from_fn(|k| columns[k][i]))
}

/// Consistent parameters near those of a description file that are not.
///
/// A link may have no mass, or a thin or impossible inertia.
///
/// The mass is at least `min_mass_kg`. The second moments about the centre of mass are at least the mass times `min_radius_m`
/// squared along each of their principal axes. Parameters that meet both conditions are returned as they are. Returns `None` if
/// a parameter is not finite.
pub fn raise_to_consistent(
    parameters: &Parameters,
    min_mass_kg: f64,
    min_radius_m: f64,
) -> Option<Parameters> {
    let mut j = pseudo_inertia(parameters);
    let c = if j[3][3] > 0.0 { [0, 1, 2].map(|i| j[i][3] / j[3][3]) } else { [0.0; 3] };
    let mass = j[3][3].max(min_mass_kg);
    let about_centre = Mat::from_fn(3, 3, |i, k| j[i][k] - j[3][3] * c[i] * c[k]);
    let eigen = symmetric_eigen(&about_centre)?;
    let least = mass * min_radius_m * min_radius_m;
    if j[3][3] >= min_mass_kg && eigen.values[0] >= least {
        return Some(*parameters);
    }
    for (i, k) in (0..3).flat_map(|i| (0..3).map(move |k| (i, k))) {
        let moment = |n: usize| eigen.values[n].max(least) * eigen.vectors[(i, n)] * eigen.vectors[(k, n)];
        j[i][k] = mass * c[i] * c[k] + (0..3).map(moment).sum::<f64>();
    }
    for i in 0..3 {
        (j[i][3], j[3][i]) = (mass * c[i], mass * c[i]);
    }
    j[3][3] = mass;
    let raised = from_pseudo_inertia(&j);
    raised.iter().all(|value| value.is_finite()).then_some(raised)
}

#[cfg(test)]
mod tests;
