//! Mass, centre of mass and inertia of a closed mesh, exactly.
//!
//! Model: each face and one point, the middle of the mesh's box, are the corners of a tetrahedron, whose volume counts
//! as negative where the face looks towards the point; over all faces these add up to the solid. With a face's corners a,
//! b, c seen from that point and `s = a + b + c`, a tetrahedron of volume `V = a . (b x c) / 6` has the first moments
//! `V s / 4` and the second moments `V (a a^T + b b^T + c c^T + s s^T) / 20`.
//! A cavity is wound inward and takes away what it holds. Where parts of a mesh overlap, the overlap counts twice.
//!
//! Accuracy: seen from the middle nothing large cancels; the sums carry what they round off (Neumaier 1974), so a million
//! triangles are summed as exactly as a dozen.
//! Frames: B the mesh's own. Cost: linear; for set-up.

use haptics::mesh::{Mesh, Sides};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::MassProperties;
use crate::error::BodyError;

/// What a solid of a density of 1 has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Volume {
    /// \[m^3\]
    pub(super) volume_m3: f64,
    /// \[m\]
    centre_B: Vector3<f64>,
    /// Mean of `x x^T` about the centre \[m^2\].
    spread_m2: Matrix3<f64>,
}

/// Of a closed mesh.
///
/// # Errors
/// A mesh that is open or cannot be oriented; one that encloses nothing.
pub(super) fn volume(mesh: &Mesh) -> Result<Volume, BodyError> {
    if mesh.sides() == Sides::Sheet {
        return Err(BodyError::OpenMesh { faces: mesh.faces().len() });
    }
    let [low_B, high_B] = mesh.bounds_B();
    let middle_B = (low_B + high_B) * 0.5;
    let mut sums = [Sum::default(); 10];
    for face in mesh.faces() {
        let [a, b, c] = face.vertices.map(|vertex| mesh.vertices()[vertex as usize] - middle_B);
        for (sum, term) in sums.iter_mut().zip(tetrahedron(&a, &b, &c)) {
            sum.add(term);
        }
    }
    let [volume_m3, x, y, z, xx, yy, zz, xy, yz, zx] = sums.map(|sum| sum.total());
    let size = high_B - low_B;
    // Thinner than roundings of the coordinates, it has no volume that could be told from none.
    if volume_m3.is_nan() || volume_m3 <= 1e-12 * size.x.max(size.y).max(size.z).powi(3) {
        return Err(BodyError::NoVolume { volume_m3 });
    }
    let mean = Vector3::new(x, y, z) / volume_m3;
    let second = Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz) / volume_m3;
    Ok(Volume { volume_m3, centre_B: middle_B + mean, spread_m2: second - mean * mean.transpose() })
}

impl Volume {
    /// Filled with this mass (kg).
    pub(super) fn with_mass(&self, mass_kg: f64) -> MassProperties {
        let inertia = Matrix3::from_diagonal_element(self.spread_m2.trace()) - self.spread_m2;
        let (moments, axes_BP) = principal(&(inertia * mass_kg));
        MassProperties { mass_kg, centre_B: self.centre_B, principal_kg_m2: moments, axes_BP }
    }
}

/// Volume, first moments along x, y, z, second moments xx, yy, zz, xy, yz, zx.
fn tetrahedron(a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>) -> [f64; 10] {
    let volume = a.dot(&b.cross(c)) / 6.0;
    let s = a + b + c;
    let first = s * (volume / 4.0);
    let share = volume / 20.0;
    let second = |i: usize, j: usize| share * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j]);
    [
        volume,
        first.x,
        first.y,
        first.z,
        second(0, 0),
        second(1, 1),
        second(2, 2),
        second(0, 1),
        second(1, 2),
        second(2, 0),
    ]
}

/// A sum that carries what it rounds off.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    sum: f64,
    lost: f64,
}

impl Sum {
    fn add(&mut self, term: f64) {
        let next = self.sum + term;
        let (large, small) = if self.sum.abs() >= term.abs() { (self.sum, term) } else { (term, self.sum) };
        self.lost += (large - next) + small;
        self.sum = next;
    }

    fn total(&self) -> f64 {
        self.sum + self.lost
    }
}

/// Principal moments and axes of a symmetric matrix, by Jacobi's rotations.
///
/// They begin at the frame's own axes and turn these no farther than needed: what is symmetric about them keeps them, each
/// moment belongs to the axis that came from the frame's axis of that number, and the axes are right-handed. The same matrix
/// gives the same axes.
pub(super) fn principal(matrix: &Matrix3<f64>) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let (mut m, mut axes) = (*matrix, Matrix3::identity());
    let small = ROUNDINGS * m.trace().abs();
    for _ in 0..SWEEPS {
        let mut is_diagonal = true;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if m[(p, q)].abs() > small {
                is_diagonal = false;
                let turn = rotation(&m, p, q);
                m = turn.transpose() * m * turn;
                axes *= turn;
            }
        }
        if is_diagonal {
            break;
        }
    }
    let axes = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    (m.diagonal(), UnitQuaternion::new_normalize(axes.into_inner()))
}

/// The smaller of the two turns in the plane of two axes that make them conjugate.
fn rotation(m: &Matrix3<f64>, p: usize, q: usize) -> Matrix3<f64> {
    let theta = (m[(q, q)] - m[(p, p)]) / (2.0 * m[(p, q)]);
    let tan = 1.0_f64.copysign(theta) / (theta.abs() + theta.hypot(1.0));
    let cos = tan.hypot(1.0).recip();
    let sin = tan * cos;
    let mut turn = Matrix3::identity();
    (turn[(p, p)], turn[(q, q)], turn[(p, q)], turn[(q, p)]) = (cos, cos, sin, -sin);
    turn
}

/// Moments are known to some roundings of the largest.
const ROUNDINGS: f64 = 1e-14;
/// Each turns quadratically less; three or four are needed.
const SWEEPS: usize = 16;
