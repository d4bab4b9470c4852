//! Bends of a mesh at its vertices: which part of what it stands on each of them bears, however finely it is cut.
//!
//! Problem: on soft points a body rests as deep, and tilts as easily, as it has points. How many vertices the outline of a foot was
//! cut into says nothing about the foot.
//! Model: the bend of a vertex is the solid angle by which it sticks out (the angle that its faces leave of a full turn: Gauss'
//! curvature), so that a corner of a box has one. Of what is cut finer each vertex has less, and all together as much: a
//! foot of any outline has four, one in the middle of a straight edge none. To that comes a tenth of its share of the mean curvature (half the lengths of
//! its edges, times the angles by which they stick out), for rings and rollers, whose solid angle is none where they lie.
//! Of many vertices some stand for others, each with the bends of those around it ([`Mesh::stands`]): of each list, those of the
//! next one are some that are no neighbours, and each of the rest gives what it has to those of them that are its neighbours.
//! Cost: to find them, `n log n` for `n` vertices.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::Vector3;

use super::{Mesh, Sides};

/// Bends of all vertices.
#[derive(Debug)]
pub(super) struct Bends {
    /// Of each vertex; a corner of a box has one.
    of_vertices: Box<[f32]>,
    lists: Vec<Box<[Stand]>>,
}

/// A vertex that stands for those around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stand {
    /// Three times the number of a face plus that of the corner there.
    pub corner: u32,
    /// Bends of all that it stands for.
    pub bend: f64,
    /// Where it is \[m\].
    pub point_B: Vector3<f64>,
}

impl Mesh {
    /// Finds the bends, for [`Self::bend`] and [`Self::stands`]: once for each mesh. Allocates.
    pub fn find_bends(&self) {
        self.bends.get_or_init(|| {
            let bends = self.bends_of_vertices();
            let lists = self.lists(&bends);
            Bends { of_vertices: bends.iter().map(|bend| *bend as f32).collect(), lists }
        });
    }

    /// The bend of a vertex: 1 for a corner of a box; 1 of all, unless [`Self::find_bends`] was called.
    pub fn bend(&self, vertex: u32) -> f64 {
        self.bends.get().map_or(1.0, |bends| f64::from(bends.of_vertices[vertex as usize]))
    }

    /// Vertices that stand for all that stick out: the finest list of at most [`MOST_STANDS`], and then ever coarser ones; `None`:
    /// there are no more, or nobody has called [`Self::find_bends`].
    pub fn stands(&self, list: usize) -> Option<&[Stand]> {
        self.bends.get()?.lists.get(list).map(|stands| &**stands)
    }

    fn bends_of_vertices(&self) -> Vec<f64> {
        let count = self.vertices.len();
        let (mut left, mut mean) = (vec![TAU; count], vec![0.0; count]);
        let mut ends = vec![false; count];
        for face in &self.faces {
            let corner = |at: usize| &self.vertices[face.vertices[at % 3] as usize];
            for at in 0..3 {
                let [to, back] = [corner(at + 1) - corner(at), corner(at + 2) - corner(at)];
                let [from, end] = [at, (at + 1) % 3].map(|at| face.vertices[at] as usize);
                left[from] -= to.cross(&back).norm().atan2(to.dot(&back));
                let link = face.links[at];
                let (turn, part) = if link.is_boundary() {
                    (ends[from], ends[end]) = (true, true);
                    (FRAC_PI_2, 0.5)
                } else {
                    let beyond = &self.faces[link.face() as usize].normal_B;
                    let turns = face.normal_B.cross(beyond).dot(&to) / to.norm();
                    let turn = turns.atan2(face.normal_B.dot(beyond));
                    // Each of its two faces tells half of it.
                    (if face.sides == Sides::Sheet { turn.abs() } else { turn.max(0.0) }, 0.25)
                };
                [from, end].iter().for_each(|vertex| mean[*vertex] += part * turn * to.norm());
            }
        }
        let all: f64 = mean.iter().sum();
        let part_of_all = if all > 0.0 { MEAN_PART * CORNERS / all } else { 0.0 };
        let of_one = |vertex: usize| {
            let gauss = left[vertex] - if ends[vertex] { PI } else { 0.0 };
            (gauss.max(0.0) / FRAC_PI_2 + part_of_all * mean[vertex]).max(LEAST_BEND)
        };
        (0..count).map(of_one).collect()
    }

    /// Ever coarser lists of those that have any bend to speak of.
    fn lists(&self, bends: &[f64]) -> Vec<Box<[Stand]>> {
        let most = bends.iter().fold(0.0, |most: f64, bend| most.max(*bend));
        let mut corners = vec![u32::MAX; bends.len()];
        let mut edges = Vec::with_capacity(3 * self.faces.len());
        for (number, face) in self.faces.iter().enumerate() {
            for at in 0..3 {
                corners[face.vertices[at] as usize] = (3 * number + at) as u32;
                edges.push([face.vertices[at], face.vertices[(at + 1) % 3]]);
            }
        }
        let sticks_out = |vertex: &u32| bends[*vertex as usize] > LEAST * most;
        edges.retain(|ends| ends.iter().all(sticks_out));
        let mut clusters = Clusters { mesh: self, bends: bends.to_vec(), edges };
        let mut left: Vec<u32> = (0..bends.len() as u32).filter(sticks_out).collect();
        let mut lists = Vec::new();
        while lists.len() < MOST_LISTS && left.len() > FEW_STANDS {
            let stand = |vertex: &u32| Stand {
                corner: corners[*vertex as usize],
                bend: clusters.bends[*vertex as usize],
                point_B: self.vertices[*vertex as usize],
            };
            if left.len() <= MOST_STANDS {
                lists.push(left.iter().map(stand).collect());
            }
            let before = left.len();
            left = clusters.coarsen(&left);
            if 10 * left.len() > 9 * before {
                break;
            }
        }
        lists
    }
}

