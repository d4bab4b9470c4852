//! The foot of a ball: where a point's distance from a mesh is least, near a face that is known.
//!
//! Model: the closest point of the face; where that lies on an edge or a vertex, of the faces beyond, as long as one of
//! them is closer. Where none is, the distance has a local minimum: which is what a ball rests on.
//!
//! Invariant: each step comes closer, hence no walk goes in circles.
//! Cost: one face while the foot stays inside of it, two on an edge, one for each face around a vertex; bounded.

use nalgebra::Vector3;

use crate::mesh::Mesh;
use crate::mesh::bvh::closest_on;
use crate::mesh::fan::for_each_around;
use crate::mesh::place::{Facet, Side};
use crate::surface::Feature;

/// A point of a mesh, as seen from another one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Foot {
    pub(super) face: u32,
    pub(super) feature: Feature,
    /// Which edge or corner of the face.
    pub(super) corner: usize,
    pub(super) point_B: Vector3<f64>,
    pub(super) squared_m2: f64,
}

impl Foot {
    /// The foot of `p_B` that one comes to from a face.
    pub(super) fn from_face(mesh: &Mesh, face: u32, p_B: &Vector3<f64>) -> Self {
        let mut here = Self::on(mesh, face, p_B);
        for _ in 0..MOST_STEPS {
            let closer = match here.feature {
                Feature::Edge => here.over_the_edge(mesh, p_B),
                Feature::Vertex => here.around_the_vertex(mesh, p_B),
                _ => return here,
            };
            match closer {
                Some(there) => here = there,
                None => return here,
            }
        }
        here
    }

    /// The closest point of one face.
    #[inline(always)]
    pub(super) fn on(mesh: &Mesh, index: u32, p_B: &Vector3<f64>) -> Self {
        let face = &mesh.faces[index as usize];
        let corners = face.vertices.map(|vertex| mesh.vertices[vertex as usize]);
        match closest_on(face, &corners, p_B, f64::INFINITY) {
            Some(found) => Self {
                face: index,
                feature: found.feature,
                corner: found.corner,
                point_B: found.point_B,
                squared_m2: found.squared_distance,
            },
            // Of what is not a number.
            None => Self {
                face: index,
                feature: Feature::Vertex,
                corner: 0,
                point_B: corners[0],
                squared_m2: f64::INFINITY,
            },
        }
    }

    fn over_the_edge(&self, mesh: &Mesh, p_B: &Vector3<f64>) -> Option<Self> {
        let link = mesh.faces[self.face as usize].links[self.corner];
        let over = (!link.is_boundary()).then(|| Self::on(mesh, link.face(), p_B))?;
        (over.squared_m2 < self.squared_m2).then_some(over)
    }

    /// The closest of all around: the first one that is closer may lead into a narrow place.
    fn around_the_vertex(&self, mesh: &Mesh, p_B: &Vector3<f64>) -> Option<Self> {
        let (mut best, mut is_closer) = (*self, false);
        let side = Side { face: self.face, is_back: false };
        for_each_around(mesh, side, self.corner, |sector| {
            let there = Self::on(mesh, sector.facet.side.face, p_B);
            if there.squared_m2 < best.squared_m2 {
                (best, is_closer) = (there, true);
            }
        });
        is_closer.then_some(best)
    }

    /// Which way the finger's centre lies from here, and `normal . x` of where it then is when it touches.
    pub(super) fn plane(&self, mesh: &Mesh, centre_B: &Vector3<f64>, radius_m: f64) -> (Vector3<f64>, f64) {
        let facet = Facet::of(mesh, Side { face: self.face, is_back: false });
        let height_m = -facet.depth_m(centre_B);
        let turned = if height_m < 0.0 { -1.0 } else { 1.0 };
        let way_B = centre_B - self.point_B;
        let way_m = way_B.norm();
        if self.feature == Feature::Face || way_m.is_nan() || way_m <= LEAST_WAY * radius_m {
            // Of a face the plane is known better than the way to the foot.
            return (facet.normal_B * turned, facet.offset_m * turned + radius_m);
        }
        let normal_B = way_B / way_m;
        (normal_B, normal_B.dot(&self.point_B) + radius_m)
    }
}

/// Bound on the steps of a walk. Fingers at 0.5 m/s cross one triangle of 0.5 mm a tick.
const MOST_STEPS: usize = 256;
/// Shorter than this share of the radius, the way to the foot has no direction.
const LEAST_WAY: f64 = 1e-9;
