//! How a finger that touches several features presses on each of them.
//!
//! Model: its centre wants to be at the HIP, and must stay in front of a plane per feature. The nearest allowed point
//! is `H + sum l_i n_i` with loads `l_i >= 0` that are zero where it is clear of the plane: the conditions of Karush,
//! Kuhn and Tucker. With four planes at the most, every set of up to three that could hold is tried.
//!
//! Cost: one plane, a few products; four, 14 little systems of equations.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// Most features that a finger is known to touch.
pub(super) const MOST: usize = 4;

/// In front: `normal . x >= offset`.
pub(crate) type Plane = (Vector3<f64>, f64);

/// The answer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pressed {
    pub(super) point_B: Vector3<f64>,
    /// Springs \[m\].
    pub(super) loads_m: [f64; MOST],
}

/// The point in front of all planes that is nearest to `hip_B`.
#[inline]
pub(super) fn press(planes: &[Plane], hip_B: &Vector3<f64>) -> Pressed {
    let free = Pressed { point_B: *hip_B, loads_m: [0.0; MOST] };
    match planes {
        [] => free,
        [(normal_B, offset_m)] => {
            let load_m = (offset_m - normal_B.dot(hip_B)).max(0.0);
            Pressed { point_B: hip_B + normal_B * load_m, loads_m: [load_m, 0.0, 0.0, 0.0] }
        }
        _ => press_many(planes, hip_B, free),
    }
}

#[inline(never)]
fn press_many(planes: &[Plane], hip_B: &Vector3<f64>, free: Pressed) -> Pressed {
    let deepest_m = |p_B: &Vector3<f64>| {
        planes.iter().map(|(normal_B, offset_m)| offset_m - normal_B.dot(p_B)).fold(0.0, f64::max)
    };
    let scale_m = deepest_m(hip_B);
    let slack_m = SLACK * scale_m;
    let mut best = (scale_m, free);
    if scale_m <= 0.0 {
        return free;
    }
    for set in SETS.iter().filter(|set| **set >> planes.len() == 0) {
        let Some(pressed) = hold(planes, *set, hip_B) else { continue };
        if pressed.loads_m.iter().any(|load_m| *load_m < -slack_m) {
            continue;
        }
        let violation_m = deepest_m(&pressed.point_B);
        if violation_m <= slack_m {
            return pressed;
        }
        if violation_m < best.0 {
            best = (violation_m, pressed);
        }
    }
    // No room, but for rounding: where the least is missing.
    best.1
}

/// The point on all planes of a set that is nearest to `p_B`.
pub(super) fn onto(planes: &[Plane], set: u8, p_B: &Vector3<f64>) -> Option<Vector3<f64>> {
    hold(planes, set, p_B).map(|held| held.point_B)
}

fn hold(planes: &[Plane], set: u8, p_B: &Vector3<f64>) -> Option<Pressed> {
    let mut of = [0; 3];
    let mut count = 0;
    for index in (0..planes.len()).filter(|index| set >> index & 1 == 1) {
        *of.get_mut(count)? = index;
        count += 1;
    }
    let normal = |i: usize| planes[of[i]].0;
    let lift = |i: usize| planes[of[i]].1 - normal(i).dot(p_B);
    let mut loads_m = [0.0; MOST];
    match count {
        1 => loads_m[of[0]] = lift(0),
        2 => {
            let cosine = normal(0).dot(&normal(1));
            let determinant = normal(0).cross(&normal(1)).norm_squared();
            if determinant < SMALLEST_DETERMINANT {
                return None;
            }
            let lifts = Vector2::new(lift(0), lift(1));
            let found = Matrix2::new(1.0, -cosine, -cosine, 1.0) * lifts / determinant;
            (loads_m[of[0]], loads_m[of[1]]) = (found.x, found.y);
        }
        3 => {
            // Rows N; the way w has N w = lifts and w = N' l.
            let rows = Matrix3::from_rows(&[0, 1, 2].map(|i| normal(i).transpose()));
            if rows.determinant().powi(2) < SMALLEST_DETERMINANT {
                return None;
            }
            let inverse = rows.try_inverse()?;
            let way_B = inverse * Vector3::new(lift(0), lift(1), lift(2));
            let found = inverse.transpose() * way_B;
            for i in 0..3 {
                loads_m[of[i]] = found[i];
            }
            return Some(Pressed { point_B: p_B + way_B, loads_m });
        }
        _ => {}
    }
    let way_B = (0..count).map(|i| normal(i) * loads_m[of[i]]).sum::<Vector3<f64>>();
    Some(Pressed { point_B: p_B + way_B, loads_m })
}

/// All sets of one to three of four planes, the smaller ones first.
const SETS: [u8; 14] = [1, 2, 4, 8, 3, 5, 6, 9, 10, 12, 7, 11, 13, 14];
/// Planes closer to parallel than this (1e-7 rad) are one: where they meet is rounding.
const SMALLEST_DETERMINANT: f64 = 1e-14;
/// Of the deepest depth, what rounding may do to the others.
const SLACK: f64 = 1e-9;
