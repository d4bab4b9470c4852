//! The vertices that lie farthest out, whatever the direction: what a mesh may stand on, however finely it is cut.
//!
//! Problem: an oblique face of very many triangles is in boxes that all stick out of it; within a tick the hierarchy finds
//! a vertex that lies far out there, but not the foot beside it that lies farther.
//! Model: the farthest vertex in each of [`STEPS`] squared directions through each side of a cube, found once; of a
//! direction between them, the farthest of those around it. Where hulls are so round that no vertex is the farthest over a
//! whole cell of directions, others near it are, by about the square of half a cell's angle times the hull's radius.
//! Cost: to find them, a query of the hierarchy for each direction; to ask for one, nine vertices.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use super::{Linear, Mesh};

/// Of each direction, the vertex that lies farthest out, as a corner of a face.
#[derive(Debug)]
pub(super) struct Extremes {
    corners: Box<[u32]>,
}

impl Mesh {
    /// Finds the vertices that lie farthest out, for [`Self::extreme`]: once for each mesh, in some tens of milliseconds. Allocates.
    pub fn find_extremes(&self) {
        self.extremes.get_or_init(|| {
            let mut corners: Vec<u32> = Vec::with_capacity(6 * STEPS * STEPS);
            for cell in 0..6 * STEPS * STEPS {
                let beyond = Linear::new(direction(cell), 2.0 * self.extent_m());
                // Next to each other, directions often lead to the same.
                let last = corners.last().map(|&corner| (corner, beyond.at(self.point_of(corner))));
                let more_than = last.map_or(0.0, |(_, far)| far);
                let found = self.outlying([&beyond, &Linear::ONE], &[], more_than, usize::MAX);
                corners.push(found.or(last).map_or(0, |(corner, _)| corner));
            }
            Extremes { corners: corners.into() }
        });
    }

    /// The vertex that lies farthest in a direction, as a corner of a face (three times its number plus that of the corner),
    /// or one about as far; none unless [`Self::find_extremes`] was called.
    pub fn extreme(&self, along_B: &Vector3<f64>) -> Option<u32> {
        let Extremes { corners } = self.extremes.get()?;
        let mut farthest = (f64::NEG_INFINITY, 0);
        for cell in cells_around(along_B) {
            let far_m = along_B.dot(self.point_of(corners[cell]));
            if far_m > farthest.0 {
                farthest = (far_m, corners[cell]);
            }
        }
        farthest.0.is_finite().then_some(farthest.1)
    }

    fn point_of(&self, corner: u32) -> &Vector3<f64> {
        &self.vertices[self.faces[(corner / 3) as usize].vertices[(corner % 3) as usize] as usize]
    }
}

/// Unit, through the middle of a cell of a side of a cube.
fn direction(cell: usize) -> Vector3<f64> {
    let [side, row, column] = [cell / (STEPS * STEPS), cell / STEPS % STEPS, cell % STEPS];
    // Equal angles, and not equal ways on the cube.
    let along = |step: usize| (((step as f64 + 0.5) / STEPS as f64 - 0.5) * FRAC_PI_2).tan();
    let mut direction = Vector3::zeros();
    direction[side % 3] = if side < 3 { 1.0 } else { -1.0 };
    direction[(side + 1) % 3] = along(row);
    direction[(side + 2) % 3] = along(column);
    direction.normalize()
}

/// The cell that a direction goes through, and those beside it on the same side of the cube.
fn cells_around(along: &Vector3<f64>) -> impl Iterator<Item = usize> {
    let axis = along.iamax();
    let side = if along[axis] < 0.0 { axis + 3 } else { axis };
    let step = |other: usize| {
        let angle = (along[(axis + other) % 3] / along[axis].abs()).atan();
        // Of no number it is the first one.
        ((angle / FRAC_PI_2 + 0.5) * STEPS as f64) as usize
    };
    let around = |step: usize| step.saturating_sub(1)..=(step + 1).min(STEPS - 1);
    let [rows, columns] = [1, 2].map(|other| around(step(other).min(STEPS - 1)));
    rows.flat_map(move |row| columns.clone().map(move |column| (side * STEPS + row) * STEPS + column))
}

/// Directions along an edge of the cube: 4.5 degrees from one to the next.
const STEPS: usize = 20;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_a_cell_goes_through_it() {
        for cell in 0..6 * STEPS * STEPS {
            let mut around: Vec<usize> = cells_around(&direction(cell)).collect();
            assert!(around.contains(&cell), "{cell}");
            around.sort_unstable();
            around.dedup();
            assert!(around.len() <= 9 && around.iter().all(|cell| *cell < 6 * STEPS * STEPS), "{cell}");
        }
        for along in [Vector3::zeros(), Vector3::repeat(f64::NAN), Vector3::repeat(f64::INFINITY)] {
            assert!(cells_around(&along).all(|cell| cell < 6 * STEPS * STEPS));
        }
    }
}
