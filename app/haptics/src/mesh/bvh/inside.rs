//! Whether a point is inside a closed mesh.
//!
//! Model: the sign of the distance to the nearest point, by the normal there: of a face its own, of an edge the sum
//! of both faces', of a vertex the sum of all faces' around it, each weighted by its angle (Baerentzen & Aanaes
//! 2005). With any other weights a sharp vertex would call outside what is inside.
//!
//! Cost: that of [`Bvh::nearest_unbounded`], and a walk around a vertex where one is nearest. What a tick asks,
//! [`Bvh::way_out`] and [`Bvh::nearest_and_side`], gives up looking for the very nearest point in time. Which side the
//! point is on then shows in how the way to the nearest face found meets the surface first; should that way, too, lead
//! past more than a tick can look at, the point counts as outside, where nothing is felt.

use nalgebra::Vector3;

use super::nearest::MOST_VISITS;
use super::{Bvh, Nearest, Triangles};
use crate::mesh::{MAX_VALENCE, Sides};
use crate::surface::Feature;

impl<const WIDTH: usize> Bvh<WIDTH> {
    /// Whether a point is inside or on the surface. The faces must be closed and wound consistently.
    pub fn is_inside_unbounded(&self, triangles: Triangles<'_>, p_B: &Vector3<f64>) -> bool {
        self.is_within_box(p_B) && is_behind(triangles, &self.nearest_unbounded(triangles, p_B), p_B)
    }

    /// A point of the surface as seen from inside, at a cost that a tick can bear; `None` outside.
    ///
    /// It is the nearest one unless very many are equally near, as at the centre of a ball: then it is one of these.
    pub fn way_out(&self, triangles: Triangles<'_>, p_B: &Vector3<f64>) -> Option<Nearest> {
        if !self.is_within_box(p_B) {
            return None;
        }
        let (nearest, is_inside) = self.nearest_and_side(triangles, p_B);
        is_inside.then_some(nearest)
    }

    /// As [`Bvh::nearest`], and whether the point is inside or on the surface, at a cost that a tick can bear.
    pub fn nearest_and_side(&self, triangles: Triangles<'_>, p_B: &Vector3<f64>) -> (Nearest, bool) {
        let (nearest, is_sure) = self.nearest_of_visited(triangles, p_B, MOST_VISITS);
        if !self.is_within_box(p_B) {
            return (nearest, false);
        }
        if is_sure {
            return (nearest, is_behind(triangles, &nearest, p_B));
        }
        match self.shut_off_by(triangles, &nearest, p_B) {
            Some(first) => (first, true),
            None => (nearest, false),
        }
    }

    /// Whether a point is in the box around all faces, as what is inside must be.
    pub fn is_within_box(&self, p_B: &Vector3<f64>) -> bool {
        (0..3).all(|axis| p_B[axis] >= self.lower_B[axis] && p_B[axis] <= self.upper_B[axis])
    }

    /// What the way through the middle of the nearest face found meets first, if it is met from behind: that face, or
    /// one on the way there.
    fn shut_off_by(
        &self,
        triangles: Triangles<'_>,
        nearest: &Nearest,
        p_B: &Vector3<f64>,
    ) -> Option<Nearest> {
        let [a, b, c] = triangles.corners(&triangles.faces[nearest.face as usize]);
        let beyond_B = p_B + ((a + b + c) / 3.0 - p_B) * BEYOND;
        let first = self
            .first_hit_of_visited(triangles, Sides::Sheet, p_B, &beyond_B, |_| false, MOST_VISITS)
            .ok()??;
        if first.is_front {
            return None;
        }
        if first.face == nearest.face {
            return Some(*nearest);
        }
        let (face, point_B) = (first.face, first.point_B);
        let distance_m = (point_B - p_B).norm();
        Some(Nearest { face, feature: Feature::Face, corner: 0, point_B, distance_m })
    }
}

fn is_behind(triangles: Triangles<'_>, nearest: &Nearest, p_B: &Vector3<f64>) -> bool {
    let face = &triangles.faces[nearest.face as usize];
    let normal_B = match nearest.feature {
        Feature::Edge => {
            let link = face.links[nearest.corner];
            if link.is_boundary() {
                face.normal_B
            } else {
                face.normal_B + triangles.faces[link.face() as usize].normal_B
            }
        }
        Feature::Vertex => normal_at_vertex(triangles, nearest.face, nearest.corner),
        _ => return face.normal_B.dot(p_B) - face.offset_m <= 0.0,
    };
    normal_B.dot(&(p_B - nearest.point_B)) <= 0.0
}

/// Sum of the normals around a vertex, weighted by the angle of each face there; not of unit length.
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

/// So far beyond the middle of a face does a way end that is sure to meet it.
const BEYOND: f64 = 1.001;

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
