//! Planes, felt through scene file, hand file and recording alone.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use system_tests::recording::Sample;
use system_tests::workplace::{Workplace, felt, hand};

/// A finger above a table; `rest` goes on describing the table.
fn table(rest: &str) -> String {
    format!(
        "[[finger]]\nstart_m = [0.0, 0.1, 0.0]\n[[entity]]\nname = \"table\"\n\
         shape = {{ kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }}\n{rest}"
    )
}

const STICTION: &str = "friction = { model = \"stiction\", mu_s = 0.7, mu_d = 0.3 }\n";

/// Sliding ratios are promised to nine digits.
const RATIO_TOLERANCE: f64 = 1e-9;

#[test]
fn normal_force_is_stiffness_times_depth_to_the_last_bit() {
    let path = [
        (0.0, [0.0, 0.01, 0.0]),
        (0.31, [0.013, -0.0073, 0.002]),
        (0.62, [-0.02, -0.0011, 0.017]),
        (1.0, [0.0, 0.004, 0.0]),
    ];
    for friction in ["", STICTION, "friction = { model = \"coulomb\", mu = 0.5 }\n"] {
        let samples = felt(&table(&format!("stiffness_n_per_m = 1234.5\n{friction}")), &hand(path), &[]);
        assert!(samples.iter().filter(|s| s.touches()).count() > 500, "most of the path lies in the table");
        for s in &samples {
            // On a plane through the origin the depth is -y without rounding, so k d has a single one.
            assert_eq!(s.touches(), s.hip.y <= 0.0, "{s:?}");
            assert_eq!(s.force.y, 1234.5 * (-s.hip.y).max(0.0), "{s:?}");
        }
    }
}

/// A half-space in the world, worked out here from what the scene file says.
struct HalfSpace {
    scene: String,
    normal: Vector3<f64>,
    offset_m: f64,
}

fn half_space(
    normal: [f64; 3],
    offset_m: f64,
    position_m: [f64; 3],
    wxyz: [f64; 4],
    friction: &str,
) -> HalfSpace {
    let scene = format!(
        "[[finger]]\n[[entity]]\nname = \"wall\"\nstiffness_n_per_m = 800.0\n\
         shape = {{ kind = \"plane\", normal = {normal:?}, offset_m = {offset_m:?} }}\n\
         position_m = {position_m:?}\norientation_wxyz = {wxyz:?}\n{friction}"
    );
    let (normal, [w, x, y, z]) = (Vector3::from(normal), wxyz);
    let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    // normal . x <= offset, both divided by the normal's length, then moved with the entity.
    let normal_w = turn * normal.normalize();
    let offset_w = offset_m / normal.norm() + normal_w.dot(&Vector3::from(position_m));
    HalfSpace { scene, normal: normal_w, offset_m: offset_w }
}

impl HalfSpace {
    /// From 1 cm outside to 5 mm deep, sideways while there, and out again.
    fn hand(&self) -> String {
        let sideways = self.normal.cross(&Vector3::new(0.3, -0.5, 0.8)).normalize();
        let on = self.normal * self.offset_m;
        let at = |height: f64, side: f64| (on + self.normal * height + sideways * side).into();
        hand([
            (0.0, at(0.01, 0.0)),
            (0.2, at(-0.005, 0.0)),
            (0.9, at(-0.003, 0.0437)),
            (1.0, at(0.002, 0.05)),
        ])
    }
}

#[test]
fn tilted_and_turned_planes_push_along_their_normal_by_the_depth_below_them() {
    let s = 0.5f64.sqrt();
    let placements = [
        ([1.0, 2.0, 2.0], 0.03, [0.0; 3], [1.0, 0.0, 0.0, 0.0]),
        ([0.0, 1.0, 0.0], 0.02, [0.1, -0.2, 0.05], [s, 0.0, 0.0, s]),
        ([0.3, 1.0, -0.2], -0.04, [-0.1, 0.2, 0.3], [0.8, 0.0, 0.6, 0.0]),
        ([-5.0, 0.1, 0.0], 0.5, [1.0, 1.0, 1.0], [0.1, -0.7, 0.5, 0.5]),
    ];
    for (normal, offset_m, position_m, wxyz) in placements {
        for friction in ["", STICTION] {
            let wall = half_space(normal, offset_m, position_m, wxyz, friction);
            let samples = felt(&wall.scene, &wall.hand(), &[]);
            let touching = samples.iter().filter(|s| s.touches()).count();
            assert!(touching > 700, "{touching} ticks in contact\n{}", wall.scene);
            samples.iter().for_each(|s| check_wall(s, &wall, friction.is_empty()));
        }
    }
}

