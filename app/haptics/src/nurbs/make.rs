//! Patches to try and to test with: exact quadrics and rings, a vase, a body of eight parts.
//!
//! Model: a circle is a rational curve of degree 2 (weights 1 and sqrt 1/2); turned about the y axis, a profile of
//! weighted points becomes a patch with nine points around. Sizes must be finite and above 0, or building says so.

use super::NurbsPatch;

/// A point of a profile: distance from the y axis, y, weight.
type ProfilePoint = [f64; 3];

const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Points of a unit circle's control polygon: where corners are, the weight is [`HALF`].
const CIRCLE: [[f64; 2]; 9] = [
    [1.0, 0.0],
    [1.0, 1.0],
    [0.0, 1.0],
    [-1.0, 1.0],
    [-1.0, 0.0],
    [-1.0, -1.0],
    [0.0, -1.0],
    [1.0, -1.0],
    [1.0, 0.0],
];
const CIRCLE_KNOTS: [f64; 12] = [0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 4.0];

fn circle_weight(k: usize) -> f64 {
    if k % 2 == 1 { HALF } else { 1.0 }
}

/// A profile turned about the y axis: u around, v along the profile. One that rises outside faces outward.
pub fn revolved(degree: usize, knots: &[f64], profile: &[[f64; 3]]) -> NurbsPatch {
    let ring = |&[rho, y, w]: &ProfilePoint| {
        CIRCLE.iter().enumerate().map(move |(k, [c, s])| [rho * c, y, -rho * s, w * circle_weight(k)])
    };
    NurbsPatch {
        degree: [2, degree],
        knots: [CIRCLE_KNOTS.to_vec(), knots.to_vec()],
        points: profile.iter().flat_map(ring).collect(),
    }
}

/// An exact ball, one patch.
pub fn sphere(radius_m: f64) -> Vec<NurbsPatch> {
    let r = radius_m;
    let profile = [[0.0, -r, 1.0], [r, -r, HALF], [r, 0.0, 1.0], [r, r, HALF], [0.0, r, 1.0]];
    vec![revolved(2, &[0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0], &profile)]
}

/// An exact ring about the y axis, one patch closed both ways.
pub fn torus(ring_radius_m: f64, tube_radius_m: f64) -> Vec<NurbsPatch> {
    let profile: Vec<_> = (0..9)
        .map(|k| {
            [ring_radius_m + tube_radius_m * CIRCLE[k][0], tube_radius_m * CIRCLE[k][1], circle_weight(k)]
        })
        .collect();
    vec![revolved(2, &CIRCLE_KNOTS, &profile)]
}

/// An exact cylinder about the y axis with its caps, one patch with creases.
pub fn cylinder(radius_m: f64, length_m: f64) -> Vec<NurbsPatch> {
    let (r, h) = (radius_m, length_m / 2.0);
    let profile = [[0.0, -h, 1.0], [r, -h, 1.0], [r, h, 1.0], [0.0, h, 1.0]];
    vec![revolved(1, &[0.0, 0.0, 1.0, 2.0, 3.0, 3.0], &profile)]
}

/// A hollow vase of three patches, outside, lip and inside, about `height_m` tall, standing on y = 0.
pub fn vase(height_m: f64) -> Vec<NurbsPatch> {
    let h = height_m;
    let cubic = |profile: &[[f64; 2]]| {
        let inner = profile.len() - 4;
        let mut knots = vec![0.0; 4];
        knots.extend((1..=inner).map(|k| k as f64));
        knots.extend([(inner + 1) as f64; 4]);
        let profile: Vec<_> = profile.iter().map(|[rho, y]| [rho * h, y * h, 1.0]).collect();
        revolved(3, &knots, &profile)
    };
    // Across the axis horizontal, up to the lip upright: so that pole and lip are smooth.
    let outside = cubic(&[
        [0.0, 0.0],
        [0.10, 0.0],
        [0.24, 0.0],
        [0.30, 0.12],
        [0.36, 0.42],
        [0.12, 0.62],
        [0.14, 0.84],
        [0.20, 0.90],
        [0.20, 0.98],
    ]);
    let inside = cubic(&[
        [0.16, 0.98],
        [0.16, 0.90],
        [0.10, 0.84],
        [0.08, 0.62],
        [0.31, 0.42],
        [0.26, 0.14],
        [0.20, 0.04],
        [0.10, 0.04],
        [0.0, 0.04],
    ]);
    let arc = [[0.20, 0.98, 1.0], [0.20, 1.0, HALF], [0.18, 1.0, 1.0], [0.16, 1.0, HALF], [0.16, 0.98, 1.0]];
    let lip =
        revolved(2, &[0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0], &arc.map(|[rho, y, w]| [rho * h, y * h, w]));
    vec![outside, lip, inside]
}

/// A rounded body like a computer's mouse, of eight patches, each an octant of an ellipsoid of its own: about
/// `length_m` long, flat below.
pub fn mouse(length_m: f64) -> Vec<NurbsPatch> {
    let l = length_m;
    let reach = |signs: [f64; 3]| {
        let [x, y, z] = signs.map(|s| s > 0.0);
        [if x { 0.30 } else { 0.27 } * l, if y { 0.28 } else { 0.09 } * l, if z { 0.58 } else { 0.42 } * l]
    };
    let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let octant = |quarter: usize, up: f64| {
        // The quarter's signs are those of its corner.
        let corner = CIRCLE[2 * quarter + 1];
        let [a, b, c] = reach([corner[0], up, corner[1]]);
        let profile = [[1.0, 0.0, 1.0], [1.0, up, HALF], [0.0, up, 1.0]];
        let point = |[rho, y, w]: ProfilePoint, k: usize| {
            let [x, z] = CIRCLE[2 * quarter + k];
            [a * rho * x, b * y, c * rho * z, w * circle_weight(k)]
        };
        // Against the clock seen from outside.
        let turned = |k: usize| if up > 0.0 { 2 - k } else { k };
        let points = profile.iter().flat_map(|&p| (0..3).map(move |k| point(p, turned(k)))).collect();
        NurbsPatch { degree: [2, 2], knots: [knots.clone(), knots.clone()], points }
    };
    [1.0, -1.0].into_iter().flat_map(|up| (0..4).map(move |q| (q, up))).map(|(q, up)| octant(q, up)).collect()
}

/// A bumpy sheet of `cells` x `cells` cubic polynomials over the square of `size_m`, bumps `height_m` high.
pub fn sheet(cells: usize, size_m: f64, height_m: f64) -> Vec<NurbsPatch> {
    let count = cells + 3;
    let mut knots = vec![0.0; 4];
    knots.extend((1..cells).map(|k| k as f64));
    knots.extend([cells as f64; 4]);
    // Greville's places, so that parameters run evenly.
    let place = |k: usize| (knots[k + 1] + knots[k + 2] + knots[k + 3]) / 3.0 / cells as f64 - 0.5;
    let point = |(j, i): (usize, usize)| {
        let (x, z) = (place(i), place(j));
        [x * size_m, height_m * (9.0 * x).sin() * (7.0 * z).cos(), z * size_m, 1.0]
    };
    let points = (0..count).flat_map(|j| (0..count).map(move |i| (j, i))).map(point).collect();
    vec![NurbsPatch { degree: [3, 3], knots: [knots.clone(), knots.clone()], points }]
}
