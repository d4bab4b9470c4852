//! Closed surfaces that are turned inside out somewhere, as a loop in an eight is.
//!
//! Problem: where a surface passes through itself so that the winding number is negative, its outer side looks into a pocket. A
//! point comes into it from behind, unfelt, and cannot get out again; a ball meets the surface from either side. Where faces
//! with a common vertex pass through each other, a walk takes them for neighbours, and goes on below one of them.
//!
//! Model: a pocket is bounded by lines in which faces cross. In front of both faces at such a line, the winding number is asked
//! for. Where limbs only go into each other it is never negative, and walks try them
//! ([`crossed`](super::crossed)).
//!
//! In doubt a surface is inverted: points roll over it, as balls do that nobody tells from points.
//! Cost: linear for fans ([`fan_crossing`](super::fan_crossing)); of faces that cross, which are known by now and few, about
//! linear in them, with a ray for each pair, at most [`MOST_RAYS`].

use nalgebra::Vector3;

use super::crossed::MOST_PAIRS;
use super::winding::Parts;
use super::{Bvh, Face, Mesh};

impl Mesh {
    /// True if points must roll, since walks come below faces or into pockets. Closed parts are turned outward by now; without
    /// cavities, different ones together are never inverted.
    pub(super) fn is_inverted(&self, parts: &Parts, has_cavities: bool) -> bool {
        self.has_crossed_fan() || self.has_pocket(parts, has_cavities)
    }

    /// True if it is inverted in front of faces of solids that cross and have no common vertex.
    fn has_pocket(&self, parts: &Parts, has_cavities: bool) -> bool {
        let (numbers, crossed): (Vec<usize>, Vec<Face>) = self
            .faces
            .iter()
            .enumerate()
            .filter(|(_, face)| face.is_crossed)
            .map(|(i, face)| (i, *face))
            .unzip();
        if crossed.is_empty() {
            return false;
        }
        let mut rays = MOST_RAYS;
        let mut left = MOST_PAIRS.saturating_mul(self.faces.len());
        let bvh: Bvh = Bvh::build(&crossed, &self.vertices);
        let is_clear = bvh.for_each_pair(0.0, |i, j| {
            left -= 1;
            let [one, other] = [i, j].map(|face| parts.of(numbers[face as usize]));
            let pair = [i, j].map(|face| &crossed[face as usize]);
            let have_common = || pair[0].vertices.iter().any(|vertex| pair[1].vertices.contains(vertex));
            if (one == other || has_cavities)
                && !have_common()
                && let Some(middle_B) = self.crossing(pair)
            {
                rays -= 1;
                if rays == 0 || self.is_negative_at(pair, &middle_B) {
                    return false;
                }
            }
            left > 0
        });
        !is_clear
    }

    /// True if it is inverted in front of two faces that cross there.
    fn is_negative_at(&self, pair: [&Face; 2], at_B: &Vector3<f64>) -> bool {
        let ahead_B = (pair[0].normal_B + pair[1].normal_B).normalize();
        let ahead_B = at_B + ahead_B * (AHEAD * self.extent_m);
        let number = self.bvh.winding_number(self.triangles(), &ahead_B, usize::MAX);
        number.is_some_and(|number| number < 0)
    }

    /// Middle of the line in which two faces cross, if it has a length.
    pub(super) fn crossing(&self, pair: [&Face; 2]) -> Option<Vector3<f64>> {
        let [one, other] = pair.map(|face| self.triangles().corners(face));
        let origin = one[0];
        let cut = |of: &[Vector3<f64>; 3], by: &Face, corner: &Vector3<f64>| {
            let heights = of.map(|at| by.normal_B.dot(&(at - corner)));
            let on_m = ON * self.extent_m;
            let heights = heights.map(|height| if height.abs() < on_m { 0.0 } else { height });
            cut_by_plane(of, heights)
        };
        // Of most pairs one lies on one side of the other.
        let ends = [cut(&other, pair[0], &origin)?, cut(&one, pair[1], &other[0])?];
        let line_B = pair[0].normal_B.cross(&pair[1].normal_B);
        let line_B = line_B.try_normalize(PARALLEL)?;
        let along = ends.map(|ends| ends.map(|end| line_B.dot(&(end - origin))));
        let [[a, b], [c, d]] = along.map(|[from, to]| [from.min(to), from.max(to)]);
        let (from, to) = (a.max(c), b.min(d));
        let start_B = ends[0][0];
        (to - from > LONG * self.extent_m)
            .then(|| start_B + line_B * (0.5 * (from + to) - line_B.dot(&(start_B - origin))))
    }
}