fn check_wall(s: &Sample, wall: &HalfSpace, is_frictionless: bool) {
    let depth_m = wall.offset_m - wall.normal.dot(&s.hip);
    // Turning by a quaternion is some twenty products and sums of lengths of at most 2 m, here and there.
    let rounding_m = 64.0 * f64::EPSILON;
    let tolerance_n = 800.0 * rounding_m;
    if depth_m.abs() > rounding_m {
        assert_eq!(s.touches(), depth_m > 0.0, "{s:?}");
    }
    let (normal_n, tangential) = s.split(&wall.normal);
    assert!((normal_n - 800.0 * depth_m.max(0.0)).abs() <= tolerance_n, "{normal_n} N at {depth_m} m: {s:?}");
    if is_frictionless {
        assert!(tangential.norm() <= tolerance_n, "{tangential:?}: {s:?}");
    }
    if s.touches() {
        let above_m = wall.normal.dot(&s.god) - wall.offset_m;
        assert!(above_m.abs() <= rounding_m, "the god-object lies {above_m} m above the surface: {s:?}");
    }
}

/// Onto the table, 5 mm into it, and then along it at 97 mm/s: no row lies exactly on the rim of a circle.
fn stroke() -> String {
    let at = |x: f64, y: f64| [0.8 * x, y, 0.6 * x];
    hand([(0.0, at(0.0, 0.01)), (0.1, at(0.0, -0.005)), (0.2, at(0.0, -0.005)), (1.2, at(0.097, -0.005))])
}

#[test]
fn contact_breaks_away_within_one_tick_at_mu_s_and_slides_at_mu_d_ever_after() {
    let samples = felt(&table(&format!("stiffness_n_per_m = 500.0\n{STICTION}")), &stroke(), &[]);
    let along = Vector3::new(0.8, 0.0, 0.6);
    let is_beyond = |s: &Sample| along.dot(&s.hip) > 0.7 * -s.hip.y;
    let first = samples.iter().position(|s| s.touches() && is_beyond(s)).expect("it breaks away");
    for (tick, s) in samples.iter().enumerate().filter(|(_, s)| s.touches()) {
        assert_eq!(s.friction, if tick < first { "stick" } else { "slip" }, "tick {tick} of {first}: {s:?}");
        let (normal_n, tangential) = s.split(&Vector3::y());
        if tick < first {
            assert_eq!((s.god.x, s.god.z), (0.0, 0.0), "it holds to the last bit: {s:?}");
            assert!(tangential.norm() <= 0.7 * normal_n * (1.0 + RATIO_TOLERANCE), "{s:?}");
        } else {
            let ratio = tangential.norm() / normal_n;
            assert!((ratio - 0.3).abs() <= RATIO_TOLERANCE, "tick {tick}: {ratio}");
            assert!(tangential.dot(&along) < 0.0, "friction pushes back: {s:?}");
        }
    }
    assert!(samples.len() - first > 900, "it slid for most of the stroke");
}

