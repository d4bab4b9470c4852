//! Places where a mesh and another solid meet: a floor and walls of one hole, the feet of an arch on steps.
//!
//! Model: each place is a plane about which either presses on the other, with what chooses their points there. The first is
//! followed from tick to tick, as if it was the only one; what else there is, [`mesh_search`](super::mesh_search) finds.
//! Identity: a place keeps its number while it is pressed, and while a search finds it again.

use nalgebra::{Isometry3, Vector3};

use super::Stands;
use super::mesh_found::Carried;
use super::mesh_spread::Spread;

/// The most places of a pair: the sides of a box inside another one.
pub(super) const MAX_PATCHES: usize = 6;

/// A place, in the mesh's frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Patch {
    /// Unit, from the mesh to the other one.
    pub(super) normal_M: Vector3<f64>,
    /// On the mesh \[m\].
    pub(super) at_M: Vector3<f64>,
    /// How deep they were in each other there; 0: nothing pressed \[m\].
    pub(super) depth_m: f64,
    /// Of the mesh and the other one, which vertices stand there.
    pub(super) stands: [Stands; 2],
    /// Which of its points carried in the last tick.
    pub(super) carried: Carried,
    /// The normal, the point and the depth are those of the last tick.
    pub(super) is_known: bool,
}

/// All places of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Patches {
    pub(super) all: [Patch; MAX_PATCHES],
    /// What they are was found by a search from here.
    pub(super) searched: Option<Searched>,
    /// Of a soft mesh on a plane, about which vertices others are grouped.
    pub(crate) spread: Spread,
}

/// What a search has seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Searched {
    pub(super) X_MO: Isometry3<f64>,
    /// All places whose gap was no larger are known \[m\].
    pub(super) within_m: f64,
    /// There may be more, all around.
    pub(super) is_crowded: bool,
    /// Ticks that it has gone on for, and how many faces it has tried in them; 0: it is over.
    pub(super) ticks: u8,
    pub(super) tried: u16,
}

impl Patch {
    /// Whether two places are the same: their normals agree, and, unless the other one is convex, so do their planes.
    pub(super) fn is_same(&self, normal_M: &Vector3<f64>, at_M: &Vector3<f64>, is_convex: bool) -> bool {
        let apart_m = self.normal_M.dot(&(at_M - self.at_M)).abs();
        self.normal_M.dot(normal_M) > SAME && (is_convex || apart_m < APART_M + 2.0 * self.depth_m)
    }

    pub(super) fn is_pressed(&self) -> bool {
        self.is_known && self.depth_m > 0.0
    }
}

impl Patches {
    /// Whether there is more than one.
    pub(super) fn are_several(&self) -> bool {
        self.all[1..].iter().any(|patch| patch.is_known)
    }

    /// True if all others look about as this one does, and press nothing: they may be sides of one round back.
    pub(super) fn is_alone(&self, number: usize) -> bool {
        let own_M = &self.all[number].normal_M;
        let is_another =
            |patch: &Patch| patch.is_known && (patch.depth_m > 0.0 || patch.normal_M.dot(own_M) < AGREES);
        !self.all.iter().enumerate().any(|(at, patch)| at != number && is_another(patch))
    }

    /// True if any place is pressed.
    pub(super) fn are_pressed(&self) -> bool {
        self.all.iter().any(Patch::is_pressed)
    }

    /// Whether another place is pressed.
    pub(super) fn others_press(&self, number: usize) -> bool {
        self.all.iter().enumerate().any(|(at, patch)| at != number && patch.is_pressed())
    }

    /// The first place with all others as one, as if nobody knew of them. `None`: one is neither in its plane, nor looks as it
    /// does and presses nothing.
    pub(super) fn as_one(&self) -> Option<Self> {
        let (first, mut one) = (&self.all[0], *self);
        for patch in one.all[1..].iter_mut().filter(|patch| patch.is_known) {
            if !first.is_same(&patch.normal_M, &patch.at_M, !patch.is_pressed()) {
                return None;
            }
            patch.is_known = false;
        }
        first.is_known.then_some(one)
    }

