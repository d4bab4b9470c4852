//! Whether a point is inside the closed parts of a mesh, and the way out.
//!
//! Model: inside is where the winding number is positive ([`ray`](super::ray)). The way out is the nearest point of the
//! surface, if the winding number is no longer positive just beyond it; beyond is where the normal there points: of a
//! face its own, of an edge the sum of both faces', of a vertex the sum of all faces' around it, each weighted by its angle
//! (Baerentzen & Aanaes 2005). Where parts overlap, and at folds, the nearest point may lead from one into another: then it
//! is the nearest of the places where rays along the axes come out of all parts.
//!
//! Invariant: what is inside has a way out, and that leads to where the winding number is not positive.
//!
//! Cost: a ray of at most [`MOST_VISITS`] nodes and runs of faces outside, three at worst; inside, also
//! [`Bvh::nearest`] and one more ray, at folds and overlaps six. Where all rays are too long a point counts as
//! outside, where nothing is felt.

use nalgebra::Vector3;

use super::nearest::MOST_VISITS;
use super::ray::{Crossing, Ray};
use super::{Bvh, Nearest, Triangles};
use crate::mesh::MAX_VALENCE;
use crate::mesh::beside::widest_m;
use crate::surface::Feature;

impl<const WIDTH: usize> Bvh<WIDTH> {
    /// Whether a point is inside or on the surface, whatever it costs. The solid faces must be closed and wound consistently.
    pub fn is_inside_unbounded(&self, triangles: Triangles<'_>, p_B: &Vector3<f64>) -> bool {
        self.winding_number(triangles, p_B, usize::MAX).is_some_and(|number| number > 0)
    }

    /// As [`Self::is_inside_unbounded`], at a cost that a tick can bear.
    pub fn is_inside(&self, triangles: Triangles<'_>, p_B: &Vector3<f64>) -> bool {
        self.winding_number(triangles, p_B, MOST_VISITS).is_some_and(|number| number > 0)
    }

    /// A point of the surface as seen from inside, at a cost that a tick can bear; `None` outside.
    ///
    /// It is the nearest one that leads outside, unless very many are equally near, as at the centre of a ball, or parts
    /// overlap: then it is one of these.
    pub fn way_out(&self, triangles: Triangles<'_>, p_B: &Vector3<f64>) -> Option<Nearest> {
        if !self.is_inside(triangles, p_B) {
            return None;
        }
        let nearest = self.nearest(triangles, p_B);
        if self.leads_outside(triangles, &nearest, p_B) {
            return Some(nearest);
        }
        let exits = self.ways_along_axes(triangles, p_B).map(|[exit, _]| exit);
        let nearer = |a: &Nearest, b: &Nearest| a.distance_m.total_cmp(&b.distance_m);
        Some(exits.into_iter().flatten().min_by(nearer).unwrap_or(nearest))
    }

    /// As [`Bvh::nearest`], and whether the point is inside or on the surface, at a cost that a tick can bear.
    pub fn nearest_and_side(&self, triangles: Triangles<'_>, p_B: &Vector3<f64>) -> (Nearest, bool) {
        (self.nearest(triangles, p_B), self.is_inside(triangles, p_B))
    }

    /// For each way along an axis, either direction, where it comes out of all parts; and where it leaves a part first of all,
    /// without having entered another one. The point must be inside.
    pub fn ways_along_axes(&self, triangles: Triangles<'_>, p_B: &Vector3<f64>) -> [[Option<Nearest>; 2]; 6] {
        self.rays(p_B).map(|ray| {
            let mut crossings = Crossings::default();
            let all =
                self.for_each_crossing(triangles, &ray, MOST_VISITS, |crossing| crossings.add(crossing));
            match all {
                Ok(()) if !crossings.is_full() => {
                    let face = |of: &Crossing| &triangles.faces[of.face as usize];
                    // A crack is as much longer along the ray as that is aslant.
                    let thin_m = |a: &Crossing, b: &Crossing| match face(a).is_beside && face(b).is_beside {
                        true => widest_m(self.extent_m()) / face(a).normal_B[ray.axes[2]].abs(),
                        false => BEYOND * self.extent_m(),
                    };
                    [crossings.exit(thin_m), crossings.first_left()]
                        .map(|found| found.map(|at| ray.place(&at)))
                }
                _ => [None; 2],
            }
        })
    }

