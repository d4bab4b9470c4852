//! Holes in parts that are all but closed.
//!
//! Problem: one missing face makes of a solid a sheet, which has no inside: fingers get in, and nothing tells that they are.
//!
//! Model: the rims of a part are loops of edges of one face. A part is nearly closed if each of its loops is small beside it and
//! lids on all of them are small beside its surface; or if whoever loads it says up to which size loops are closed. A lid
//! is a triangle, or a fan around the mean of the loop's vertices. What hangs together with a lid is the same part, and if
//! no loop is left, a solid.
//!
//! Invariant: lids are proper faces between the vertices of the loop and one more, wound like the part.
//! Cost: linear in the faces.

use super::order::{Curve, Triangle};
use super::repair::{area_vector, has_area};
use super::report::{MeshReport, OpenHole, OpenHoles, TOLD};
use super::{Link, MAX_VALENCE, winding};
use nalgebra::Vector3;

/// Which holes are closed when a mesh is built.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum CloseHoles {
    /// All of a part that are small beside it, so that it is a solid; no others.
    #[default]
    Small,
    /// All that fit into a box with this diagonal \[m\]; with 0, none.
    UpTo(f64),
}

/// Puts lids on holes; says whether there were any. Faces of a part must be wound alike.
pub(super) fn close(
    which: CloseHoles,
    triangles: &mut Vec<Triangle>,
    links: &[[Link; 3]],
    vertices: &mut Vec<Vector3<f64>>,
    report: &mut MeshReport,
) -> bool {
    let loops = loops(triangles, links, vertices);
    if loops.is_empty() || which == CloseHoles::UpTo(0.0) {
        return false;
    }
    let parts = Parts::new(triangles, links, vertices, &loops);
    let curve = Curve::through(vertices);
    let faces = triangles.len();
    for hole in &loops {
        let is_wanted = match which {
            CloseHoles::Small => parts.is_nearly_closed(hole),
            CloseHoles::UpTo(size_m) => hole.size_m <= size_m,
        };
        if !is_wanted || triangles.len() + hole.corners.len() > Link::MAX_FACES {
            continue;
        }
        let Some(lid) = hole.lid(vertices) else { continue };
        report.closed_holes.note(hole.origin as usize);
        for corners in lid {
            let points = corners.map(|corner| vertices[corner as usize]);
            triangles.push(Triangle::new(corners, &points, hole.origin, &curve).of_lid());
        }
    }
    triangles.len() > faces
}

/// The holes that there are: how many, and the largest few.
pub(super) fn largest(triangles: &[Triangle], links: &[[Link; 3]], vertices: &[Vector3<f64>]) -> OpenHoles {
    let mut loops = loops(triangles, links, vertices);
    loops.sort_by(|a, b| b.size_m.total_cmp(&a.size_m));
    let mut largest = [None; TOLD];
    for (told, hole) in largest.iter_mut().zip(&loops) {
        *told = Some(OpenHole { size_m: hole.size_m, middle_B: hole.middle_B.into() });
    }
    OpenHoles { count: loops.len(), largest }
}

/// A loop of edges of one face.
struct Hole {
    /// A face beside it.
    face: usize,
    /// The first face of the input beside it.
    origin: u32,
    /// As the faces beside it run.
    corners: Vec<u32>,
    /// Diagonal of the box around it.
    size_m: f64,
    middle_B: Vector3<f64>,
    /// Of its lid.
    area_m2: f64,
}

impl Hole {
    fn new(rim: &[(usize, usize)], triangles: &[Triangle], vertices: &[Vector3<f64>]) -> Self {
        let corners: Vec<u32> = rim.iter().map(|&(face, edge)| triangles[face].corners[edge]).collect();
        let origin = rim.iter().map(|&(face, _)| triangles[face].origin()).min().unwrap_or(0);
        let points: Vec<_> = corners.iter().map(|&corner| vertices[corner as usize]).collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        let area_m2 = |(a, b): (&Vector3<f64>, &Vector3<f64>)| 0.5 * (a - middle).cross(&(b - middle)).norm();
        let area_m2 = points.iter().zip(points.iter().cycle().skip(1)).map(area_m2).sum();
        Self { face: rim[0].0, origin, corners, size_m: diagonal_m(&points), middle_B: middle, area_m2 }
    }