    /// Whether a normal is another place's rather than this one's.
    pub(super) fn belongs_elsewhere(&self, number: usize, normal_M: &Vector3<f64>) -> bool {
        let agrees = self.all[number].normal_M.dot(normal_M);
        let agrees_more = |(at, patch): (usize, &Patch)| {
            at != number && patch.is_known && patch.normal_M.dot(normal_M) > agrees.max(AGREES)
        };
        agrees < AGREES && self.all.iter().enumerate().any(agrees_more)
    }

    /// The way across this place's normal from a point to where it is clear of what presses elsewhere, or may in this tick
    /// \[m\]. Against the other one's normals: -1.
    pub(super) fn lift_M(
        &self,
        number: usize,
        point_M: &Vector3<f64>,
        sign: f64,
        travel_m: f64,
    ) -> Vector3<f64> {
        let normal_M = self.all[number].normal_M;
        let mut lift_M = Vector3::zeros();
        for (at, patch) in self.all.iter().enumerate() {
            // Places are known by points of the mesh, which is deep in the other one there.
            let surface_m = if sign < 0.0 { patch.depth_m } else { 0.0 };
            let behind_m = sign * patch.normal_M.dot(&(patch.at_M - point_M)) + surface_m;
            let most_m = 1.5 * patch.depth_m + 2.0 * travel_m;
            if at != number && patch.is_known && behind_m > -2.0 * travel_m {
                let across_M = patch.normal_M - normal_M * normal_M.dot(&patch.normal_M);
                lift_M += across_M * (sign * (behind_m + 2.0 * travel_m + LEAST_M).min(most_m));
            }
        }
        lift_M
    }

    /// The first place is a pressed one, if any is.
    pub(super) fn put_a_pressed_one_first(&mut self) {
        if self.all[0].is_pressed() {
            return;
        }
        if let Some(pressed) = self.all.iter().position(Patch::is_pressed) {
            self.all.swap(0, pressed);
            self.searched = None;
        }
    }
}

/// What crosses to another thread: only what is not as in new ones.
impl Patches {
    /// The next place from this number on that is not as a new one, and its number.
    pub(crate) fn used_from(&self, first: usize) -> Option<(usize, Patch)> {
        let is_used = |(_, patch): &(usize, Patch)| *patch != Patch::default();
        self.all.iter().copied().enumerate().skip(first).find(is_used)
    }

    /// Puts what [`Self::used_from`] found.
    pub(crate) fn put(&mut self, number: usize, patch: &Patch) {
        if let Some(own) = self.all.get_mut(number) {
            *own = *patch;
        }
    }

    /// From where a search found them.
    pub(crate) fn searched(&self) -> Option<Searched> {
        self.searched
    }

    /// Takes note of that.
    pub(crate) fn go_on_from(&mut self, searched: Option<Searched>) {
        self.searched = searched;
    }
}

/// Cosine between normals of one place.
const SAME: f64 = 0.9;
/// Places of one normal are two if so far apart along it \[m\].
const APART_M: f64 = 1e-3;
/// Cosine between a place's normal and that of a point there, beyond which it is nobody else's.
const AGREES: f64 = 0.7;
/// Farther is clear \[m\].
const LEAST_M: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_presses_elsewhere_is_cleared_by_a_lifted_point_of_either() {
        // The mesh ends at x = 10 mm, and is 0.1 mm deep in the other one.
        let (end_m, depth_m) = (0.01, 1e-4);
        let mut patches = Patches::default();
        patches.all[0] = Patch { normal_M: -Vector3::y(), is_known: true, ..Patch::default() };
        let at_M = Vector3::x() * end_m;
        patches.all[1] = Patch { normal_M: Vector3::x(), at_M, depth_m, is_known: true, ..Patch::default() };
        for deep_m in [0.1 * depth_m, 0.5 * depth_m, depth_m] {
            let of_mesh_M = Vector3::x() * (end_m - depth_m + deep_m);
            let lifted_M = of_mesh_M + patches.lift_M(0, &of_mesh_M, -1.0, 0.0);
            assert!(
                lifted_M.x < end_m - depth_m && lifted_M.x > end_m - 2.0 * depth_m,
                "{deep_m} {lifted_M:?}"
            );
            let of_other_M = Vector3::x() * (end_m - deep_m);
            let lifted_M = of_other_M + patches.lift_M(0, &of_other_M, 1.0, 0.0);
            assert!(lifted_M.x > end_m && lifted_M.x < end_m + depth_m, "{deep_m} {lifted_M:?}");
        }
    }
}
