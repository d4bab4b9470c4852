//! The point of a cell between planes that is nearest to a HIP.
//!
//! Model: the planes meet in the origin. The nearest point of a cell is the HIP itself, its foot on a plane, its foot on the
//! edge of two, or the origin: the nearest of those that are not behind any plane. Which side of a plane is the cell's does
//! not move a foot, so that all cells of a corner choose among the same [`Feet`].
//!
//! Frames and signs: object frame B, the corner as origin. A cell has a bit for each plane, set behind it; so has a mask of the
//! planes that a point lies on.

use nalgebra::Vector3;

/// Of a cell, the point nearest to the HIP.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearest {
    pub(super) distance_m2: f64,
    pub(super) way_B: Vector3<f64>,
    /// The planes that it lies on.
    pub(super) mask: usize,
}

/// A HIP's feet on planes through the origin, and on their edges: `EDGES` is `PLANES (PLANES - 1) / 2`.
pub(super) struct Feet<const PLANES: usize, const EDGES: usize> {
    to_hip_B: Vector3<f64>,
    distance_m2: f64,
    slack_m: f64,
    /// Of the HIP over the planes.
    heights_m: [f64; PLANES],
    on_planes: [Foot<PLANES>; PLANES],
    /// Of planes 1 and 0, 2 and 0, 2 and 1.
    on_edges: [Foot<PLANES>; EDGES],
}

#[derive(Clone, Copy)]
struct Foot<const PLANES: usize> {
    at: Nearest,
    /// Over the planes that it does not lie on.
    heights_m: [f64; PLANES],
}

impl<const PLANES: usize, const EDGES: usize> Feet<PLANES, EDGES> {
    #[inline(always)]
    pub(super) fn of(normals_B: &[Vector3<f64>; PLANES], to_hip_B: &Vector3<f64>) -> Self {
        let heights_m = normals_B.map(|normal_B| normal_B.dot(to_hip_B));
        let distance_m2 = to_hip_B.norm_squared();
        let on_planes = std::array::from_fn(|i| Foot::on_plane(normals_B, &heights_m, i, to_hip_B));
        let mut on_edges = [Foot::NOWHERE; EDGES];
        for i in 0..PLANES {
            for j in 0..i {
                on_edges[i * (i - 1) / 2 + j] = Foot::on_edge(normals_B, i, j, to_hip_B);
            }
        }
        let slack_m = SLACK * distance_m2.sqrt();
        Self { to_hip_B: *to_hip_B, distance_m2, slack_m, heights_m, on_planes, on_edges }
    }

    #[inline(always)]
    pub(super) fn nearest(&self, cell: usize) -> Nearest {
        let before = |heights_m: &[f64; PLANES], k: usize| {
            if cell >> k & 1 == 1 { -heights_m[k] } else { heights_m[k] }
        };
        if (0..PLANES).all(|k| before(&self.heights_m, k) >= 0.0) {
            return Nearest { distance_m2: 0.0, way_B: self.to_hip_B, mask: 0 };
        }
        let tip = Nearest { distance_m2: self.distance_m2, way_B: Vector3::zeros(), mask: (1 << PLANES) - 1 };
        let mut best = tip;
        let mut offer = |foot: &Foot<PLANES>| {
            let is_in = |k: usize| foot.at.mask >> k & 1 == 1 || before(&foot.heights_m, k) >= -self.slack_m;
            if foot.at.distance_m2 < best.distance_m2 && (0..PLANES).all(is_in) {
                best = foot.at;
            }
        };
        for i in 0..PLANES {
            if before(&self.heights_m, i) < 0.0 {
                offer(&self.on_planes[i]);
            }
            (0..i).for_each(|j| offer(&self.on_edges[i * (i - 1) / 2 + j]));
        }
        best
    }
}

impl<const PLANES: usize> Foot<PLANES> {
    const NOWHERE: Self = {
        let at = Nearest { distance_m2: f64::INFINITY, way_B: Vector3::new(0.0, 0.0, 0.0), mask: 0 };
        Self { at, heights_m: [0.0; PLANES] }
    };

    #[inline(always)]
    fn on_plane(
        normals_B: &[Vector3<f64>; PLANES],
        heights_m: &[f64; PLANES],
        i: usize,
        to_hip_B: &Vector3<f64>,
    ) -> Self {
        let height_m = heights_m[i];
        let way_B = to_hip_B - normals_B[i] * height_m;
        let at = Nearest { distance_m2: height_m * height_m, way_B, mask: 1 << i };
        let over = |k: usize| heights_m[k] - normals_B[i].dot(&normals_B[k]) * height_m;
        Self { at, heights_m: std::array::from_fn(over) }
    }

    #[inline(always)]
    fn on_edge(normals_B: &[Vector3<f64>; PLANES], i: usize, j: usize, to_hip_B: &Vector3<f64>) -> Self {
        let along_B = normals_B[i].cross(&normals_B[j]);
        let length2 = along_B.norm_squared();
        if length2 <= SLIT * SLIT {
            return Self::NOWHERE;
        }
        let way_B = along_B * (along_B.dot(to_hip_B) / length2);
        let at = Nearest { distance_m2: (way_B - to_hip_B).norm_squared(), way_B, mask: 1 << i | 1 << j };
        Self { at, heights_m: std::array::from_fn(|k| normals_B[k].dot(&way_B)) }
    }
}

