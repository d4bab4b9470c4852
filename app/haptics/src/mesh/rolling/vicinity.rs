//! The corners of all faces near a ball: where all of them lie below its tangent plane, nothing is in its way.
//!
//! Problem: a query of the hierarchy each tick takes as long as all the rest of a ball's tick; on convex surfaces its
//! answer is always the same.
//!
//! Model: all faces within the radius and a margin of one place are gathered. As long as the ball is nearer than the
//! margin to that place, no other face can reach into it; and a face with all corners below a plane that touches the
//! ball cannot either. So some dozens of products tell that nothing is in the way; where they do not, the query does.
//!
//! Cost: one larger query every few ticks, instead of one each tick.

use nalgebra::Vector3;

use crate::mesh::Mesh;

/// Corners, axis by axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vicinity {
    centre_B: Vector3<f64>,
    /// Balls that are as near to the centre are spoken for \[m\]; negative while none are.
    margin_m: f64,
    corners: [[f64; MOST_CORNERS]; 3],
    count: usize,
    /// Margin to try next, as a share of the radius.
    next: f64,
}

impl Default for Vicinity {
    fn default() -> Self {
        Self {
            centre_B: Vector3::zeros(),
            margin_m: -1.0,
            corners: [[0.0; MOST_CORNERS]; 3],
            count: 0,
            next: LARGEST_MARGIN,
        }
    }
}

impl Vicinity {
    /// Whether it is certain that no face is nearer to `centre_B` than `near_m`; `moved_m` is how far the ball came in
    /// this tick.
    #[inline]
    pub(super) fn is_clear(
        &mut self,
        mesh: &Mesh,
        centre_B: &Vector3<f64>,
        normal_B: &Vector3<f64>,
        near_m: f64,
        moved_m: f64,
    ) -> bool {
        if !self.has(centre_B) {
            // One that moves fast would gather anew each tick.
            let is_worth_it = 3.0 * moved_m < self.next * near_m;
            if !(is_worth_it && self.gather(mesh, centre_B, near_m)) {
                self.next = (RECOVERY * self.next).min(LARGEST_MARGIN);
                return false;
            }
        }
        let offset_m = normal_B.dot(centre_B) - near_m;
        let [x, y, z] = &self.corners;
        let mut above = 0_u64;
        for i in 0..self.count.min(MOST_CORNERS).next_multiple_of(LANES).min(MOST_CORNERS) {
            above |= u64::from(normal_B.x * x[i] + normal_B.y * y[i] + normal_B.z * z[i] > offset_m);
        }
        above == 0
    }

    fn has(&self, centre_B: &Vector3<f64>) -> bool {
        self.margin_m > 0.0 && (centre_B - self.centre_B).norm_squared() < self.margin_m * self.margin_m
    }

    /// Whether there was room for all.
    #[inline(never)]
    fn gather(&mut self, mesh: &Mesh, centre_B: &Vector3<f64>, near_m: f64) -> bool {
        let margin_m = self.next * near_m;
        let (corners, mut count) = (&mut self.corners, 0);
        let mut seen = [u32::MAX; SEEN];
        let has_room = mesh.for_each_within(centre_B, near_m + margin_m, |face| {
            for vertex in face.vertices {
                // Most repetitions are caught, and the others do no harm.
                let place = &mut seen[vertex as usize % SEEN];
                if std::mem::replace(place, vertex) == vertex {
                    continue;
                }
                if count == MOST_CORNERS {
                    return false;
                }
                let corner = &mesh.vertices[vertex as usize];
                for axis in 0..3 {
                    corners[axis][count] = corner[axis];
                }
                count += 1;
            }
            true
        });
        if !has_room || count == 0 {
            self.margin_m = -1.0;
            self.next *= 0.7;
            return false;
        }
        // Whole lanes, filled with a corner that counts anyway.
        for i in count..count.next_multiple_of(LANES).min(MOST_CORNERS) {
            for axis in corners.iter_mut() {
                axis[i] = axis[0];
            }
        }
        (self.centre_B, self.margin_m, self.count) = (*centre_B, margin_m, count);
        true
    }
}

const MOST_CORNERS: usize = 192;
const LANES: usize = 8;
const SEEN: usize = 256;
/// As shares of the radius.
const LARGEST_MARGIN: f64 = 1.0;
/// After so many corners that there was no room, the margin grows again by this much a tick.
const RECOVERY: f64 = 1.02;