/// Vertices that stand for others, and which of them are neighbours.
struct Clusters<'m> {
    mesh: &'m Mesh,
    bends: Vec<f64>,
    edges: Vec<[u32; 2]>,
}

impl Clusters<'_> {
    /// Leaves some that are no neighbours, and gives them what the others have.
    fn coarsen(&mut self, left: &[u32]) -> Vec<u32> {
        let count = self.bends.len();
        let length_m =
            |[a, b]: &[u32; 2]| (self.mesh.vertices[*a as usize] - self.mesh.vertices[*b as usize]).norm();
        // What lies far away is no neighbour, though an edge leads there.
        let mut shortest_m = vec![f64::INFINITY; count];
        for ends in &self.edges {
            for end in ends.map(|end| end as usize) {
                shortest_m[end] = shortest_m[end].min(length_m(ends));
            }
        }
        let is_short =
            |ends: &[u32; 2]| ends.iter().all(|end| length_m(ends) <= FAR * shortest_m[*end as usize]);
        let mut edges: Vec<[u32; 2]> = self.edges.iter().copied().filter(is_short).collect();
        edges.extend(edges.clone().iter().map(|[a, b]| [*b, *a]));
        edges.sort_unstable();
        edges.dedup();
        let mut first = vec![0; count + 1];
        edges.iter().for_each(|[a, _]| first[*a as usize + 1] += 1);
        (0..count).for_each(|at| first[at + 1] += first[at]);
        let around =
            |vertex: u32| edges[first[vertex as usize]..first[vertex as usize + 1]].iter().map(|[_, to]| *to);
        let mut stays = vec![false; count];
        for &vertex in left {
            stays[vertex as usize] = !around(vertex).any(|to| stays[to as usize]);
        }
        let mut goes_to: Vec<u32> = (0..count as u32).collect();
        for &vertex in left.iter().filter(|&&vertex| !stays[vertex as usize]) {
            let near = || around(vertex).filter(|&to| stays[to as usize]);
            let nearest = near().min_by(|&a, &b| length_m(&[vertex, a]).total_cmp(&length_m(&[vertex, b])));
            goes_to[vertex as usize] = nearest.unwrap_or(vertex);
            // So that the middle of all stays where it is.
            let part = |to: u32| length_m(&[vertex, to]).max(f64::MIN_POSITIVE).recip();
            let all: f64 = near().map(part).sum();
            for to in near() {
                self.bends[to as usize] += self.bends[vertex as usize] * part(to) / all;
            }
        }
        self.edges =
            edges.iter().map(|ends| ends.map(|end| goes_to[end as usize])).filter(|[a, b]| a < b).collect();
        self.edges.sort_unstable();
        self.edges.dedup();
        left.iter().copied().filter(|&vertex| stays[vertex as usize]).collect()
    }
}

/// The most of a list: so many are looked at within a tick.
pub const MOST_STANDS: usize = 8192;
/// So few need no coarser list.
const FEW_STANDS: usize = 24;
const MOST_LISTS: usize = 12;
/// Corners of a box.
const CORNERS: f64 = 8.0;
/// Share of the mean curvature beside that of Gauss.
const MEAN_PART: f64 = 0.1;
/// None has less: hollows press next to nothing beside what sticks out, and where they touch alone, all there is.
const LEAST_BEND: f64 = 1e-6;
/// Less, in parts of the largest, stands for nobody.
const LEAST: f64 = 2e-6;
/// So many times as long as its shortest is a long edge.
const FAR: f64 = 4.0;

#[cfg(test)]
mod tests {
    use super::super::{Mesh, TriangleSoup, make};

    fn bends(soup: TriangleSoup) -> (Mesh, Vec<f64>) {
        let mesh = Mesh::build(soup).unwrap().0;
        mesh.find_bends();
        let bends = (0..mesh.vertices().len() as u32).map(|vertex| mesh.bend(vertex)).collect();
        (mesh, bends)
    }

    #[test]
    fn corners_of_boxes_have_as_much_each_and_all_of_a_round_thing_as_much() {
        // Single precision.
        let (_, of_box) = bends(make::cuboid([0.02, 0.1, 0.05]));
        assert!(of_box.iter().all(|bend| (bend - 1.1).abs() < 1e-6), "{of_box:?}");
        for (nu, nv) in [(8, 4), (48, 24), (200, 100)] {
            let (mesh, of_ball) = bends(make::uv_sphere(nu, nv, 0.03));
            // A full solid angle, and a tenth.
            let all: f64 = of_ball.iter().sum();
            assert!((all - 8.8).abs() < 1e-4, "{nu} {nv}: {all}");
            // Lists that stand for it have as much, and where it is.
            for list in 0.. {
                let Some(stands) = mesh.stands(list) else { break };
                let all: f64 = stands.iter().map(|stand| stand.bend).sum();
                let middle_m: f64 = stands.iter().map(|stand| stand.bend * stand.point_B.z).sum();
                assert!((all - 8.8).abs() < 1e-4, "{nu} {nv} {list}: {all}");
                // A millimetre, or of few a part of how far they are from each other.
                let apart_m = 0.03 * (4.0 * std::f64::consts::PI / stands.len() as f64).sqrt();
                assert!((middle_m / 8.8).abs() < 1e-3_f64.max(0.2 * apart_m), "{nu} {nv} {list}: {middle_m}");
            }
        }
    }
}
