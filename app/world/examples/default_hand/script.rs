//! The hands of the default scene: one finger on the ball, one on the table, for ten seconds.
//!
//! Model: each finger follows legs from way point to way point, at rest at each of them, along
//! the surface (great circles on the ball, lines on the table) with the minimum-jerk time law of
//! human reaching (Flash and Hogan 1985). A way point gives a spot on the surface and a height
//! above it; a height below 0 is the depth that a stiff surface answers with force.
//!
//! The legs are chosen to show what friction does: dwells and reversals, after which the contact
//! sticks until the finger has crossed the friction circle; pressing deeper, which widens it; a
//! circle within it, during which the contact must not move; strokes that slip from end to end.
//!
//! Units: world frame, SI; milliseconds, millimetres and degrees only in the tables below.

use std::fmt::Write;

use nalgebra::{Point3, Vector3};

/// Centre of the scene's ball.
pub(crate) const BALL_CENTRE_M: [f64; 3] = [-0.08, 0.06, 0.0];
/// Radius of the scene's ball.
pub(crate) const BALL_RADIUS_M: f64 = 0.04;
/// Length of the script.
pub(crate) const END_MS: u32 = 10_000;
/// One row of the hand file every so often.
pub(crate) const ROW_MS: u32 = 5;

/// The hand file. Positions are rounded to nanometres, far below any encoder: last digits of
/// sine and cosine differ between systems, and the file must not.
pub(crate) fn csv() -> String {
    let mut text = String::from("t,f0_x,f0_y,f0_z,f1_x,f1_y,f1_z\n");
    for ms in (0..=END_MS).step_by(ROW_MS as usize) {
        let t_s = f64::from(ms) / 1e3;
        write!(text, "{t_s}").expect("a string takes everything");
        for p in [on_ball(t_s), on_table(t_s)] {
            for x in p.iter() {
                // Adding 0 turns -0, which prints a sign, into 0.
                write!(text, ",{}", (x * 1e9).round() / 1e9 + 0.0).expect("a string takes everything");
            }
        }
        text.push('\n');
    }
    text
}

/// Where f0 wants to be.
pub(crate) fn on_ball(t_s: f64) -> Point3<f64> {
    let (from, leg, s) = leg_at(&BALL_LEGS, t_s);
    let direction = great_circle(ball_direction(from.spot), ball_direction(leg.spot), s);
    let radius_m = BALL_RADIUS_M + height_m(from, leg, s);
    Point3::from(BALL_CENTRE_M) + direction * radius_m
}

/// Where f1 wants to be.
pub(crate) fn on_table(t_s: f64) -> Point3<f64> {
    let (from, leg, s) = leg_at(&TABLE_LEGS, t_s);
    let [x, z] = match leg.circle_mm {
        Some(radius) => circle(from.spot, radius, s),
        None => std::array::from_fn(|i| from.spot[i] + (leg.spot[i] - from.spot[i]) * s),
    };
    Point3::new(x / 1e3, height_m(from, leg, s), z / 1e3)
}

/// One leg of a finger's way: how long it takes and where it ends.
struct Leg {
    ms: u32,
    /// On the ball: tilt from the top towards +x and +z, degrees. On the table: x and z, mm.
    spot: [f64; 2],
    height_mm: f64,
    /// Instead of a line: once around a circle of this radius that touches the spot from -x.
    circle_mm: Option<f64>,
}

/// The way point before, the leg, and how much of it is done at `t_s`; rest after the last.
fn leg_at(legs: &[Leg], t_s: f64) -> (&Leg, &Leg, f64) {
    let mut left_s = t_s;
    for pair in legs.windows(2) {
        let duration_s = f64::from(pair[1].ms) / 1e3;
        if left_s < duration_s {
            return (&pair[0], &pair[1], minimum_jerk(left_s / duration_s));
        }
        left_s -= duration_s;
    }
    let last = &legs[legs.len() - 1];
    (last, last, 0.0)
}

