//! Of all vertices of a mesh that lie low over a flat face of something else, the few that it stands on.
//!
//! Problem: a mesh of a hundred thousand triangles stands on a table with thousands of vertices, and a tick has room for
//! [`PATCH_POINTS`]. These must carry it as all together would: resting where it rests, tipping where it tips.
//!
//! Model: where no more than that many are within reach, all count. Of more, some have a role, as a hull is drawn: the
//! one that lies deepest (D); one far away from it (E); one on either side of the line between these (F, G); and one
//! outside each side of the quadrilateral D F E G. *Far* and *deep* count together: the product of distance and depth is
//! made as large as possible. So the corners of a flat face are found however finely it is cut, and a ball of triangles
//! stands on a ring of vertices around its lowest point. Sought is from what is known, from neighbour to neighbour as long as
//! it gets better, and by the hierarchy for what lies apart.
//! Identity: who was chosen stays chosen while it touches, unless others need the room for a role; one that is to have a
//! role must be better by `BETTER` than all that were chosen, and to be D deeper than all of them by [`DEEPER`]. Where all
//! places are taken it must stick out far (`CROWDED`). After the first choice depths beyond a quarter of D's count no more:
//! what comes in comes in at the rim of the patch, with little load, and goes when it has none. (Loads that come and go feed
//! what rolls: a ball of a hundred thousand triangles rolled on for ever, or ever faster, with other rules tried.)
//! While no vertex can have come down or risen by more than [`STILL`] of D's depth since they were sought, they are not
//! sought anew: a body that rests, slides or spins on its face keeps its points for ever. Of what goes farther than
//! [`FAST_M`] in a tick all are, since the next limb of what tumbles comes down far from those that were chosen.
//! Error: what sticks out of the polygon by less than `BULGE` of the side that it sticks out of may be missing, so a
//! tipping threshold is that of the convex hull of the contact patch to about a twentieth of the patch; where eight touch
//! already while the patch grows beyond them, to half a side of their polygon.
//! Frames: the mesh's own. Cost: next to nothing while it rests; when it tilts or sinks, a walk and a query of the
//! hierarchy for each role, both bounded. Of very many triangles in an oblique face a query may miss the best; so in each
//! tick that of another role looks at more, D's among them: a bump between others is no neighbour of theirs.

use haptics::mesh::Linear;

