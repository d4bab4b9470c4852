//! Triangles to be drawn, with a normal at each corner.

use nalgebra::{Isometry3, Point3, Vector3};
use std::f64::consts::TAU;

/// Triangles in some frame (m); counter-clockwise from outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Triangles {
    /// Corners.
    pub places: Vec<Point3<f64>>,
    /// Which way the surface looks at each of them; unit length.
    pub normals: Vec<Vector3<f64>>,
    /// Three corners of each triangle.
    pub corners: Vec<[u32; 3]>,
    /// Places of the corners on a texture, in pictures from the upper left corner; none where nothing lies on them.
    pub uv: Vec<[f64; 2]>,
}

/// A ring of a surface of revolution around y.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ring {
    /// From the axis, and along it (m).
    pub(crate) place: [f64; 2],
    /// From the axis, and along it.
    pub(crate) normal: [f64; 2],
}

impl Triangles {
    /// What the rings sweep, from the lowest on: the outside is on the right of somebody who goes up.
    pub(crate) fn revolved(rings: &[Ring], around: u32) -> Self {
        let mut made = Self::default();
        for ring in rings {
            for step in 0..=around {
                let (sin, cos) = (TAU * f64::from(step) / f64::from(around)).sin_cos();
                let turned = |[out, up]: [f64; 2]| Vector3::new(out * cos, up, out * sin);
                made.places.push(turned(ring.place).into());
                made.normals.push(turned(ring.normal));
            }
        }
        made.grid(rings.len() as u32, around + 1);
        made
    }

    /// Joins the corners made so far, a grid of so many rows, to triangles.
    pub(crate) fn grid(&mut self, rows: u32, columns: u32) {
        for row in 1..rows {
            for column in 1..columns {
                let above = row * columns + column;
                let below = above - columns;
                self.corners.push([below - 1, above, below]);
                self.corners.push([below - 1, above - 1, above]);
            }
        }
    }

    /// A flat convex surface with these corners, counter-clockwise around its normal.
    pub(crate) fn add_flat(&mut self, around: &[Point3<f64>], normal: Vector3<f64>) {
        let first = self.places.len() as u32;
        self.places.extend(around);
        self.normals.extend(around.iter().map(|_| normal));
        self.corners.extend((2..around.len() as u32).map(|k| [first, first + k - 1, first + k]));
    }

    /// The same, elsewhere.
    #[must_use]
    pub fn moved(mut self, by: &Isometry3<f64>) -> Self {
        self.places.iter_mut().for_each(|place| *place = by * *place);
        self.normals.iter_mut().for_each(|normal| *normal = by * *normal);
        self
    }

    /// Drawn out along the axes; factors above 0.
    #[must_use]
    pub(crate) fn scaled(mut self, factors: &Vector3<f64>) -> Self {
        self.places.iter_mut().for_each(|place| place.coords.component_mul_assign(factors));
        for normal in &mut self.normals {
            *normal = normal.component_div(factors).normalize();
        }
        self
    }

    /// The volume that they enclose, if they are closed (m^3): a check of their sides.
    pub fn volume_m3(&self) -> f64 {
        let at = |corner: u32| self.places[corner as usize].coords;
        self.corners.iter().map(|[a, b, c]| at(*a).dot(&at(*b).cross(&at(*c)))).sum::<f64>() / 6.0
    }
}
