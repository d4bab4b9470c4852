//! Back onto the patches that hold a god-object.
//!
//! Model: Newton's method by the shortest way: each step leads to the nearest point that is on all tangent planes. One
//! rigid patch takes one step, edges of curved patches two or three. At the end the tangent planes are those of where it ends.
//! From beyond the tip of a cone the nearest point is the tip: a step along the normal would lead past the axis, off the cone.
//!
//! Cost: bounded by [`MAX_ROUNDS`] looks at each of up to three patches.

use nalgebra::{Matrix3, Vector3};

use super::Csg;
use super::god::{God, places, worst_m};
use super::near::Sides;
use super::patch::{Look, Patch};

/// The point of all these patches nearest to one that is near them, to first order.
pub(super) fn settle(
    csg: &Csg,
    god: &God,
    patches: Sides,
    from_B: &Vector3<f64>,
    hip_B: &Vector3<f64>,
) -> Vector3<f64> {
    let mut held = places(patches).map(|index| god.near.patch(csg, index));
    match (held.next(), held.next(), held.next()) {
        (Some(a), None, _) => settle_on([a], from_B, hip_B).0,
        (Some(a), Some(b), None) => settle_on([a, b], from_B, hip_B).0,
        (Some(a), Some(b), Some(c)) => settle_on([a, b, c], from_B, hip_B).0,
        _ => *from_B,
    }
}

/// The same, and what the patches show there.
#[inline(always)]
pub(super) fn settle_on<const N: usize>(
    patches: [&Patch; N],
    from_B: &Vector3<f64>,
    hip_B: &Vector3<f64>,
) -> (Vector3<f64>, [Look; N]) {
    let mut point_B = *from_B;
    let mut looks = looks_at(&patches, &point_B, hip_B);
    if N == 1 && looks[0].height_m > 0.0 {
        let foot_B = point_B + correction(&looks);
        if let Some(tip_B) = patches[0].tip_between(&point_B, &foot_B) {
            return (tip_B, looks_at(&patches, &tip_B, hip_B));
        }
    }
    if N == 1 && patches[0].is_distance() {
        // The first step leads there, and along it the normal is the same.
        point_B += correction(&looks);
        looks[0].height_m = 0.0;
        return (point_B, looks);
    }
    let mut last = f64::INFINITY;
    for _ in 0..MAX_ROUNDS {
        let worst = worst_m(&looks);
        let resolution_m = 2.0 * f64::EPSILON * point_B.amax();
        // Rounding has the last word.
        if worst.is_nan() || worst <= resolution_m || (worst >= last && worst <= 8.0 * resolution_m) {
            break;
        }
        last = worst;
        point_B += correction(&looks);
        looks = looks_at(&patches, &point_B, hip_B);
    }
    (point_B, looks)
}

/// What patches show of a point.
#[inline(always)]
pub(super) fn looks_at<const N: usize>(
    patches: &[&Patch; N],
    point_B: &Vector3<f64>,
    hip_B: &Vector3<f64>,
) -> [Look; N] {
    let mut looks = [Look { height_m: 0.0, normal_B: Vector3::zeros() }; N];
    for (look, patch) in looks.iter_mut().zip(patches) {
        *look = patch.look(point_B, hip_B);
    }
    looks
}

/// Whether a place is on the patches that show this there, but for a few roundings of its coordinates.
#[inline(always)]
pub(super) fn is_on(looks: &[Look], point_B: &Vector3<f64>) -> bool {
    worst_m(looks) <= ON_IT * f64::EPSILON * point_B.amax()
}

/// Two tangent planes.
pub(super) struct Pair {
    normals_B: [Vector3<f64>; 2],
    cosine: f64,
    /// Along both; as long as the sine between them.
    pub(super) along_B: Vector3<f64>,
    pub(super) sine2: f64,
}

impl Pair {
    #[inline(always)]
    pub(super) fn of(looks: &[Look; 2]) -> Self {
        let normals_B = [looks[0].normal_B, looks[1].normal_B];
        let along_B = normals_B[0].cross(&normals_B[1]);
        Self { normals_B, cosine: normals_B[0].dot(&normals_B[1]), along_B, sine2: along_B.norm_squared() }
    }

    /// The shortest step down from both by these heights (m).
    #[inline(always)]
    pub(super) fn down_B(&self, [a_m, b_m]: [f64; 2]) -> Vector3<f64> {
        let [a_B, b_B] = &self.normals_B;
        if self.sine2 < PARALLEL * PARALLEL {
            return -a_B * a_m;
        }
        let share = 1.0 / self.sine2;
        a_B * ((self.cosine * b_m - a_m) * share) + b_B * ((self.cosine * a_m - b_m) * share)
    }
}

/// The shortest step onto the tangent planes.
#[inline(always)]
fn correction(looks: &[Look]) -> Vector3<f64> {
    match looks {
        [a] => -a.normal_B * a.height_m,
        [a, b] => onto_both(a, b),
        [a, b, c, ..] => {
            let rows = Matrix3::from_rows(&[a, b, c].map(|look| look.normal_B.transpose()));
            let heights = Vector3::new(a.height_m, b.height_m, c.height_m);
            match rows.try_inverse().filter(|_| rows.determinant().abs() > PARALLEL) {
                Some(inverse) => -(inverse * heights),
                None => onto_both(a, b),
            }
        }
        [] => Vector3::zeros(),
    }
}

#[inline(always)]
fn onto_both(a: &Look, b: &Look) -> Vector3<f64> {
    Pair::of(&[*a, *b]).down_B([a.height_m, b.height_m])
}

/// Bound on Newton's method; patches that touch halve their distance each round.
const MAX_ROUNDS: u32 = 24;
/// Patches closer to parallel than this (rad) have no edge.
const PARALLEL: f64 = 1e-9;
/// Roundings of its coordinates that a place on the patches may be off.
const ON_IT: f64 = 8.0;
