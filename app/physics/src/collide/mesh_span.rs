//! Of all vertices of a mesh that lie low over a flat face of something else, the few that it stands on.
//!
//! Problem: a mesh of a hundred thousand triangles stands on a table with thousands of vertices, and a tick has room for
//! [`MAX_POINTS`]. These must carry it as all together would: resting where it rests, tipping where it tips.
//!
//! Model: where no more than that many are within reach, all count. Of more, some have a role, as a hull is drawn: the
//! one that lies deepest (D); one far away from it (E); one on either side of the line between these (F, G); and one
//! outside each side of the quadrilateral D F E G. *Far* and *deep* count together: the product of distance and depth is
//! made as large as possible. So the corners of a flat face are found however finely it is cut, and a ball of triangles
//! stands on a ring of vertices around its lowest point. Sought is from what is known, from neighbour to neighbour as long as
//! it gets better, and by the hierarchy for what lies apart.
//! Identity: who was chosen stays chosen while it touches, unless others need the room for a role; one that is to have a
//! role must be better by [`BETTER`] than all that were chosen, and to be D deeper than all of them by [`DEEPER`]. Where all
//! places are taken it must stick out far ([`CROWDED`]). After the first choice depths beyond a quarter of D's count no more:
//! what comes in comes in at the rim of the patch, with little load, and goes when it has none. (Loads that come and go feed
//! what rolls: a ball of a hundred thousand triangles rolled on for ever, or ever faster, with other rules tried.)
//! While no vertex can have come down or risen by more than [`STILL`] of D's depth since they were sought, they are not
//! sought anew: a body that rests, slides or spins on its face keeps its points for ever.
//! Error: what sticks out of the polygon by less than [`BULGE`] of the side that it sticks out of may be missing, so a
//! tipping threshold is that of the convex hull of the contact patch to about a twentieth of the patch; where eight touch
//! already while the patch grows beyond them, to half a side of their polygon.
//! Frames: the mesh's own. Cost: next to nothing while it rests; when it tilts or sinks, a walk and a query of the
//! hierarchy for each role, both bounded. Of very many triangles in an oblique face a query may miss the best; so in each
//! tick that of another role looks at more.

use haptics::mesh::Linear;
use nalgebra::Vector3;

use super::mesh_corner::Corner;
use super::{MAX_POINTS, Stands};

/// A mesh over a flat face.
pub(super) struct Standing<'m> {
    pub(super) mesh: &'m haptics::mesh::Mesh,
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
pub(super) type Chosen = [Option<Corner>; MAX_POINTS];

