//! Points with Coulomb friction in grooves and corners of flat patches, tick by tick against what Coulomb's law allows there.

use std::collections::HashMap;
use std::sync::Arc;

use crate::common::meshes::*;
use crate::common::*;
use crate::mesh_oracle::coulomb::{Coulomb, Rule};
use haptics::mesh::TriangleSoup;
use haptics::{ContactState, Friction, Nurbs, NurbsPatch, Shape};
use nalgebra::Vector3;

/// A closed set of flat faces of four corners, counter-clockwise as seen from outside.
#[derive(Default)]
struct Quads {
    vertices: Vec<Vector3<f64>>,
    faces: Vec<[u32; 4]>,
}

impl Quads {
    /// A block with a groove of this angle along z, whose bottom is at the origin.
    fn groove(degrees: f64) -> Self {
        const WIDTH: f64 = 0.05;
        let rim_y = WIDTH / (0.5 * degrees.to_radians()).tan();
        let outline =
            [[-WIDTH, -WIDTH], [0.0, -WIDTH], [WIDTH, -WIDTH], [WIDTH, rim_y], [0.0, 0.0], [-WIDTH, rim_y]];
        let vertices = [WIDTH, -WIDTH].map(|z| outline.map(|[x, y]| Vector3::new(x, y, z))).concat();
        let sides = (0..6).map(|i| [i, i + 6, (i + 1) % 6 + 6, (i + 1) % 6]);
        let ends = [[0, 1, 4, 5], [1, 2, 3, 4], [11, 10, 7, 6], [10, 9, 8, 7]];
        Self { vertices, faces: sides.chain(ends).collect() }
    }

    /// Those of the eight cubes around the origin that are not among these, each as one of its corners says.
    fn without_cubes(missing: &[[i32; 3]]) -> Self {
        let cells = (0..8).map(|i| [i % 2 - 1, i / 2 % 2 - 1, i / 4 - 1]);
        let filled: Vec<[i32; 3]> = cells.filter(|cell| !missing.contains(cell)).collect();
        let mut quads = Self::default();
        let mut known = HashMap::new();
        for (cell, side) in filled.iter().flat_map(|cell| (0..6).map(move |side| (cell, side))) {
            let (axis, upper) = (side % 3, side as i32 / 3);
            let mut beside = *cell;
            beside[axis] += 2 * upper - 1;
            if filled.contains(&beside) {
                continue;
            }
            let mut ring = [[0, 0], [1, 0], [1, 1], [0, 1]];
            if upper == 0 {
                ring.reverse();
            }
            quads.faces.push(ring.map(|[s, t]| {
                let mut corner = *cell;
                corner[axis] += upper;
                corner[(axis + 1) % 3] += s;
                corner[(axis + 2) % 3] += t;
                *known.entry(corner).or_insert_with(|| {
                    quads.vertices.push(Vector3::from(corner.map(f64::from)) * 0.04);
                    quads.vertices.len() as u32 - 1
                })
            }));
        }
        quads
    }

    fn patches(&self) -> Vec<NurbsPatch> {
        let patch = |[a, b, c, d]: &[u32; 4]| NurbsPatch {
            degree: [1, 1],
            knots: [vec![0.0, 0.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]],
            points: [a, b, d, c].map(|&corner| self.vertices[corner as usize].push(1.0).into()).to_vec(),
        };
        self.faces.iter().map(patch).collect()
    }

    fn triangles(&self) -> TriangleSoup {
        let halves = |[a, b, c, d]: &[u32; 4]| [[*a, *b, *c], [*a, *c, *d]];
        TriangleSoup { vertices: self.vertices.clone(), faces: self.faces.iter().flat_map(halves).collect() }
    }
}

/// Leads a finger along: what it feels is what forces in the friction cones of all touched faces bear. Without friction it is
/// where the god-object of the oracle is, from tick to tick. Returns in how many ticks it touched several faces.
fn follow(quads: &Quads, mu: f64, hips: impl Iterator<Item = Vector3<f64>>) -> usize {
    /// A thousand roundings of positions of 0.05 m (m).
    const SAME_PLACE: f64 = 1e-14;
    let nurbs = Arc::new(Nurbs::build(&quads.patches()).unwrap().0);
    let entity = entity(Shape::from(nurbs), Friction::coulomb(mu).unwrap());
    let mesh = built(quads.triangles());
    let mut oracle = Coulomb::new(&mesh, mu, Rule::OneCone);
    let (mut finger, mut last) = (point_finger(), None);
    let (mut on_several, mut held) = (0, 0);
    for hip in hips {
        let out = step(&mut finger, &entity, &hip);
        let from = last.take();
        if out.entity.is_none() {
            continue;
        }
        let ours = out.god_object_W;
        last = Some(ours);
        on_several += usize::from(oracle.touched(&ours).len() > 1);
        held += usize::from(out.friction == ContactState::Stick);
        let unexplained = oracle.unexplained(&ours, &hip);
        assert!(
            unexplained <= SAME_PLACE,
            "mu {mu}: at {ours} no forces in the cones bear {hip}: {unexplained}"
        );
        let its = from.filter(|_| mu == 0.0).and_then(|from| oracle.step(from, &hip));
        let apart = its.map_or(0.0, |its| (its.god_object - ours).norm());
        assert!(apart <= SAME_PLACE, "{apart}: {ours} {hip} {its:?}");
    }
    assert!(mu == 0.0 || held > 100, "{held}");
    on_several
}

