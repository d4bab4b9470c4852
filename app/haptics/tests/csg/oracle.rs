//! Trees of shapes against meshes of the same solids, made by marching tetrahedra from their boolean expressions.
//!
//! Nothing is shared with the trees: the surface is found by bisection of the expression along the edges of a grid.

use std::collections::HashMap;
use std::sync::Arc;

use crate::common::meshes::Roaming;
use crate::common::*;
use crate::trees::{self, Contains, Tree, touchable};
use haptics::mesh::{Mesh, TriangleSoup};
use haptics::{Entity, Finger, FingerOutput, Friction, Shape};
use nalgebra::Vector3;

type Node = [i32; 3];

/// The six tetrahedra of a cube, all around the same diagonal, so that neighbours fit.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

struct Marching {
    contains: Contains,
    pitch_m: f64,
    soup: TriangleSoup,
    vertices: HashMap<(Node, Node), u32>,
}

impl Marching {
    fn at(&self, node: Node) -> Vector3<f64> {
        // Off the planes of the solids: a node on a boundary would make triangles without area.
        Vector3::from(node.map(|i| (f64::from(i) + 0.4142) * self.pitch_m))
    }

    /// Where the boundary cuts the edge from a node inside to one outside.
    fn cut(&mut self, inside: Node, outside: Node) -> u32 {
        let (mut low, mut high) = (self.at(inside), self.at(outside));
        let key = (inside.min(outside), inside.max(outside));
        if let Some(&vertex) = self.vertices.get(&key) {
            return vertex;
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if (self.contains)(&middle) { low = middle } else { high = middle }
        }
        // Not nearer to a node than a hundredth of the edge: triangles keep their area.
        let (from, to) = (self.at(inside), self.at(outside));
        let share = ((low - from).norm() / (to - from).norm()).clamp(0.01, 0.99);
        self.soup.vertices.push(from + (to - from) * share);
        let vertex = self.soup.vertices.len() as u32 - 1;
        self.vertices.insert(key, vertex);
        vertex
    }

    /// Four nodes, and which of them are inside.
    fn tetrahedron(&mut self, nodes: [(Node, bool); 4]) {
        let of = |side: bool| -> Vec<Node> {
            nodes.iter().filter(|(_, is_inside)| *is_inside == side).map(|(node, _)| *node).collect()
        };
        let (inside, outside) = (of(true), of(false));
        let faces: Vec<[u32; 3]> = match (&inside[..], &outside[..]) {
            (&[a], &[b, c, d]) => vec![[self.cut(a, b), self.cut(a, c), self.cut(a, d)]],
            (&[a, b, c], &[d]) => vec![[self.cut(a, d), self.cut(b, d), self.cut(c, d)]],
            (&[a, b], &[c, d]) => {
                let [ac, ad, bd, bc] = [self.cut(a, c), self.cut(a, d), self.cut(b, d), self.cut(b, c)];
                vec![[ac, ad, bd], [ac, bd, bc]]
            }
            _ => return,
        };
        let out = outside.iter().map(|node| self.at(*node)).sum::<Vector3<f64>>() / outside.len() as f64
            - inside.iter().map(|node| self.at(*node)).sum::<Vector3<f64>>() / inside.len() as f64;
        for [a, b, c] in faces {
            let [p, q, r] = [a, b, c].map(|i| self.soup.vertices[i as usize]);
            let is_outward = (q - p).cross(&(r - p)).dot(&out) > 0.0;
            self.soup.faces.push(if is_outward { [a, b, c] } else { [a, c, b] });
        }
    }
}

