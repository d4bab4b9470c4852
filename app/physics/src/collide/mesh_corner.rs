//! A vertex of a mesh, known as a corner of one of its faces: from there its neighbours are found.

use haptics::mesh::{Face, Mesh, Sides};
use nalgebra::Vector3;
use std::f64::consts::FRAC_1_SQRT_2;

/// Three times the face's number plus that of the corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Corner(u32);

impl Corner {
    pub(super) fn new(corner: u32) -> Self {
        Self(corner)
    }

    /// One that was remembered as [`Self::number`]: 0 is none, nor is one that this mesh does not have.
    pub(super) fn remembered(number: u32, mesh: &Mesh) -> Option<Self> {
        number.checked_sub(1).filter(|&corner| (corner as usize) < 3 * mesh.faces().len()).map(Self)
    }

    pub(super) fn number(self) -> u32 {
        self.0 + 1
    }

    pub(super) fn vertex(self, mesh: &Mesh) -> u32 {
        mesh.faces()[(self.0 / 3) as usize].vertices[(self.0 % 3) as usize]
    }

    pub(super) fn point_M(self, mesh: &Mesh) -> &Vector3<f64> {
        &mesh.vertices()[self.vertex(mesh) as usize]
    }

    /// Whether all faces around it lie in one plane.
    pub(super) fn is_in_a_plane(self, mesh: &Mesh) -> bool {
        let first = &mesh.faces()[(self.0 / 3) as usize].normal_B;
        let mut fan = Fan::new(mesh, self.0 / 3, (self.0 % 3) as usize);
        let mut is_closed = false;
        while let Some((face, corner)) = fan.next() {
            let face = &mesh.faces()[face as usize];
            if (face.normal_B - first).norm_squared() > FLAT * FLAT {
                return false;
            }
            is_closed = face.links[corner].face() == fan.first && !face.links[corner].is_boundary();
        }
        is_closed
    }

    /// Whether an edge that sticks out leaves it: what is flat or hollow around touches no other mesh before the edges and
    /// corners of that do.
    pub(super) fn sticks_out(self, mesh: &Mesh) -> bool {
        let mut fan = Fan::new(mesh, self.0 / 3, (self.0 % 3) as usize);
        let mut is_closed = false;
        while let Some((number, corner)) = fan.next() {
            let face = &mesh.faces()[number as usize];
            let link = face.links[corner];
            if link.is_boundary() || link.is_turned() {
                return true;
            }
            if bends(mesh, face, corner) {
                return true;
            }
            is_closed = link.face() == fan.first;
        }
        !is_closed
    }

    /// Answer of [`Self::sticks_out`] for one edge: if it does, one of the faces around it says so.
    pub(super) fn sticks_out_here(self, mesh: &Mesh) -> bool {
        let (face, corner) = (&mesh.faces()[(self.0 / 3) as usize], (self.0 % 3) as usize);
        let link = face.links[corner];
        link.is_boundary() || link.is_turned() || bends(mesh, face, corner)
    }

    /// Denial of [`Self::is_in_a_plane`] for one edge: if it is not, one of the faces around it says so.
    pub(super) fn is_bent_here(self, mesh: &Mesh) -> bool {
        let (face, corner) = (&mesh.faces()[(self.0 / 3) as usize], (self.0 % 3) as usize);
        let link = face.links[corner];
        link.is_boundary() || {
            let beyond = &mesh.faces()[link.face() as usize];
            (face.normal_B - beyond.normal_B).norm_squared() > FLAT * FLAT
        }
    }

    /// Visits the faces around it, of many the first.
    pub(super) fn for_each_face(self, mesh: &Mesh, mut visit: impl FnMut(&Face)) {
        let mut fan = Fan::new(mesh, self.0 / 3, (self.0 % 3) as usize);
        while let Some((face, _)) = fan.next() {
            visit(&mesh.faces()[face as usize]);
        }
    }

    /// Whether any face around it looks that way.
    pub(super) fn looks(self, mesh: &Mesh, way_M: &Vector3<f64>) -> bool {
        let mut fan = Fan::new(mesh, self.0 / 3, (self.0 % 3) as usize);
        std::iter::from_fn(|| fan.next()).any(|(face, _)| {
            let toward = mesh.faces()[face as usize].normal_B.dot(way_M);
            toward > LOOKS || mesh.sides() == Sides::Sheet && toward < -LOOKS
        })
    }

    /// Whether several faces around it look about that way, and not all alike: on what is round others bear when it rolls.
    pub(super) fn is_round(self, mesh: &Mesh, way_M: &Vector3<f64>) -> bool {
        let is_sheet = mesh.sides() == Sides::Sheet;
        let mut fan = Fan::new(mesh, self.0 / 3, (self.0 % 3) as usize);
        let mut first = None;
        while let Some((face, _)) = fan.next() {
            let normal_M = mesh.faces()[face as usize].normal_B;
            let toward = normal_M.dot(way_M);
            if (if is_sheet { toward.abs() } else { toward }) < LOOKS_ALONG {
                continue;
            }
            if (normal_M - *first.get_or_insert(normal_M)).norm_squared() > FLAT * FLAT {
                return true;
            }
        }
        false
    }

