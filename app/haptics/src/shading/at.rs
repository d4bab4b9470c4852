//! Where a shaded normal is asked for: on a face, an edge or a vertex, and from which side.
//!
//! On an edge the normal `m` of a god-object lies between those of the two faces, `m = a n1 + b n2`: a concave edge
//! holds it, or a ball rolls around a convex one. There `a N1 + b N2` is felt, N being the shaded normals on either
//! side: at a blunt edge both are the same, so nothing changes while it stays there; at a crease the normal goes from
//! one to the other as `m` does. Both continue what was felt on the face before. On the rim of a sheet `m` turns with
//! its face. At a vertex the vertex' normal is felt, and where a crease or a rim ends at it, `m`.

use nalgebra::Vector3;

use super::form::{ShadingForm, Turn};
use crate::mesh::{Face, Mesh, VertexNormals};
use crate::surface::{Feature, SurfacePoint};

/// Normals all over the front of a mesh.
pub(super) trait Field {
    /// Those at its corners.
    fn vertex_normals(&self) -> &VertexNormals;

    /// At a point of a face, of any length; zero or not finite where there is none. `None` where it is the face's.
    fn normal(&self, mesh: &Mesh, index: usize, face: &Face, point_B: &Vector3<f64>) -> Option<Vector3<f64>>;
}

/// A vector at a surface point, turned; as it was where nothing is shaded.
#[inline(always)]
pub(super) fn turned(
    field: &impl Field,
    mesh: &Mesh,
    at: &SurfacePoint,
    v_B: &Vector3<f64>,
    form: ShadingForm,
) -> Vector3<f64> {
    if !field.vertex_normals().fit(mesh) {
        return *v_B;
    }
    let index = at.piece as usize;
    let Some(face) = mesh.faces().get(index) else { return *v_B };
    let turn = match at.feature {
        Feature::Edge => on_edge(field, mesh, index, face, at),
        Feature::Vertex => at_vertex(field, mesh, index, face, at),
        _ => {
            let to_B = field.normal(mesh, index, face, &at.point_B);
            // Here and not below, so that nothing on this way goes through memory.
            return on_face(face, at, to_B, v_B, form);
        }
    };
    turn.map_or(*v_B, |turn| form.turned(v_B, &turn))
}

#[inline(always)]
fn on_face(
    face: &Face,
    at: &SurfacePoint,
    to_B: Option<Vector3<f64>>,
    v_B: &Vector3<f64>,
    form: ShadingForm,
) -> Vector3<f64> {
    let to_B = match (to_B, form) {
        (Some(to_B), _) => to_B,
        (None, ShadingForm::Rotate) => return *v_B,
        // As printed it is bent, too, where nothing is to be turned.
        (None, ShadingForm::Bisect) => face.normal_B,
    };
    let is_back = face.normal_B.dot(&at.normal_B) < 0.0;
    form.turned(v_B, &Turn { from_B: at.normal_B, to_B: if is_back { -to_B } else { to_B } })
}

#[inline(never)]
fn on_edge(field: &impl Field, mesh: &Mesh, index: usize, face: &Face, at: &SurfacePoint) -> Option<Turn> {
    let (edge, on_B) = nearest_edge(mesh, face, &at.point_B);
    let link = face.links[edge];
    let here_B = field.normal(mesh, index, face, &on_B).unwrap_or(face.normal_B).try_normalize(SMALLEST)?;
    if link.is_boundary() {
        // Away from the finger's side of the face, whichever it is: the rotation is the same.
        return Some(Turn { from_B: face.normal_B, to_B: here_B });
    }
    let over_index = link.face() as usize;
    let over = &mesh.faces()[over_index];
    let over_B = field.normal(mesh, over_index, over, &on_B).unwrap_or(over.normal_B);
    let (mut over_B, mut over_normal_B) = (over_B.try_normalize(SMALLEST)?, over.normal_B);
    if link.is_turned() {
        (over_B, over_normal_B) = (-over_B, -over_normal_B);
    }
    let to_B = if field.vertex_normals().joins(&face.normal_B, &over_normal_B) {
        here_B
    } else {
        // Of m = a n1 + b n2 solved for a and b, which have the same sign as seen from one side.
        let cos = face.normal_B.dot(&over_normal_B);
        let (along_here, along_over) = (at.normal_B.dot(&face.normal_B), at.normal_B.dot(&over_normal_B));
        here_B * (along_here - cos * along_over) + over_B * (along_over - cos * along_here)
    };
    Some(Turn { from_B: at.normal_B, to_B: towards(&to_B, &at.normal_B) })
}

#[inline(never)]
fn at_vertex(field: &impl Field, mesh: &Mesh, index: usize, face: &Face, at: &SurfacePoint) -> Option<Turn> {
    let away_m2 =
        |corner: &usize| (mesh.vertices()[face.vertices[*corner] as usize] - at.point_B).norm_squared();
    let corner = (0..3).min_by(|a, b| away_m2(a).total_cmp(&away_m2(b)))?;
    let to_B = field.vertex_normals().of_whole_vertex(mesh, index as u32, corner)?;
    Some(Turn { from_B: at.normal_B, to_B: towards(&to_B, &at.normal_B) })
}

/// The edge of a face that is nearest to a point, and the point of it that is.
fn nearest_edge(mesh: &Mesh, face: &Face, point_B: &Vector3<f64>) -> (usize, Vector3<f64>) {
    let corners_B = corners_B(mesh, face);
    let mut best = (f64::INFINITY, 0, corners_B[0]);
    for edge in 0..3 {
        let (start_B, end_B) = (corners_B[edge], corners_B[(edge + 1) % 3]);
        let along_B = end_B - start_B;
        let share = along_B.dot(&(point_B - start_B)) / along_B.norm_squared();
        let foot_B = start_B + along_B * share.clamp(0.0, 1.0);
        let away_m2 = (point_B - foot_B).norm_squared();
        if away_m2 < best.0 {
            best = (away_m2, edge, foot_B);
        }
    }
    (best.1, best.2)
}

/// Written out, since arrays that are mapped go through memory.
#[inline(always)]
pub(super) fn corners_B(mesh: &Mesh, face: &Face) -> [Vector3<f64>; 3] {
    let ([a, b, c], vertices_B) = (face.vertices, mesh.vertices());
    [vertices_B[a as usize], vertices_B[b as usize], vertices_B[c as usize]]
}

/// Of a direction and its opposite, the one on this side.
fn towards(direction_B: &Vector3<f64>, side_B: &Vector3<f64>) -> Vector3<f64> {
    if direction_B.dot(side_B) < 0.0 { -direction_B } else { *direction_B }
}

/// Squares of shorter vectors underflow; normals may be weighted with areas, which can be tiny.
const SMALLEST: f64 = 1e-150;
