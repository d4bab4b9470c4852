//! Divides polygons into triangles.
//!
//! Problem: two triangles that meet at a diagonal must be the only ones there. Quads that share two edges, as around a vertex
//! of two quads, would have four if both were cut along the line that closes the two edges; and what is cut along an edge of
//! another face would have three.
//!
//! Model: a polygon whose fan around a corner turns the same way throughout is divided into that fan, around its first corner if
//! it can be; any other by cutting ears off (G. H. Meisters, *Polygons have ears*, 1975), so that concave ones keep their
//! outline. Diagonals that another polygon of the file has as an edge or as its own diagonal are left to it where there are others.
//! A polygon that crosses itself has no inside that could be divided: it becomes the fan around its first corner, which has its
//! edges, so that what it closes is closed.
//!
//! The turning sense is measured about the polygon's own normal (Newell), so nothing depends on its plane.
//! Cost: linear for the fan; for ears quadratic, since what is known of a corner is kept until something there changes, but cubic
//! at worst, hence [`MAX_CONCAVE_CORNERS`].

use nalgebra::Vector3;
use std::collections::{HashMap, HashSet};

/// Concave polygons may have so many corners.
const MAX_CONCAVE_CORNERS: usize = 500;

/// Of the polygon's area: a part of it that small is none.
const ROUNDING: f64 = 1e-12;
/// Corners that a fan is tried around.
const MOST_FANS: usize = 16;

/// What was found and what is allowed, of a polygon that cannot be divided.
pub(super) fn indivisible(corners: usize) -> (String, String) {
    let allowed = format!(
        "at most {MAX_CONCAVE_CORNERS} corners where a face is concave; export the model as triangles"
    );
    (format!("a face of {corners} corners that cannot be divided"), allowed)
}

/// Polygons as their corners.
#[derive(Default)]
pub(super) struct Polygons {
    /// Of all, one after another.
    corners: Vec<u32>,
    /// For each, behind its last corner.
    ends: Vec<u32>,
}

impl Polygons {
    /// A corner of the polygon that is being told.
    pub(super) fn corner(&mut self, vertex: u32) {
        self.corners.push(vertex);
    }

    /// The polygon that was told is whole. It must have at least three corners.
    pub(super) fn close(&mut self) {
        self.ends.push(self.corners.len() as u32);
    }

    /// All of them as triangles; how many corners the first has that cannot be divided, and its number.
    pub(super) fn divide(&self, vertices: &[Vector3<f64>]) -> Result<Vec<[u32; 3]>, (usize, usize)> {
        let begins = std::iter::once(0).chain(self.ends.iter().map(|&end| end as usize));
        let all = begins.zip(&self.ends).map(|(begin, &end)| &self.corners[begin..end as usize]);
        let mut divider = Divider::new(vertices, all.clone());
        let (mut faces, mut divided) = (Vec::with_capacity(self.ends.len()), Vec::new());
        for (number, corners) in all.enumerate() {
            divided.clear();
            divider.divide(corners, &mut divided).ok_or((corners.len(), number))?;
            faces.extend(divided.iter().map(|face| face.map(|at| corners[at as usize])));
        }
        Ok(faces)
    }
}

/// Divides the polygons of a file, one after the other.
pub(super) struct Divider<'v> {
    vertices: &'v [Vector3<f64>],
    /// For each vertex the first one in the same place. Empty if there are triangles only.
    names: Vec<u32>,
    /// Edges and diagonals so far, by the names of their ends, the lower one first.
    taken: HashSet<[u32; 2]>,
}