/// From 0 to 1 with the least jerk: at rest, without acceleration, at both ends.
fn minimum_jerk(s: f64) -> f64 {
    s * s * s * (10.0 - s * (15.0 - s * 6.0))
}

fn height_m(from: &Leg, leg: &Leg, s: f64) -> f64 {
    (from.height_mm + (leg.height_mm - from.height_mm) * s) / 1e3
}

fn ball_direction([tilt_x, tilt_z]: [f64; 2]) -> Vector3<f64> {
    Vector3::new(tilt_x.to_radians().tan(), 1.0, tilt_z.to_radians().tan()).normalize()
}

fn great_circle(from: Vector3<f64>, to: Vector3<f64>, s: f64) -> Vector3<f64> {
    let angle = from.cross(&to).norm().atan2(from.dot(&to));
    if angle == 0.0 {
        return from;
    }
    (from * ((1.0 - s) * angle).sin() + to * (s * angle).sin()) / angle.sin()
}

fn circle([x, z]: [f64; 2], radius: f64, s: f64) -> [f64; 2] {
    let angle = s * std::f64::consts::TAU;
    [x - radius * (1.0 - angle.cos()), z + radius * angle.sin()]
}

const fn to(ms: u32, spot: [f64; 2], height_mm: f64) -> Leg {
    Leg { ms, spot, height_mm, circle_mm: None }
}

const fn around(ms: u32, radius_mm: f64, spot: [f64; 2], height_mm: f64) -> Leg {
    Leg { ms, spot, height_mm, circle_mm: Some(radius_mm) }
}

/// The first entry is the start; each later one says how long it takes, where it ends, how high.
const BALL_LEGS: [Leg; 19] = [
    to(0, [0.0, 0.0], 25.0),
    to(400, [0.0, 0.0], 25.0),
    to(800, [0.0, 0.0], -4.0), // touches down
    to(300, [0.0, 0.0], -4.0),
    to(900, [35.0, 0.0], -4.0), // breaks loose, slips
    to(300, [35.0, 0.0], -4.0),
    to(800, [-30.0, 0.0], -4.0), // reverses: sticks, slips over the top
    to(300, [-30.0, 0.0], -4.0),
    to(1000, [-10.0, 0.0], -4.0), // slowly
    to(500, [-10.0, 0.0], -6.0),  // presses: the friction circle widens
    to(700, [0.0, 40.0], -6.0),
    to(200, [0.0, 40.0], -6.0),
    to(700, [0.0, -35.0], -6.0),
    to(300, [0.0, -33.0], -6.0), // to and fro within the circle: sticks
    to(300, [0.0, -36.0], -6.0),
    to(500, [0.0, -20.0], -3.0), // lets go: the circle shrinks past the contact, it slips
    to(600, [0.0, 0.0], -3.0),
    to(300, [0.0, 0.0], -3.0),
    to(600, [0.0, 0.0], 25.0), // lifts off, rests
];

const TABLE_LEGS: [Leg; 18] = [
    to(0, [30.0, 0.0], 40.0),
    to(300, [30.0, 0.0], 40.0),
    to(900, [30.0, 0.0], -4.0), // touches down
    to(200, [30.0, 0.0], -4.0),
    to(1000, [110.0, 0.0], -4.0), // breaks loose, slips
    to(300, [110.0, 0.0], -4.0),
    around(1000, 1.2, [110.0, 0.0], -4.0), // within the friction circle: sticks
    to(200, [110.0, 0.0], -4.0),
    to(800, [110.0, 40.0], -4.0), // turns a corner
    to(200, [110.0, 40.0], -4.0),
    to(1000, [50.0, -30.0], -4.0), // fast
    to(200, [50.0, -30.0], -4.0),
    to(500, [50.0, -30.0], 20.0), // lifts off
    to(500, [80.0, 0.0], 20.0),
    to(500, [80.0, 0.0], -5.0), // touches down again
    to(800, [60.0, 0.0], -5.0),
    to(800, [100.0, 0.0], -5.0), // reverses
    to(700, [100.0, 0.0], 40.0), // lifts off, rests
];
