//! Normals at the vertices of a mesh, for surfaces that are to feel smooth across their edges.
//!
//! Model: the normal of a corner is the mean of the normals of the faces in its fan, each weighted with its angle at the
//! vertex, so that it does not depend on how a flat piece is cut into triangles. The fan are the faces around the vertex
//! that are joined to the corner's face by edges blunter than the crease angle: sharp edges stay sharp.
//!
//! Frames and signs: object frame B; a corner's normal leaves the front of its own face, also where neighbours are
//! turned (a surface without an outside).
//! Invariants: the two ends of a blunt edge have the same normals seen from either of its faces. Normals have unit
//! length, or none: where those of a fan cancel, zero.
//! Cost: linear, a few cache lines for each face. Memory: 24 bytes for each vertex; on meshes with creases or turned
//! faces also 12 for each face, and 24 for each further fan.

use nalgebra::Vector3;

use super::fan::{Sector, for_each_around};
use super::place::{Facet, Side, next, previous};
use super::{Face, MAX_VALENCE, Mesh};
use crate::error::ParameterError;

/// The normals of a mesh's corners.
#[derive(Debug)]
pub struct VertexNormals {
    /// Whose they are: indices of another mesh would lead nowhere.
    mesh: u64,
    cos_crease: f64,
    /// First one for each vertex, then those of the further fans at creases.
    normals: Box<[Vector3<f64>]>,
    /// Which one each corner has; absent where it is always that of its vertex.
    corners: Option<Box<[[CornerNormal; 3]]>>,
}

/// Index of a normal, and in the highest bit whether the face sees it from behind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct CornerNormal(u32);

/// Edges sharper than this stay sharp whatever the crease angle (rad): where a sheet is folded back upon itself, the
/// mean of the two normals is no direction.
pub const SHARPEST_CREASE_RAD: f64 = 170.0 / 180.0 * std::f64::consts::PI;

impl VertexNormals {
    /// Those of a mesh. Edges whose faces' normals are more than `crease_angle_rad` apart stay sharp.
    ///
    /// Errors: an angle that is not between 0 and pi.
    pub fn of(mesh: &Mesh, crease_angle_rad: f64) -> Result<Self, ParameterError> {
        if !(0.0..=std::f64::consts::PI).contains(&crease_angle_rad) {
            return Err(ParameterError::OutOfRange {
                parameter: "crease_angle_rad",
                value: crease_angle_rad,
                allowed: "a number from 0 to pi",
            });
        }
        let mut normals = Self {
            mesh: mesh.identity,
            cos_crease: crease_angle_rad.min(SHARPEST_CREASE_RAD).cos(),
            normals: sums_around_vertices(mesh),
            corners: None,
        };
        normals.part_at_creases(mesh);
        normals.normals.iter_mut().for_each(|sum| *sum = sum.try_normalize(CANCELLED).unwrap_or_default());
        Ok(normals)
    }

    /// How much memory they take.
    pub fn bytes(&self) -> usize {
        let corners = self.corners.as_ref().map_or(0, |corners| size_of_val(&**corners));
        size_of_val(&*self.normals) + corners
    }

    /// Whether they are of this mesh.
    pub fn fit(&self, mesh: &Mesh) -> bool {
        self.mesh == mesh.identity
    }

    /// At the corners of a face, which must be one of the mesh's.
    #[inline(always)]
    pub(crate) fn at_corners(&self, index: usize, face: &Face) -> [Vector3<f64>; 3] {
        // Written out: arrays that are mapped go through memory.
        match &self.corners {
            None => {
                let [a, b, c] = face.vertices;
                [self.normals[a as usize], self.normals[b as usize], self.normals[c as usize]]
            }
            Some(corners) => {
                let [a, b, c] = corners[index];
                [self.seen(a), self.seen(b), self.seen(c)]
            }
        }
    }

    /// Whether an edge between faces with these normals is blunt.
    #[inline(always)]
    pub(crate) fn joins(&self, normal_B: &Vector3<f64>, over_B: &Vector3<f64>) -> bool {
        normal_B.dot(over_B) >= self.cos_crease
    }

    /// The one normal of the whole surface at a vertex; `None` where a crease or a rim ends there.
    pub(crate) fn of_whole_vertex(&self, mesh: &Mesh, index: u32, corner: usize) -> Option<Vector3<f64>> {
        let face = &mesh.faces[index as usize];
        let vertex = face.vertices[corner];
        let mut has_one_fan = true;
        let is_closed = for_each_around(mesh, Side { face: index, is_back: false }, corner, |sector| {
            let corners = self.corners.as_ref();
            let at = corners.map(|corners| corners[sector.facet.side.face as usize][sector.corner]);
            has_one_fan &= at.is_none_or(|at| at.index() == vertex as usize);
        });
        (is_closed && has_one_fan).then(|| self.at_corners(index as usize, face)[corner])
    }

    #[inline(always)]
    fn seen(&self, corner: CornerNormal) -> Vector3<f64> {
        let normal_B = self.normals[corner.index()];
        if corner.is_behind() { -normal_B } else { normal_B }
    }

