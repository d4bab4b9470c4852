//! The vertices that lie farthest out, whatever the direction: what a mesh may stand on, however finely it is cut.
//!
//! Problem: an oblique face of very many triangles is in boxes that all stick out of it; within a tick the hierarchy finds
//! a vertex that lies far out there, but not the foot beside it that lies farther.
//! Model: the farthest vertex in each of [`STEPS`] squared directions through each side of a cube, found once; of a
//! direction between them, the farthest of these. Where hulls are so round that no vertex is the farthest over a
//! whole cell of directions, others near it are, by about the square of half a cell's angle times the hull's radius.
//! Cost: to find them, a query of the hierarchy for each direction; to ask for one, a product for each.

use nalgebra::Vector3;

use super::{Linear, Mesh};

/// Vertices that lie farthest out.
#[derive(Debug, Default)]
pub(super) struct Extremes {
    points: Box<[Vector3<f64>]>,
    /// Of each, as corners of faces.
    corners: Box<[u32]>,
}

impl Mesh {
    /// Finds the vertices that lie farthest out, for [`Self::extreme`]: once for each mesh, in some tens of milliseconds. Allocates.
    pub fn find_extremes(&self) {
        self.extremes.get_or_init(|| {
            let mut corners: Vec<u32> = Vec::with_capacity(6 * STEPS * STEPS);
            for side in 0..6 {
                for cell in 0..STEPS * STEPS {
                    let along_B = direction(side, cell);
                    let beyond = Linear::new(along_B, 2.0 * self.extent_m());
                    // Next to each other, directions often lead to the same.
                    let last = corners.last().map(|&corner| (corner, beyond.at(self.point_of(corner))));
                    let more_than = last.map_or(0.0, |(_, far)| far);
                    let found = self.outlying([&beyond, &Linear::ONE], &[], more_than, usize::MAX);
                    corners.extend(found.or(last).map(|(corner, _)| corner));
                }
            }
            corners.sort_unstable_by_key(|&corner| self.vertex_of(corner));
            corners.dedup_by_key(|corner| self.vertex_of(*corner));
            let points = corners.iter().map(|&corner| *self.point_of(corner)).collect();
            Extremes { points, corners: corners.into() }
        });
    }

    /// The vertex that lies farthest in a direction, as a corner of a face (three times its number plus that of the corner),
    /// or one about as far; none unless [`Self::find_extremes`] was called.
    pub fn extreme(&self, along_B: &Vector3<f64>) -> Option<u32> {
        let Extremes { points, corners } = self.extremes.get()?;
        let mut farthest = (f64::NEG_INFINITY, 0);
        for (point_B, &corner) in points.iter().zip(corners) {
            let far_m = along_B.dot(point_B);
            if far_m > farthest.0 {
                farthest = (far_m, corner);
            }
        }
        farthest.0.is_finite().then_some(farthest.1)
    }

    fn vertex_of(&self, corner: u32) -> u32 {
        self.faces[(corner / 3) as usize].vertices[(corner % 3) as usize]
    }

    fn point_of(&self, corner: u32) -> &Vector3<f64> {
        &self.vertices[self.vertex_of(corner) as usize]
    }
}

/// Unit, through a side of a cube; from cell to cell it is the next one's.
fn direction(side: usize, cell: usize) -> Vector3<f64> {
    let [row, column] = [cell / STEPS, cell % STEPS];
    let column = if row.is_multiple_of(2) { column } else { STEPS - 1 - column };
    // Equal angles, and not equal ways on the cube.
    let along =
        |step: usize| (((step as f64 + 0.5) / STEPS as f64 - 0.5) * std::f64::consts::FRAC_PI_2).tan();
    let mut direction = Vector3::zeros();
    direction[side % 3] = if side < 3 { 1.0 } else { -1.0 };
    direction[(side + 1) % 3] = along(row);
    direction[(side + 2) % 3] = along(column);
    direction.normalize()
}

/// Directions along an edge of the cube: 4.5 degrees from one to the next.
const STEPS: usize = 20;
