//! Makes a mesh of a triangle soup.
//!
//! Problem: files contain repeated vertices, faces without an area, faces wound the wrong way round and in any
//! order; a walk over the mesh needs none of these.
//!
//! Model: validate, repair ([`repair`]), order in space ([`order`]), link ([`topology`]), close cracks ([`junction`]), wind
//! ([`winding`]), close holes of what is nearly closed ([`hole`]), part what meets at vertices ([`pinch`]), unfold slivers
//! ([`fold`]), mark what passes through itself ([`crossed`](super::crossed)), turn closed parts outward
//! ([`nesting`](super::nesting)). What was done is reported; what has no meaning is refused with the first offender.
//!
//! Invariants of the result: every face has an area; links are mutual; the same geometry gives the same mesh,
//! whatever the order of its faces and vertices was in the input.
//!
//! Cost: linear, but for sorting.

use super::order::Triangle;
use super::repair::area_vector;
use super::{Bvh, CloseHoles, Face, Link, Mesh, MeshError, MeshReport, Sides, TriangleSoup};
use super::{fold, hole, junction, order, pinch, repair, topology, winding};
use nalgebra::Vector3;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// A face is divided on one edge at a time.
const MOST_DIVISIONS: usize = 4;

/// How many meshes there have been.
static BUILT: AtomicU64 = AtomicU64::new(0);

impl Mesh {
    /// Builds a mesh, and says what had to be repaired.
    ///
    /// # Errors
    /// When the input contradicts itself, or has a defect that cannot be repaired without guessing.
    pub fn build(soup: TriangleSoup) -> Result<(Self, MeshReport), MeshError> {
        Self::build_closing(soup, CloseHoles::Small)
    }

    /// As [`Self::build`], and says which holes are to be closed.
    ///
    /// # Errors
    /// As [`Self::build`].
    pub fn build_closing(soup: TriangleSoup, holes: CloseHoles) -> Result<(Self, MeshReport), MeshError> {
        Self::build_and_tell(soup, holes, |_, _| {})
    }