use super::mesh_corner::Corner;
use super::mesh_role::{CROWDED, FIRST, How, LATER, MANY_VISITS, Seek};
use super::{PATCH_POINTS, Stands};

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
pub(super) type Chosen = [Option<Corner>; PATCH_POINTS];

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
        let mut all: Chosen = [None; PATCH_POINTS];
        let mut count = 0;
        let see = |corner: Corner| {
            let vertex = corner.vertex(self.mesh);
            if all[..count].iter().flatten().any(|one| one.vertex(self.mesh) == vertex) {
                return true;
            }
            let Some(place) = all.get_mut(count) else { return false };
            *place = Some(corner);
            count += 1;
            true
        };
        let are_few = self.for_each_low(see, MANY_VISITS);
        are_few.then_some(all)
    }

    /// Visits all within reach, each as often as faces meet there, until `visit` says `false` or there is too much to look at; says
    /// whether all were visited.
    pub(super) fn for_each_low(&self, mut visit: impl FnMut(Corner) -> bool, most_visits: usize) -> bool {
        let mut limits = [self.below(self.reach_m); MAX_LIMITS];
        let given = self.limits.len().min(MAX_LIMITS - 1);
        limits[1..=given].copy_from_slice(&self.limits[..given]);
        self.mesh.for_each_vertex_within(&limits[..=given], |corner| visit(Corner::new(corner)), most_visits)
    }

    /// Those that have a role, and as many of the last tick as there is room for.
    fn of_many(&self, kept: &Chosen, ticks: u32) -> Chosen {
        let is_low = |corner: &Corner| self.is_over(*corner) && self.height_m(*corner) <= self.reach_m;
        let begins = self.is_fast() || !kept.iter().flatten().any(is_low);
        let searched = (!begins).then_some(1 + ticks as usize % (PATCH_POINTS - 1));
        let mut chosen = self.turn(kept, if begins { &FIRST } else { &LATER }, searched);
        // What is found at first is found from anywhere.
        for _ in 0..if begins { FIRST_TURNS } else { 0 } {
            chosen = self.turn(&chosen, &FIRST, None);
        }
        chosen
    }

    fn turn(&self, kept: &Chosen, how: &How, searched: Option<usize>) -> Chosen {
        let mut chosen = [None; PATCH_POINTS];
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
        for place in 0..PATCH_POINTS {
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

    /// Motion in which another limb may lie deepest in each tick.
    fn is_fast(&self) -> bool {
        self.travel_m > FAST_M
    }

    /// The one that lies deepest: of those of the last tick if any still counts, else of all.
    fn deepest(&self, kept: &Chosen) -> Option<Corner> {
        let counts = |corner: &Corner| self.is_over(*corner) && self.height_m(*corner) <= self.reach_m;
        let lower = |a: Corner, b: Corner| if self.height_m(b) < self.height_m(a) { b } else { a };
        let mut kept = kept.iter().flatten().copied().filter(|corner| counts(corner) && !self.is_fast());
        let Some(first) = kept.next() else { return self.of_all(-self.reach_m, f64::INFINITY) };
        let known = kept.fold(first, lower);
        // What comes in loaded pushes: a ball that rolls would be driven by what enters below it and leaves behind.
        let depth = |corner: Corner| self.depth_m(corner);
        let (lowest, depth_m) = known.climb(self.mesh, depth);
        let least_m = DEEPER * depth(known) + LEAST_M;
        // Another limb that comes down is no neighbour. What is far behind the face is another side.
        let most_m = least_m + 2.0 * self.travel_m + BEHIND_M;
        Some(self.of_all(least_m.max(depth_m), most_m).unwrap_or(if depth_m > least_m {
            lowest
        } else {
            known
        }))
    }

    /// The one that lies deepest of all, if it is deeper than this and not deeper than that (m).
    fn of_all(&self, than_m: f64, most_m: f64) -> Option<Corner> {
        if let Some(farthest) = self.mesh.extreme(&-self.height.along_B) {
            let (farthest, depth_m) = Corner::new(farthest).climb(self.mesh, |corner| self.depth_m(corner));
            if depth_m > than_m && depth_m <= most_m {
                return Some(farthest);
            }
        }
        let mut limits = [Linear::new(self.height.along_B, self.height.base + most_m); MAX_LIMITS];
        let given = self.limits.len().min(MAX_LIMITS - 1);
        limits[1..=given].copy_from_slice(&self.limits[..given]);
        let limits = if most_m.is_finite() { &limits[..=given] } else { self.limits };
        let counts = [&self.below(self.reach_m), &Linear::ONE];
        let found = self.mesh.outlying(counts, limits, self.reach_m + than_m, MANY_VISITS);
        found.map(|(corner, _)| Corner::new(corner))
    }

    /// Depth in the face; a vertex that is not over it is not in it.
    fn depth_m(&self, corner: Corner) -> f64 {
        if self.is_over(corner) { -self.height_m(corner) } else { f64::MIN }
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

    pub(super) fn is_over(&self, corner: Corner) -> bool {
        let point_B = corner.point_M(self.mesh);
        self.limits.iter().all(|limit| limit.at(point_B) >= 0.0)
    }
}

/// Way in a tick from which on all are sought anew, and nobody is kept \[m\].
const FAST_M: f64 = 1e-3;
/// So many times as deep as all that were chosen must be what takes D's place.
const DEEPER: f64 = 1.5;
/// Turns of a first choice: what is found is found from anywhere.
const FIRST_TURNS: usize = 3;
/// Heights that change by less than this share of the depth do not.
const STILL: f64 = 0.01;
/// Depths below this are as this one \[m\].
const LEAST_M: f64 = 1e-5;
/// Vertices that are newly found are no deeper than what has come down in a tick, and this \[m\].
const BEHIND_M: f64 = 1e-3;
/// Limits of a face, and the level.
const MAX_LIMITS: usize = 6;
