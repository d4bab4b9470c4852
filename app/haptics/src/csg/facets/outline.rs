//! A patch's surface as flat pieces: curved ones by lines around their axis and along it.
//!
//! Model: corners lie on the surface. Lines go through the places that are farthest along the solid's axes, so that the box
//! around the pieces is the one around the surface.
//! Frames: object frame B, L that of the patch.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Matrix3, Vector3};

use super::super::curved::Curved;
use super::super::kind::Kind;
use super::super::patch::Patch;
use super::FINEST;
use super::polygon::Polygon;

/// The part of a surface within a ball, and perhaps more, with so many pieces around an axis.
pub(super) fn outline(patch: &Patch, centre_B: &Vector3<f64>, radius_m: f64, around: usize) -> Vec<Polygon> {
    match patch {
        Patch::Plane { normal_B, offset_m } => {
            let foot_B = centre_B - normal_B * (normal_B.dot(centre_B) - offset_m);
            vec![square(&foot_B, normal_B, radius_m)]
        }
        Patch::Curved(curved) => round(curved, centre_B, radius_m, around),
    }
}

fn square(middle_B: &Vector3<f64>, normal_B: &Vector3<f64>, half_m: f64) -> Polygon {
    let u = normal_B.cross(&Vector3::ith(normal_B.iamin(), 1.0)).normalize() * half_m;
    let v = normal_B.cross(&u);
    Polygon::new([-u - v, u - v, u + v, v - u].map(|to| middle_B + to))
}

fn round(curved: &Curved, centre_B: &Vector3<f64>, radius_m: f64, around: usize) -> Vec<Polygon> {
    let (turn_LB, shift_L) = curved.map();
    let Some(turn_BL) = turn_LB.try_inverse() else { return Vec::new() };
    let far_L: Vec<Vector3<f64>> = farthest(&turn_BL);
    let rings = rings(curved.kind(), &far_L, around, || {
        let middle = (turn_LB * centre_B + shift_L).y;
        let reach = radius_m * turn_LB.row(1).norm();
        [middle - reach, middle + reach]
    });
    let steps = match curved.kind() {
        Kind::Ring { ring_radius_m, tube_radius_m } => steps_of_ring(around, ring_radius_m, tube_radius_m)[0],
        _ => around,
    };
    let mut angles: Vec<f64> = (0..steps).map(|k| TAU * k as f64 / steps as f64).collect();
    let across = far_L.iter().filter(|far| far.x.hypot(far.z) > LEAST_ACROSS * far.norm());
    lines_through(&mut angles, across.map(|far| turned(far.z.atan2(far.x))));
    let place = |[rho, y]: [f64; 2], angle: f64| {
        let (sin, cos) = angle.sin_cos();
        turn_BL * (Vector3::new(rho * cos, y, rho * sin) - shift_L)
    };
    let mut pieces = Vec::with_capacity(angles.len() * rings.len());
    for pair in rings.windows(2) {
        let [below, above] = [pair[0], pair[1]];
        for (k, &from) in angles.iter().enumerate() {
            let to = angles[(k + 1) % angles.len()];
            let mut corners = Vec::with_capacity(4);
            for (ring, angle) in [(below, from), (below, to), (above, to), (above, from)] {
                // At a pole all are one.
                if ring[0] > 0.0 || angle == from {
                    corners.push(place(ring, angle));
                }
            }
            if corners.len() > 2 {
                pieces.push(Polygon::new(corners));
            }
        }
    }
    pieces
}