    /// As [`Self::build_closing`]; `tell` hears of each face, in order, of which face of the input it is a part, and whether it
    /// is one of a lid instead: that face is beside the hole then.
    ///
    /// # Errors
    /// As [`Self::build`].
    pub fn build_and_tell(
        soup: TriangleSoup,
        holes: CloseHoles,
        mut tell: impl FnMut(usize, bool),
    ) -> Result<(Self, MeshReport), MeshError> {
        soup.validate()?;
        let mut report = MeshReport::default();
        let mut triangles = repair::proper_triangles(&soup, &mut report)?;
        order::sort_spatially(&mut triangles, &soup.vertices, &mut report.duplicate);
        let mut vertices = order::renumber(&mut triangles, &soup.vertices);
        let faces_before = soup.faces.len();
        drop(soup);
        let mut links = topology::link(&triangles, &vertices, &mut report)?;
        let mut room = (3 * triangles.len()).min(Link::MAX_FACES - triangles.len());
        for _ in 0..MOST_DIVISIONS {
            if !junction::divide(&mut triangles, &links, &vertices, &mut room, &mut report.divided) {
                break;
            }
            links = link_again(&mut triangles, &mut vertices, &mut report)?;
        }
        let mut parts = winding::orient(&mut triangles, &mut links, &mut report);
        if hole::close(holes, &mut triangles, &links, &mut vertices, &mut report) {
            links = link_again(&mut triangles, &mut vertices, &mut report)?;
            let flipped = std::mem::take(&mut report.flipped);
            parts = winding::orient(&mut triangles, &mut links, &mut report);
            report.flipped = flipped;
        }
        let has_crowds = report.touching_edges.count + report.crowded_edges.count > 0;
        let mut must_roll = has_crowds && topology::do_sheets_meet(&triangles, vertices.len(), &parts);
        let copies = pinch::part(&mut triangles, &links, &mut vertices);
        if fold::unfold(&mut triangles, (&links, &parts), &vertices, &copies, &mut report.unfolded) {
            if triangles.is_empty() {
                return Err(MeshError::OnlySlivers { faces: faces_before });
            }
            let told = report;
            links = link_again(&mut triangles, &mut vertices, &mut report)?;
            parts = winding::orient(&mut triangles, &mut links, &mut report);
            // Parts have vertices of their own by now: that they touch can be told only as it was.
            report.flipped = told.flipped;
            (report.touching_edges, report.crowded_edges) = (told.touching_edges, told.crowded_edges);
            pinch::part(&mut triangles, &links, &mut vertices);
        }
        report.open_holes = hole::largest(&triangles, &links, &vertices);
        report_edges(&triangles, &links, &mut report);
        let faces: Box<[Face]> =
            (0..triangles.len()).map(|i| face(&triangles[i], &links[i], parts.sides(i), &vertices)).collect();
        triangles.iter().for_each(|triangle| tell(triangle.origin() as usize, triangle.is_lid()));
        drop((triangles, links));
        let has_inside = faces.iter().any(|face| face.sides == Sides::Solid);
        let is_solid = faces.iter().all(|face| face.sides == Sides::Solid);
        let sides = if is_solid { Sides::Solid } else { Sides::Sheet };
        report.faces = faces.len();
        report.vertices = vertices.len();
        let extent_m = vertices.iter().fold(0.0_f64, |extent, v| extent.max(v.amax()));
        let edges_m = faces.iter().flat_map(|face| {
            let [a, b, c] = face.vertices.map(|vertex| vertices[vertex as usize]);
            [(a - b).norm(), (b - c).norm(), (c - a).norm()]
        });
        let longest_edge_m = edges_m.fold(0.0, f64::max);
        let vertices = vertices.into_boxed_slice();
        let bvh = Bvh::build(&faces, &vertices);
        let identity = BUILT.fetch_add(1, Ordering::Relaxed);
        let mut mesh = Self {
            faces,
            vertices,
            bvh,
            sides,
            has_inside,
            extent_m,
            longest_edge_m,
            point_radius_m: 0.0,
            has_crowds,
            convex_inner_m: None,
            identity,
            uv: None,
            labels: None,
            extremes: OnceLock::new(),
        };
        must_roll |= mesh.note_sealed(&parts, &mut report);
        report.crossed = mesh.mark_crossed(&parts, must_roll);
        mesh.turn_outward(&parts, &mut report);
        if mesh.point_radius_m == 0.0 && mesh.is_inverted(&parts, report.cavities.count > 0) {
            must_roll = true;
            mesh.point_radius_m = mesh.least_ball_m();
        }
        let is_fitting;
        (report.narrow_gaps, is_fitting) = mesh.mark_beside(&parts);
        mesh.fit(&is_fitting, &mut report.narrow_gaps);
        if report.narrow_gaps.moved > 0 {
            mesh.mark_crossed(&parts, must_roll);
        }
        report.point_radius_m = mesh.point_radius_m;
        mesh.mark_ledges();
        mesh.convex_inner_m = if parts.len() == 1 { mesh.find_convex_inner_m() } else { None };
        Ok((mesh, report))
    }
}

/// Of faces that were divided or added: in order again, and with their links.
fn link_again(
    triangles: &mut Vec<Triangle>,
    vertices: &mut Vec<Vector3<f64>>,
    report: &mut MeshReport,
) -> Result<Vec<[Link; 3]>, MeshError> {
    order::sort_spatially(triangles, vertices, &mut report.duplicate);
    *vertices = order::renumber(triangles, vertices);
    (report.touching_edges, report.crowded_edges) = Default::default();
    topology::link(triangles, vertices, report)
}

/// Normal and offset of a face: the middle of those of its corners, so that none of them is further from the plane than needed.
pub(super) fn plane_of(corners: &[Vector3<f64>; 3]) -> (Vector3<f64>, f64) {
    let normal_B = area_vector(corners).normalize();
    let [a, b, c] = corners.map(|corner| normal_B.dot(&corner));
    (normal_B, 0.5 * (a.min(b).min(c) + a.max(b).max(c)))
}

fn face(triangle: &Triangle, links: &[Link; 3], sides: Sides, vertices: &[Vector3<f64>]) -> Face {
    let corners = triangle.corners.map(|v| vertices[v as usize]);
    let (normal_B, offset_m) = plane_of(&corners);
    Face {
        normal_B,
        offset_m,
        vertices: triangle.corners,
        links: *links,
        sides,
        is_crossed: false,
        is_beside: false,
        is_at_ledge: false,
    }
}

fn report_edges(triangles: &[Triangle], links: &[[Link; 3]], report: &mut MeshReport) {
    for (face, (triangle, own)) in triangles.iter().zip(links).enumerate() {
        for link in own {
            if link.is_boundary() {
                report.boundary_edges.note(triangle.origin() as usize);
            } else if link.is_turned() && link.face() as usize > face {
                let origin = triangle.origin().min(triangles[link.face() as usize].origin());
                report.turned_edges.note(origin as usize);
            }
        }
    }
}
