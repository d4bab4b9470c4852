//! Fingers that are more than points on objects that move: pads, gimbals, ties and the quality of a grasp, through scene
//! file, hand file and recording alone.

use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::PI;
use std::fmt::Write as _;
use system_tests::recording::{BodySample, Table};
use system_tests::workplace::Workplace;

type V = Vector3<f64>;

const G: f64 = 9.81;
const MASS: f64 = 0.1;
const EDGE: f64 = 0.05;

/// A cube on a table; `scene` and `finger` are lines of the scene and of each of two fingers.
fn cube(scene: &str, finger: &str) -> String {
    format!(
        r#"
        {scene}
        [[finger]]
        {finger}
        [[finger]]
        {finger}
        [[entity]]
        name = "table"
        shape = {{ kind = "plane", normal = [0, 1, 0], offset_m = 0 }}
        stiffness_n_per_m = 2000
        damping_n_s_per_m = 2
        friction = {{ model = "coulomb", mu = 0.5 }}
        [[entity]]
        name = "cube"
        shape = {{ kind = "box", size_m = [{EDGE}, {EDGE}, {EDGE}] }}
        position_m = [0.0, 0.0244, 0.0]
        mass_kg = {MASS}
        stiffness_n_per_m = 500
        friction = {{ model = "coulomb", mu = 0.6 }}"#
    )
}

fn smooth(t: f64, from: f64, to: f64) -> f64 {
    0.5 - 0.5 * (PI * ((t - from) / (to - from)).clamp(0.0, 1.0)).cos()
}

/// Two fingers close on the cube, so far (m) off its middle, lift it by 50 mm within 2 s and hold it; f0 turns its gimbal
/// about x from 2 s to 3 s, if at all (rad).
fn lift(off: f64, gimbal: Option<f64>) -> String {
    let mut hand = String::from("t,f0_x,f0_y,f0_z,f1_x,f1_y,f1_z");
    hand += if gimbal.is_some() { ",f0_qw,f0_qx,f0_qy,f0_qz\n" } else { "\n" };
    for step in 0..=400 {
        let t = f64::from(step) * 0.01;
        let x = 0.03 - 0.009 * smooth(t, 0.0, 0.5);
        let y = 0.0244 + 0.05 * smooth(t, 0.7, 2.0);
        let _ = write!(hand, "{t:?},{x:?},{y:?},{off:?},{:?},{y:?},{off:?}", -x);
        if let Some(angle) = gimbal {
            let half = 0.5 * angle * smooth(t, 2.0, 3.0);
            let _ = write!(hand, ",{:?},{:?},0,0", half.cos(), half.sin());
        }
        hand.push('\n');
    }
    hand
}

fn played(scene: &str, hand: &str) -> Table {
    Workplace::new().play(scene, hand, &[])
}

fn turned(body: &BodySample) -> f64 {
    body.orientation.angle()
}

#[test]
fn pads_hold_what_points_let_swing() {
    let most = |finger: &str| {
        let cube = played(&cube("", finger), &lift(0.005, None)).body("cube");
        cube.iter().map(turned).fold(0.0, f64::max)
    };
    // The centre of mass hangs 5 mm beside the axis and comes to hang below it: a quarter turn, and half a one at most.
    assert!(most("") > 1.5, "points: {}", most(""));
    // m g 5 mm on two pads of 0.5 N m/rad, 5 mrad; by as much more as it was when it was lifted off.
    let held = most("soft = true");
    assert!(held < 0.03, "pads: {held}");
    assert_eq!(most("soft = { model = \"none\" }"), most(""));
    // 2 N on each pad: 0.41 of what friction bears, and 0.96 of what torsion does, which both bear alone.
    let small = |surface: &str| most(&format!("soft = {{ pad_radius_m = 0.0032{surface} }}"));
    let [shared, alone] = ["", ", limit_surface = \"uncoupled\""].map(small);
    assert!(shared > 0.15 && alone < 0.03, "{shared} {alone}");
    // The thesis' model, with an area that the circle of this grip exceeds: nothing turns; and with one that it does not.
    let viscous = |area: f64| most(&format!("soft = {{ model = \"viscous\", critical_area_m2 = {area:?} }}"));
    assert!(viscous(1e-7) < 0.03, "{}", viscous(1e-7));
    assert!(viscous(1e-3) > 0.5, "{}", viscous(1e-3));
}

#[test]
fn a_gimbal_turns_what_its_finger_holds() {
    let angle = 0.5;
    let table = played(&cube("", "soft = true"), &lift(0.0, Some(angle)));
    let cube = table.body("cube");
    let wanted = UnitQuaternion::from_axis_angle(&V::x_axis(), angle);
    let left = cube.last().unwrap().orientation.angle_to(&wanted);
    // Against nothing but the swing that is left.
    assert!(left < 0.02, "{left}: {:?}", cube.last());
    assert!(turned(&cube[1990]) < 0.01, "not before: {:?}", cube[1990]);
    let points = played(&self::cube("", ""), &lift(0.0, Some(angle))).body("cube");
    assert!(turned(points.last().unwrap()) < 0.05, "points turn nothing: {:?}", points.last());
}