/// The same in front of any number of planes: what a single cell of more than three chooses.
pub(super) fn nearest_before(normals_B: &[Vector3<f64>], to_hip_B: &Vector3<f64>) -> Nearest {
    let slack_m = SLACK * to_hip_B.norm();
    let is_in = |p: &Vector3<f64>, mask: usize| {
        (0..normals_B.len()).all(|k| mask >> k & 1 == 1 || normals_B[k].dot(p) >= -slack_m)
    };
    if normals_B.iter().all(|normal_B| normal_B.dot(to_hip_B) >= 0.0) {
        return Nearest { distance_m2: 0.0, way_B: *to_hip_B, mask: 0 };
    }
    // At the tip, if nowhere else.
    let (distance_m2, mask) = (to_hip_B.norm_squared(), (1 << normals_B.len()) - 1);
    let mut best = Nearest { distance_m2, way_B: Vector3::zeros(), mask };
    let mut offer = |way_B: Vector3<f64>, mask: usize| {
        let distance_m2 = (way_B - to_hip_B).norm_squared();
        if distance_m2 < best.distance_m2 && is_in(&way_B, mask) {
            best = Nearest { distance_m2, way_B, mask };
        }
    };
    for i in 0..normals_B.len() {
        let height_m = normals_B[i].dot(to_hip_B);
        if height_m < 0.0 {
            offer(to_hip_B - normals_B[i] * height_m, 1 << i);
        }
        for j in 0..i {
            let along_B = normals_B[i].cross(&normals_B[j]);
            let length_squared = along_B.norm_squared();
            if length_squared > SLIT * SLIT {
                offer(along_B * (along_B.dot(to_hip_B) / length_squared), 1 << i | 1 << j);
            }
        }
    }
    best
}

/// Whether in front of two planes the nearest point lies on both: the HIP is behind one at least, and its foot on that one is
/// not in front of the other.
#[inline(always)]
pub(super) fn only_both_hold([a_B, b_B]: &[Vector3<f64>; 2], to_hip_B: &Vector3<f64>) -> bool {
    let (a_m, b_m, cosine) = (a_B.dot(to_hip_B), b_B.dot(to_hip_B), a_B.dot(b_B));
    let slack_m = SLACK * to_hip_B.norm();
    let one_holds = |height_m: f64, other_m: f64| height_m < 0.0 && other_m - cosine * height_m >= -slack_m;
    a_m.min(b_m) < 0.0 && !one_holds(a_m, b_m) && !one_holds(b_m, a_m)
}

/// Planes closer to parallel than this (rad) are one, or leave a slit between them through which nothing goes.
pub(super) const SLIT: f64 = 1e-6;
/// Points may miss a plane by this share of their distance.
const SLACK: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;

    fn spread(i: u32) -> Vector3<f64> {
        let along = |step: f64| 2.0 * (f64::from(i) * step).fract() - 1.0;
        Vector3::new(along(0.618_034), along(0.414_214), along(0.732_051))
    }

    /// All cells of two and three planes, beside the same planes turned one cell after the other.
    #[test]
    fn all_cells_of_a_corner_choose_among_the_same_feet() {
        let mut on = [0; 4];
        for i in 0..2000 {
            let normals_B = [1, 2, 3].map(|n| spread(5 * i + n).normalize());
            let to_hip_B = spread(7 * i + 3);
            let two = Feet::<2, 1>::of(&[normals_B[0], normals_B[1]], &to_hip_B);
            let three = Feet::<3, 3>::of(&normals_B, &to_hip_B);
            for cell in 0..8 {
                let turned: [_; 3] =
                    std::array::from_fn(|k| if cell >> k & 1 == 1 { -normals_B[k] } else { normals_B[k] });
                let mut beside = vec![(three.nearest(cell), nearest_before(&turned, &to_hip_B))];
                if cell < 4 {
                    beside.push((two.nearest(cell), nearest_before(&turned[..2], &to_hip_B)));
                    let is_edge = only_both_hold(&[turned[0], turned[1]], &to_hip_B);
                    assert_eq!(is_edge, beside[1].1.mask == 0b11, "{i} {cell}");
                }
                for (found, expected) in beside {
                    assert_eq!(found.mask, expected.mask, "{i} {cell}");
                    // A few roundings of points within two, over the sine of planes that are hardly parallel.
                    assert!((found.way_B - expected.way_B).norm() < 1e-12, "{i} {cell}");
                    assert!((found.distance_m2 - expected.distance_m2).abs() < 1e-12, "{i} {cell}");
                    on[found.mask.count_ones() as usize] += 1;
                }
            }
        }
        assert!(on.iter().all(|&count| count > 500), "{on:?}");
    }
}
