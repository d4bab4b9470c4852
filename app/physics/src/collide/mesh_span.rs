//! Of all vertices of a mesh that lie low over a flat face of something else, the few that it stands on.
//!
//! Problem: a mesh of a hundred thousand triangles stands on a table with thousands of vertices, and a tick has room for
//! [`MAX_POINTS`]. These must carry it as all together would: resting where it rests, tipping where it tips.
//!
//! Model: where no more than that many are within reach, all count. Of more, each is chosen for a role, as a hull is
//! drawn: one that lies deep (D); one far away from it (E); one on either side of the line between these (F, G); and one
//! outside each side of the quadrilateral D F E G. *Far* and *deep* count together: what is sought makes the product
//! of its distance and its depth below a level as large as possible. So a vertex that comes to the ground enters with
//! little load, the corners of a flat face are found however finely it is cut, and a ball of triangles stands on a ring of
//! vertices around its lowest point.
//! Identity: those of the last tick stay unless another one is better by [`BETTER`]; D is the deepest of all that were
//! chosen. A body at rest keeps its points for ever.
//! Error: what sticks out of the polygon by less than [`BULGE`] of the side that it sticks out of may be missing, so a
//! tipping threshold is that of the convex hull of the contact patch to about two hundredths of the patch; as D follows
//! the deepest one, to `BETTER` where it tips over a vertex.
//! Frames: the mesh's own. Cost: a query of the hierarchy for each role; bounded.

use haptics::mesh::{Linear, Mesh};
use nalgebra::Vector3;

use super::MAX_POINTS;

/// A mesh over a flat face.
pub(super) struct Standing<'m> {
    pub(super) mesh: &'m Mesh,
    /// Height above the face \[m\].
    pub(super) height: Linear,
    /// What lies outside of one of these is not over the face.
    pub(super) limits: &'m [Linear],
    /// Vertices higher than this do not count \[m\].
    pub(super) reach_m: f64,
    /// How far the mesh may come down in this tick \[m\].
    pub(super) travel_m: f64,
}

/// The vertices that were chosen, each for its role.
pub(super) type Chosen = [Option<u32>; MAX_POINTS];

impl Standing<'_> {
    /// Changes those of the last tick to those of this one; none is named twice.
    pub(super) fn choose(&self, chosen: &mut Chosen) {
        if let Some(all) = self.all_of_few() {
            *chosen = all;
            return;
        }
        let kept = *chosen;
        *chosen = [None; MAX_POINTS];
        let Some(deepest) = self.deepest(&kept) else { return };
        chosen[0] = Some(deepest);
        let level_m = self.level_m(self.height_m(deepest));
        let depth = Linear { along_B: -self.height.along_B, base: level_m - self.height.base };
        let seek = Seek { standing: self, depth, deepest_m: level_m - self.height_m(deepest), kept: &kept };
        seek.choose(deepest, chosen);
    }

    /// All within reach, if they are few.
    fn all_of_few(&self) -> Option<Chosen> {
        let mut all = [None; MAX_POINTS];
        let mut count = 0;
        let above = Linear { along_B: -self.height.along_B, base: self.reach_m - self.height.base };
        let mut limits = [above; MAX_LIMITS];
        let given = self.limits.len().min(MAX_LIMITS - 1);
        limits[1..=given].copy_from_slice(&self.limits[..given]);
        let are_few = self.mesh.for_each_vertex_within(&limits[..=given], |vertex| {
            if all[..count].contains(&Some(vertex)) {
                return true;
            }
            let Some(place) = all.get_mut(count) else { return false };
            *place = Some(vertex);
            count += 1;
            true
        });
        are_few.then_some(all)
    }

    /// The one that lies deepest: of those of the last tick if any still counts, else of all.
    fn deepest(&self, kept: &Chosen) -> Option<u32> {
        let counts = |vertex: &u32| self.is_over(*vertex) && self.height_m(*vertex) <= self.reach_m;
        let height_m = |vertex: &u32| self.height_m(*vertex);
        let mut kept = kept.iter().flatten().copied().filter(counts);
        let above = Linear { along_B: -self.height.along_B, base: self.reach_m - self.height.base };
        let Some(first) = kept.next() else {
            return self.mesh.outlying([&above, &Linear::ONE], self.limits, 0.0).map(|(vertex, _)| vertex);
        };
        // The first is that of the last tick.
        let best = kept.fold(first, |best, one| if height_m(&one) < height_m(&best) { one } else { best });
        let gain_m = self.height_m(first) - self.height_m(best);
        let depth_m = (-self.height_m(best)).max(LEAST_M);
        Some(if gain_m > (BETTER - 1.0) * depth_m { best } else { first })
    }

    /// Below this height they count when a vertex of that height does \[m\].
    fn level_m(&self, lowest_m: f64) -> f64 {
        if lowest_m >= 0.0 {
            return self.reach_m;
        }
        (self.travel_m + (MARGIN * -lowest_m).max(LEAST_M)).min(self.reach_m)
    }

    pub(super) fn height_m(&self, vertex: u32) -> f64 {
        self.height.at(&self.point_B(vertex))
    }

    fn is_over(&self, vertex: u32) -> bool {
        let point_B = self.point_B(vertex);
        self.limits.iter().all(|limit| limit.at(&point_B) >= 0.0)
    }

    fn point_B(&self, vertex: u32) -> Vector3<f64> {
        // What was remembered may be another mesh's.
        self.mesh.vertices().get(vertex as usize).copied().unwrap_or_else(Vector3::zeros)
    }
}

