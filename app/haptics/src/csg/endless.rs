//! Planes without an end: how far a solid reaches that they bound, and whether it has an end at all.
//!
//! Problem: planes that cut each other at a small angle meet far from where they are nearest to the origin, and what is
//! felt there has to be as large as they make it.
//! Model: a solid of planes that has an end reaches as far as its corners. It has none if it goes on in some direction, and then does
//! so along a line in which two of the planes, or one and a coordinate plane, would meet through the origin.
//! In doubt it has no end, and is near everything.

use nalgebra::Vector3;

use super::patch::Patch;
use super::{Csg, CsgOp, STACK, Step};

/// Reach of a solid.
pub(super) struct Reach {
    /// Largest coordinate of a corner in which three planes of leaves without an end meet \[m\]; 0 where there is none.
    pub(super) farthest_m: f64,
    /// Nothing of it is beyond that, and what holds its other leaves.
    pub(super) has_end: bool,
}

/// Places far away in a direction.
#[derive(Debug, Clone, Copy, Default)]
struct Far {
    may_be_in: bool,
    may_be_out: bool,
}

impl Csg {
    pub(super) fn reach(&self) -> Reach {
        let endless = self.steps.iter().filter_map(|step| match *step {
            Step::Leaf { radius_m: f64::INFINITY, first, count, .. } => Some((first, count)),
            _ => None,
        });
        let items = endless.flat_map(|(first, count)| &self.items[first as usize..(first + count) as usize]);
        let mut numbers: Vec<u16> = items.map(|item| item.patch).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let planes: Option<Vec<_>> = numbers
            .iter()
            .map(|number| match self.patches[usize::from(*number)] {
                Patch::Plane { normal_B, offset_m } => Some((normal_B, offset_m)),
                Patch::Curved(_) => None,
            })
            .collect();
        let Some(planes) = planes.filter(|planes| planes.len() <= MOST_PLANES) else {
            return Reach { farthest_m: 0.0, has_end: false };
        };
        let farthest_m = self.farthest_corner_m(&planes);
        if farthest_m > FARTHEST * self.extent_m || self.goes_on(&planes) {
            return Reach { farthest_m: 0.0, has_end: false };
        }
        Reach { farthest_m, has_end: true }
    }

    fn farthest_corner_m(&self, planes: &[(Vector3<f64>, f64)]) -> f64 {
        let mut farthest_m = 0.0_f64;
        for (a, (normal_a, offset_a)) in planes.iter().enumerate() {
            for (b, (normal_b, offset_b)) in planes[..a].iter().enumerate() {
                let line = normal_a.cross(normal_b);
                for (normal_c, offset_c) in &planes[..b] {
                    let volume = line.dot(normal_c);
                    let corner = (normal_b.cross(normal_c) * *offset_a
                        + normal_c.cross(normal_a) * *offset_b
                        + line * *offset_c)
                        / volume;
                    let far_m = corner.amax();
                    let is_found = far_m > farthest_m && far_m < f64::INFINITY;
                    if is_found && self.signed_distance(&corner).abs() <= CORNER * self.extent_m.max(far_m) {
                        farthest_m = far_m;
                    }
                }
            }
        }
        farthest_m
    }

    /// True if it may go on for ever.
    fn goes_on(&self, planes: &[(Vector3<f64>, f64)]) -> bool {
        let axes = (0..3).map(|axis| Vector3::ith(axis, 1.0));
        let normals: Vec<Vector3<f64>> = planes.iter().map(|(normal, _)| *normal).chain(axes).collect();
        normals.iter().enumerate().any(|(at, one)| {
            normals[..at]
                .iter()
                .filter_map(|other| one.cross(other).try_normalize(PARALLEL))
                .any(|line| [line, -line].iter().any(|way| self.far_in(way).may_be_in))
        })
    }

    /// Places far away in a direction of unit length.
    fn far_in(&self, way: &Vector3<f64>) -> Far {
        let mut stack = [Far::default(); STACK];
        let mut top = 0;
        for step in &self.steps {
            match *step {
                Step::Leaf { radius_m, first, count, .. } => {
                    stack[top] =
                        Far { may_be_in: radius_m == f64::INFINITY, may_be_out: radius_m < f64::INFINITY };
                    for item in &self.items[first as usize..(first + count) as usize] {
                        if let Patch::Plane { normal_B, .. } = self.patches[usize::from(item.patch)] {
                            let outward = if item.is_flipped { -normal_B } else { normal_B };
                            let ahead = outward.dot(way);
                            stack[top].may_be_in &= ahead < ALONG;
                            stack[top].may_be_out |= ahead > -ALONG;
                        }
                    }
                    top += 1;
                }
                Step::Join(op) => {
                    let [a, b] = [stack[top - 2], stack[top - 1]];
                    top -= 1;
                    stack[top - 1] = match op {
                        CsgOp::Union => Far {
                            may_be_in: a.may_be_in || b.may_be_in,
                            may_be_out: a.may_be_out && b.may_be_out,
                        },
                        CsgOp::Intersection => Far {
                            may_be_in: a.may_be_in && b.may_be_in,
                            may_be_out: a.may_be_out || b.may_be_out,
                        },
                        CsgOp::Difference => Far {
                            may_be_in: a.may_be_in && b.may_be_out,
                            may_be_out: a.may_be_out || b.may_be_in,
                        },
                    };
                }
            }
        }
        stack[0]
    }
}

/// Planes that are looked at.
const MOST_PLANES: usize = 64;
/// Of the extent: corners beyond are of planes that are all but parallel.
const FARTHEST: f64 = 1e4;
/// Of the extent: so near to the boundary a corner is one of its own.
const CORNER: f64 = 1e-9;
/// Sine of the angle between planes below which they are parallel, and of that to a plane below which a way may lie in it.
const PARALLEL: f64 = 1e-12;
const ALONG: f64 = 1e-9;