impl Standing<'_> {
    /// The vertices that count in this tick; none is named twice.
    pub(super) fn choose(&self, memory: &mut Stands) -> Chosen {
        let kept = memory.corners.map(|number| Corner::remembered(number, self.mesh));
        if self.is_still(memory, &kept) {
            return kept;
        }
        let chosen = self.all_of_few().unwrap_or_else(|| self.of_many(&kept, memory.ticks));
        self.remember(&chosen, memory);
        chosen
    }

    /// Whether all heights are what they were when these were chosen.
    fn is_still(&self, memory: &Stands, kept: &Chosen) -> bool {
        if memory.lowest_m >= 0.0 || kept[0].is_none() {
            return false;
        }
        let turned = (self.height.along_B - memory.along).norm();
        let sunk_m = (self.height.base - memory.base).abs();
        turned * 1.8 * self.mesh.extent_m() + sunk_m <= STILL * -memory.lowest_m
    }

    fn remember(&self, chosen: &Chosen, memory: &mut Stands) {
        let heights = chosen.iter().flatten().map(|vertex| self.height_m(*vertex));
        let lowest_m = heights.fold(f64::INFINITY, f64::min);
        let corners = chosen.map(|corner| corner.map_or(0, Corner::number));
        let (along, base, ticks) = (self.height.along_B, self.height.base, memory.ticks.wrapping_add(1));
        *memory = Stands { corners, along, base, lowest_m, ticks };
    }

    /// All within reach, if they are few.
    fn all_of_few(&self) -> Option<Chosen> {
        let mut all: Chosen = [None; MAX_POINTS];
        let mut count = 0;
        let mut limits = [self.below(self.reach_m); MAX_LIMITS];
        let given = self.limits.len().min(MAX_LIMITS - 1);
        limits[1..=given].copy_from_slice(&self.limits[..given]);
        let are_few = self.mesh.for_each_vertex_within(&limits[..=given], |corner| {
            let corner = Corner::new(corner);
            let vertex = corner.vertex(self.mesh);
            if all[..count].iter().flatten().any(|one| one.vertex(self.mesh) == vertex) {
                return true;
            }
            let Some(place) = all.get_mut(count) else { return false };
            *place = Some(corner);
            count += 1;
            true
        });
        are_few.then_some(all)
    }

    /// Those that have a role, and as many of the last tick as there is room for.
    fn of_many(&self, kept: &Chosen, ticks: u32) -> Chosen {
        let is_low = |corner: &Corner| self.is_over(*corner) && self.height_m(*corner) <= self.reach_m;
        let begins = !kept.iter().flatten().any(is_low);
        let searched = (!begins).then_some(1 + ticks as usize % (MAX_POINTS - 1));
        let mut chosen = self.turn(kept, if begins { &FIRST } else { &LATER }, searched);
        // What is found at first is found from anywhere.
        for _ in 0..if begins { FIRST_TURNS } else { 0 } {
            chosen = self.turn(&chosen, &FIRST, None);
        }
        chosen
    }

    fn turn(&self, kept: &Chosen, how: &How, searched: Option<usize>) -> Chosen {
        let mut chosen = [None; MAX_POINTS];
        let Some(deepest) = self.deepest(kept) else { return chosen };
        let height_m = self.height_m(deepest);
        let level_m = self.level_m(height_m);
        let kept = kept.map(|one| one.filter(|one| self.is_over(*one) && self.height_m(*one) <= level_m));
        // Where all places are taken by what touches, only what sticks out far is worth that one of these goes.
        let is_full = kept.iter().all(Option::is_some);
        let how = if is_full && how.better > FIRST.better { &CROWDED } else { how };
        let depth = self.below(level_m).at_most(how.full * (level_m - height_m));
        Seek { standing: self, depth, deepest, kept: &kept, how, searched }.choose(&mut chosen);
        self.keep(kept, &mut chosen);
        chosen
    }

    /// Fills what room is left, the deepest first.
    fn keep(&self, mut kept: Chosen, chosen: &mut Chosen) {
        let is_in = |chosen: &Chosen, one: Corner| {
            chosen.iter().flatten().any(|other| other.vertex(self.mesh) == one.vertex(self.mesh))
        };
        for place in 0..MAX_POINTS {
            if chosen[place].is_some() {
                continue;
            }
            for one in &mut kept {
                *one = one.filter(|one| !is_in(chosen, *one));
            }
            let lower = |a: &Corner, b: &Corner| self.height_m(*a).total_cmp(&self.height_m(*b));
            chosen[place] = kept.iter().flatten().copied().min_by(lower);
        }
    }

    /// How deep something is below a level (m).
    fn below(&self, level_m: f64) -> Linear {
        Linear::new(-self.height.along_B, level_m - self.height.base)
    }

    /// The one that lies deepest: of those of the last tick if any still counts, else of all.
    fn deepest(&self, kept: &Chosen) -> Option<Corner> {
        let counts = |corner: &Corner| self.is_over(*corner) && self.height_m(*corner) <= self.reach_m;
        let lower = |a: Corner, b: Corner| if self.height_m(b) < self.height_m(a) { b } else { a };
        let mut kept = kept.iter().flatten().copied().filter(counts);
        let Some(first) = kept.next() else {
            let counts = [&self.below(self.reach_m), &Linear::ONE];
            return self
                .mesh
                .outlying(counts, self.limits, 0.0, MANY_VISITS)
                .map(|(corner, _)| Corner::new(corner));
        };
        let known = kept.fold(first, lower);
        // What comes in loaded pushes: a ball that rolls would be driven by what enters below it and leaves behind.
        let depth = |corner: Corner| if self.is_over(corner) { -self.height_m(corner) } else { f64::MIN };
        let (lowest, depth_m) = known.climb(self.mesh, depth);
        Some(if depth_m > DEEPER * depth(known) + LEAST_M { lowest } else { known })
    }

    /// Below this height they count when a vertex of that height does \[m\].
    fn level_m(&self, lowest_m: f64) -> f64 {
        if lowest_m >= 0.0 {
            return self.reach_m;
        }
        (self.travel_m + LEAST_M).min(self.reach_m)
    }

    pub(super) fn height_m(&self, corner: Corner) -> f64 {
        self.height.at(corner.point_M(self.mesh))
    }

    fn is_over(&self, corner: Corner) -> bool {
        let point_B = corner.point_M(self.mesh);
        self.limits.iter().all(|limit| limit.at(point_B) >= 0.0)
    }
}

struct Seek<'s> {
    standing: &'s Standing<'s>,
    /// Below the level, as far as it counts \[m\].
    depth: Linear,
    /// D.
    deepest: Corner,
    kept: &'s Chosen,
    how: &'s How,
    /// The role for which much is looked at; `None`: each.
    searched: Option<usize>,
}

/// What makes one chosen that was not.
struct How {
    /// So many times as good as all that were chosen.
    better: f64,
    /// It sticks out of a side by this share of it.
    bulge: f64,
    /// Deeper than this share of D's depth is no better: what comes in loaded brakes what rolls, or drives it.
    full: f64,
}

/// Where nothing was chosen yet.
const FIRST: How = How { better: 1.001, bulge: 0.02, full: 1.0 };
/// From then on.
const LATER: How = How { better: BETTER, bulge: BULGE, full: 0.25 };
const CROWDED: How = How { better: 3.0, bulge: 0.5, full: 0.25 };
const FIRST_TURNS: usize = 3;

