//! A point finger with Coulomb friction on a mesh, slow and obvious: all faces in reach are looked at, nothing is known of
//! neighbours, and every piece of the god-object's way is asked for anew.
//!
//! The god-object g holds the spring to the HIP h; what it touches pushes with forces `f_i`, each in the friction cone of
//! its own face, and all together they are `k (g - h)`. If it slides, all faces see the same motion, so that each force is
//! on the rim of its cone, against the motion: of one face, straight along its plane; of two, along the groove, with the
//! loads that hold it there; of three, nowhere. Which of these a state allows is found by trying them all.
//!
//! With several faces the answer is not unique: friction alone may squeeze the finger between them and so raise its
//! own loads. [`Rule`] says what is made of it.

use haptics::mesh::Mesh;
use nalgebra::Vector3;

use super::{closest, corners, winding_number};

/// A choice among the forces that Coulomb's law allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rule {
    /// As much friction as can be: it holds wherever forces in the cones can be found that bear the spring, by squeezing
    /// too, and slides by the least that brings it to where it holds.
    Most,
    /// As little as can be: it slides wherever it can. In a groove each wall has the load that it has without friction.
    Least,
    /// One contact at the bottom of a groove, whose normal is the direction of what both walls bear (Melder ch. 4.2.5).
    OneCone,
}

/// A face as three corners and a normal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Triangle {
    corners: [Vector3<f64>; 3],
    pub(crate) normal: Vector3<f64>,
}

/// A way on which a god-object can slide, and how far.
#[derive(Debug, Clone, Copy)]
struct Slide {
    direction: Vector3<f64>,
    /// To where nothing would draw it on without friction (m).
    reach: f64,
    /// To where friction stops it (m).
    length: f64,
    faces: usize,
}

/// End of a tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ended {
    pub(crate) god_object: Vector3<f64>,
    /// Pieces of way that it went.
    pub(crate) pieces: usize,
    /// Its last piece was along a groove.
    pub(crate) along_groove: bool,
}

/// Oracle for a mesh and a friction coefficient.
pub(crate) struct Coulomb<'m> {
    mesh: &'m Mesh,
    triangles: Vec<Triangle>,
    mu: f64,
    rule: Rule,
    /// Faces that may be touched within this reach of this place.
    near: (Vector3<f64>, f64, Vec<Triangle>),
}

/// Touching, in terms of metres: a thousand roundings of positions.
const TOUCHING: f64 = 1e-12;
/// Distance from the rim of a face that counts as on it (m): the direction of a short way is rounded.
const RIM: f64 = 1e-13;
/// Of directions, which side is left to rounding.
const ALONG: f64 = 1e-11;
/// Distance ahead of the god-object that is looked at (m): small against faces, large against rounding.
const AHEAD: f64 = 1e-8;
/// A slide by less is rest (m): ten thousand roundings.
const REST: f64 = 1e-14;
/// Faces of a patch are within this of where it was cut (m).
const REACH: f64 = 5e-3;

impl<'m> Coulomb<'m> {
    pub(crate) fn new(mesh: &'m Mesh, mu: f64, rule: Rule) -> Self {
        let triangles = (0..mesh.faces().len()).map(|face| Triangle::of(corners(mesh, face))).collect();
        Self { mesh, triangles, mu, rule, near: (Vector3::zeros(), 0.0, Vec::new()) }
    }

    /// The end of a god-object's way that `hip` draws; `None` if it is free and gone.
    pub(crate) fn step(&mut self, from: Vector3<f64>, hip: &Vector3<f64>) -> Option<Ended> {
        let mut ended = Ended { god_object: from, pieces: 0, along_groove: false };
        for pieces in 0..MOST_PIECES {
            ended.pieces = pieces;
            let at = ended.god_object;
            let touched = self.touched(&at);
            if self.is_free(&at, hip, &touched) {
                ended.god_object = self.hit(&(at + (hip - at).normalize() * AHEAD), hip)?;
                continue;
            }
            if self.rule == Rule::Most && self.can_hold(&at, hip, &touched) {
                return Some(ended);
            }
            let slides = self.slides(&at, hip, &touched);
            let Some(slide) = slides.into_iter().max_by(|a, b| a.reach.total_cmp(&b.reach)) else {
                return Some(ended);
            };
            let room = touched.iter().map(|face| face.room(&at, &slide.direction)).fold(0.0, f64::max);
            let length = slide.length.min(room);
            ended.along_groove = slide.faces > 1;
            let along = |length: f64| at + slide.direction * length;
            let holds = |length: f64| {
                let there = along(length);
                self.can_hold(&there, hip, &touching(&touched, &there))
            };
            if self.rule == Rule::Most && slide.faces > 1 && holds(length) {
                // It can be held earlier than where it stops by itself.
                let (mut too_short, mut enough) = (0.0, length);
                for _ in 0..60 {
                    let middle = 0.5 * (too_short + enough);
                    if holds(middle) { enough = middle } else { too_short = middle }
                }
                ended.god_object = along(enough);
                return Some(ended);
            }
            ended.god_object = self.onto_rim(along(length));
            if length >= slide.length {
                return Some(ended);
            }
        }
        panic!("it does not come to rest: {from} {hip}");
    }

