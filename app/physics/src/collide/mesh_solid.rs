//! A mesh and another solid, a closed form or a mesh: where either presses on the other.
//!
//! Model: about where they meet there is a plane; what of the mesh lies low over it from one side and of the other one from
//! the other side may touch. That is: vertices of the mesh, chosen as those on a plane are ([`mesh_span`](super::mesh_span)),
//! against the other one's surface; points of the other one (corners, points of rims, ends of axes, vertices) against the
//! mesh; and where an outline of the one is cut off by the other, the places where it is. Each counts with its own normal and
//! gap, which are exact; the plane chooses only. It is that of the last tick's contact points; where there were none, it is
//! found by going to and fro between the two.
//! A vertex in the middle of a flat face presses nothing that the other one's corners do not: it is left out.
//! Frames: the mesh's frame M; normals from the mesh to the other one.
//! Limits: of two that touch in several places at once around a corner or in a hole, points of the other one are found
//! everywhere, vertices of the mesh only where most of the load is. Crossings are found of a box's edges and of sharp edges
//! that leave the vertices of a mesh that were chosen: of fine meshes these are short, but vertices lie as near. Rims of round
//! forms are not cut off.
//! Memory: words 0 to 2 the normal, 3 whether there is one, 4 to 6 where, 7 how deep.
//! Cost: two choices of vertices and at most eight queries for the nearest point for each side; bounded.

use haptics::mesh::{Linear, Mesh};
use nalgebra::{Point3, Vector3};

use super::mesh::{About, Contact, Told};
use super::mesh_corner::Corner;
use super::mesh_cut::Edge;
use super::mesh_other::{Meeting, Other, Solidity, see};
use super::mesh_span::Standing;
use super::{MAX_POINTS, PairMemory};

pub(super) fn contact_points(
    mesh: &Mesh,
    other: &Other<'_>,
    reach_m: f64,
    memory: &mut PairMemory,
    told: &mut Told<'_>,
) {
    let travel_m = (reach_m - crate::pair::REACH_M).max(0.0);
    let Some(meeting) = meet(mesh, other, reach_m, travel_m, memory) else {
        *memory = PairMemory::default();
        return;
    };
    let mut found = Found { meeting: &meeting, contacts: [Contact::default(); ROOM], count: 0 };
    found.vertices(mesh, other, memory);
    found.owns(mesh, other, memory);
    let contacts = &found.contacts[..found.count];
    contacts.iter().for_each(|contact| told.tell(contact));
    remember(contacts, memory);
}

/// About where they meet: as in the last tick, or else found by going to and fro; `None` where they are far apart.
fn meet(mesh: &Mesh, other: &Other<'_>, reach_m: f64, travel_m: f64, memory: &PairMemory) -> Option<Meeting> {
    let [x, y, z, is_known, at_x, at_y, at_z, depth_m] = memory.words;
    if is_known == 1.0 {
        let normal_M = Vector3::new(x, y, z);
        return Some(Meeting { normal_M, at_M: Vector3::new(at_x, at_y, at_z), depth_m, reach_m, travel_m });
    }
    let (centre_M, radius_m) = other.ball();
    let mut at_M = mesh.nearest(&centre_M).point_B;
    if (at_M - centre_M).norm() > radius_m + reach_m && !mesh.is_inside(&centre_M) {
        return None;
    }
    let [low_M, high_M] = mesh.bounds_B();
    // Out of the larger one is where the smaller one's middle is.
    let is_smaller = 0.5 * (high_M - low_M).norm() < radius_m;
    let out_M = |at_M: &Vector3<f64>| {
        let out_M = if is_smaller { (low_M + high_M) * 0.5 - at_M } else { at_M - centre_M };
        out_M.try_normalize(0.0).unwrap_or_else(Vector3::y)
    };
    let mut seen = other.see(&at_M, &out_M(&at_M), 0.0);
    for _ in 0..TO_AND_FRO {
        at_M = mesh.nearest(&(at_M - seen.out * seen.gap_m)).point_B;
        seen = other.see(&at_M, &out_M(&at_M), 0.0);
    }
    let normal_M = -seen.out;
    Some(Meeting { normal_M, at_M, depth_m: (-seen.gap_m).max(0.0), reach_m, travel_m })
}