/// Ends of the line in which a plane cuts a triangle, of which these are the corners' heights above it.
fn cut_by_plane(corners: &[Vector3<f64>; 3], heights: [f64; 3]) -> Option<[Vector3<f64>; 2]> {
    let (mut ends, mut count) = ([Vector3::zeros(); 2], 0);
    for corner in 0..3 {
        let next = (corner + 1) % 3;
        let found = match (heights[corner], heights[next]) {
            (0.0, _) => Some(corners[corner]),
            (here, there) if here * there < 0.0 => {
                Some(corners[corner] + (corners[next] - corners[corner]) * (here / (here - there)))
            }
            _ => None,
        };
        if let Some(end) = found {
            // All three lie in it only where the faces are as one.
            *ends.get_mut(count)? = end;
            count += 1;
        }
    }
    (count == 2).then_some(ends)
}

/// Crossing pairs of which the winding number is asked for.
const MOST_RAYS: usize = 50_000;
/// Of the extent: so far before the faces; a thousand times what a ray's answer is rounded by.
const AHEAD: f64 = 1e-8;
/// Of the extent: nearer to a plane is in it.
const ON: f64 = 1e-13;
/// Of the extent: shorter lines are points.
const LONG: f64 = 1e-6;
/// Sine of the angle below which faces that cross are as one.
const PARALLEL: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;
    use crate::mesh::{TriangleSoup, make};

    impl Mesh {
        /// Each pair of faces whose boxes overlap, one after the other.
        fn is_inverted_pair_by_pair(&self, parts: &Parts, has_cavities: bool) -> bool {
            let mut is_inverted = false;
            self.bvh.for_each_pair(0.0, |i, j| {
                let pair = [i, j].map(|face| &self.faces[face as usize]);
                let common =
                    pair[0].vertices.iter().filter(|vertex| pair[1].vertices.contains(vertex)).count();
                let is_one = || parts.of(i as usize) == parts.of(j as usize);
                let may_be = match common {
                    0 => pair.iter().all(|face| face.is_crossed) && (is_one() || has_cavities),
                    1 => true,
                    _ => false,
                };
                if may_be && let Some(middle_B) = self.crossing(pair) {
                    is_inverted = common == 1 || self.is_negative_at(pair, &middle_B);
                }
                !is_inverted
            });
            is_inverted
        }
    }

    struct Random(u64);

    impl Random {
        fn between(&mut self, low: f64, high: f64) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            low + (high - low) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
        }

        fn vector(&mut self, size: f64) -> Vector3<f64> {
            Vector3::from_fn(|_, _| self.between(-size, size))
        }
    }

    fn moved(mut soup: TriangleSoup, by_m: f64, random: &mut Random) -> TriangleSoup {
        soup.vertices.iter_mut().for_each(|vertex| *vertex += random.vector(by_m));
        soup
    }

    fn heap(random: &mut Random, parts: usize) -> TriangleSoup {
        let mut all = TriangleSoup::default();
        for part in 0..parts {
            let [size, other] = [random.between(0.01, 0.06), random.between(0.01, 0.06)];
            let part = match part % 3 {
                0 => make::cuboid([size, other, 0.03]),
                1 => make::uv_sphere(12, 7, size),
                _ => make::torus(12, 9, size + other, other),
            };
            let (turn, at) = (Rotation3::new(random.vector(1.0)), random.vector(0.05));
            let first = all.vertices.len() as u32;
            all.vertices.extend(part.vertices.iter().map(|vertex| turn * vertex + at));
            all.faces.extend(part.faces.iter().map(|face| face.map(|vertex| vertex + first)));
        }
        all
    }

    /// As programs for design write them: both caps cut into fans from a vertex of the rim.
    #[test]
    fn a_cylinder_of_thousands_of_sides_is_not_inverted_however_its_caps_are_cut() {
        const SIDES: u32 = 6000;
        let rim = |i: u32, y: f64| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(SIDES)).sin_cos();
            Vector3::new(0.05 * cos, y, 0.05 * sin)
        };
        let vertices = [-0.05, 0.05].into_iter().flat_map(|y| (0..SIDES).map(move |i| rim(i, y))).collect();
        let mut faces = Vec::new();
        for i in 0..SIDES {
            let next = (i + 1) % SIDES;
            faces.extend([[i, i + SIDES, next], [next, i + SIDES, next + SIDES]]);
            if i > 0 && next > 0 {
                faces.extend([[0, i, next], [SIDES, next + SIDES, i + SIDES]]);
            }
        }
        let (mesh, _) = Mesh::build(TriangleSoup { vertices, faces }).unwrap();
        assert!(!mesh.has_crossed_fan());
    }

    #[test]
    fn the_answer_is_that_of_looking_at_each_pair() {
        let (mut yes, mut no) = (0, 0);
        for seed in 0..if cfg!(debug_assertions) { 60 } else { 600 } {
            let mut random = Random(seed);
            let edge_m = 0.05 * std::f64::consts::TAU / 24.0;
            let share = 10f64.powf(random.between(-1.5, 0.3));
            let soup = match seed % 6 {
                0 => moved(make::uv_sphere(24, 13, 0.05), share * edge_m, &mut random),
                1 => moved(make::torus(24, 12, 0.05, 0.02), 0.5 * share * edge_m, &mut random),
                2 => heap(&mut random, 8),
                // Spindles pass through themselves, inside out.
                3 => make::torus(24, 12, random.between(0.01, 0.05), random.between(0.01, 0.05)),
                4 => moved(make::mobius_strip(24, 4, 0.05, 0.02), share * 2e-3, &mut random),
                _ => {
                    let mut soup = moved(make::uv_sphere(24, 13, 0.05), share * edge_m, &mut random);
                    for _ in 0..20 {
                        let at = random.between(0.0, soup.faces.len() as f64) as usize;
                        soup.faces.swap_remove(at);
                    }
                    soup
                }
            };
            let (mesh, report) = Mesh::build(soup).unwrap();
            let parts = Parts::of_faces(&mesh.faces);
            let slow = mesh.is_inverted_pair_by_pair(&parts, report.cavities.count > 0);
            assert_eq!(mesh.is_inverted(&parts, report.cavities.count > 0), slow, "{seed}");
            *(if slow { &mut yes } else { &mut no }) += 1;
        }
        assert!(yes > 10 && no > 10, "{yes} {no}");
    }

    /// Both are measured in one program, in turns: what else the machine does slows both down.
    #[test]
    #[cfg(not(debug_assertions))]
    fn it_takes_a_tenth_of_loading_at_most() {
        let soup = make::bumpy_sphere(400, 200, 0.1);
        let mut least = [std::time::Duration::MAX; 2];
        for _ in 0..5 {
            let copy = soup.clone();
            let begin = std::time::Instant::now();
            let (mesh, _) = Mesh::build(copy).unwrap();
            least[0] = least[0].min(begin.elapsed());
            let parts = Parts::of_faces(&mesh.faces);
            let begin = std::time::Instant::now();
            assert!(!mesh.is_inverted(&parts, false));
            least[1] = least[1].min(begin.elapsed());
        }
        assert!(least[1] * 10 < least[0], "{least:?}");
    }
}
