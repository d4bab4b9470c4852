//! How much a grasp with force closure resists.
//!
//! Model: the hull of the wrenches that the contacts give with forces that sum up to 1 N; the margin is the radius of the
//! largest ball around the origin in it (Ferrari and Canny's epsilon). Finding the nearest face of a hull in six dimensions
//! is more than a tick's work; what is found here are bounds.
//! - From below: how far the hull reaches along all twelve half axes; it contains the cross that these span, and the ball
//!   inside of that.
//! - From above: the distance of a face is never less than the margin. From each half axis and against each wrench goes a
//!   walk: where a ray leaves the hull there is a face; the ray along that face's normal leaves it sooner, or there.
//!   The nearest face on which a walk ended is nearly always the nearest there is.

use nalgebra::{SVector, Vector6};

use super::Grasp;
use super::closure::Edges;
use super::simplex::farthest;

/// Bounds of the largest wrench of whatever direction that contacts resist while their normal forces sum up to 1 N: in N, or
/// N m over the largest distance of a contact from the centre of mass.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Margin {
    /// Surely not less.
    pub at_least: f64,
    /// Surely not more, of the pyramids inside the cones; nearly always what it is.
    pub at_most: f64,
}

pub(super) fn margin(grasp: &Grasp) -> Margin {
    if !grasp.has_force_closure() {
        return Margin::default();
    }
    within(Edges::of(grasp).as_slice())
}

/// Of a hull around the origin.
fn within(points: &[Vector6<f64>]) -> Margin {
    let mut least_reach = f64::INFINITY;
    let mut at_most = f64::INFINITY;
    for axis in 0..12 {
        let mut direction = Vector6::zeros();
        direction[axis / 2] = if axis % 2 == 0 { 1.0 } else { -1.0 };
        let Some(reach) = reach(points, &direction) else { return Margin::default() };
        least_reach = least_reach.min(reach);
        at_most = at_most.min(walk(points, direction));
    }
    for point in points {
        at_most = at_most.min(walk(points, -point));
    }
    Margin { at_least: (least_reach / 6.0_f64.sqrt()).min(at_most), at_most }
}

fn reach(points: &[Vector6<f64>], direction: &Vector6<f64>) -> Option<f64> {
    ray(points, direction).map(|face| face.reach)
}

fn ray(points: &[Vector6<f64>], direction: &Vector6<f64>) -> Option<super::simplex::Farthest> {
    let mut line = SVector::<f64, 7>::zeros();
    line.fixed_rows_mut::<6>(0).copy_from(&-direction);
    farthest(points, &line)
}

/// From face to face, nearer each time; returns the distance of the last (infinite: none was found).
fn walk(points: &[Vector6<f64>], mut direction: Vector6<f64>) -> f64 {
    let mut nearest = f64::INFINITY;
    for _ in 0..MAX_FACES {
        let Some(face) = ray(points, &direction) else { break };
        let distance = face.reach / face.normal.norm();
        if distance.is_nan() || distance >= nearest * (1.0 - 1e-9) {
            break;
        }
        (nearest, direction) = (distance, face.normal.normalize());
    }
    nearest
}

/// The most faces of a walk.
const MAX_FACES: usize = 20;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ball_inside_a_cross_touches_its_nearest_faces() {
        let mut cross = Vec::new();
        for axis in 0..6 {
            for sign in [1.0, -1.0] {
                let mut point = Vector6::zeros();
                point[axis] = sign * if axis < 3 { 1.0 } else { 2.0 };
                cross.push(point);
            }
        }
        // The planes sum +-x_i / a_i = 1.
        let expected = 1.0 / (3.0 + 3.0 * 0.25_f64).sqrt();
        let margin = within(&cross);
        assert!((margin.at_most - expected).abs() < 1e-12, "{margin:?} {expected}");
        assert!((margin.at_least - 1.0 / 6.0_f64.sqrt()).abs() < 1e-12);
    }
}
