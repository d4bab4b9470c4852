//! A ball at a mesh: a contact point at each locally nearest feature (Melder ch. 6.3.1, 7.4.6).
//!
//! Model: a point of the mesh is locally nearest if the way along the mesh leads away from the centre on all sides: the
//! foot of the perpendicular inside a face; a point of an edge from which both faces lead away; a vertex from which all
//! edges do. On faces in one plane, however many, that is one point, the same as on the plane. Its normal points to the
//! centre.
//! Where the mesh is slightly concave, a ball touches on both sides of the fold with nearly the same normal; were each
//! pressed by its whole depth, a ball in a shallow valley would be pressed twice. So depths are shared: the part of a depth
//! that another contact takes already, by the cosine between their normals, does not count again ([`share`]). A contact
//! begins with nothing that way.
//!
//! A centre that went through the surface in a tick, or was pushed through a thin wall, is still on the side it came from:
//! the place where it was last outside is remembered ([`PairMemory`]), and the face between there and here presses it back.
//! Frames and signs: the mesh's frame M; normals from the mesh to the ball.
//! Cost: a query for the nearest point; where that is in reach, one for all faces as near, at most [`MOST_FACES`], beyond
//! which only the nearest counts.

use haptics::Feature;
use haptics::mesh::{Face, Mesh, Nearest};
use nalgebra::Vector3;

use super::mesh::{About, Contact, Told};
use super::mesh_share::share;
use super::{PATCH_POINTS, PairMemory};

/// In the mesh's frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ball {
    pub(super) centre_M: Vector3<f64>,
    pub(super) radius_m: f64,
}

pub(super) fn contact_points(
    mesh: &Mesh,
    ball: &Ball,
    reach_m: f64,
    memory: &mut PairMemory,
    told: &mut Told<'_>,
) {
    if !ball.centre_M.iter().all(|x| x.is_finite()) {
        return;
    }
    if let Some(through) = went_through(mesh, ball, memory) {
        told.tell(&through);
        return;
    }
    let nearest = mesh.nearest(&ball.centre_M);
    if nearest.distance_m > ball.radius_m + reach_m {
        return;
    }
    let mut found = Found::default();
    // Of all but the nearest only those that may touch in this tick.
    let travel_m = (reach_m - crate::pair::REACH_M).max(0.0);
    let within_m = ball.radius_m + travel_m;
    let all = nearest.distance_m <= within_m && found.gather(mesh, ball, within_m);
    if !all || found.count == 0 {
        found = Found::default();
        found.add(of_nearest(mesh, ball, &nearest));
    }
    found.unite();
    share(&mut found.contacts[..found.count]);
    found.contacts[..found.count].iter().for_each(|contact| told.tell(contact));
}

/// The face that the centre went through since it was last outside, if it did.
fn went_through(mesh: &Mesh, ball: &Ball, memory: &mut PairMemory) -> Option<Contact> {
    let [x, y, z, is_known, ..] = memory.words;
    let centre_M = ball.centre_M;
    let outside_M = Vector3::new(x, y, z);
    let begins = is_known == 0.0;
    let contact = if begins {
        mesh.way_out(&centre_M).map(|way| pressed_by(mesh, way.face, true, ball))
    } else {
        let through = mesh.first_hit(&outside_M, &centre_M);
        through.map(|hit| pressed_by(mesh, hit.face, hit.is_front, ball))
    };
    if contact.is_none() {
        let [x, y, z] = centre_M.into();
        memory.words = [x, y, z, 1.0, 0.0, 0.0, 0.0, 0.0];
    }
    contact
}

/// By the plane of a face, on this side of it.
fn pressed_by(mesh: &Mesh, number: u32, is_front: bool, ball: &Ball) -> Contact {
    let face = &mesh.faces()[number as usize];
    let normal_M = if is_front { face.normal_B } else { -face.normal_B };
    let height_m = face.normal_B.dot(&ball.centre_M) - face.offset_m;
    let on_mesh_M = ball.centre_M - face.normal_B * height_m;
    let gap_m = if is_front { height_m } else { -height_m } - ball.radius_m;
    Contact::new(About::Face(number), on_mesh_M, normal_M, gap_m)
}

fn of_nearest(mesh: &Mesh, ball: &Ball, nearest: &Nearest) -> Contact {
    let face = &mesh.faces()[nearest.face as usize];
    let about = match nearest.feature {
        Feature::Vertex => About::Vertex(face.vertices[nearest.corner]),
        Feature::Edge => edge(face, nearest.face, nearest.corner),
        _ => About::Face(nearest.face),
    };
    at(mesh, ball, about, nearest.face, nearest.point_B)
}

fn at(mesh: &Mesh, ball: &Ball, about: About, face: u32, on_mesh_M: Vector3<f64>) -> Contact {
    let to_centre_M = ball.centre_M - on_mesh_M;
    let distance_m = to_centre_M.norm();
    let normal_M =
        if distance_m > 0.0 { to_centre_M / distance_m } else { mesh.faces()[face as usize].normal_B };
    Contact::new(about, on_mesh_M, normal_M, distance_m - ball.radius_m)
}

/// An edge by the lower of its two faces.
fn edge(face: &Face, number: u32, edge: usize) -> About {
    let link = face.links[edge];
    if link.is_boundary() || number < link.face() {
        About::Edge(number, edge)
    } else {
        About::Edge(link.face(), link.edge())
    }
}

#[derive(Default)]
struct Found {
    contacts: [Contact; PATCH_POINTS],
    count: usize,
}