    /// First place at which a segment enters the mesh.
    pub(crate) fn hit(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> Option<Vector3<f64>> {
        super::first_fraction(self.mesh, from, to, -1e-12).map(|fraction| from + (to - from) * fraction)
    }

    /// Distance of the nearest face (m).
    pub(crate) fn distance(&self, p: &Vector3<f64>) -> f64 {
        self.triangles.iter().map(|face| face.distance(p)).fold(f64::INFINITY, f64::min)
    }

    /// Part of the spring (m) that the friction cones of all faces touched here cannot bear.
    pub(crate) fn unexplained(&mut self, at: &Vector3<f64>, hip: &Vector3<f64>) -> f64 {
        let normals: Vec<_> = self.touched(at).iter().map(|face| face.normal).collect();
        distance_from_sum(&normals, self.mu, &(at - hip))
    }

    pub(crate) fn touched(&mut self, at: &Vector3<f64>) -> Vec<Triangle> {
        if (at - self.near.0).norm() > self.near.1 - 10.0 * TOUCHING {
            let is_near = |face: &&Triangle| face.distance(at) < REACH;
            self.near = (*at, REACH, self.triangles.iter().filter(is_near).copied().collect());
        }
        touching(&self.near.2, at)
    }

    /// A god-object within rounding of an edge or a corner is there.
    fn onto_rim(&self, at: Vector3<f64>) -> Vector3<f64> {
        let is_near = |p: &Vector3<f64>| (p - at).norm() < RIM;
        let faces = &self.near.2;
        let corners = faces.iter().flat_map(|face| face.corners).find(is_near);
        corners.or_else(|| faces.iter().flat_map(|face| face.edge_feet(&at)).find(is_near)).unwrap_or(at)
    }

    fn can_hold(&self, at: &Vector3<f64>, hip: &Vector3<f64>, touched: &[Triangle]) -> bool {
        let spring = at - hip;
        let normals: Vec<_> = touched.iter().map(|face| face.normal).collect();
        distance_from_sum(&normals, self.mu, &spring) <= 1e-12 * spring.norm() + REST
    }

    /// The way to the HIP leads out of the material.
    fn is_free(&self, at: &Vector3<f64>, hip: &Vector3<f64>, touched: &[Triangle]) -> bool {
        let way = hip - at;
        let length = way.norm();
        // Behind all that it touches, it is not.
        let is_in_front = touched.iter().any(|face| face.normal.dot(&way) > 0.0);
        is_in_front && length > AHEAD && winding_number(self.mesh, &(at + way * (AHEAD / length))) < 0.5
    }

    fn slides(&self, at: &Vector3<f64>, hip: &Vector3<f64>, touched: &[Triangle]) -> Vec<Slide> {
        let mut slides = Vec::new();
        let mut offer = |way: Vector3<f64>, bears: f64, faces: usize| {
            let reach = way.norm();
            let length = reach - self.mu * bears;
            if length > REST {
                slides.push(Slide { direction: way / reach, reach, length, faces });
            }
        };
        let pull = hip - at;
        for (i, a) in touched.iter().enumerate() {
            let load = -a.normal.dot(&pull);
            let way = pull + a.normal * load;
            if load >= 0.0 && way.norm() > REST && a.room(at, &way.normalize()) > 0.0 {
                offer(way, load, 1);
            }
            for b in &touched[i + 1..] {
                let across = a.normal.cross(&b.normal);
                let sine = across.norm();
                if sine < 1e-9 {
                    continue;
                }
                let edge = across / sine;
                let edge = if edge.dot(&pull) < 0.0 { -edge } else { edge };
                let leads_along = a.room(at, &edge) > 0.0 && b.room(at, &edge) > 0.0;
                if !leads_along || !is_hollow(a, b, at, &edge) {
                    continue;
                }
                let way = edge * edge.dot(&pull);
                let both = way - pull;
                // both = load a + load b.
                let cosine = a.normal.dot(&b.normal);
                let [on_a, on_b] = [a, b].map(|face| face.normal.dot(&both));
                let loads = [on_a - cosine * on_b, on_b - cosine * on_a].map(|load| load / (sine * sine));
                if loads[0] < 0.0 || loads[1] < 0.0 {
                    continue;
                }
                let bears = if self.rule == Rule::OneCone { both.norm() } else { loads[0] + loads[1] };
                offer(way, bears, 2);
            }
        }
        slides
    }
}

impl Triangle {
    fn of(corners: [Vector3<f64>; 3]) -> Self {
        let [a, b, c] = corners;
        Self { corners, normal: (b - a).cross(&(c - a)).normalize() }
    }

    fn distance(&self, p: &Vector3<f64>) -> f64 {
        (closest(&self.corners, p) - p).norm()
    }

