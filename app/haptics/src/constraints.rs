//! The point nearest to another one that lies in front of a few planes.
//!
//! Model: of all points on up to three of the planes that are nearest to the target, the nearest one that is in front
//! of the other planes, too, is the answer: a quadratic program so small that every active set is tried. Where Zilles
//! and Salisbury solve a system with Lagrange multipliers, this solves it for each set.
//!
//! Cost: 41 active sets at the most.

use nalgebra::{Matrix3, Vector3};

/// Planes that the god-object must not cross.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Constraints {
    planes: [Plane; MAX_PLANES],
    count: usize,
}

/// In front: `normal . x >= offset`.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Plane {
    pub(crate) normal_B: Vector3<f64>,
    pub(crate) offset_m: f64,
}

/// Of more than three planes met in one descent, three at the most hold the god-object.
const MAX_PLANES: usize = 6;

/// Where the god-object would like to be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Target {
    pub(crate) point_B: Vector3<f64>,
    /// Planes that hold it there.
    pub(crate) active: u32,
}

impl Plane {
    /// In front is positive \[m\].
    pub(crate) fn distance(&self, p_B: &Vector3<f64>) -> f64 {
        self.normal_B.dot(p_B) - self.offset_m
    }
}

impl Constraints {
    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Whether there was room for it.
    pub(crate) fn add(&mut self, plane: Plane) -> bool {
        let Some(place) = self.planes.get_mut(self.count) else { return false };
        *place = plane;
        self.count += 1;
        true
    }

    /// The point nearest to `hip_B` at least `hover_m` in front of all planes; `None` if they leave no room.
    pub(crate) fn nearest_to(&self, hip_B: &Vector3<f64>, hover_m: f64, slack_m: f64) -> Option<Target> {
        let planes = &self.planes[..self.count];
        let lift = |plane: &Plane| hover_m - plane.distance(hip_B);
        let mut best: Option<(f64, Target)> = None;
        let mut offer = |way_B: Option<Vector3<f64>>, active: u32| {
            let Some(way_B) = way_B else { return };
            let is_allowed = planes.iter().all(|plane| plane.normal_B.dot(&way_B) >= lift(plane) - slack_m);
            if is_allowed && best.is_none_or(|(shortest, _)| way_B.norm() < shortest) {
                best = Some((way_B.norm(), Target { point_B: hip_B + way_B, active }));
            }
        };
        offer(Some(Vector3::zeros()), 0);
        for (i, a) in planes.iter().enumerate() {
            offer(Some(a.normal_B * lift(a)), 1);
            for (j, b) in planes.iter().enumerate().take(i) {
                offer(onto_two([a, b], [lift(a), lift(b)]), 2);
                for c in &planes[..j] {
                    offer(onto_three([a, b, c], [lift(a), lift(b), lift(c)]), 3);
                }
            }
        }
        best.map(|(_, target)| target)
    }
}

/// The shortest way onto both planes, in the span of their normals.
fn onto_two(planes: [&Plane; 2], lifts: [f64; 2]) -> Option<Vector3<f64>> {
    let [a, b] = planes.map(|plane| plane.normal_B);
    let cosine = a.dot(&b);
    let determinant = a.cross(&b).norm_squared();
    if determinant < SMALLEST_DETERMINANT {
        return None;
    }
    let [la, lb] = lifts;
    Some((a * (la - cosine * lb) + b * (lb - cosine * la)) / determinant)
}

fn onto_three(planes: [&Plane; 3], lifts: [f64; 3]) -> Option<Vector3<f64>> {
    let rows = Matrix3::from_rows(&planes.map(|plane| plane.normal_B.transpose()));
    if rows.determinant().abs() < SMALLEST_DETERMINANT {
        return None;
    }
    rows.try_inverse().map(|inverse| inverse * Vector3::from(lifts))
}

/// Planes closer to parallel than this (1e-7 rad) are one: where they meet is rounding.
const SMALLEST_DETERMINANT: f64 = 1e-14;

#[cfg(test)]
mod tests {
    use super::*;

    fn constraints(planes: &[(Vector3<f64>, f64)]) -> Constraints {
        let mut all = Constraints::default();
        for &(normal, offset_m) in planes {
            assert!(all.add(Plane { normal_B: normal.normalize(), offset_m }));
        }
        all
    }

    #[test]
    fn the_walls_of_a_corner_hold_as_many_as_are_pressed() {
        let corner = constraints(&[(Vector3::x(), 0.0), (Vector3::y(), 0.0), (Vector3::z(), 0.0)]);
        for (hip, expected, active) in [
            ([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], 0),
            ([-1.0, 2.0, 3.0], [0.0, 2.0, 3.0], 1),
            ([-1.0, 2.0, -3.0], [0.0, 2.0, 0.0], 2),
            ([-1.0, -2.0, -3.0], [0.0, 0.0, 0.0], 3),
        ] {
            let target = corner.nearest_to(&Vector3::from(hip), 0.0, 0.0).unwrap();
            assert_eq!((target.point_B, target.active), (Vector3::from(expected), active));
        }
    }

    #[test]
    fn an_acute_corner_pushes_along_one_wall_only_if_the_other_allows_it() {
        // Below the first plane, in front of the second: but straight up would lead behind the second.
        let gap = constraints(&[(Vector3::y(), 0.0), (Vector3::new(-1.0, -0.5, 0.0), 0.0)]);
        let target = gap.nearest_to(&Vector3::new(0.3, -1.0, 0.0), 0.0, 1e-12).unwrap();
        assert_eq!(target.active, 2);
        assert!(target.point_B.norm() < 1e-15, "the edge: {}", target.point_B);
    }

    #[test]
    fn planes_that_leave_no_room_have_no_nearest_point() {
        let shut = constraints(&[(Vector3::y(), 1.0), (-Vector3::y(), 1.0)]);
        assert!(shut.nearest_to(&Vector3::zeros(), 0.0, 1e-12).is_none());
    }
}