impl Found {
    /// Whether all were looked at.
    fn gather(&mut self, mesh: &Mesh, ball: &Ball, within_m: f64) -> bool {
        let mut left = MOST_FACES;
        self.count = 0;
        mesh.for_each_face_near(&ball.centre_M, within_m, |face| {
            on_face(mesh, ball, face, within_m).into_iter().for_each(|contact| self.add(contact));
            left -= 1;
            left > 0
        })
    }

    /// On both sides of a fold that is nearly flat, the deeper one counts for both.
    fn unite(&mut self) {
        self.contacts[..self.count].sort_unstable_by(|a, b| a.gap_m.total_cmp(&b.gap_m));
        let mut kept = 0;
        for at in 0..self.count {
            let one = self.contacts[at];
            let is_flat = |other: &Contact| (other.normal_M - one.normal_M).norm_squared() < FOLD * FOLD;
            if !self.contacts[..kept].iter().any(is_flat) {
                self.contacts[kept] = one;
                kept += 1;
            }
        }
        self.count = kept;
    }

    /// Each feature once, at most as many as there is room for: the nearest.
    fn add(&mut self, contact: Contact) {
        let found = &self.contacts[..self.count];
        let apart_m = SAME * (contact.gap_m.abs() + contact.on_mesh_M.amax());
        if found.iter().any(|one| {
            one.id == contact.id || (one.on_mesh_M - contact.on_mesh_M).norm_squared() <= apart_m * apart_m
        }) {
            return;
        }
        if let Some(place) = self.contacts.get_mut(self.count) {
            *place = contact;
            self.count += 1;
            return;
        }
        let farthest = self.contacts.iter_mut().max_by(|a, b| a.gap_m.total_cmp(&b.gap_m));
        if let Some(farthest) = farthest.filter(|farthest| contact.gap_m < farthest.gap_m) {
            *farthest = contact;
        }
    }
}

/// The point of a face that is nearest to the centre, if it is as near as this and locally nearest on the mesh.
fn on_face(mesh: &Mesh, ball: &Ball, number: u32, within_m: f64) -> Option<Contact> {
    let face = &mesh.faces()[number as usize];
    let height_m = face.normal_B.dot(&ball.centre_M) - face.offset_m;
    if height_m.abs() > within_m {
        return None;
    }
    let corners = face.vertices.map(|vertex| mesh.vertices()[vertex as usize]);
    let edges = [0, 1, 2].map(|i| corners[(i + 1) % 3] - corners[i]);
    let to_centre = corners.map(|corner| ball.centre_M - corner);
    let is_beyond = [0, 1, 2].map(|i| face.normal_B.dot(&edges[i].cross(&to_centre[i])) <= 0.0);
    if is_beyond == [false; 3] {
        let point_M = ball.centre_M - face.normal_B * height_m;
        return Some(at(mesh, ball, About::Face(number), number, point_M));
    }
    let is_near = |point_M: &Vector3<f64>| (ball.centre_M - point_M).norm_squared() <= within_m * within_m;
    for i in (0..3).filter(|&i| is_beyond[i]) {
        let share = edges[i].dot(&to_centre[i]) / edges[i].norm_squared();
        if share > 0.0 && share < 1.0 {
            let point_M = corners[i] + edges[i] * share;
            return (is_near(&point_M) && leads_away(mesh, face, i, &point_M, ball))
                .then(|| at(mesh, ball, edge(face, number, i), number, point_M));
        }
    }
    let nearer =
        |i: usize, j: usize| if to_centre[i].norm_squared() <= to_centre[j].norm_squared() { i } else { j };
    let i = nearer(nearer(0, 1), 2);
    let about = About::Vertex(face.vertices[i]);
    (is_near(&corners[i]) && is_nearest_vertex(mesh, number, i, ball))
        .then(|| at(mesh, ball, about, number, corners[i]))
}

/// Whether the face across an edge leads away from the centre, too.
fn leads_away(mesh: &Mesh, face: &Face, edge: usize, point_M: &Vector3<f64>, ball: &Ball) -> bool {
    let link = face.links[edge];
    if link.is_boundary() {
        return true;
    }
    let Some(other) = mesh.faces().get(link.face() as usize) else { return true };
    let corners = other.vertices.map(|vertex| mesh.vertices()[vertex as usize]);
    let along = corners[(link.edge() + 1) % 3] - corners[link.edge()];
    let inward = other.normal_B.cross(&along);
    let to_centre = ball.centre_M - point_M;
    inward.dot(&to_centre) <= ROUNDING * inward.norm() * (to_centre.norm() + point_M.amax())
}

/// Whether all edges lead away from a vertex and the centre.
fn is_nearest_vertex(mesh: &Mesh, number: u32, corner: usize, ball: &Ball) -> bool {
    let vertex_M = mesh.vertices()[mesh.faces()[number as usize].vertices[corner] as usize];
    let to_centre = ball.centre_M - vertex_M;
    let slack = ROUNDING * (to_centre.norm() + vertex_M.amax());
    let mut leads_away = true;
    mesh.for_each_face_around(number, corner, |face, at| {
        for next in [(at + 1) % 3, (at + 2) % 3] {
            let edge = mesh.vertices()[face.vertices[next] as usize] - vertex_M;
            leads_away &= edge.dot(&to_centre) <= slack * edge.norm();
        }
    });
    leads_away
}

/// Faces that are looked at around a ball.
const MOST_FACES: usize = 512;
/// Points nearer than this share of where they are are the same: a foot on an edge of two faces in one plane.
const SAME: f64 = 1e-9;
/// Roundings of products of coordinates.
const ROUNDING: f64 = 1e-13;
/// A fold that turns the normal by less is flat \[rad\]: what it would do sideways is a hundredth of the load at most.
const FOLD: f64 = 0.01;
