//! Remainder of a solid joined of others: whether there is any.
//!
//! Problem: a drawing leaves out what is thinner than rounding tells, so that an empty one does not say that nothing is felt.
//! Model: no place within `r` of one is inside if the distance there is more than `r`, since the distance that a solid tells is
//! never too large. Cubes are divided until that holds for all of them, or there are too many. A place inside is looked for from
//! a lattice: to the boundary that is nearest, and a little further.
//! Cost: bounded by [`MOST_CUBES`] and by the lattice, about what it costs to draw the solid; only of what is not drawn.

#![allow(non_snake_case)] // Frames are capital letters.

use haptics::Csg;
use nalgebra::Vector3;

/// Knowledge of a solid without triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Remainder {
    /// There is no place in it.
    Nothing,
    /// There is one.
    Something,
    /// Neither was found.
    Unknown,
}

impl Remainder {
    pub(super) fn of(csg: &Csg) -> Self {
        if is_nothing(csg) {
            Self::Nothing
        } else if is_something(csg) {
            Self::Something
        } else {
            Self::Unknown
        }
    }
}

fn is_nothing(csg: &Csg) -> bool {
    let mut cubes = vec![(Vector3::zeros(), reach_m(csg))];
    for _ in 0..MOST_CUBES {
        let Some((middle_B, half_m)) = cubes.pop() else { return true };
        let distance_m = csg.signed_distance(&middle_B);
        if distance_m <= 0.0 {
            return false;
        }
        if distance_m <= half_m * f64::sqrt(3.0) {
            cubes.extend(eighths(&middle_B, half_m));
        }
    }
    false
}

fn eighths(middle_B: &Vector3<f64>, half_m: f64) -> [(Vector3<f64>, f64); 8] {
    std::array::from_fn(|eighth| {
        let side = |axis: usize| if eighth >> axis & 1 == 0 { -0.5 } else { 0.5 };
        (middle_B + half_m * Vector3::from_fn(|axis, _| side(axis)), 0.5 * half_m)
    })
}

fn is_something(csg: &Csg) -> bool {
    let step_m = 2.0 * reach_m(csg) / LATTICE as f64;
    let place = |k: usize| {
        let at = [k % LATTICE, k / LATTICE % LATTICE, k / LATTICE.pow(2)];
        Vector3::from(at).map(|i| (i as f64 + 0.5) * step_m).add_scalar(-reach_m(csg))
    };
    (0..LATTICE.pow(3)).any(|k| leads_inside(csg, place(k)))
}

/// True if the way to the boundary, and a little further, ends inside.
fn leads_inside(csg: &Csg, mut place_B: Vector3<f64>) -> bool {
    let further_m = FURTHER * csg.extent_m();
    for _ in 0..STEPS {
        let distance_m = csg.signed_distance(&place_B);
        if distance_m < 0.0 {
            return true;
        }
        let slope = Vector3::from_fn(|axis, _| {
            let to = Vector3::ith(axis, 0.1 * further_m);
            csg.signed_distance(&(place_B + to)) - csg.signed_distance(&(place_B - to))
        });
        let Some(up) = slope.try_normalize(0.0) else { return false };
        place_B -= up * (distance_m + further_m);
    }
    false
}

/// Half of the cube in which all bounded parts are (m).
fn reach_m(csg: &Csg) -> f64 {
    1.02 * csg.extent_m()
}

/// Looked at for that nothing is left.
const MOST_CUBES: usize = 50_000;
/// Places along each side from which an inside is looked for.
const LATTICE: usize = 16;
/// Steps to the boundary: where it is curved or scaled the distance is too small.
const STEPS: usize = 8;
/// Of the extent, beyond the boundary: half of the thinnest that is found.
const FURTHER: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;
    use haptics::{CsgPart, CsgTree, Cuboid, Sphere};

    fn cube(x: f64, size_m: f64) -> CsgPart {
        CsgPart::at(Cuboid::new([size_m; 3]).unwrap(), Vector3::new(x, 0.0, 0.0))
    }

    fn of(tree: &CsgTree) -> Remainder {
        Remainder::of(&Csg::build(tree).unwrap())
    }

    #[test]
    fn thin_plates_and_shells_are_something_and_what_does_not_meet_is_nothing() {
        for thin_m in [1e-3, 1e-4, 1e-6] {
            assert_eq!(of(&CsgTree::difference([cube(0.0, 0.1), cube(thin_m, 0.1)])), Remainder::Something);
            assert_eq!(
                of(&CsgTree::intersection([cube(0.0, 0.1), cube(0.1 - thin_m, 0.1)])),
                Remainder::Something
            );
            let ball = |radius_m| Sphere::new(radius_m).unwrap();
            assert_eq!(of(&CsgTree::difference([ball(0.05), ball(0.05 - thin_m)])), Remainder::Something);
            assert_eq!(of(&CsgTree::difference([ball(0.05), ball(0.06)])), Remainder::Nothing);
        }
        assert_eq!(of(&CsgTree::intersection([cube(0.0, 0.1), cube(0.102, 0.1)])), Remainder::Nothing);
        assert_eq!(of(&CsgTree::difference([cube(0.0, 0.1), cube(0.0, 0.2)])), Remainder::Nothing);
        assert_ne!(of(&CsgTree::difference([cube(0.0, 0.1), cube(0.0, 0.1)])), Remainder::Something);
    }
}
