//! Ridges that an edge of one solid dips through: in by one face of a mesh and out by another, as through the back of a round bar.
//!
//! Model: the way out is across both edges, from where it leads out of both faces at once; how far, the mesh itself tells. An end that
//! is inside counts as if it had come in by the face that is over it.

use haptics::mesh::{Face, Hit, Mesh};
use nalgebra::Vector3;

use super::mesh_cut::{Cut, INSIDE, WayOut, pressed};

/// A part of an edge between where it comes in, seen from either end; or that end, if it is inside already.
pub(super) struct Part {
    pub(super) ends: [Vector3<f64>; 2],
    pub(super) hits: [Option<Hit>; 2],
}

impl Part {
    /// The place at which it is deepest in a ridge.
    pub(super) fn dips(&self, mesh: &Mesh, way: &WayOut<'_>) -> Option<Cut> {
        let [a, b] = &self.ends;
        let insides = [
            inside(mesh, self.hits[0].as_ref(), (a, b), way),
            inside(mesh, self.hits[1].as_ref(), (b, a), way),
        ];
        dips(mesh, &insides, way).or_else(|| self.dips_from_outside(mesh, way))
    }

    /// The same, if it comes in at both ends, however the faces look there.
    pub(super) fn dips_from_outside(&self, mesh: &Mesh, way: &WayOut<'_>) -> Option<Cut> {
        dips(mesh, &self.entered(mesh, way), way)
    }

    /// The points at which it comes in at either end.
    fn entered<'m>(&self, mesh: &'m Mesh, way: &WayOut<'_>) -> [Option<Inside<'m>>; 2] {
        [0, 1].map(|at| entered(mesh, self.hits[at].as_ref()?, way, LOOKS_AWAY))
    }
}

/// A point of an edge in a mesh, and the face that is between it and the way out.
struct Inside<'m> {
    at: Vector3<f64>,
    face: &'m Face,
}

/// The point at which an edge comes in, seen from one end; or that end, if it is inside already.
fn inside<'m>(
    mesh: &'m Mesh,
    hit: Option<&Hit>,
    (from, to): (&Vector3<f64>, &Vector3<f64>),
    way: &WayOut<'_>,
) -> Option<Inside<'m>> {
    if let Some(entered) = hit.and_then(|hit| entered(mesh, hit, way, LOOKS)) {
        return Some(entered);
    }
    let at = match hit {
        Some(hit) => hit.point_B + (to - hit.point_B).try_normalize(0.0)? * (INSIDE * mesh.extent_m()),
        None => *from,
    };
    let face = pressed(mesh, &at, way, LOOKS)?;
    Some(Inside { at, face })
}

/// The point at which it comes in, if that is through a face that looks along the way out by so much.
fn entered<'m>(mesh: &'m Mesh, hit: &Hit, way: &WayOut<'_>, looks: f64) -> Option<Inside<'m>> {
    let face = &mesh.faces()[hit.face as usize];
    (face.normal_B.dot(&way.along) > looks).then_some(Inside { at: hit.point_B, face })
}

