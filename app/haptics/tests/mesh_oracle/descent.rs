//! The contact with a mesh, slow and obvious: every face is looked at, nothing is known of neighbours.
//!
//! The frictionless god-object goes downhill: of all faces that it touches, the one that lets it come nearest to the
//! HIP, again, until none does. A triangle is convex, so that the way is straight and downhill all along. Before each
//! move it is asked whether the HIP is outside, seen from the god-object: then nothing holds it, and it flies straight
//! to the HIP, up to the first face in its way.

use haptics::mesh::Mesh;
use nalgebra::Vector3;

use super::{closest, corners, winding_number};

/// A frictionless god-object on a mesh of few faces.
pub(crate) struct Descent<'m> {
    mesh: &'m Mesh,
    /// May be set: two god-objects part where two ways lead downhill.
    pub(crate) god_object: Option<Vector3<f64>>,
    last_hip: Option<Vector3<f64>>,
}

/// Touching, in terms of metres: a thousand roundings of positions.
const TOUCHING_M: f64 = 1e-12;
/// How far ahead of the god-object it is asked what is there \[m\]: small against faces, large against rounding.
const AHEAD_M: f64 = 1e-8;

impl<'m> Descent<'m> {
    pub(crate) fn new(mesh: &'m Mesh) -> Self {
        Self { mesh, god_object: None, last_hip: None }
    }

    /// One tick. The first HIP has to be outside.
    pub(crate) fn step(&mut self, hip: &Vector3<f64>) -> Option<Vector3<f64>> {
        let last_hip = self.last_hip.replace(*hip);
        if self.god_object.is_none() {
            self.god_object = self.meet(&last_hip?, hip);
        }
        for _ in 0..1000 {
            let at = self.god_object?;
            if self.is_free(&at, hip) {
                let ahead = at + (hip - at).normalize() * AHEAD_M;
                self.god_object = self.meet(&ahead, hip);
                continue;
            }
            let lower = self.lowest_reachable(&at, hip);
            if (at - hip).norm() - (lower - hip).norm() <= 1e-16 {
                return Some(at);
            }
            self.god_object = Some(lower);
        }
        panic!("the descent does not end: HIP {hip}");
    }

    /// Whether a god-object may rest there: on the mesh, held back, with nothing nearer to the HIP in reach.
    pub(crate) fn is_at_rest(&self, at: &Vector3<f64>, hip: &Vector3<f64>) -> bool {
        let is_on_it = super::distance(self.mesh, at) < TOUCHING_M;
        // A rounding of squares of distances: 1e-16 m^2 over 1 mm.
        let gain_m = (at - hip).norm() - (self.lowest_reachable(at, hip) - hip).norm();
        is_on_it && !self.is_free(at, hip) && gain_m < 1e-13
    }

    /// Where a segment first enters the mesh.
    fn meet(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> Option<Vector3<f64>> {
        super::first_fraction(self.mesh, from, to, -1e-12).map(|fraction| from + (to - from) * fraction)
    }

    /// Whether the way to the HIP leads out of the material.
    fn is_free(&self, at: &Vector3<f64>, hip: &Vector3<f64>) -> bool {
        let way = hip - at;
        let length = way.norm();
        length > AHEAD_M && winding_number(self.mesh, &(at + way * (AHEAD_M / length))) < 0.5
    }

    fn lowest_reachable(&self, at: &Vector3<f64>, hip: &Vector3<f64>) -> Vector3<f64> {
        let faces = (0..self.mesh.faces().len()).map(|face| corners(self.mesh, face));
        let touched = faces.filter(|face| (closest(face, at) - at).norm() < TOUCHING_M);
        let foot = touched.map(|face| closest(&face, hip));
        foot.min_by(|a, b| (a - hip).norm().total_cmp(&(b - hip).norm())).unwrap_or(*at)
    }
}