#[test]
fn along_grooves_of_patches_a_point_slides_as_far_as_coulomb_says() {
    for degrees in [40.0, 80.0, 120.0, 160.0] {
        for mu in [0.0, 0.3, 0.8] {
            let mut roaming = Roaming::new(1, 0.02, 2e-4);
            roaming.hip = Vector3::y() * 0.05;
            let on_several = follow(&Quads::groove(degrees), mu, (0..4000).map(|_| roaming.next()));
            assert!(on_several > 30, "{degrees} degrees, mu {mu}: {on_several}");
        }
    }
}

/// A corner of three faces, and a groove that goes on from patch to patch.
#[test]
fn in_corners_of_patches_a_point_is_held_by_what_is_in_its_way() {
    for missing in [&[[0, 0, 0]][..], &[[0, 0, 0], [-1, 0, 0]]] {
        for mu in [0.0, 0.3, 0.8] {
            let mut roaming = Roaming::new(3, 0.03, 3e-4);
            roaming.hip = Vector3::repeat(0.03);
            let on_several = follow(&Quads::without_cubes(missing), mu, (0..8000).map(|_| roaming.next()));
            assert!(on_several > 1000, "{missing:?}, mu {mu}: {on_several}");
        }
    }
}

/// A triangle, whose last edge has shrunk to a point.
fn triangular(soup: &TriangleSoup) -> Vec<NurbsPatch> {
    let corner = |corner: u32| soup.vertices[corner as usize].push(1.0).into();
    let patch = |[a, b, c]: &[u32; 3]| NurbsPatch {
        degree: [1, 1],
        knots: [vec![0.0, 0.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]],
        points: [a, b, c, c].map(|at| corner(*at)).to_vec(),
    };
    soup.faces.iter().map(patch).collect()
}

/// Rugged balls of triangles, where shrunk edges and mere corners of patches meet in one point: over such a point every way
/// leads on that leads down. Without friction each tick's force is one that the touched faces can bear; with friction all
/// but a few of a hundred are, and none is zero for long.
#[test]
fn over_points_where_patches_meet_with_corners_and_shrunk_edges_a_point_finds_its_way() {
    for (subdivisions, share, seed) in [(1, 0.3, 11), (2, 0.1, 10), (2, 0.3, 12)] {
        let mut soup = icosphere(subdivisions, 0.05);
        let mut noise = Noise(seed);
        soup.vertices.iter_mut().for_each(|vertex| *vertex *= (share * noise.gaussian()).exp());
        let (nurbs, mesh) = (Arc::new(Nurbs::build(&triangular(&soup)).unwrap().0), built(soup));
        for mu in [0.0, 0.3, 0.8] {
            let friction = if mu == 0.0 { Friction::None } else { Friction::coulomb(mu).unwrap() };
            let mut oracle = Coulomb::new(&mesh, mu, Rule::OneCone);
            let entity = entity(Shape::from(Arc::clone(&nurbs)), friction);
            let mut roaming = Roaming::new(3, 0.055, 5.5e-4);
            roaming.hip = Vector3::y() * 0.1;
            let (mut finger, mut ticks, mut unexplained, mut unfelt) = (point_finger(), 0, 0, 0);
            for hip in (0..4000).map(|_| roaming.next()) {
                let out = step(&mut finger, &entity, &hip);
                if out.entity.is_none() {
                    continue;
                }
                let spring = out.force_on_user_W / K;
                ticks += 1;
                unexplained +=
                    usize::from(oracle.unexplained(&out.god_object_W, &(out.god_object_W - spring)) > 1e-12);
                unfelt += usize::from(spring.norm() == 0.0);
            }
            assert!(ticks > 2000, "{ticks}");
            let most = if mu == 0.0 { 0 } else { ticks / 50 };
            assert!(
                unexplained <= most && unfelt <= 10,
                "{subdivisions} {share} {mu}: {unexplained} {unfelt}"
            );
        }
    }
}