impl<'v> Divider<'v> {
    /// For polygons that are given as their corners.
    pub(super) fn new<'c>(
        vertices: &'v [Vector3<f64>],
        polygons: impl Iterator<Item = &'c [u32]> + Clone,
    ) -> Self {
        let mut divider = Self { vertices, names: Vec::new(), taken: HashSet::new() };
        if polygons.clone().all(|corners| corners.len() == 3) {
            return divider;
        }
        let mut first = HashMap::with_capacity(vertices.len());
        let name = |(vertex, place): (usize, &Vector3<f64>)| {
            *first.entry([place.x, place.y, place.z].map(|x| (x + 0.0).to_bits())).or_insert(vertex as u32)
        };
        divider.names = vertices.iter().enumerate().map(name).collect();
        for corners in polygons {
            for (i, &from) in corners.iter().enumerate() {
                let edge = divider.ends(from, corners[(i + 1) % corners.len()]);
                divider.taken.insert(edge);
            }
        }
        divider
    }

    /// Appends the `corners.len() - 2` triangles of a polygon to `faces`, as numbers of its corners.
    ///
    /// `None` if it is concave and has too many corners. It must have at least three.
    pub(super) fn divide(&mut self, corners: &[u32], faces: &mut Vec<[u32; 3]>) -> Option<()> {
        let begin = faces.len();
        if corners.len() == 3 {
            faces.push([0, 1, 2]);
            return Some(());
        }
        let places: Vec<_> = corners.iter().map(|&corner| self.vertices[corner as usize]).collect();
        let outline = Outline { normal: newell(&places), places: &places };
        let is_free =
            |a: u32, b: u32| !self.taken.contains(&self.ends(corners[a as usize], corners[b as usize]));
        if outline.turns_one_way(0) {
            let is_good = |start: &usize| {
                outline.turns_one_way(*start) && outline.fan(*start).skip(1).all(|[a, b, _]| is_free(a, b))
            };
            faces.extend(outline.fan((0..places.len().min(MOST_FANS)).find(is_good).unwrap_or(0)));
        } else if corners.len() > MAX_CONCAVE_CORNERS {
            return None;
        } else if outline.cut_ears(is_free, faces).is_none() {
            faces.truncate(begin);
            faces.extend(outline.fan(0));
        }
        for [a, b, c] in &faces[begin..] {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                let edge = self.ends(corners[*a as usize], corners[*b as usize]);
                self.taken.insert(edge);
            }
        }
        Some(())
    }

    fn ends(&self, a: u32, b: u32) -> [u32; 2] {
        let [a, b] = [a, b].map(|vertex| self.names[vertex as usize]);
        [a.min(b), a.max(b)]
    }
}

/// Twice the area, along the normal of whatever plane it lies in.
fn newell(places: &[Vector3<f64>]) -> Vector3<f64> {
    let arms = places.windows(2).map(|pair| [pair[0] - places[0], pair[1] - places[0]]);
    arms.map(|[last, arm]| last.cross(&arm)).sum()
}

struct Outline<'p> {
    normal: Vector3<f64>,
    places: &'p [Vector3<f64>],
}

impl Outline<'_> {
    /// Above 0 if the triangle runs around like the polygon.
    fn turn(&self, [a, b, c]: [u32; 3]) -> f64 {
        let [a, b, c] = [a, b, c].map(|corner| self.places[corner as usize]);
        (b - a).cross(&(c - a)).dot(&self.normal)
    }

    /// The triangles around a corner, the one with the edge from there first.
    fn fan(&self, start: usize) -> impl Iterator<Item = [u32; 3]> {
        let count = self.places.len();
        let corner = move |i: usize| ((start + i) % count) as u32;
        (1..count - 1).map(move |i| [corner(0), corner(i), corner(i + 1)])
    }

    fn turns_one_way(&self, start: usize) -> bool {
        self.fan(start).all(|triangle| self.turn(triangle) >= 0.0)
    }

    /// `None` if it crosses itself. Diagonals that `is_free` are taken first.
    fn cut_ears(&self, is_free: impl Fn(u32, u32) -> bool, faces: &mut Vec<[u32; 3]>) -> Option<()> {
        let rounding = ROUNDING * self.normal.norm_squared();
        let mut left: Vec<u32> = (0..self.places.len() as u32).collect();
        let mut known = vec![Known::Nothing; left.len()];
        while left.len() > 3 {
            let around =
                |i: usize| [left[(i + left.len() - 1) % left.len()], left[i], left[(i + 1) % left.len()]];
            let mut ear = None;
            for i in 0..left.len() {
                let known = &mut known[left[i] as usize];
                if *known == Known::Nothing {
                    *known = self.look_at(around(i), &left, &is_free);
                }
                if *known == Known::FreeEar {
                    ear = Some(i);
                    break;
                }
                ear = ear.or((*known == Known::Ear).then_some(i));
            }
            // Corners on a straight line leave a triangle without an area, once no proper ear is there.
            let is_straight = |i: &usize| self.turn(around(*i)).abs() <= rounding;
            let ear = ear.or_else(|| (0..left.len()).find(is_straight))?;
            let triangle @ [before, corner, after] = around(ear);
            faces.push(triangle);
            left.remove(ear);
            [before, after].iter().for_each(|&neighbour| known[neighbour as usize] = Known::Nothing);
            let was_held = |known: &&mut Known| **known == Known::HeldBy(corner);
            known.iter_mut().filter(was_held).for_each(|known| *known = Known::Nothing);
        }
        // Where ears have more area than the polygon, the rest runs the other way: it crosses itself.
        let last = [left[0], left[1], left[2]];
        faces.push(last);
        (self.turn(last) >= -rounding).then_some(())
    }

    fn look_at(&self, triangle: [u32; 3], left: &[u32], is_free: impl Fn(u32, u32) -> bool) -> Known {
        if self.turn(triangle) <= 0.0 {
            return Known::NotConvex;
        }
        match self.first_within(triangle, left) {
            Some(corner) => Known::HeldBy(corner),
            None if is_free(triangle[0], triangle[2]) => Known::FreeEar,
            None => Known::Ear,
        }
    }

    /// The first other corner that lies in the triangle.
    fn first_within(&self, triangle @ [a, b, c]: [u32; 3], corners: &[u32]) -> Option<u32> {
        let is_corner = |p: u32| triangle.iter().any(|&t| self.places[t as usize] == self.places[p as usize]);
        let is_inside = |p: u32| [[a, b, p], [b, c, p], [c, a, p]].into_iter().all(|t| self.turn(t) >= 0.0);
        corners.iter().copied().find(|&p| is_inside(p) && !is_corner(p))
    }
}