/// The place between two points of an edge at which it is deepest in the ridge of the faces over them.
fn dips(mesh: &Mesh, insides: &[Option<Inside<'_>>; 2], way: &WayOut<'_>) -> Option<Cut> {
    let [Some(first), Some(last)] = insides else { return None };
    let along_edge = (last.at - first.at).try_normalize(0.0)?;
    let normals = [first, last].map(|inside| inside.face.normal_B);
    let [sinks, rises] = normals.map(|normal| normal.dot(&along_edge));
    // Out of a valley it would be deepest at its ends.
    if sinks >= 0.0 || rises <= 0.0 {
        return None;
    }
    let out = along_edge.cross(&normals[0].cross(&normals[1])).try_normalize(FLAT)?;
    let out = if out.dot(&way.along) < 0.0 { -out } else { out };
    let leans = normals.map(|normal| normal.dot(&out));
    if out.dot(&way.along) < ACROSS || leans[0] <= 0.0 || leans[1] <= 0.0 {
        return None;
    }
    // Out of both at once: ways out grow from either end.
    let ways_m = [first, last].map(|inside| inside.face.offset_m - inside.face.normal_B.dot(&first.at));
    let [from_m, to_m] = [0, 1].map(|at| ways_m[at] / leans[at]);
    let far_m = (to_m - from_m) / (rises / leans[1] - sinks / leans[0]);
    if !(0.0..=(last.at - first.at).norm()).contains(&far_m) {
        return None;
    }
    let on_edge = first.at + along_edge * far_m;
    let left = mesh.first_hit(&(on_edge + out * way.most_m), &on_edge)?;
    Some(Cut { on_edge, on_mesh: left.point_B, out, gap_m: -(left.point_B - on_edge).norm() })
}

/// Sine between two directions that are one.
const FLAT: f64 = 1e-6;
/// Cosine between the way out and a face of a ridge, of one that is found by it, and of a sharp one that it leans on.
pub(super) const LOOKS: f64 = 0.1;
const LOOKS_AWAY: f64 = -0.7;
/// Cosine between the way out and that across two edges.
const ACROSS: f64 = 0.4;

#[cfg(test)]
mod tests {
    use super::super::mesh_cut::Edge;
    use super::*;
    use haptics::mesh::TriangleSoup;

    /// A block between x = +-1 and z = +-1 whose top is 0 at the sides and as high as this in the middle, along z.
    fn roof(middle: f64) -> Mesh {
        let outline = [[-1.0, 0.0], [-1.0, -2.0], [1.0, -2.0], [1.0, 0.0], [0.0, middle]];
        let end = |z: f64| outline.map(|[x, y]| Vector3::new(x, y, z));
        let vertices = [end(1.0), end(-1.0)].concat();
        let fan =
            if middle > 0.0 { [[0, 1, 2], [0, 2, 3], [0, 3, 4]] } else { [[4, 0, 1], [4, 1, 2], [4, 2, 3]] };
        let mut faces = fan.to_vec();
        faces.extend(fan.map(|[a, b, c]| [a + 5, c + 5, b + 5]));
        faces.extend((0..5).flat_map(|a| {
            let b = (a + 1) % 5;
            [[a, a + 5, b + 5], [a, b + 5, b]]
        }));
        Mesh::build(TriangleSoup { vertices, faces }).unwrap().0
    }

    fn cuts(middle: f64, along: Vector3<f64>, ends: [[f64; 3]; 2]) -> Vec<Cut> {
        let way = WayOut { along, most_m: 1.0, ahead_m: 0.0, lift: &|_| Vector3::zeros() };
        let edge = Edge { ends: ends.map(Vector3::from) };
        edge.cuts(&roof(middle), &way).into_iter().flatten().collect()
    }

    #[test]
    fn an_edge_through_a_ridge_is_let_out_across_it_and_not_by_a_side() {
        let leaning = Vector3::new(1.0, 1.0, 0.0).normalize();
        // From far outside, and from inside; its ends may be as far from the ridge as they like.
        for (along, from, to) in [
            (Vector3::y(), -5.0, 5.0),
            (Vector3::y(), -0.05, 0.05),
            (Vector3::y(), -0.08, 5.0),
            (Vector3::y(), -3.0, 0.02),
            (leaning, -5.0, 5.0),
            (leaning, -0.2, 0.3),
        ] {
            let cuts = cuts(1.0, along, [[from, 0.9, 0.3], [to, 0.9, 0.3]]);
            let [cut] = cuts[..] else { panic!("{along} {from} {to}: {cuts:?}") };
            assert!((cut.gap_m + 0.1).abs() < 1e-12, "{along} {from} {to}: {cut:?}");
            assert!((cut.out - Vector3::y()).norm() < 1e-12, "{cut:?}");
            assert!((cut.on_mesh - Vector3::new(0.0, 1.0, 0.3)).norm() < 1e-12, "{cut:?}");
        }
    }

    /// It leans by a quarter along z and a half across: what is across both is `(0, 1, 0)` without what leans across.
    #[test]
    fn a_leaning_edge_is_as_deep_as_the_way_across_both_is_long() {
        let way = Vector3::new(1.0, 0.5, 0.25);
        let middle = Vector3::new(0.0, 0.8, 0.1);
        let ends = [middle - way * 4.0, middle + way * 4.0].map(|end| [end.x, end.y, end.z]);
        let [cut] = cuts(1.0, Vector3::y(), ends)[..] else { panic!() };
        let out = Vector3::new(-0.5, 1.0, 0.0).normalize();
        assert!((cut.out - out).norm() < 1e-12, "{cut:?}");
        // From the ridge's foot to any of the edge's.
        assert!((cut.gap_m + out.dot(&(Vector3::new(0.0, 1.0, 0.1) - middle))).abs() < 1e-12, "{cut:?}");
    }

    /// Of a saw of three roofs an edge dips through the first and the last.
    #[test]
    fn an_edge_across_several_ridges_is_let_out_across_each_of_the_outer_ones() {
        let mut soup = TriangleSoup { vertices: vec![], faces: vec![] };
        for x in [-3.0, 0.0, 3.0] {
            let first = soup.vertices.len() as u32;
            let one = roof(1.0);
            soup.vertices.extend(one.vertices().iter().map(|at| at + Vector3::x() * x));
            soup.faces.extend(one.faces().iter().map(|face| face.vertices.map(|vertex| first + vertex)));
        }
        let saw = Mesh::build(soup).unwrap().0;
        let way = WayOut { along: Vector3::y(), most_m: 1.0, ahead_m: 0.0, lift: &|_| Vector3::zeros() };
        for [from, to] in [[-5.0, 5.0], [-3.05, 5.0], [-3.05, 3.05]] {
            let edge = Edge { ends: [from, to].map(|x| Vector3::new(x, 0.9, 0.3)) };
            let mut at: Vec<_> = edge.cuts(&saw, &way).into_iter().flatten().collect();
            at.sort_by(|a, b| a.on_edge.x.total_cmp(&b.on_edge.x));
            let [first, last] = at[..] else { panic!("{from} {to}: {at:?}") };
            for (cut, x) in [(first, -3.0), (last, 3.0)] {
                assert!((cut.on_mesh - Vector3::new(x, 1.0, 0.3)).norm() < 1e-12, "{from} {to}: {cut:?}");
                assert!((cut.gap_m + 0.1).abs() < 1e-12, "{cut:?}");
            }
        }
    }

    #[test]
    fn an_edge_over_a_valley_dips_through_nothing() {
        assert!(cuts(-0.5, Vector3::y(), [[-0.8, -0.55, 0.0], [0.8, -0.55, 0.0]]).is_empty());
    }
}