#[test]
fn a_button_ties_what_its_finger_touches_and_lets_go_of_it() {
    let scene = cube("", "attach = { button = 1, orientation = \"locked\" }");
    let mut hand = String::from("t,f0_x,f0_y,f0_z,f0_buttons,f1_x,f1_y,f1_z\n");
    for step in 0..=300 {
        let t = f64::from(step) * 0.01;
        // Down to 1 mm under the top, then up by 51 mm while the button is held.
        let y = 0.06 - 0.0116 * smooth(t, 0.0, 0.5) + 0.051 * smooth(t, 0.7, 1.7);
        let buttons = if (0.6..2.5).contains(&t) { 2 } else { 0 };
        let _ = writeln!(hand, "{t:?},0,{y:?},0,{buttons},1,1,1");
    }
    let table = played(&scene, &hand);
    let (cube, f0) = (table.body("cube"), table.finger("f0"));
    let attached = table.texts("f0_attached");
    for (row, sample) in f0.iter().enumerate() {
        let is_held = (600..2500).contains(&row);
        // Then it fades.
        if !(2500..2530).contains(&row) {
            assert_eq!(attached[row], if is_held { "cube" } else { "" }, "at {} s", sample.t);
        }
    }
    // It hangs by m g / k = 1 mm, and does not turn.
    let hangs = &cube[2490];
    assert!((hangs.position.y - (0.0244 + 0.051 - 0.001)).abs() < 1e-3, "{hangs:?}");
    assert!(turned(hangs) < 1e-6, "{hangs:?}");
    assert!((f0[2490].force - V::new(0.0, -MASS * G, 0.0)).norm() < 0.01, "{:?}", f0[2490]);
    // Taken up and let go without a kick.
    for (row, pair) in f0.windows(2).enumerate() {
        let step = (pair[1].force - pair[0].force).norm();
        assert!(step < 0.2, "row {row}: {step} N in a tick");
    }
    assert!(cube.last().unwrap().position.y < 0.03, "it fell: {:?}", cube.last());
}

#[test]
fn how_good_a_grasp_is_is_told_where_the_scene_asks() {
    let told = |finger: &str| {
        let table = played(&cube("grasp_quality = true", finger), &lift(0.0, None));
        let of = |what: &str| table.numbers(&format!("cube_{what}"));
        let [contacts, rank, residual, closure] = ["contacts", "rank", "residual", "closure"].map(of);
        ([contacts[0], rank[0], closure[0]], [contacts[3500], rank[3500], closure[3500]], residual[3500])
    };
    let (free, held, residual) = told("soft = true");
    assert_eq!(free, [0.0, 0.0, 0.0]);
    assert_eq!(held, [2.0, 6.0, 1.0], "two soft fingers");
    assert!(residual < 1e-3, "{residual}");
    let (_, held, _) = told("");
    assert_eq!(held, [2.0, 5.0, 0.0], "two points cannot turn it about the line between them");
    let plain = played(&cube("", ""), &lift(0.0, None));
    assert!(!plain.columns().iter().any(|name| name == "cube_rank" || name == "f0_attached"));
}

#[test]
fn fingers_that_cannot_be_are_refused_with_line_and_key() {
    for (finger, says) in [
        ("soft = 3", "scene.toml:4: finger[0].soft: found 3"),
        ("soft = { model = \"sticky\" }", "coulomb, viscous, stick-slip, none"),
        ("soft = { model = \"viscous\", pad_radius_m = 0.01 }", "unknown key"),
        ("soft = { pad_radius_m = 0 }", "a number above 0"),
        (
            "soft = { limit_surface = \"round\" }",
            "unknown limit surface `round`; allowed: ellipse, uncoupled",
        ),
        ("soft = { model = \"viscous\", limit_surface = \"ellipse\" }", "unknown key"),
        (
            "soft = { model = \"stick-slip\", critical_area_at_rest_m2 = 1e-6, critical_area_turning_m2 = 2e-6 }",
            "critical_area_turning_m2 is 0.000002",
        ),
        ("attach = true", "a table such as { button = 0"),
        ("attach = { button = 64 }", "0 to 63"),
        ("attach = { button = 0, orientation = \"loose\" }", "free, locked, gimbal"),
    ] {
        let place = Workplace::new();
        place.write("scene.toml", cube("", finger));
        let said = place.run(["run", "scene.toml", "--clock", "virtual"]);
        assert_eq!(said.status, Some(2), "{finger}: {}", said.err);
        assert!(said.err.contains("scene.toml") && said.err.contains(says), "{finger}: {}", said.err);
    }
}