impl Seek<'_> {
    fn choose(&self, chosen: &mut Chosen) {
        let up_B = self.standing.height.along_B;
        chosen[0] = Some(self.deepest);
        let d_B = self.deepest.point_M(self.standing.mesh);
        let Some(far) = self.far_from(d_B) else { return };
        chosen[1] = Some(far);
        let along_B = flat(&(far.point_M(self.standing.mesh) - d_B), &up_B);
        let length_m = along_B.norm();
        let beside_B = up_B.cross(&along_B) / length_m;
        for (role, side_B) in [(2, beside_B), (3, -beside_B)] {
            let found = self.best(role, &Linear::from(d_B, side_B), self.how.bulge * length_m);
            chosen[role] = found.filter(|found| self.is_new(found, chosen));
        }
        self.sides(chosen);
    }

    /// One far away in any direction: at first along the line to that of the last tick.
    fn far_from(&self, d_B: &Vector3<f64>) -> Option<Corner> {
        let up_B = self.standing.height.along_B;
        let mesh = self.standing.mesh;
        let was_B = self.kept[1].map(|corner| flat(&(corner.point_M(mesh) - d_B), &up_B));
        let least_m = FAR * mesh.extent_m();
        let along_B = match was_B.and_then(|was_B| was_B.try_normalize(least_m)) {
            Some(along_B) => along_B,
            None => across(&up_B),
        };
        let beside_B = up_B.cross(&along_B);
        [along_B, -along_B, beside_B, -beside_B]
            .iter()
            .find_map(|way_B| self.best(1, &Linear::from(d_B, *way_B), least_m))
    }

    /// What sticks out of the sides of the quadrilateral.
    fn sides(&self, chosen: &mut Chosen) {
        let (up_B, mesh) = (self.standing.height.along_B, self.standing.mesh);
        let corners = [chosen[0], chosen[2], chosen[1], chosen[3]];
        for (role, (from, to)) in [(0, 1), (1, 2), (2, 3), (3, 0)].into_iter().enumerate() {
            let (Some(from), Some(to)) = (corners[from], corners[to]) else { continue };
            let from_B = from.point_M(mesh);
            let along_B = flat(&(to.point_M(mesh) - from_B), &up_B);
            let length_m = along_B.norm();
            if length_m > 0.0 {
                // F is to the left of D E seen from above, so the outside is to the left of D F.
                let outward_B = up_B.cross(&along_B) / length_m;
                let found = self.best(4 + role, &Linear::from(from_B, outward_B), self.how.bulge * length_m);
                chosen[4 + role] = found.filter(|found| self.is_new(found, chosen));
            }
        }
    }

    fn is_new(&self, found: &Corner, chosen: &Chosen) -> bool {
        let mesh = self.standing.mesh;
        !chosen.iter().flatten().any(|one| one.vertex(mesh) == found.vertex(mesh))
    }

    /// The best by distance and depth; if it was not chosen before, it is at least this far away (m).
    fn best(&self, role: usize, distance: &Linear, at_least_m: f64) -> Option<Corner> {
        let mesh = self.standing.mesh;
        let score = |point_B: &Vector3<f64>| {
            let (far, deep) = (distance.at(point_B), self.depth.at(point_B));
            if far > 0.0 && deep > 0.0 { far * deep } else { 0.0 }
        };
        let of = |corner: Corner| {
            if self.standing.is_over(corner) { score(corner.point_M(mesh)) } else { 0.0 }
        };
        let least = at_least_m * self.depth.at_most;
        let kept = self
            .kept
            .iter()
            .flatten()
            .fold((self.deepest, 0.0), |best, &one| if of(one) > best.1 { (one, of(one)) } else { best });
        let (mut best, mut most) = (kept.0, kept.1);
        let (near, near_score) = kept.0.climb(mesh, of);
        if near_score > least.max(self.how.better * kept.1) {
            (best, most) = (near, near_score);
        }
        let needed = least.max(self.how.better * most);
        let visits =
            if self.searched.is_none_or(|searched| searched == role) { MANY_VISITS } else { FEW_VISITS };
        if let Some((corner, score)) =
            mesh.outlying([distance, &self.depth], self.standing.limits, needed, visits)
        {
            (best, most) = (Corner::new(corner), score);
        }
        (most > 0.0).then_some(best)
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

/// So many times as good as all that were chosen must be what takes a role.
const BETTER: f64 = 1.5;
/// So many times as deep as all that were chosen must be what takes D's place.
const DEEPER: f64 = 1.5;
/// Heights that change by less than this share of the depth do not.
const STILL: f64 = 0.01;
/// What sticks out of a side by less than this share of it is left out.
const BULGE: f64 = 0.05;
/// E is at least this share of the mesh's extent away from D.
const FAR: f64 = 1e-5;
/// Depths below this are as this one \[m\].
const LEAST_M: f64 = 1e-5;
/// Nodes of the hierarchy that are looked at for a role: in each tick many for one of them.
const MANY_VISITS: usize = 256;
const FEW_VISITS: usize = 32;
/// Limits of a face, and the level.
const MAX_LIMITS: usize = 6;
