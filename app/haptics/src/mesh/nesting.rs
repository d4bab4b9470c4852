//! Closed parts, turned outward where they face inward and are no cavities.
//!
//! Problem: files hold parts that are wound inward by mistake, and cavities, which are wound inward by right.
//!
//! Model: a closed part faces inward if its volume is negative. It lies in another one if that one's winding number at a vertex
//! of it is not zero and the two have no common point. A part that lies in no other one is turned outward; what lies in it turns
//! with it: so a cavity stays a cavity, also in a file that is inside out as a whole. Of several around a part, the one of the
//! largest volume counts.
//!
//! In doubt a part lies in no other one: to fill a cavity that nobody reaches does less than to leave a part inside out, which
//! would pull a finger in.
//!
//! Cost: linear where all closed parts are wound alike, as nearly everywhere. Otherwise all pairs of faces that cross, and a ray
//! for each part.

use std::collections::HashSet;

use nalgebra::Vector3;

use super::winding::Parts;
use super::{Face, Link, Mesh, MeshReport, Sides};

impl Mesh {
    /// Notes what was turned, and what was taken for a cavity.
    pub(super) fn turn_outward(&mut self, parts: &Parts, report: &mut MeshReport) {
        let volumes = self.volumes(parts);
        let is_inward = |part: usize| volumes[part].times_six_m3 < 0.0;
        if !(0..parts.len()).any(is_inward) {
            return;
        }
        let outermost = self.outermost(parts, &volumes);
        let is_turned: Vec<bool> = outermost.iter().map(|&part| is_inward(part)).collect();
        for (part, is_turned) in is_turned.iter().enumerate() {
            if *is_turned {
                report.inside_out.note(parts.first_of_input(part));
            }
            if *is_turned != is_inward(part) {
                report.cavities.note(parts.first_of_input(part));
            }
        }
        for (i, face) in self.faces.iter_mut().enumerate() {
            if is_turned[parts.of(i)] {
                turn_over(face);
            }
        }
    }

    /// Nothing for what has no inside.
    fn volumes(&self, parts: &Parts) -> Vec<Volume> {
        let mut volumes = vec![Volume::default(); parts.len()];
        for (i, face) in self.faces.iter().enumerate().filter(|(_, face)| face.sides == Sides::Solid) {
            let volume = &mut volumes[parts.of(i)];
            let [a, b, c] = self.triangles().corners(face);
            let apex = *volume.apex.get_or_insert(a);
            volume.times_six_m3 += (a - apex).dot(&(b - apex).cross(&(c - apex)));
        }
        volumes
    }

    /// For each part the one in which it lies and that lies in no other one, or itself.
    fn outermost(&self, parts: &Parts, volumes: &[Volume]) -> Vec<usize> {
        let mut outermost: Vec<usize> = (0..parts.len()).collect();
        let is_outward = |volume: &Volume| volume.apex.is_some() && volume.times_six_m3 >= 0.0;
        if !volumes.iter().any(is_outward) {
            return outermost;
        }
        let mut crossed = HashSet::new();
        let is_done = self.for_each_near_pair(parts, |pair, do_cross| {
            let [a, b] = pair.map(|face| parts.of(face));
            if !crossed.contains(&[a, b]) && do_cross() {
                crossed.extend([[a, b], [b, a]]);
            }
        });
        if !is_done {
            return outermost;
        }
        let mut around: Vec<(usize, i32)> = Vec::new();
        for (part, outermost) in outermost.iter_mut().enumerate() {
            let Some(apex) = volumes[part].apex else { continue };
            around.clear();
            self.bvh.for_each_face_on_the_way_out(self.triangles(), &apex, |face, is_leaving| {
                around.push((parts.of(face as usize), if is_leaving { 1 } else { -1 }));
            });
            around.sort_unstable();
            let numbers = around.chunk_by(|a, b| a.0 == b.0);
            let containers =
                numbers.filter(|changes| changes.iter().map(|(_, change)| change).sum::<i32>() != 0);
            let containers = containers.map(|changes| changes[0].0);
            let containers = containers.filter(|&other| other != part && !crossed.contains(&[part, other]));
            let size = |part: &usize| volumes[*part].times_six_m3.abs();
            *outermost = containers.max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(part);
        }
        outermost
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct Volume {
    /// Any vertex of the part: volumes are measured from here, since from far away they would cancel.
    apex: Option<Vector3<f64>>,
    /// Negative if the part faces inward.
    times_six_m3: f64,
}

/// Turns a face over whose neighbours are turned, too. Its last two corners are exchanged, and with them its first and last edges.
fn turn_over(face: &mut Face) {
    face.vertices.swap(1, 2);
    face.links.swap(0, 2);
    for link in face.links.iter_mut().filter(|link| !link.is_boundary()) {
        *link = Link::new(link.face(), 2 - link.edge() as u8, link.is_turned());
    }
    face.normal_B = -face.normal_B;
    face.offset_m = -face.offset_m;
}