struct Seek<'s> {
    standing: &'s Standing<'s>,
    /// Below the level \[m\].
    depth: Linear,
    /// That of D \[m\].
    deepest_m: f64,
    kept: &'s Chosen,
}

impl Seek<'_> {
    fn choose(&self, deepest: u32, chosen: &mut Chosen) {
        let up_B = self.standing.height.along_B;
        let d_B = self.standing.point_B(deepest);
        let Some(far) = self.far_from(&d_B) else { return };
        chosen[1] = Some(far);
        let e_B = self.standing.point_B(far);
        let along_B = flat(&(e_B - d_B), &up_B);
        let length_m = along_B.norm();
        let beside_B = up_B.cross(&along_B) / length_m;
        for (role, side_B) in [(2, beside_B), (3, -beside_B)] {
            chosen[role] = self.best(&Linear::from(&d_B, side_B), BULGE * length_m);
        }
        self.sides(chosen);
    }

    /// One far away in any direction: at first along the line to that of the last tick.
    fn far_from(&self, d_B: &Vector3<f64>) -> Option<u32> {
        let up_B = self.standing.height.along_B;
        let was_B = self.kept[1].map(|vertex| flat(&(self.standing.point_B(vertex) - d_B), &up_B));
        let least_m = FAR * self.standing.mesh.extent_m();
        let along_B = match was_B.and_then(|was_B| was_B.try_normalize(least_m)) {
            Some(along_B) => along_B,
            None => across(&up_B),
        };
        let beside_B = up_B.cross(&along_B);
        [along_B, -along_B, beside_B, -beside_B]
            .iter()
            .find_map(|way_B| self.best(&Linear::from(d_B, *way_B), least_m))
    }

    /// What sticks out of the sides of the quadrilateral.
    fn sides(&self, chosen: &mut Chosen) {
        let up_B = self.standing.height.along_B;
        let corners = [chosen[0], chosen[2], chosen[1], chosen[3]];
        for (role, (from, to)) in [(0, 1), (1, 2), (2, 3), (3, 0)].into_iter().enumerate() {
            let (Some(from), Some(to)) = (corners[from], corners[to]) else { continue };
            let from_B = self.standing.point_B(from);
            let along_B = flat(&(self.standing.point_B(to) - from_B), &up_B);
            let length_m = along_B.norm();
            if length_m > 0.0 {
                // F is to the left of D E seen from above, so the outside is to the left of D F.
                let outward_B = up_B.cross(&along_B) / length_m;
                let found = self.best(&Linear::from(&from_B, outward_B), BULGE * length_m);
                chosen[4 + role] = found.filter(|found| !chosen.contains(&Some(*found)));
            }
        }
    }

    /// The best by distance and depth, if it is at least this far when it is as deep as the level is high above D.
    fn best(&self, distance: &Linear, at_least_m: f64) -> Option<u32> {
        let score = |vertex: &u32| {
            let point_B = self.standing.point_B(*vertex);
            let (far, deep) = (distance.at(&point_B), self.depth.at(&point_B));
            if far > 0.0 && deep > 0.0 && self.standing.is_over(*vertex) { far * deep } else { 0.0 }
        };
        let least = at_least_m * self.deepest_m;
        let best_of_kept = self.kept.iter().flatten().map(|one| (score(one), *one)).fold(
            (0.0, None),
            |best: (f64, Option<u32>), (score, one)| if score > best.0 { (score, Some(one)) } else { best },
        );
        let (was, kept) = best_of_kept;
        let counts = [distance, &self.depth];
        let better = self.standing.mesh.outlying(counts, self.standing.limits, least.max(was * BETTER));
        // One that was chosen goes only when it is well below what is needed to come.
        better.map(|(vertex, _)| vertex).or(kept.filter(|_| was > 0.5 * least))
    }
}

/// The part of a vector along the face.
fn flat(v_B: &Vector3<f64>, up_B: &Vector3<f64>) -> Vector3<f64> {
    v_B - up_B * up_B.dot(v_B)
}

/// Any direction along the face.
pub(super) fn across(up_B: &Vector3<f64>) -> Vector3<f64> {
    let axis_B = match up_B.iamin() {
        0 => Vector3::x(),
        1 => Vector3::y(),
        _ => Vector3::z(),
    };
    up_B.cross(&axis_B).try_normalize(0.0).unwrap_or_else(Vector3::x)
}

/// So many times as good as one of the last tick must be what takes its place.
const BETTER: f64 = 1.01;
/// What sticks out of a side by less than this share of it is left out.
const BULGE: f64 = 0.02;
/// E is at least this share of the mesh's extent away from D.
const FAR: f64 = 1e-5;
/// Where it touches, what is so much higher than the ground as this share of the depth counts, too.
const MARGIN: f64 = 0.25;
/// Depths below this are as this one \[m\].
const LEAST_M: f64 = 1e-5;
/// Limits of a face, and the level.
const MAX_LIMITS: usize = 6;