    /// Length of the way from a place in it in a direction in its plane (m); 0 where that leads out at once, or leaves the
    /// plane.
    fn room(&self, at: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
        if self.normal.dot(direction).abs() > ALONG {
            return 0.0;
        }
        let mut room = f64::INFINITY;
        for i in 0..3 {
            let (start, end) = (self.corners[i], self.corners[(i + 1) % 3]);
            let inward = self.normal.cross(&(end - start)).normalize();
            let (left, gained) = (inward.dot(&(at - start)), inward.dot(direction));
            if gained < -ALONG {
                let left = if left < TOUCHING { 0.0 } else { left };
                room = room.min(left / -gained);
            }
        }
        room
    }

    /// On each edge, the point nearest to `p`.
    fn edge_feet(&self, p: &Vector3<f64>) -> [Vector3<f64>; 3] {
        [0, 1, 2].map(|i| {
            let (start, edge) = (self.corners[i], self.corners[(i + 1) % 3] - self.corners[i]);
            start + edge * (edge.dot(&(p - start)) / edge.norm_squared()).clamp(0.0, 1.0)
        })
    }

    /// Away from an edge through `at`, into the face.
    fn inward(&self, at: &Vector3<f64>, edge: &Vector3<f64>) -> Vector3<f64> {
        let middle = (self.corners[0] + self.corners[1] + self.corners[2]) / 3.0 - at;
        middle - edge * edge.dot(&middle)
    }
}

/// The faces on both sides of an edge are in front of each other.
fn is_hollow(a: &Triangle, b: &Triangle, at: &Vector3<f64>, edge: &Vector3<f64>) -> bool {
    a.normal.dot(&b.inward(at, edge)) > 0.0 && b.normal.dot(&a.inward(at, edge)) > 0.0
}

fn touching(faces: &[Triangle], at: &Vector3<f64>) -> Vec<Triangle> {
    faces.iter().filter(|face| face.distance(at) < TOUCHING).copied().collect()
}

/// Of a force, what a sum of forces in the friction cones of these normals cannot be: its distance from that sum of cones.
///
/// It is as long as the force goes along a direction `u` in which none of the cones leads: `n_i . u <= -sin(atan mu)`. Of
/// all such directions the best is the force's own, or on the rim of what one cone allows the nearest to that, or where
/// the rims of two meet. All of these are tried.
pub(crate) fn distance_from_sum(normals: &[Vector3<f64>], mu: f64, force: &Vector3<f64>) -> f64 {
    let sine = mu / (1.0 + mu * mu).sqrt();
    let cosine = 1.0 / (1.0 + mu * mu).sqrt();
    let mut distance = 0.0_f64;
    let mut offer = |u: Vector3<f64>| {
        if normals.iter().all(|normal| normal.dot(&u) <= -sine + 1e-14) {
            distance = distance.max(force.dot(&u));
        }
    };
    offer(force.normalize());
    for (i, a) in normals.iter().enumerate() {
        let across = force - a * a.dot(force);
        if across.norm() > 0.0 {
            // Twice: what is far shorter than the force is mostly rounding along the normal.
            let across = across.normalize();
            let across = (across - a * a.dot(&across)).normalize();
            offer(across * cosine - a * sine);
        }
        for b in &normals[i + 1..] {
            let (middle, along) = (a + b, a.cross(b));
            if along.norm() < 1e-9 {
                continue;
            }
            // Both dot products are the same only in the plane of the bisector and the edge.
            let in_plane = middle * (-2.0 * sine / middle.norm_squared());
            let rest = 1.0 - in_plane.norm_squared();
            if rest >= 0.0 {
                let along = along.normalize() * rest.sqrt();
                offer(in_plane + along);
                offer(in_plane - along);
            }
        }
    }
    distance
}

/// The same by projections: one force after the other set to its best.
pub(crate) fn distance_from_sum_by_projections(
    normals: &[Vector3<f64>],
    mu: f64,
    force: &Vector3<f64>,
) -> f64 {
    let mut forces = vec![Vector3::<f64>::zeros(); normals.len()];
    let mut left = *force;
    for _ in 0..100_000 {
        for (f, normal) in forces.iter_mut().zip(normals) {
            let wanted = left + *f;
            *f = into_cone(&wanted, normal, mu);
            left = wanted - *f;
        }
    }
    left.norm()
}

/// The nearest force of a friction cone.
fn into_cone(force: &Vector3<f64>, normal: &Vector3<f64>, mu: f64) -> Vector3<f64> {
    let along = force.dot(normal);
    let across = force - normal * along;
    let length = across.norm();
    if length <= mu * along {
        return *force;
    }
    if mu * length <= -along || length == 0.0 {
        return Vector3::zeros();
    }
    // Onto the ray (1, mu) of the half plane.
    let share = (along + mu * length) / (1.0 + mu * mu);
    normal * share + across * (mu * share / length)
}

const MOST_PIECES: usize = 10_000;