    /// Gives the corners of vertices where a crease or a turned edge ends normals of their own.
    fn part_at_creases(&mut self, mesh: &Mesh) {
        let parted = self.vertices_at_creases(mesh);
        if parted.is_empty() {
            return;
        }
        let mut corners: Vec<_> = mesh.faces.iter().map(|face| face.vertices.map(CornerNormal)).collect();
        let mut normals = std::mem::take(&mut self.normals).into_vec();
        // The first fan of a vertex keeps the vertex's place.
        let mut is_taken = vec![false; mesh.vertices.len()];
        let mut is_done = vec![[false; 3]; mesh.faces.len()];
        for (index, face) in mesh.faces.iter().enumerate() {
            for corner in 0..3 {
                let vertex = face.vertices[corner] as usize;
                if !parted[vertex] || is_done[index][corner] {
                    continue;
                }
                let place = if is_taken[vertex] { normals.len() } else { vertex };
                if is_taken[vertex] {
                    normals.push(Vector3::zeros());
                }
                is_taken[vertex] = true;
                let mut sum = Vector3::zeros();
                self.for_each_in_fan(mesh, index as u32, corner, |sector| {
                    let Side { face, is_back } = sector.facet.side;
                    corners[face as usize][sector.corner] = CornerNormal::new(place, is_back);
                    is_done[face as usize][sector.corner] = true;
                    sum += sector.facet.normal_B * angle_at(mesh, &sector);
                });
                normals[place] = sum;
            }
        }
        self.normals = normals.into_boxed_slice();
        self.corners = Some(corners.into_boxed_slice());
    }

    /// For each vertex, whether it is one; empty if there are none.
    fn vertices_at_creases(&self, mesh: &Mesh) -> Vec<bool> {
        let mut parted = Vec::new();
        for (index, face) in mesh.faces.iter().enumerate() {
            for (edge, link) in face.links.iter().enumerate() {
                // Each edge once.
                if link.is_boundary() || (link.face() as usize) < index {
                    continue;
                }
                let over = &mesh.faces[link.face() as usize];
                if link.is_turned() || !self.joins(&face.normal_B, &over.normal_B) {
                    if parted.is_empty() {
                        parted = vec![false; mesh.vertices.len()];
                    }
                    parted[face.vertices[edge] as usize] = true;
                    parted[face.vertices[next(edge)] as usize] = true;
                }
            }
        }
        parted
    }

    /// Calls `visit` for every face that blunt edges join to a corner around its vertex, each once.
    fn for_each_in_fan<'m>(
        &self,
        mesh: &'m Mesh,
        index: u32,
        corner: usize,
        mut visit: impl FnMut(Sector<'m>),
    ) {
        let first = Sector { facet: Facet::of(mesh, Side { face: index, is_back: false }), corner };
        visit(first);
        for edge in [previous(corner), corner] {
            let (mut sector, mut edge) = (first, edge);
            for _ in 0..MAX_VALENCE {
                let Some((over, arrived_by)) = sector.over(mesh, edge) else { break };
                if !self.joins(&sector.facet.normal_B, &over.facet.normal_B) {
                    break;
                }
                if over.facet.side.face == index {
                    return;
                }
                visit(over);
                edge = if arrived_by == over.corner { previous(over.corner) } else { over.corner };
                sector = over;
            }
        }
    }
}

impl CornerNormal {
    const BEHIND: u32 = 1 << 31;

    fn new(index: usize, is_behind: bool) -> Self {
        Self(index as u32 | if is_behind { Self::BEHIND } else { 0 })
    }

    fn index(self) -> usize {
        (self.0 & !Self::BEHIND) as usize
    }

    fn is_behind(self) -> bool {
        self.0 & Self::BEHIND != 0
    }
}

// A mesh has at most three corners with normals of their own for each face.
const _: () = assert!(3 * super::Link::MAX_FACES < CornerNormal::BEHIND as usize);

/// Of all faces around each vertex, weighted with their angles there: right where there are no creases.
fn sums_around_vertices(mesh: &Mesh) -> Box<[Vector3<f64>]> {
    let mut sums = vec![Vector3::zeros(); mesh.vertices.len()];
    for face in &mesh.faces {
        for (vertex, angle) in face.vertices.into_iter().zip(angles(mesh, face)) {
            sums[vertex as usize] += face.normal_B * angle;
        }
    }
    sums.into_boxed_slice()
}

/// The angles of a triangle at its corners (rad).
fn angles(mesh: &Mesh, face: &Face) -> [f64; 3] {
    let [a_B, b_B, c_B] = face.vertices.map(|vertex| mesh.vertices[vertex as usize]);
    let (ab_B, bc_B, ca_B) = (b_B - a_B, c_B - b_B, a_B - c_B);
    let doubled_area_m2 = ab_B.cross(&bc_B).norm();
    let at_a = doubled_area_m2.atan2(-ab_B.dot(&ca_B));
    let at_b = doubled_area_m2.atan2(-bc_B.dot(&ab_B));
    [at_a, at_b, (std::f64::consts::PI - at_a - at_b).max(0.0)]
}

/// The angle of a face at one of them (rad).
fn angle_at(mesh: &Mesh, sector: &Sector<'_>) -> f64 {
    let at_B = |corner: usize| mesh.vertices[sector.facet.face.vertices[corner] as usize];
    let tip_B = at_B(sector.corner);
    let (one_B, other_B) = (at_B(next(sector.corner)) - tip_B, at_B(previous(sector.corner)) - tip_B);
    one_B.cross(&other_B).norm().atan2(one_B.dot(&other_B))
}

/// Sums of normals shorter than this, in radians of a face's angle, are rounding.
const CANCELLED: f64 = 1e-9;
