//! Crossing points of slides and edges, beside the same geometry with twice the digits.
//!
//! Over the ridge of a roof the god-object is drawn from where it crosses the edge to the rim of the circle around the HIP's
//! foot on the other side: the rim shows where it crossed.

use std::sync::Arc;

use crate::common::*;
use haptics::mesh::{Mesh, TriangleSoup};
use haptics::{ContactState, Feature, Friction};
use nalgebra::Vector3;
use proptest::prelude::*;

const MU: f64 = 0.3;

/// A number as a sum of two (T. J. Dekker 1971): 106 bits.
#[derive(Debug, Clone, Copy)]
struct Double(f64, f64);

impl Double {
    fn sum(a: f64, b: f64) -> Self {
        let (s, t) = (a + b, (a + b) - a);
        Self(s, (a - (s - t)) + (b - t))
    }

    fn add(self, other: Self) -> Self {
        let s = Self::sum(self.0, other.0);
        Self::sum(s.0, s.1 + self.1 + other.1)
    }

    fn times(self, other: Self) -> Self {
        let p = self.0 * other.0;
        Self::sum(p, self.0.mul_add(other.0, -p) + (self.0 * other.1 + self.1 * other.0))
    }

    fn over(self, other: Self) -> Self {
        let first = self.0 / other.0;
        let left = self.add(other.times(Self(-first, 0.0)));
        Self::sum(first, left.0 / other.0)
    }

    /// One of Newton's steps from what the processor has.
    fn root(self) -> Self {
        let first = self.0.sqrt();
        let left = self.add(Self(first, 0.0).times(Self(-first, 0.0)));
        Self::sum(first, left.0 / (2.0 * first))
    }
}

/// A vector of such numbers.
type Point = [Double; 3];

fn point(v: &Vector3<f64>) -> Point {
    [v.x, v.y, v.z].map(|x| Double(x, 0.0))
}

/// `a + b s`.
fn along(a: &Point, b: &Point, s: Double) -> Point {
    std::array::from_fn(|i| a[i].add(b[i].times(s)))
}

fn minus(a: &Point, b: &Point) -> Point {
    along(a, b, Double(-1.0, 0.0))
}

fn dot(a: &Point, b: &Point) -> Double {
    a[0].times(b[0]).add(a[1].times(b[1])).add(a[2].times(b[2]))
}

fn cross(a: &Point, b: &Point) -> Point {
    let minor = |i: usize, j: usize| a[i].times(b[j]).add(a[j].times(b[i]).times(Double(-1.0, 0.0)));
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

/// A plane through a point, with a normal of any length.
struct Plane {
    at: Point,
    normal: Point,
}

impl Plane {
    fn of(corners: [&Vector3<f64>; 3]) -> Self {
        let [a, b, c] = corners.map(point);
        Self { at: a, normal: cross(&minus(&b, &a), &minus(&c, &a)) }
    }

    /// Where the line from a point along a way meets it.
    fn met(&self, from: &Point, way: &Point) -> Point {
        let share = dot(&self.normal, &minus(&self.at, from)).over(dot(&self.normal, way));
        along(from, way, share)
    }

    fn foot(&self, of: &Point) -> Point {
        self.met(of, &self.normal)
    }
}

/// Drawn from `from` to within `MU` times the depth of the foot.
fn drawn(from: &Point, foot: &Point, hip: &Point) -> Point {
    let (lag, out) = (minus(from, foot), minus(foot, hip));
    let rim = Double(MU, 0.0).times(dot(&out, &out).over(dot(&lag, &lag)).root());
    along(foot, &lag, rim)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn a_slide_over_a_ridge_crosses_it_where_twice_the_digits_say(
        corners in prop::array::uniform4(prop::array::uniform3(-0.005..0.005f64)),
        [x0, z0, x1, z1] in prop::array::uniform4(0.0..1.0f64), depth in 1e-3..5e-3f64,
    ) {
        let base = [[0.0, 0.0, -0.1], [0.0, 0.0, 0.1], [-0.15, -0.015, 0.0], [0.15, -0.015, 0.0]];
        let [p, q, left, right] = std::array::from_fn(|i| Vector3::from(base[i]) + Vector3::from(corners[i]));
        let soup = TriangleSoup { vertices: vec![p, q, left, right], faces: vec![[1, 0, 2], [0, 1, 3]] };
        let roof = [entity(Arc::new(Mesh::build(soup).unwrap().0), Friction::coulomb(MU).unwrap())];
        let (one, other) = (Plane::of([&q, &p, &left]), Plane::of([&p, &q, &right]));
        // Below the left side, then below the right one.
        let below = |plane: &Plane, x: f64, z: f64| {
            let down = [0.0, -1.0, 0.0].map(|y| Double(y, 0.0));
            let met = plane.met(&point(&Vector3::new(x, 0.05, z)), &down);
            Vector3::new(x, met[1].0 - depth, z)
        };
        let above = Vector3::new(-0.02 - 0.02 * x0, 0.05, -0.03 + 0.06 * z0);
        let hips = [below(&one, above.x, above.z), below(&other, 0.02 + 0.02 * x1, -0.03 + 0.06 * z1)];
        let mut finger = point_finger();
        finger.step(&roof, &above, DT);
        let held = finger.step(&roof, &hips[0], DT);
        prop_assert_eq!((held.friction, held.feature), (ContactState::Stick, Feature::Face));
        let slid = finger.step(&roof, &hips[1], DT);
        prop_assert_eq!((slid.friction, slid.feature), (ContactState::Slip, Feature::Face));

        let [from, to] = hips.map(|hip| point(&hip));
        let entered = one.met(&point(&above), &minus(&from, &point(&above)));
        let ridge = Plane { at: point(&p), normal: cross(&minus(&point(&q), &point(&p)), &one.normal) };
        let crossed = ridge.met(&entered, &minus(&one.foot(&to), &entered));
        let end = drawn(&crossed, &other.foot(&to), &to).map(|x| x.0);
        // Coordinates of 0.15 m are rounded to 1.4e-17. The way crosses the ridge at no less than 20 degrees and the entry is at
        // no less than 60 to the face: three times each; and some thirty operations.
        let error_m = (slid.god_object_W - Vector3::from(end)).norm();
        prop_assert!(error_m < 30.0 * 9.0 * 1.4e-17, "{} m off: {:?}, {:?}", error_m, slid.god_object_W, end);
        // An error of the crossing shows in the end, by the share of the rim's radius in the way there.
        let way_m = (slid.god_object_W - Vector3::from(crossed.map(|x| x.0))).norm();
        prop_assert!(way_m > 5e-3);
    }
}