#[test]
fn a_reversal_sticks_again_and_the_force_never_leaves_the_cone() {
    let zigzag = (0..=10u32).map(|turn| {
        let side = if turn.is_multiple_of(2) { -0.01 } else { 0.01 };
        (f64::from(turn) * 0.3, [side, -0.005, 0.0])
    });
    let samples = felt(&table(&format!("stiffness_n_per_m = 500.0\n{STICTION}")), &hand(zigzag), &[]);
    let mut breakaways = 0;
    for pair in samples.windows(2) {
        let [before, s] = pair else { unreachable!() };
        let (normal_n, tangential) = s.split(&Vector3::y());
        let limit = if s.friction == "stick" { 0.7 } else { 0.3 };
        assert!(tangential.norm() <= limit * normal_n * (1.0 + RATIO_TOLERANCE), "{s:?}");
        breakaways += u32::from(before.friction == "stick" && s.friction == "slip");
    }
    assert_eq!(breakaways, 10, "once for each stroke");
}

#[test]
fn without_friction_the_god_object_is_the_classic_one() {
    let path = [(0.0, [0.0, 0.01, 0.0]), (0.3, [0.02, -0.006, 0.01]), (1.0, [-0.05, -0.001, 0.04])];
    for friction in
        ["", "friction = { model = \"none\" }\n", "friction = { model = \"coulomb\", mu = 0.0 }\n"]
    {
        let samples = felt(&table(friction), &hand(path), &[]);
        for s in samples.iter().filter(|s| s.touches()) {
            assert_eq!(s.god, Vector3::new(s.hip.x, 0.0, s.hip.z), "the nearest point of the surface: {s:?}");
            assert_eq!((s.force.x, s.force.z), (0.0, 0.0), "{s:?}");
        }
    }
}

#[test]
fn a_spherical_finger_touches_a_radius_earlier() {
    let path = [(0.0, [0.0, 0.02, 0.0]), (0.5, [0.0, -0.001, 0.0]), (1.0, [0.02, 0.003, 0.0])];
    let scene = table(STICTION).replace("start_m", "radius_m = 0.004\nstart_m");
    for s in felt(&scene, &hand(path), &[]) {
        assert_eq!(s.touches(), s.hip.y <= 0.004, "{s:?}");
        // One subtraction, one product; the default stiffness is 1000 N/m.
        assert_eq!(s.force.y, 1000.0 * (0.004 - s.hip.y).max(0.0), "{s:?}");
        if s.touches() {
            assert!((s.god.y - 0.004).abs() <= f64::EPSILON * 0.02, "its centre stays a radius above: {s:?}");
        }
    }
}

/// Velocity of the HIP in each tick, as two recorded positions show it; dt is 1 ms.
fn with_velocity(samples: &[Sample]) -> impl Iterator<Item = (&Sample, Vector3<f64>)> {
    samples.windows(2).map(|pair| (&pair[1], (pair[1].hip - pair[0].hip) / 1e-3))
}

#[test]
fn damping_adds_to_an_approach_and_never_pulls_on_a_retreat() {
    let path = [
        (0.0, [0.0, 0.002, 0.0]),
        (0.1, [0.0, -0.008, 0.0]), // 0.1 m/s down
        (0.2, [0.0, -0.008, 0.0]), // at rest
        (0.4, [0.0, -0.006, 0.0]), // 0.01 m/s up: less force
        (0.5, [0.0, 0.094, 0.0]),  // 1 m/s up: the damper alone would pull
    ];
    let samples = felt(&table("stiffness_n_per_m = 500.0\ndamping_n_s_per_m = 7.0\n"), &hand(path), &[]);
    let mut released = 0;
    for (s, velocity) in with_velocity(&samples).filter(|(s, _)| s.touches()) {
        // Exactly on the surface nothing is pressed, however fast it came.
        let is_pressed = s.hip.y < 0.0;
        let expected = if is_pressed { (500.0 * -s.hip.y - 7.0 * velocity.y).max(0.0) } else { 0.0 };
        // A handful of roundings of at most 8 N.
        assert!(
            (s.force.y - expected).abs() <= 16.0 * f64::EPSILON * 8.0,
            "{} N, not {expected} N: {s:?}",
            s.force.y
        );
        assert_eq!((s.force.x, s.force.z), (0.0, 0.0));
        released += u32::from(is_pressed && s.force.y == 0.0);
    }
    assert!(released > 3, "the retreat was fast enough to have pulled");
    let speed_step = samples.iter().find(|s| s.hip.y < -0.004).expect("deep");
    assert!(
        (speed_step.force.y - (500.0 * -speed_step.hip.y + 7.0 * 0.1)).abs() < 1e-9,
        "k d + b v: {speed_step:?}"
    );
}