    /// Whether a point is in the box around all faces, as what is inside must be.
    pub fn is_within_box(&self, p_B: &Vector3<f64>) -> bool {
        (0..3).all(|axis| p_B[axis] >= self.lower_B[axis] && p_B[axis] <= self.upper_B[axis])
    }

    /// Whether the nearest point of the surface is seen from behind, and nothing is inside just beyond it.
    fn leads_outside(&self, triangles: Triangles<'_>, nearest: &Nearest, p_B: &Vector3<f64>) -> bool {
        let normal_B = normal_at(triangles, nearest);
        let Some(normal_B) = normal_B.try_normalize(CANCELLED) else { return false };
        let is_behind = match nearest.feature {
            Feature::Edge | Feature::Vertex => normal_B.dot(&(p_B - nearest.point_B)) <= 0.0,
            _ => true,
        };
        let is_beside = triangles.faces[nearest.face as usize].is_beside;
        // In a crack that no finger feels it is not outside.
        let beyond_m = if is_beside { widest_m(self.extent_m()) } else { BEYOND * self.extent_m() };
        let beyond_B = nearest.point_B + normal_B * beyond_m;
        let number = || self.winding_number(triangles, &beyond_B, MOST_VISITS);
        is_behind && number().is_some_and(|number| number <= 0)
    }
}

impl Ray {
    fn place(&self, crossing: &Crossing) -> Nearest {
        let Crossing { face, ahead_m, .. } = *crossing;
        Nearest { face, feature: Feature::Face, corner: 0, point_B: self.at(ahead_m), distance_m: ahead_m }
    }
}

/// What a ray crosses, up to a bound.
struct Crossings {
    all: [Crossing; MOST_CROSSINGS],
    count: usize,
}

impl Default for Crossings {
    fn default() -> Self {
        let none = Crossing { face: 0, ahead_m: f64::INFINITY, is_leaving: false };
        Self { all: [none; MOST_CROSSINGS], count: 0 }
    }
}

impl Crossings {
    /// Keeps them in order; of equally far ones those that enter come first, so that what touches hangs together.
    fn add(&mut self, crossing: Crossing) {
        if self.is_full() {
            return;
        }
        let key = |of: &Crossing| (of.ahead_m, of.is_leaving);
        let mut at = self.count;
        while at > 0 && key(&self.all[at - 1]) > key(&crossing) {
            self.all[at] = self.all[at - 1];
            at -= 1;
        }
        self.all[at] = crossing;
        self.count += 1;
    }

    /// The last place is kept free: one more would not be seen.
    fn is_full(&self) -> bool {
        self.count == MOST_CROSSINGS
    }

    /// Behind which the winding number is not positive any more, for more than `thin_m` of what is left and entered: where faces lie upon each other,
    /// nothing is between them.
    fn exit(&self, thin_m: impl Fn(&Crossing, &Crossing) -> f64) -> Option<Crossing> {
        let all = &self.all[..self.count];
        let change = |crossing: &Crossing| if crossing.is_leaving { 1 } else { -1 };
        let mut number: i32 = all.iter().map(change).sum();
        (0..all.len()).find_map(|i| {
            number -= change(&all[i]);
            let has_room =
                all.get(i + 1).is_none_or(|next| next.ahead_m - all[i].ahead_m > thin_m(&all[i], next));
            (number <= 0 && all[i].is_leaving && has_room).then_some(all[i])
        })
    }

    fn first_left(&self) -> Option<Crossing> {
        self.all[..self.count].first().copied().filter(|first| first.is_leaving)
    }
}

/// Out of the surface, not of unit length: of a face its own, of an edge both faces', of a vertex all of those around it,
/// weighted by their angles.
pub(in crate::mesh) fn normal_at(triangles: Triangles<'_>, nearest: &Nearest) -> Vector3<f64> {
    let face = &triangles.faces[nearest.face as usize];
    match nearest.feature {
        Feature::Edge => {
            let link = face.links[nearest.corner];
            if link.is_boundary() {
                face.normal_B
            } else {
                face.normal_B + triangles.faces[link.face() as usize].normal_B
            }
        }
        Feature::Vertex => normal_at_vertex(triangles, nearest.face, nearest.corner),
        _ => face.normal_B,
    }
}