    /// Triangles over it, around a new vertex if there are more than three; `None` if one had no area, or that vertex too many.
    fn lid(&self, vertices: &mut Vec<Vector3<f64>>) -> Option<Vec<[u32; 3]>> {
        let proper = |corners: &[u32; 3], vertices: &[Vector3<f64>]| {
            has_area(&corners.map(|corner| vertices[corner as usize]))
        };
        if let [a, b, c] = *self.corners {
            return proper(&[c, b, a], vertices).then(|| vec![[c, b, a]]);
        }
        if self.corners.len() > MAX_VALENCE as usize {
            return None;
        }
        let sum: Vector3<f64> = self.corners.iter().map(|&corner| vertices[corner as usize]).sum();
        let middle = vertices.len() as u32;
        vertices.push(sum / self.corners.len() as f64);
        let next = self.corners.iter().cycle().skip(1);
        let lid: Vec<_> = self.corners.iter().zip(next).map(|(&a, &b)| [b, a, middle]).collect();
        if lid.iter().all(|corners| proper(corners, vertices)) {
            return Some(lid);
        }
        vertices.pop();
        None
    }
}

/// What is known of the parts of the mesh, and which part each face belongs to.
struct Parts {
    part_of: Vec<u32>,
    all: Vec<Part>,
}

#[derive(Clone, Default)]
struct Part {
    area_m2: f64,
    size_m: f64,
    largest_hole_m: f64,
    holes_m2: f64,
}

impl Parts {
    fn new(triangles: &[Triangle], links: &[[Link; 3]], vertices: &[Vector3<f64>], holes: &[Hole]) -> Self {
        let (states, parts) = winding::flood(links);
        let part_of: Vec<u32> = states.iter().map(|state| state.part).collect();
        let mut boxes =
            vec![[Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)]; parts.len()];
        let mut all = vec![Part::default(); parts.len()];
        for (triangle, &part) in triangles.iter().zip(&part_of) {
            let corners = triangle.corners.map(|corner| vertices[corner as usize]);
            all[part as usize].area_m2 += 0.5 * area_vector(&corners).norm();
            let [low, high] = &mut boxes[part as usize];
            corners.iter().for_each(|corner| (*low, *high) = (low.inf(corner), high.sup(corner)));
        }
        all.iter_mut().zip(boxes).for_each(|(part, [low, high])| part.size_m = (high - low).norm());
        for hole in holes {
            let part = &mut all[part_of[hole.face] as usize];
            part.largest_hole_m = part.largest_hole_m.max(hole.size_m);
            part.holes_m2 += hole.area_m2;
        }
        Self { part_of, all }
    }

    fn is_nearly_closed(&self, hole: &Hole) -> bool {
        let part = &self.all[self.part_of[hole.face] as usize];
        part.largest_hole_m <= SMALL * part.size_m && part.holes_m2 <= SMALL_AREA * part.area_m2
    }
}

/// All loops of edges of one face, with three corners or more.
fn loops(triangles: &[Triangle], links: &[[Link; 3]], vertices: &[Vector3<f64>]) -> Vec<Hole> {
    let mut is_done = vec![[false; 3]; links.len()];
    let mut loops = Vec::new();
    for face in 0..links.len() {
        for edge in 0..3 {
            if !links[face][edge].is_boundary() || is_done[face][edge] {
                continue;
            }
            let mut rim = Vec::new();
            let mut at = Some((face, edge));
            while let Some((face, edge)) = at.filter(|&(face, edge)| !is_done[face][edge]) {
                is_done[face][edge] = true;
                rim.push((face, edge));
                at = next_open(links, face, edge);
            }
            if at == Some((face, edge)) && rim.len() >= 3 {
                loops.push(Hole::new(&rim, triangles, vertices));
            }
        }
    }
    loops
}

/// The open edge that begins where this one ends, of the same fan; `None` if neighbours are not wound alike.
fn next_open(links: &[[Link; 3]], face: usize, edge: usize) -> Option<(usize, usize)> {
    let (mut face, mut edge) = (face, (edge + 1) % 3);
    for _ in 0..MAX_VALENCE {
        let link = links[face][edge];
        if link.is_boundary() {
            return Some((face, edge));
        }
        if link.is_turned() {
            return None;
        }
        (face, edge) = (link.face() as usize, (link.edge() + 1) % 3);
    }
    None
}

fn diagonal_m(points: &[Vector3<f64>]) -> f64 {
    let nothing = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    let (low, high) = points.iter().fold(nothing, |(low, high), point| (low.inf(point), high.sup(point)));
    (high - low).norm()
}

/// Most that a hole of a nearly closed part may measure, as a share of the part: scans have holes of a sixth where they stood;
/// a teapot's spout has a quarter.
const SMALL: f64 = 0.2;
/// Most that all lids of a nearly closed part may have of its surface: scans have up to a fortieth, a spout a sixteenth.
const SMALL_AREA: f64 = 0.03;
