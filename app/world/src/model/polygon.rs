//! Divides polygons into triangles.
//!
//! Model: a polygon whose fan around its first corner turns the same way throughout is divided into that fan; any other
//! by cutting ears off (G. H. Meisters, *Polygons have ears*, 1975), so that concave ones keep their outline.
//!
//! The turning sense is measured about the polygon's own normal (Newell), so nothing depends on its plane.
//! Cost: linear for the fan, cubic at worst for ears, hence [`MAX_CONCAVE_CORNERS`].

use nalgebra::Vector3;

/// Concave polygons may have so many corners.
pub(super) const MAX_CONCAVE_CORNERS: usize = 500;

/// Of the polygon's area: a part of it that small is none.
const ROUNDING: f64 = 1e-12;

/// Appends the `corners.len() - 2` triangles of a polygon to `faces`.
///
/// `None` if it crosses itself, or is concave and has too many corners. It must have at least three.
pub(super) fn triangulate(
    corners: &[u32],
    vertices: &[Vector3<f64>],
    faces: &mut Vec<[u32; 3]>,
) -> Option<()> {
    if let &[a, b, c] = corners {
        faces.push([a, b, c]);
        return Some(());
    }
    let place = |corner: u32| vertices[corner as usize];
    let outline = Outline { normal: newell(corners.iter().map(|&corner| place(corner))), vertices };
    let fan = || corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]]);
    if fan().all(|triangle| outline.turn(triangle) >= 0.0) {
        faces.extend(fan());
        return Some(());
    }
    (corners.len() <= MAX_CONCAVE_CORNERS).then(|| outline.cut_ears(corners, faces)).flatten()
}

/// Twice the area, along the normal of whatever plane it lies in.
fn newell(mut places: impl Iterator<Item = Vector3<f64>>) -> Vector3<f64> {
    let Some(first) = places.next() else { return Vector3::zeros() };
    let (mut normal, mut last) = (Vector3::zeros(), Vector3::zeros());
    for place in places {
        let arm = place - first;
        normal += last.cross(&arm);
        last = arm;
    }
    normal
}

struct Outline<'v> {
    normal: Vector3<f64>,
    vertices: &'v [Vector3<f64>],
}

impl Outline<'_> {
    /// Above 0 if the triangle runs around like the polygon.
    fn turn(&self, [a, b, c]: [u32; 3]) -> f64 {
        let [a, b, c] = [a, b, c].map(|corner| self.vertices[corner as usize]);
        (b - a).cross(&(c - a)).dot(&self.normal)
    }

    fn cut_ears(&self, corners: &[u32], faces: &mut Vec<[u32; 3]>) -> Option<()> {
        let rounding = ROUNDING * self.normal.norm_squared();
        let mut left = corners.to_vec();
        while left.len() > 3 {
            let around =
                |i: usize| [left[(i + left.len() - 1) % left.len()], left[i], left[(i + 1) % left.len()]];
            // Corners on a straight line leave a triangle without an area, once no proper ear is there.
            let ear = (0..left.len())
                .find(|&i| self.turn(around(i)) > 0.0 && self.is_empty(around(i), &left))
                .or_else(|| (0..left.len()).find(|&i| self.turn(around(i)).abs() <= rounding))?;
            faces.push(around(ear));
            left.remove(ear);
        }
        // Where ears have more area than the polygon, the rest runs the other way: it crosses itself.
        let last = [left[0], left[1], left[2]];
        faces.push(last);
        (self.turn(last) >= -rounding).then_some(())
    }

    /// Whether no other corner lies in the triangle.
    fn is_empty(&self, triangle @ [a, b, c]: [u32; 3], corners: &[u32]) -> bool {
        let is_corner =
            |p: u32| triangle.iter().any(|&t| self.vertices[t as usize] == self.vertices[p as usize]);
        let is_inside = |p: u32| [[a, b, p], [b, c, p], [c, a, p]].into_iter().all(|t| self.turn(t) >= 0.0);
        !corners.iter().any(|&p| !is_corner(p) && is_inside(p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of the polygon in the plane z = x, and the sum of their areas' sizes and of their signed areas.
    fn areas(outline: &[[f64; 2]]) -> Option<[f64; 2]> {
        let vertices: Vec<_> = outline.iter().map(|[x, y]| Vector3::new(*x, *y, *x)).collect();
        let corners: Vec<u32> = (0..vertices.len() as u32).collect();
        let mut faces = Vec::new();
        triangulate(&corners, &vertices, &mut faces)?;
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
    fn a_polygon_that_crosses_itself_is_refused() {
        // A pentagram turns twice around its middle.
        let star: Vec<[f64; 2]> =
            (0..5).map(|i| (f64::from(2 * i) * std::f64::consts::TAU / 5.0).sin_cos().into()).collect();
        assert_eq!(areas(&star), None);
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