/// Sum of the normals around a vertex, weighted by the angle of each face there.
fn normal_at_vertex(triangles: Triangles<'_>, first: u32, corner: usize) -> Vector3<f64> {
    let (mut face, mut corner) = (first, corner);
    let mut sum = Vector3::zeros();
    for _ in 0..MAX_VALENCE {
        let record = &triangles.faces[face as usize];
        let corners = triangles.corners(record);
        let (left, right) =
            (corners[(corner + 1) % 3] - corners[corner], corners[(corner + 2) % 3] - corners[corner]);
        sum += record.normal_B * left.cross(&right).norm().atan2(left.dot(&right));
        let link = record.links[corner];
        if link.is_boundary() || link.is_turned() {
            break;
        }
        (face, corner) = (link.face(), (link.edge() + 1) % 3);
        if face == first {
            break;
        }
    }
    sum
}

/// Most faces that a ray along an axis is followed through.
const MOST_CROSSINGS: usize = 64;
/// So far beyond the surface, relative to the mesh, it is asked whether that is outside: a thousand times the rounding of
/// coordinates and planes, and nothing that a finger could feel.
const BEYOND: f64 = 1e-12;
/// Sums of normals shorter than this are rounding.
const CANCELLED: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, POPPED, make};

    #[test]
    fn the_way_out_of_a_ball_s_centre_is_not_sought_among_all_faces() {
        let (ball, _) = Mesh::build(make::uv_sphere(200, 101, 0.1)).unwrap();
        let triangles = Triangles { faces: ball.faces(), vertices: ball.vertices() };
        let centre = Vector3::zeros();
        assert!(!ball.bvh.nearest_of_visited(triangles, &centre, MOST_VISITS).1, "40,000 are as near");
        let way_out = ball.way_out(&centre).unwrap();
        // Facets of 1.8 degrees cut off 1.3e-4 of the radius.
        assert!((way_out.distance_m - 0.1).abs() < 3e-5, "{way_out:?}");
        let cost_of = |ask: &dyn Fn() -> f64| {
            let before = POPPED.get();
            std::hint::black_box(ask());
            POPPED.get() - before
        };
        // Each visit puts four at most on the stack; the segment to the face found takes some tens.
        assert!(cost_of(&|| ball.nearest(&centre).distance_m) <= 1 + 4 * MOST_VISITS);
        assert!(cost_of(&|| f64::from(u8::from(ball.is_inside(&centre)))) <= 200 + 4 * MOST_VISITS);
        assert!(cost_of(&|| ball.nearest_unbounded(&centre).distance_m) > 10 * MOST_VISITS);
        let near_the_surface = Vector3::new(0.03, 0.08, -0.04);
        assert!(ball.bvh.nearest_of_visited(triangles, &near_the_surface, MOST_VISITS).1);
        assert_eq!(ball.way_out(&near_the_surface), Some(ball.nearest_unbounded(&near_the_surface)));
    }

    #[test]
    fn there_is_a_way_out_of_what_is_inside_alone() {
        // In the hole of the torus, all of its inner ring is equally near.
        let torus = make::torus(400, 200, 0.1, 0.04);
        let pearl = make::uv_sphere(200, 101, 0.1);
        for (name, soup) in [("torus", torus), ("pearl", pearl), ("star", make::star(5, 0.1, 0.04, 0.05))] {
            let (mesh, _) = Mesh::build(soup).unwrap();
            let mut inside = 0;
            for i in 0..400 {
                // Golden ratios fill the box evenly; the first points crowd around its middle.
                let share = |k: f64| (f64::from(i) * k).fract() - 0.5;
                let size = 0.3 * f64::from(i.min(100)) / 100.0;
                let p = Vector3::new(share(0.819_172_5), share(0.671_043_6), share(0.549_700_5)) * size;
                let is_inside = mesh.is_inside_unbounded(&p);
                assert_eq!(mesh.way_out(&p).is_some(), is_inside, "{name}: {p:?}");
                inside += usize::from(is_inside);
            }
            assert!((20..380).contains(&inside), "{name}: {inside}");
        }
    }
}