#[test]
fn damping_acts_along_the_tangent_while_it_sticks_and_leaves_sliding_ratios_alone() {
    let samples = felt(
        &table(&format!("stiffness_n_per_m = 500.0\ndamping_n_s_per_m = 4.0\n{STICTION}")),
        &stroke(),
        &[],
    );
    let along = Vector3::new(0.8, 0.0, 0.6);
    let (mut stuck, mut slid) = (0, 0);
    // While pressing, the speed is along the normal; what is looked at begins with the stroke.
    for (s, velocity) in with_velocity(&samples).filter(|(s, _)| s.t > 0.2) {
        let (normal_n, tangential) = s.split(&Vector3::y());
        if s.friction == "stick" {
            stuck += 1;
            let spring_and_damper = 500.0 * along.dot(&s.hip) + 4.0 * along.dot(&velocity);
            let expected = spring_and_damper.min(0.7 * normal_n);
            // Positions of centimetres at 1 kHz: velocities carry 1e-17 m / 1 ms, times b.
            assert!(
                (tangential.norm() - expected).abs() <= 1e-12,
                "{} N, not {expected} N: {s:?}",
                tangential.norm()
            );
        } else {
            slid += 1;
            assert!((tangential.norm() / normal_n - 0.3).abs() <= RATIO_TOLERANCE, "{s:?}");
        }
    }
    assert!(stuck > 30 && slid > 900, "{stuck} ticks stuck, {slid} slid");
}

#[test]
fn a_finger_in_a_corner_feels_both_walls() {
    let scene = table("stiffness_n_per_m = 500.0\n")
        + "[[entity]]\nname = \"wall\"\nstiffness_n_per_m = 300.0\n\
           shape = { kind = \"plane\", normal = [1.0, 0.0, 0.0], offset_m = 0.0 }\n";
    let path = [(0.0, [0.01, 0.01, 0.0]), (0.5, [-0.004, -0.002, 0.0]), (1.0, [-0.001, -0.005, 0.0])];
    let mut seen = [0; 2];
    for s in felt(&scene, &hand(path), &[]) {
        let (on_wall, on_table) = (300.0 * (-s.hip.x).max(0.0), 500.0 * (-s.hip.y).max(0.0));
        assert_eq!(s.force, Vector3::new(on_wall, on_table, 0.0), "{s:?}");
        if on_wall > 0.0 && on_table > 0.0 {
            let stronger = usize::from(on_wall > on_table);
            assert_eq!(s.entity, ["table", "wall"][stronger], "the row names the stronger contact: {s:?}");
            seen[stronger] += 1;
        }
    }
    assert!(seen.iter().all(|&ticks| ticks > 50), "{seen:?}");
}

#[test]
fn two_fingers_touch_two_entities_without_knowing_of_each_other() {
    let scene = "[[finger]]\n[[finger]]\nname = \"thumb\"\n\
        [[entity]]\nname = \"table\"\nshape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }\n\
        [[entity]]\nname = \"ball\"\nshape = { kind = \"sphere\", radius_m = 0.05 }\nposition_m = [0.5, 0.1, 0.0]\n";
    let both = "t,f0_x,f0_y,f0_z,thumb_x,thumb_y,thumb_z\n0,0,0.01,0,0.5,0.2,0\n1,0,-0.005,0,0.5,0.14,0\n";
    let table = Workplace::new().play(scene, both, &[]);
    let last = |finger: &str| table.finger(finger).pop().expect("rows");
    assert_eq!((last("f0").entity.as_str(), last("thumb").entity.as_str()), ("table", "ball"));
    let alone = felt(scene, "t,f0_x,f0_y,f0_z\n0,0,0.01,0\n1,0,-0.005,0\n", &[]);
    assert_eq!(table.finger("f0"), alone, "what f0 feels is the same when the thumb rests");
}