/// Distances from the axis and places along it, of lines around it.
fn rings(kind: Kind, far_L: &[Vector3<f64>], around: usize, ends: impl Fn() -> [f64; 2]) -> Vec<[f64; 2]> {
    let pitches = || far_L.iter().map(|far| far.y.atan2(far.x.hypot(far.z)));
    let latitudes = || {
        let steps = around / 2;
        let mut angles: Vec<f64> = (1..steps).map(|k| PI * k as f64 / steps as f64 - FRAC_PI_2).collect();
        lines_through(&mut angles, pitches());
        angles.retain(|angle| angle.abs() < FRAC_PI_2 - LEAST_ACROSS);
        angles
    };
    let on_ball = |radius: f64, angle: f64, up: f64| [radius * angle.cos(), radius * angle.sin() + up];
    match kind {
        Kind::Ball { radius_m } => {
            let between = latitudes().into_iter().map(|angle| on_ball(radius_m, angle, 0.0));
            [[0.0, -radius_m]].into_iter().chain(between).chain([[0.0, radius_m]]).collect()
        }
        Kind::Pill { radius_m, half_length_m } => {
            let angles = latitudes();
            let end = |up: f64| angles.iter().map(move |&angle| on_ball(radius_m, angle, up));
            let lower = end(-half_length_m).filter(|[_, y]| *y < -half_length_m);
            let upper = end(half_length_m).filter(|[_, y]| *y > half_length_m);
            let belt = [[radius_m, -half_length_m], [radius_m, half_length_m]];
            let tip_m = half_length_m + radius_m;
            [[0.0, -tip_m]].into_iter().chain(lower).chain(belt).chain(upper).chain([[0.0, tip_m]]).collect()
        }
        Kind::Tube { radius_m } => ends().map(|y| [radius_m, y]).into(),
        Kind::Nappe { normal_rho, normal_y, offset_m } => {
            let [mut low, mut high] = ends();
            let tip = offset_m / normal_y;
            if normal_y > 0.0 {
                (low, high) = (low.min(tip), high.min(tip));
            } else if normal_y < 0.0 {
                (low, high) = (low.max(tip), high.max(tip));
            }
            [low, high]
                .map(|y| if y == tip { [0.0, y] } else { [(offset_m - normal_y * y) / normal_rho, y] })
                .into()
        }
        Kind::Ring { ring_radius_m, tube_radius_m } => {
            let [_, steps] = steps_of_ring(around, ring_radius_m, tube_radius_m);
            let mut angles: Vec<f64> = (0..steps).map(|k| TAU * k as f64 / steps as f64).collect();
            lines_through(&mut angles, pitches().map(turned));
            let mut rings: Vec<[f64; 2]> = angles
                .into_iter()
                .map(|angle| [ring_radius_m + tube_radius_m * angle.cos(), tube_radius_m * angle.sin()])
                .collect();
            rings.push(rings[0]);
            rings
        }
    }
}

/// Steps around a ring and around its tube: as many pieces as with equal numbers, and chords that miss the same of both (m): as
/// the radius over the square of the number. With the finest steps both miss the same share of their radius.
fn steps_of_ring(around: usize, ring_radius_m: f64, tube_radius_m: f64) -> [usize; 2] {
    if around >= FINEST {
        return [around; 2];
    }
    let more = ((ring_radius_m + tube_radius_m) / tube_radius_m).powf(0.25);
    let of_tube = ((around as f64 / more).ceil() as usize).clamp(LEAST_AROUND_TUBE.min(around), around);
    [(around * around / of_tube).min(FINEST), of_tube]
}

/// The same angle within a turn.
fn turned(angle: f64) -> f64 {
    let angle = angle.rem_euclid(TAU);
    if TAU - angle < LEAST_ACROSS { 0.0 } else { angle }
}

/// Directions in L in which the surface is farthest along the axes of B.
fn farthest(turn_BL: &Matrix3<f64>) -> Vec<Vector3<f64>> {
    (0..3).flat_map(|axis| [1.0, -1.0].map(|sign| turn_BL.row(axis).transpose() * sign)).collect()
}

/// Adds lines, or moves those that are near.
fn lines_through(lines: &mut Vec<f64>, through: impl Iterator<Item = f64>) {
    let step = lines.get(1).zip(lines.first()).map_or(1.0, |(b, a)| b - a);
    for angle in through {
        match lines.iter_mut().find(|line| (**line - angle).abs() < NEAR * step) {
            Some(line) => *line = angle,
            None => lines.push(angle),
        }
    }
    lines.sort_by(f64::total_cmp);
}

/// Fewer steps around a tube make an edge of it.
const LEAST_AROUND_TUBE: usize = 8;
/// Of a step: nearer lines are moved.
const NEAR: f64 = 0.1;
/// Of a direction: along an axis no angle around it is farthest; and poles have no lines beside them.
const LEAST_ACROSS: f64 = 1e-6;