fn marched(tree: &Tree, cells: i32) -> Arc<Mesh> {
    let pitch_m = 1.05 * tree.size_m / f64::from(cells);
    let soup = TriangleSoup { vertices: Vec::new(), faces: Vec::new() };
    let mut marching = Marching { contains: tree.contains, pitch_m, soup, vertices: HashMap::new() };
    // Each node is a corner of eight cubes, and asked once.
    let (first, count) = (-cells - 1, 2 * cells + 3);
    let is_inside: Vec<bool> = (0..count.pow(3))
        .map(|i| [i / (count * count), i / count % count, i % count].map(|i| first + i))
        .map(|node| (tree.contains)(&marching.at(node)))
        .collect();
    let place = |node: Node| node.iter().fold(0, |place, i| place * count + (i - first)) as usize;
    for x in first..cells + 1 {
        for y in first..cells + 1 {
            for z in first..cells + 1 {
                let corner = |i: usize| {
                    let node = [x + (i & 1) as i32, y + (i >> 1 & 1) as i32, z + (i >> 2) as i32];
                    (node, is_inside[place(node)])
                };
                // Most cubes are all inside or all outside, and have no part of the surface.
                let inside = (0..8).filter(|i| corner(*i).1).count();
                if inside == 0 || inside == 8 {
                    continue;
                }
                for tetrahedron in TETRAHEDRA {
                    marching.tetrahedron(tetrahedron.map(corner));
                }
            }
        }
    }
    Arc::new(Mesh::build(marching.soup).unwrap().0)
}

fn step(finger: &mut Finger, entity: &Entity, hip: &Vector3<f64>) -> FingerOutput {
    finger.step(std::slice::from_ref(entity), hip, DT)
}

/// The median difference of forces, in terms of the mean force, under a finger that roams.
fn difference(tree: &Tree, mesh: &Arc<Mesh>, friction: &Friction) -> f64 {
    let (exact, meshed) =
        (touchable(&tree.tree, friction.clone()), entity(Shape::from(Arc::clone(mesh)), friction.clone()));
    let (mut differences, mut total) = (Vec::new(), 0.0);
    // Presses from outside, a few millimetres deep, with a stroke: both begin where they meet, together.
    let mut roaming = Roaming::new(31, tree.size_m, 4e-3);
    for _ in 0..400 {
        let (from, to) = (roaming.next() * 2.0, roaming.next());
        let (mut a, mut b) = (point_finger(), point_finger());
        if (tree.contains)(&from) {
            continue;
        }
        let Some(first) =
            (0..=2000).map(|i| from.lerp(&to, f64::from(i) / 2000.0)).find(|p| (tree.contains)(p))
        else {
            continue;
        };
        let way = (to - from).normalize();
        let aside = way.cross(&Vector3::new(0.3, 0.4, 0.5)).normalize();
        for tick in 0..30 {
            let t = f64::from(tick) / 30.0;
            let hip = first + way * (4e-3 * t - 1e-3) + aside * (2e-3 * t);
            let (here, there) = (step(&mut a, &exact, &hip), step(&mut b, &meshed, &hip));
            if here.entity.is_some() && there.entity.is_some() {
                differences.push((here.force_on_user_W - there.force_on_user_W).norm());
                total += here.force_on_user_W.norm();
            }
        }
    }
    assert!(differences.len() > 1000, "{}: {}", tree.name, differences.len());
    differences.sort_by(f64::total_cmp);
    differences[differences.len() / 2] / (total / differences.len() as f64)
}

#[test]
fn finer_meshes_of_the_same_solid_feel_more_like_the_tree() {
    for tree in
        [trees::bored_box(), trees::lens(), trees::two_balls(), trees::half_ball(), trees::everything()]
    {
        let meshes = [24, 48].map(|cells| marched(&tree, cells));
        for friction in [Friction::None, Friction::coulomb(0.3).unwrap()] {
            let [coarse, fine] = meshes.each_ref().map(|mesh| difference(&tree, mesh, &friction));
            eprintln!("{} {friction:?}: {coarse} {fine}", tree.name);
            // Vertices lie on the solid; chords lie below it by the pitch squared over eight radii, and facets' normals
            // are off by the pitch over twice the radius: half the pitch, at most about half the difference. Edges of the
            // solid are cut off by up to the pitch of 1 mm, against presses of 3 mm; the median keeps them out.
            assert!(fine < 0.03 && fine < 0.8 * coarse + 1e-4, "{}: {coarse} {fine}", tree.name);
        }
    }
}
