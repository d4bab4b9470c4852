//! Flat pieces of a surface, and how a level cuts them in two.

use nalgebra::Vector3;

/// A flat convex piece of a surface.
#[derive(Debug, Clone)]
pub(super) struct Polygon {
    pub(super) corners: Vec<Corner>,
}

/// A corner, and the edge that begins there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    pub(super) place: Vector3<f64>,
    /// The patch that the edge was cut along, or [`UNCUT`].
    pub(super) cut: u16,
}

/// An edge that nothing was cut along.
pub(super) const UNCUT: u16 = u16::MAX;

impl Polygon {
    pub(super) fn new(places: impl IntoIterator<Item = Vector3<f64>>) -> Self {
        Self { corners: places.into_iter().map(|place| Corner { place, cut: UNCUT }).collect() }
    }

    pub(super) fn middle(&self) -> Vector3<f64> {
        self.corners.iter().map(|corner| corner.place).sum::<Vector3<f64>>() / self.corners.len() as f64
    }

    /// The longest way between two corners.
    pub(super) fn longest(&self) -> Vector3<f64> {
        let mut longest = Vector3::zeros();
        for (k, a) in self.corners.iter().enumerate() {
            for b in &self.corners[..k] {
                let way = a.place - b.place;
                if way.norm_squared() > longest.norm_squared() {
                    longest = way;
                }
            }
        }
        longest
    }

    /// Twice the area, along the normal around which the corners go counter-clockwise.
    pub(super) fn area(&self) -> Vector3<f64> {
        let first = self.corners[0].place;
        let fan = self.corners.windows(2).skip(1);
        fan.map(|pair| (pair[0].place - first).cross(&(pair[1].place - first))).sum()
    }

    /// Two pieces, divided across its longest way.
    pub(super) fn halves(&self) -> [Option<Self>; 2] {
        let (middle, across) = (self.middle(), self.longest());
        let level = |place: &Vector3<f64>| across.dot(&(place - middle));
        self.split(&level, 0.0, UNCUT)
    }

    /// Parts below a level and above it; corners nearer to it than `on` belong to both.
    pub(super) fn split(
        &self,
        level: &impl Fn(&Vector3<f64>) -> f64,
        on: f64,
        cut: u16,
    ) -> [Option<Self>; 2] {
        let levels: Vec<f64> = self
            .corners
            .iter()
            .map(|corner| Some(level(&corner.place)).filter(|level| level.abs() > on).unwrap_or(0.0))
            .collect();
        let mut sides = [Vec::new(), Vec::new()];
        for (k, &corner) in self.corners.iter().enumerate() {
            let next = (k + 1) % self.corners.len();
            let (here, there) = (levels[k], levels[next]);
            let crossing = || {
                let place = crossing(level, on, [(corner.place, here), (self.corners[next].place, there)]);
                Corner { place, cut: corner.cut }
            };
            for (side, sign) in sides.iter_mut().zip([-1.0, 1.0]) {
                let (is_here, is_there) = (sign * here >= 0.0, sign * there >= 0.0);
                let is_along = here == 0.0 && there == 0.0 && corner.cut == UNCUT;
                match (is_here, is_there) {
                    (true, true) if is_along => side.push(Corner { cut, ..corner }),
                    (true, true) => side.push(corner),
                    // From a corner that is on it the edge goes along the level.
                    (true, false) if here == 0.0 => side.push(Corner { cut, ..corner }),
                    (true, false) => side.extend([corner, Corner { cut, ..crossing() }]),
                    (false, true) if there != 0.0 => side.push(crossing()),
                    (false, _) => {}
                }
            }
        }
        sides.map(|corners| (corners.len() > 2).then_some(Self { corners }))
    }
}

/// Place at which a level is zero between two places on different sides of it; the same to the bit from either end.
fn crossing(level: &impl Fn(&Vector3<f64>) -> f64, on: f64, ends: [(Vector3<f64>, f64); 2]) -> Vector3<f64> {
    let [(mut below, mut low), (mut above, mut high)] =
        if ends[0].1 < ends[1].1 { ends } else { [ends[1], ends[0]] };
    let resolution = (NEAR * on).max(f64::EPSILON * (high - low));
    for _ in 0..MOST_STEPS {
        // Regula falsi, in which the end that stays counts half the second time (Illinois).
        let place = below + (above - below) * (low / (low - high));
        let here = level(&place);
        if here.abs() <= resolution {
            return place;
        }
        if here < 0.0 {
            (below, low) = (place, here);
            high *= 0.5;
        } else {
            (above, high) = (place, here);
            low *= 0.5;
        }
    }
    below + (above - below) * (low / (low - high))
}

/// Of what belongs to both sides: that near to zero is zero.
const NEAR: f64 = 0.01;
/// Steps of regula falsi, which doubles the digits nearly each time.
const MOST_STEPS: usize = 24;

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Polygon {
        Polygon::new([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Vector3::new(x, y, 0.0)))
    }

    fn areas(sides: &[Option<Polygon>; 2]) -> [f64; 2] {
        sides.each_ref().map(|side| side.as_ref().map_or(0.0, |side| 0.5 * side.area().z))
    }

    #[test]
    fn a_cut_leaves_the_area_and_knows_its_edges() {
        let slanted = |p: &Vector3<f64>| p.x + 0.5 * p.y - 0.75;
        let sides = square().split(&slanted, 1e-12, 7);
        // Trapezoids of widths 0.75 and 0.25.
        let [below, above] = areas(&sides);
        assert!((below - 0.5).abs() < 1e-15 && (above - 0.5).abs() < 1e-15, "{below} {above}");
        for side in sides.into_iter().flatten() {
            assert_eq!(side.corners.iter().filter(|corner| corner.cut == 7).count(), 1, "{side:?}");
            for (k, corner) in side.corners.iter().enumerate().filter(|(_, corner)| corner.cut == 7) {
                let next = side.corners[(k + 1) % side.corners.len()].place;
                assert!(slanted(&corner.place).abs() < 1e-15 && slanted(&next).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn a_cut_through_corners_makes_no_slivers() {
        let through = |p: &Vector3<f64>| p.x - p.y;
        let sides = square().split(&through, 1e-12, 7);
        assert_eq!(areas(&sides), [0.5, 0.5]);
        assert!(sides.iter().flatten().all(|side| side.corners.len() == 3), "{sides:?}");
        let along = square().split(&|p: &Vector3<f64>| p.x, 1e-12, 7);
        assert_eq!(areas(&along), [0.0, 1.0]);
    }

    #[test]
    fn halves_are_divided_across_the_longest_way() {
        let long = Polygon::new(
            square().corners.iter().map(|corner| corner.place.component_mul(&Vector3::new(8.0, 1.0, 1.0))),
        );
        let [a, b] = areas(&long.halves());
        assert!((a - 4.0).abs() < 1e-12 && (b - 4.0).abs() < 1e-12, "{a} {b}");
    }
}
