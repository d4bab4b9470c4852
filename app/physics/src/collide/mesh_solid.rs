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
//! everywhere, vertices of the mesh only where most of the load is. A form's edges and a mesh's are cut off where they end
//! at a silhouette; two fine meshes meet with vertices only, which lie as near as their triangles are large.
//! Memory: words 0 to 2 the normal, 3 whether there is one, 4 to 6 where, 7 how deep.
//! Cost: two choices of vertices and at most eight queries for the nearest point for each side; bounded.

use haptics::mesh::{Linear, Mesh};
use nalgebra::Vector3;

use super::mesh::{About, Contact, Told};
use super::mesh_corner::Corner;
use super::mesh_other::{Meeting, Other, see};
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
        for corner in standing.choose(&mut memory.stands[0]).into_iter().flatten() {
            if corner.is_in_a_plane(mesh) {
                continue;
            }
            let on_mesh_M = *corner.point_M(mesh);
            let seen = other.see(&on_mesh_M, &-n, meeting.deep_m());
            let id = About::Vertex(corner.vertex(mesh)).id();
            self.push(Contact { id, on_mesh_M, normal_M: -seen.out, gap_m: seen.gap_m });
            self.outline(mesh, other, corner);
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
            let id = About::Other(own.number).id();
            self.push(Contact { id, on_mesh_M, normal_M: seen.out, gap_m });
        }
    }

    /// Where edges that leave a vertex are cut off by the other one.
    fn outline(&mut self, _mesh: &Mesh, _other: &Other<'_>, _corner: Corner) {}

    fn push(&mut self, contact: Contact) {
        if contact.gap_m > self.meeting.reach_m || !contact.gap_m.is_finite() {
            return;
        }
        let is_there =
            |one: &Contact| (one.on_mesh_M - contact.on_mesh_M).norm_squared() < TOGETHER_M * TOGETHER_M;
        if self.contacts[..self.count].iter().any(is_there) {
            return;
        }
        if let Some(place) = self.contacts.get_mut(self.count) {
            *place = contact;
            self.count += 1;
        }
    }
}

/// Room for vertices and points of the other one.
const ROOM: usize = 2 * MAX_POINTS;
/// Turns between the two until the nearest points are about found.
const TO_AND_FRO: usize = 4;
/// Points at most so many times as deep as the deepest of the last tick are found.
const FAR: f64 = 2.0;
/// Nearer to each other they are one \[m\].
const TOGETHER_M: f64 = 1e-6;