/// The mean of the contact points, by their depth.
fn remember(contacts: &[Contact], memory: &mut PairMemory) {
    let deepest_m = contacts.iter().fold(0.0_f64, |deepest_m, contact| deepest_m.max(-contact.gap_m));
    let (mut normal_M, mut at_M, mut sum) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    for contact in contacts.iter().filter(|contact| contact.gap_m < 0.0) {
        normal_M -= contact.normal_M * contact.gap_m;
        at_M -= contact.on_mesh_M * contact.gap_m;
        sum -= contact.gap_m;
    }
    let Some(normal_M) = normal_M.try_normalize(1e-3 * sum).filter(|_| sum > 0.0) else {
        // Nothing presses: the next tick looks anew.
        memory.words[3] = 0.0;
        return;
    };
    let [n, at] = [normal_M, at_M / sum];
    memory.words = [n.x, n.y, n.z, 1.0, at.x, at.y, at.z, deepest_m];
}

struct Found<'m> {
    meeting: &'m Meeting,
    contacts: [Contact; ROOM],
    count: usize,
}

impl Found<'_> {
    /// The mesh's vertices against the other one.
    fn vertices(&mut self, mesh: &Mesh, other: &Other<'_>, memory: &mut PairMemory) {
        let meeting = self.meeting;
        let n = meeting.normal_M;
        let standing = Standing {
            mesh,
            height: Linear::from(&other.front(&-n, meeting), -n),
            limits: &meeting.shadow(other.ball()),
            reach_m: meeting.reach_m,
            travel_m: meeting.travel_m,
        };
        let chosen = standing.choose(&mut memory.stands[0]);
        for corner in chosen.into_iter().flatten().filter(|corner| !corner.is_in_a_plane(mesh)) {
            let on_mesh_M = *corner.point_M(mesh);
            let seen = other.see(&on_mesh_M, &-n, meeting.deep_m());
            let about = About::Vertex(corner.vertex(mesh));
            self.push(Contact::new(about, on_mesh_M, -seen.out, seen.gap_m));
        }
        if self.meeting.depth_m > 0.0 {
            chosen.into_iter().flatten().for_each(|corner| self.edges_of_mesh(mesh, other, corner));
        }
    }

    /// The other one's points against the mesh.
    fn owns(&mut self, mesh: &Mesh, other: &Other<'_>, memory: &mut PairMemory) {
        let meeting = self.meeting;
        let [low_M, high_M] = mesh.bounds_B();
        let around = ((low_M + high_M) * 0.5, 0.5 * (high_M - low_M).norm());
        let owns = other.owns(meeting, &meeting.shadow(around), &mut memory.stands[1]);
        let far_m = meeting.reach_m + FAR * meeting.depth_m;
        for own in owns.into_iter().flatten() {
            // Far from all faces it is outside, or so deep inside that it does not matter where others press.
            if mesh.clearance(&own.at_M, own.radius_m + far_m) >= own.radius_m + far_m {
                continue;
            }
            let seen = see(mesh, &own.at_M, &meeting.normal_M, meeting.deep_m());
            let gap_m = seen.gap_m - own.radius_m;
            let on_mesh_M = own.at_M - seen.out * seen.gap_m;
            self.push(Contact::new(About::Other(own.number), on_mesh_M, seen.out, gap_m));
        }
        if meeting.depth_m > 0.0 {
            self.edges(mesh, other);
            let corners = owns.into_iter().flatten().filter_map(|own| own.corner);
            corners.for_each(|corner| self.edges_of_other(mesh, other, corner));
        }
    }

    /// Where edges of a form are cut off by the mesh.
    fn edges(&mut self, mesh: &Mesh, other: &Other<'_>) {
        let n = self.meeting.normal_M;
        for (number, edge) in other.edges(&-n).into_iter().flatten().enumerate() {
            self.cuts_by_mesh(mesh, &edge, About::Cut { edge: number as u32, of_mesh: false, end: 0 });
        }
    }

    /// Where edges that leave a vertex of the other mesh are cut off by this one.
    fn edges_of_other(&mut self, mesh: &Mesh, other: &Other<'_>, corner: Corner) {
        let Solidity::Mesh(second) = other.solid else { return };
        let place = |point: &Vector3<f64>| (other.X_MO * Point3::from(*point)).coords;
        let from = place(corner.point_M(second));
        corner.for_each_sharp_edge(second, |to, face, edge| {
            let about = About::Cut { edge: 3 * face + edge as u32, of_mesh: false, end: 0 };
            self.cuts_by_mesh(mesh, &Edge { ends: [from, place(to)] }, about);
        });
    }

    fn cuts_by_mesh(&mut self, mesh: &Mesh, edge: &Edge, about: About) {
        let meeting = self.meeting;
        let cuts = edge.cuts(mesh, &meeting.normal_M, meeting.deep_m());
        for (end, cut) in cuts.into_iter().enumerate() {
            if let Some(cut) = cut {
                let about = about.at_end(end as u32);
                self.push(Contact::new(about, cut.on_mesh, cut.out, cut.gap_m));
            }
        }
    }

    /// Where edges that leave a vertex of this mesh are cut off by the other one.
    fn edges_of_mesh(&mut self, mesh: &Mesh, other: &Other<'_>, corner: Corner) {
        let Solidity::Mesh(second) = other.solid else { return };
        let meeting = self.meeting;
        let place = |point: &Vector3<f64>| other.X_MO.inverse_transform_point(&Point3::from(*point)).coords;
        let along = other.X_MO.inverse_transform_vector(&-meeting.normal_M);
        let from = place(corner.point_M(mesh));
        corner.for_each_sharp_edge(mesh, |to, face, edge| {
            let cuts = Edge { ends: [from, place(to)] }.cuts(second, &along, meeting.deep_m());
            for (end, cut) in cuts.into_iter().enumerate() {
                let about = About::Cut { edge: 3 * face + edge as u32, of_mesh: true, end: end as u32 };
                if let Some(cut) = cut {
                    let on_mesh_M = (other.X_MO * Point3::from(cut.on_edge)).coords;
                    let normal_M = -(other.X_MO * cut.out);
                    self.push(Contact::new(about, on_mesh_M, normal_M, cut.gap_m));
                }
            }
        });
    }

    fn push(&mut self, contact: Contact) {
        if contact.gap_m > self.meeting.reach_m || !contact.gap_m.is_finite() {
            return;
        }
        // Of a crossing both edges tell, each on its side of the depth.
        let together_m = TOGETHER_M + 2.0 * contact.gap_m.min(0.0).abs();
        let is_there =
            |one: &Contact| (one.on_mesh_M - contact.on_mesh_M).norm_squared() < together_m * together_m;
        if self.contacts[..self.count].iter().any(is_there) {
            return;
        }
        if let Some(place) = self.contacts.get_mut(self.count) {
            *place = contact;
            self.count += 1;
        }
    }
}

/// Room for vertices, points of the other one and crossings.
const ROOM: usize = 3 * MAX_POINTS;
/// Turns between the two until the nearest points are about found.
const TO_AND_FRO: usize = 4;
/// Points at most so many times as deep as the deepest of the last tick are found.
const FAR: f64 = 2.0;
/// Nearer to each other they are one \[m\].
const TOGETHER_M: f64 = 1e-6;
