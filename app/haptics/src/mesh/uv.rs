//! Texture coordinates of a mesh: where a picture lies on it.
//!
//! Model: each face has the coordinates of its three corners, so that a picture may have a seam where faces meet. Faces
//! are reordered, turned over and divided while a mesh is built; a face's coordinates are those that the face of the
//! input has at its corners.
//!
//! Memory: 24 bytes a face, in single precision: a thousandth of a texel on pictures of ten thousand. Meshes without
//! coordinates keep none.
//! Cost: a chart takes two cross products.

use super::{CloseHoles, Mesh, MeshError, MeshReport, TriangleSoup};
use crate::chart::{Chart, Coordinate};
use nalgebra::Vector3;

/// Texture coordinates `[u, v]` of the corners of a face, in pictures; (0, 0) is a picture's lower left corner.
pub type CornerUv = [[f64; 2]; 3];

/// As it is kept.
pub(super) type FaceUv = [[f32; 2]; 3];

/// Where single precision still tells hundredths of a picture.
pub(super) const LARGEST_UV: f64 = 1e4;

impl Mesh {
    /// As [`Self::build`], of a soup with texture coordinates for each of its faces.
    ///
    /// # Errors
    /// As [`Self::build`]; coordinates that are not finite or too large, or not as many as faces.
    pub fn build_with_uv(soup: TriangleSoup, uv: &[CornerUv]) -> Result<(Self, MeshReport), MeshError> {
        Self::build_with_uv_and_tell(soup, uv, CloseHoles::default(), |_| {})
    }

    /// As [`Self::build_with_uv`], and says which holes are to be closed; `tell` hears of each face of which face of the input
    /// it is a part.
    pub(super) fn build_with_uv_and_tell(
        soup: TriangleSoup,
        uv: &[CornerUv],
        holes: CloseHoles,
        mut tell: impl FnMut(usize),
    ) -> Result<(Self, MeshReport), MeshError> {
        validate(&soup, uv)?;
        let given = soup.clone();
        let mut origins = Vec::with_capacity(soup.faces.len());
        let told = |origin, _| {
            origins.push(origin);
            tell(origin);
        };
        let (mut mesh, report) = Self::build_and_tell(soup, holes, told)?;
        let of_face = |(face, &origin): (usize, &usize)| {
            let corners = given.faces[origin].map(|v| given.vertices[v as usize]);
            let own = mesh.faces[face].vertices.map(|v| mesh.vertices[v as usize]);
            own.map(|corner| at(&corners, &uv[origin], &corner).map(|x| x as f32))
        };
        let uv = origins.iter().enumerate().map(of_face).collect();
        mesh.uv = Some(uv);
        Ok((mesh, report))
    }

    /// Texture coordinates of the corners of each face, if it has any.
    pub fn uv(&self) -> Option<&[[[f32; 2]; 3]]> {
        self.uv.as_deref()
    }

    /// Texture coordinates at a point of a face, in pictures; `None` if it has none.
    pub fn chart(&self, face: u32, point_B: &Vector3<f64>) -> Option<Chart> {
        let uv = self.uv.as_ref()?.get(face as usize)?.map(|corner| corner.map(f64::from));
        let corners = self.faces[face as usize].vertices.map(|v| self.vertices[v as usize]);
        let [towards_b, towards_c] = shares(&corners);
        let away_B = point_B - corners[0];
        let [u, v] = [0, 1].map(|i| {
            let gradient_B = towards_b * (uv[1][i] - uv[0][i]) + towards_c * (uv[2][i] - uv[0][i]);
            let at_m = uv[0][i] + gradient_B.dot(&away_B) - 0.5;
            Coordinate { at_m, length_m: 1.0, closes: false, gradient_B }
        });
        Some(Chart { u, v, weight: 1.0, weight_gradient_B: Vector3::zeros() })
    }
}

fn validate(soup: &TriangleSoup, uv: &[CornerUv]) -> Result<(), MeshError> {
    if uv.len() != soup.faces.len() {
        return Err(MeshError::UvNumber { found: uv.len(), faces: soup.faces.len() });
    }
    let is_usable = |uv: &CornerUv| uv.iter().flatten().all(|x| x.abs() <= LARGEST_UV);
    match uv.iter().position(|uv| !is_usable(uv)) {
        Some(face) => Err(MeshError::Uv { face, found: uv[face] }),
        None => Ok(()),
    }
}

/// Gradients of the shares of the second and the third corner \[1/m\].
fn shares([a, b, c]: &[Vector3<f64>; 3]) -> [Vector3<f64>; 2] {
    let (ab, ac) = (b - a, c - a);
    let area_B = ab.cross(&ac);
    let squared = area_B.norm_squared();
    [ac.cross(&area_B) / squared, area_B.cross(&ab) / squared]
}

/// The coordinates of the input's face at a corner of what became of it: mostly one of its own corners.
fn at(corners: &[Vector3<f64>; 3], uv: &CornerUv, corner: &Vector3<f64>) -> [f64; 2] {
    if let Some(same) = corners.iter().position(|own| own == corner) {
        return uv[same];
    }
    let away = corner - corners[0];
    let [b, c] = shares(corners).map(|share| share.dot(&away));
    [0, 1].map(|i| uv[0][i] + b * (uv[1][i] - uv[0][i]) + c * (uv[2][i] - uv[0][i]))
}