/// Of a corner and its neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Known {
    Nothing,
    NotConvex,
    /// The triangle holds this corner, and is no ear while it is there.
    HeldBy(u32),
    /// An ear stays one while its neighbours do.
    Ear,
    /// Its diagonal is nobody else's.
    FreeEar,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of the polygon in the plane z = x, and the sum of their areas' sizes and of their signed areas.
    fn areas(outline: &[[f64; 2]]) -> Option<[f64; 2]> {
        let vertices: Vec<_> = outline.iter().map(|[x, y]| Vector3::new(*x, *y, *x)).collect();
        let corners: Vec<u32> = (0..vertices.len() as u32).collect();
        let mut faces = Vec::new();
        Divider::new(&vertices, std::iter::once(&corners[..])).divide(&corners, &mut faces)?;
        assert_eq!(faces.len(), outline.len() - 2);
        let area = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|corner| outline[corner as usize]);
            0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        };
        Some([faces.iter().map(|face| area(face).abs()).sum(), faces.iter().map(area).sum()])
    }

    #[test]
    fn a_concave_polygon_keeps_its_outline_wherever_it_begins() {
        // An L of three unit squares, and a comb with five teeth.
        let l = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        let mut comb = vec![[10.0, -1.0]];
        for tooth in (0..5).rev() {
            let x = 2.0 * f64::from(tooth);
            comb.extend([[x + 2.0, 0.0], [x + 1.0, 3.0], [x, 0.0]]);
        }
        comb.push([0.0, -1.0]);
        for (outline, area) in [(l, 3.0), (comb, 10.0 + 15.0)] {
            for start in 0..outline.len() {
                let mut turned = outline.clone();
                turned.rotate_left(start);
                // Small whole numbers: exact. Overlapping triangles would have more area in size than in sum.
                assert_eq!(areas(&turned), Some([area, area]), "from corner {start}");
            }
        }
    }

    /// Ears by their definition, looked for anew after each cut.
    fn plainly_cut(outline: &Outline, is_free: impl Fn(u32, u32) -> bool) -> Vec<[u32; 3]> {
        let mut left: Vec<u32> = (0..outline.places.len() as u32).collect();
        let mut faces = Vec::new();
        while left.len() > 3 {
            let around =
                |i: usize| [left[(i + left.len() - 1) % left.len()], left[i], left[(i + 1) % left.len()]];
            let is_ear =
                |i: usize| outline.turn(around(i)) > 0.0 && outline.first_within(around(i), &left).is_none();
            let ears: Vec<usize> = (0..left.len()).filter(|&i| is_ear(i)).collect();
            let free = ears.iter().find(|&&i| is_free(around(i)[0], around(i)[2]));
            let rounding = ROUNDING * outline.normal.norm_squared();
            let straight = (0..left.len()).find(|&i| outline.turn(around(i)).abs() <= rounding);
            let Some(ear) = free.or(ears.first()).copied().or(straight) else { return faces };
            faces.push(around(ear));
            left.remove(ear);
        }
        faces.push([left[0], left[1], left[2]]);
        faces
    }

    #[test]
    fn ears_are_those_of_the_definition_whatever_was_known_before() {
        let mut state = 5_u64;
        let mut next = |below: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % below
        };
        let mut concave = 0;
        for round in 0..600 {
            let count = 4 + next(40);
            // Stars about a middle, which do not cross themselves, and any; on a grid, so that many corners stand on lines.
            let place = |i: u64| {
                let (sin, cos) = (i as f64 * std::f64::consts::TAU / count as f64).sin_cos();
                let radius = 1.0 + next(6) as f64;
                let any = [next(7) as f64, next(7) as f64];
                if round % 3 == 0 {
                    any
                } else {
                    [(radius * cos * 8.0).round(), (radius * sin * 8.0).round()]
                }
            };
            let places: Vec<_> = (0..count).map(place).map(|[x, y]| Vector3::new(x, y, 0.0)).collect();
            let outline = Outline { normal: newell(&places), places: &places };
            let is_free = |a: u32, b: u32| !(a + b).is_multiple_of(3);
            let mut faces = Vec::new();
            outline.cut_ears(is_free, &mut faces);
            assert_eq!(faces, plainly_cut(&outline, is_free), "{places:?}");
            concave += u32::from(!outline.turns_one_way(0) && faces.len() as u64 == count - 2);
        }
        assert!(concave > 300, "{concave}");
    }

    #[test]
    fn corners_on_a_straight_line_do_no_harm() {
        let square = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 2.0], [0.0, 2.0]];
        for start in 0..square.len() {
            let mut turned = square;
            turned.rotate_left(start);
            assert_eq!(areas(&turned), Some([4.0, 4.0]));
        }
        assert_eq!(areas(&[[1.0, 1.0]; 5]), Some([0.0, 0.0]), "all of it in one place");
    }

    #[test]
    fn a_polygon_that_crosses_itself_keeps_its_edges() {
        // A pentagram turns twice around its middle; a bow tie has two halves that turn against each other.
        let star: Vec<[f64; 2]> =
            (0..5).map(|i| (f64::from(2 * i) * std::f64::consts::TAU / 5.0).sin_cos().into()).collect();
        let bow_tie = vec![[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        for outline in [star, bow_tie] {
            let [_, sum] = areas(&outline).expect("a fan");
            let twice_area = |i: usize| {
                let [a, b] = [outline[i], outline[(i + 1) % outline.len()]];
                a[0] * b[1] - a[1] * b[0]
            };
            let whole: f64 = 0.5 * (0..outline.len()).map(twice_area).sum::<f64>();
            // The sum of signed areas is that of the closed line, up to rounding.
            assert!((sum - whole).abs() < 1e-15, "{sum} {whole}");
        }
    }

    /// How many triangles have each edge.
    fn edges(faces: &[[u32; 3]]) -> HashMap<[u32; 2], usize> {
        let mut edges = HashMap::new();
        for [a, b, c] in faces {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                *edges.entry([*a.min(b), *a.max(b)]).or_insert(0) += 1;
            }
        }
        edges
    }

    #[test]
    fn polygons_that_share_two_edges_are_not_cut_along_the_same_line() {
        // A pillow of two quads: every vertex has two. And one of two hexagons.
        for count in [4, 5, 6, 9] {
            let corner = |i: usize| (i as f64 * std::f64::consts::TAU / count as f64).sin_cos();
            let vertices: Vec<_> =
                (0..count).map(|i| Vector3::new(corner(i).0, corner(i).1, 0.3 * (i % 2) as f64)).collect();
            let front: Vec<u32> = (0..count as u32).collect();
            for start in 0..count {
                let mut back: Vec<u32> = front.iter().rev().copied().collect();
                back.rotate_left(start);
                let both = [front.clone(), back];
                let mut divider = Divider::new(&vertices, both.iter().map(Vec::as_slice));
                let mut faces = Vec::new();
                for polygon in &both {
                    let mut divided = Vec::new();
                    divider.divide(polygon, &mut divided).unwrap();
                    faces.extend(divided.iter().map(|face| face.map(|number| polygon[number as usize])));
                }
                assert_eq!(faces.len(), 2 * (count - 2));
                assert!(edges(&faces).values().all(|&faces| faces == 2), "{count} from {start}: {faces:?}");
            }
        }
    }

    #[test]
    fn no_polygon_is_cut_along_an_edge_of_another_also_where_vertices_are_repeated() {
        // A roof of two quads over a beam; below the beam's ends a triangle has the line from corner 0 to corner 2 for an edge.
        let place = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
        let mut vertices =
            vec![place(0.0, 0.0, 0.0), place(1.0, 0.0, 0.2), place(1.0, 1.0, 0.0), place(0.0, 1.0, 0.2)];
        vertices.extend([vertices[0], vertices[2], place(0.5, 0.5, -1.0)]);
        let polygons: [&[u32]; 2] = [&[0, 1, 2, 3], &[4, 5, 6]];
        let mut divided = Vec::new();
        Divider::new(&vertices, polygons.into_iter()).divide(polygons[0], &mut divided).unwrap();
        assert_eq!(edges(&divided)[&[1, 3]], 2, "{divided:?}");
    }

    #[test]
    fn a_convex_polygon_may_have_any_number_of_corners_and_a_concave_one_not() {
        let corner = |i: usize, n: usize| (i as f64 * std::f64::consts::TAU / n as f64).sin_cos();
        let mut disc: Vec<[f64; 2]> = (0..2000).rev().map(|i| corner(i, 2000).into()).collect();
        let [size, sum] = areas(&disc).expect("a disc");
        // Two thousand areas of a unit disc, each rounded.
        assert!((size - sum).abs() < 1e-12 && (sum - std::f64::consts::PI).abs() < 1e-4);
        disc[7] = [0.0, 0.0];
        assert_eq!(areas(&disc), None);
    }
}
