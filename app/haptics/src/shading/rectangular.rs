//! Regions of activation of a box.
//!
//! The same mixture as on a mesh ([`super::regions`]), the box' faces being what they are: rectangles, whose neighbours'
//! normals are the axes. A ball on a box touches a face, or rolls around an edge or a corner of the box within: it
//! feels the normal of the point that it touches.

use nalgebra::Vector3;

use super::form::Turn;
use super::regions::{drawn_to_vertex, mixed};
use crate::cuboid::Cuboid;
use crate::error::{ParameterError, above_zero};
use crate::surface::SurfacePoint;

/// How long the regions of a box are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxRegions {
    length_m: f64,
}

impl BoxRegions {
    /// Those of a box: never longer than half its smallest size.
    ///
    /// Errors: a length that is not above 0.
    pub fn of(cuboid: &Cuboid, length_m: f64) -> Result<Self, ParameterError> {
        let [x, y, z] = cuboid.size_m();
        Ok(Self { length_m: above_zero("length_m", length_m)?.min(0.5 * x.min(y).min(z)) })
    }

    pub(super) fn turn(&self, cuboid: &Cuboid, at: &SurfacePoint) -> Turn {
        let half_m = Vector3::from(cuboid.size_m()) * 0.5;
        // Of a ball, what it touches.
        let touched_B = at.point_B.zip_map(&half_m, |x, half| x.clamp(-half, half));
        // A face that it lies on: the nearest, since where there are several all give the same.
        let below_m = half_m - touched_B.abs();
        let axis = below_m.imin();
        let side = |axis: usize| {
            let mut normal_B = Vector3::zeros();
            normal_B[axis] = 1.0_f64.copysign(touched_B[axis]);
            normal_B
        };
        let beside = [(axis + 1) % 3, (axis + 2) % 3];
        let distances = beside.map(|axis| below_m[axis] / self.length_m);
        let edge_B = mixed(&side(axis), &distances, |edge| Some(side(beside[edge])));
        let corner_B = Vector3::from_fn(|axis, _| side(axis)[axis]).normalize();
        let [u, v] = distances;
        Turn { from_B: at.normal_B, to_B: drawn_to_vertex(&edge_B, &corner_B, u.hypot(v)) }
    }
}