    /// Visits the ends of all edges that leave it and are sharp, or long and bent at all, each with its face and number there:
    /// between round bars that cross there is no vertex. Edges that go straight on from each other are one, however
    /// finely it is cut.
    pub(super) fn for_each_edge(self, mesh: &Mesh, mut visit: impl FnMut(&Vector3<f64>, u32, usize)) {
        let from_M = self.point_M(mesh);
        let [low_M, high_M] = mesh.bounds_B();
        let long_m = LONG * (high_M - low_M).max();
        self.visit_bent_edges(mesh, |mut to, face, edge, is_sharp| {
            if !is_sharp && (to.point_M(mesh) - from_M).norm() * (MOST_PIECES as f64) < long_m {
                return;
            }
            let along_M = (to.point_M(mesh) - from_M).normalize();
            for _ in 0..MOST_PIECES {
                let mut next = None;
                to.visit_bent_edges(mesh, |end, _, _, _| {
                    let way_M = end.point_M(mesh) - to.point_M(mesh);
                    if way_M.dot(&along_M) > STRAIGHT * way_M.norm() {
                        next = Some(end);
                    }
                });
                let Some(end) = next else { break };
                to = end;
            }
            if is_sharp || (to.point_M(mesh) - from_M).norm() > long_m {
                visit(to.point_M(mesh), face, edge);
            }
        });
    }

    /// Says of each that sticks out whether it is sharp.
    fn visit_bent_edges(self, mesh: &Mesh, mut visit: impl FnMut(Self, u32, usize, bool)) {
        let mut fan = Fan::new(mesh, self.0 / 3, (self.0 % 3) as usize);
        while let Some((number, corner)) = fan.next() {
            let face = &mesh.faces()[number as usize];
            let link = face.links[corner];
            let end = Self(3 * number + (corner as u32 + 1) % 3);
            if link.is_boundary() {
                visit(end, number, corner, true);
                continue;
            }
            let beyond = &mesh.faces()[link.face() as usize].normal_B;
            let is_sharp = beyond.dot(&face.normal_B) < SHARP;
            if is_sharp || bends(mesh, face, corner) {
                visit(end, number, corner, is_sharp);
            }
        }
    }

    /// From neighbour to neighbour as long as the score grows; where that ends, and the score there.
    pub(super) fn climb(self, mesh: &Mesh, score: impl Fn(Self) -> f64) -> (Self, f64) {
        let (mut at, mut most) = (self, score(self));
        for _ in 0..MOST_STEPS {
            let from = at;
            let (face, corner) = (from.0 / 3, (from.0 % 3) as usize);
            // Which number a face has, the link of the one before it tells; so neighbours are taken face by face.
            let mut fan = Fan::new(mesh, face, corner);
            while let Some((face, corner)) = fan.next() {
                for next in [(corner + 1) % 3, (corner + 2) % 3] {
                    let neighbour = Self(3 * face + next as u32);
                    let score = score(neighbour);
                    if score > most {
                        (at, most) = (neighbour, score);
                    }
                }
            }
            if at == from {
                break;
            }
        }
        (at, most)
    }
}

/// The faces around a corner, one way round, up to an end of the mesh.
struct Fan<'m> {
    mesh: &'m Mesh,
    first: u32,
    next: Option<(u32, usize)>,
    left: usize,
}

impl<'m> Fan<'m> {
    fn new(mesh: &'m Mesh, face: u32, corner: usize) -> Self {
        Self { mesh, first: face, next: Some((face, corner)), left: MOST_AROUND }
    }

    fn next(&mut self) -> Option<(u32, usize)> {
        let (face, corner) = self.next.take()?;
        let link = self.mesh.faces()[face as usize].links[corner];
        self.left -= 1;
        if !link.is_boundary() && !link.is_turned() && link.face() != self.first && self.left > 0 {
            self.next = Some((link.face(), (link.edge() + 1) % 3));
        }
        Some((face, corner))
    }
}

/// True of an edge that sticks out; it begins at a face's corner.
fn bends(mesh: &Mesh, face: &Face, corner: usize) -> bool {
    let ends = [corner, (corner + 1) % 3].map(|end| mesh.vertices()[face.vertices[end] as usize]);
    let edge = ends[1] - ends[0];
    let beyond = &mesh.faces()[face.links[corner].face() as usize].normal_B;
    let bend = face.normal_B.cross(beyond).dot(&edge);
    let bend = if mesh.sides() == Sides::Sheet { bend.abs() } else { bend };
    bend > FLAT * edge.norm()
}

/// Normals that differ by less are the same: rounding of what lies in a plane.
const FLAT: f64 = 1e-6;
/// Cosine to the normal of a face that looks there.
const LOOKS: f64 = 0.2;
/// Cosine to the normal of a face that looks about there: half way between two sides of a box.
const LOOKS_ALONG: f64 = FRAC_1_SQRT_2;
/// Cosine between the faces of a sharp edge.
const SHARP: f64 = 0.9;
/// Cosine of a turn from one edge to the next that is none.
const STRAIGHT: f64 = 1.0 - 1e-6;
/// Of a mesh's longest side: a longer edge is long.
const LONG: f64 = 0.25;
/// Pieces that make one edge.
const MOST_PIECES: usize = 32;
/// Steps of a climb; the next tick goes on.
const MOST_STEPS: usize = 64;
/// Faces that are looked at around a vertex.
const MOST_AROUND: usize = 64;
