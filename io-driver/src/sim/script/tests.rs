//! Hand files: what is played, and what is refused.

use super::*;
use proptest::prelude::*;

const TWO: &str = "t,f0_x,f0_y,f0_z,f1_x,f1_y,f1_z\n0,0,0,0,1,1,1\n1,1,-2,4,1,1,1\n3,1,-2,0,2,1,1\n";

fn parse(text: &str, fingers: &[&str]) -> Result<HandScript, HandError> {
    HandScript::parse(text, Path::new("hands/lift.csv"), fingers)
}

fn play(text: &str) -> HandPlayer {
    HandPlayer::new(parse(text, &["f0", "f1"]).unwrap())
}

fn message(text: &str) -> String {
    parse(text, &["f0", "f1"]).unwrap_err().to_string()
}

#[test]
fn positions_are_linear_between_rows_and_held_outside() {
    let mut player = play(TWO);
    // All numbers are exact in binary.
    assert_eq!(player.position(0, 0.25), Some(Vector3::new(0.25, -0.5, 1.0)));
    assert_eq!(player.position(1, 2.0), Some(Vector3::new(1.5, 1.0, 1.0)));
    assert_eq!(player.position(0, -7.0), Some(Vector3::zeros()));
    assert_eq!(player.position(0, f64::NAN), Some(Vector3::zeros()));
    assert_eq!(player.position(0, 3.5), Some(Vector3::new(1.0, -2.0, 0.0)));
    assert_eq!(player.position(0, f64::INFINITY), Some(Vector3::new(1.0, -2.0, 0.0)));
    assert_eq!(player.script().duration_s(), 3.0);
}

#[test]
fn a_finger_without_columns_has_no_script() {
    let mut player = play("t,f1_x,f1_y,f1_z\n0,1,2,3\n");
    assert_eq!(player.position(0, 0.0), None);
    assert_eq!(player.position(1, 0.0), Some(Vector3::new(1.0, 2.0, 3.0)));
    assert_eq!(player.position(2, 0.0), None);
    assert!(player.script().is_scripted(1) && !player.script().is_scripted(0));
}

#[test]
fn columns_may_come_in_any_order_and_names_may_have_underscores() {
    let script = parse("t,my_f_z,my_f_x,my_f_y\n0,3,1,2\n", &["my_f"]).unwrap();
    assert_eq!(HandPlayer::new(script).position(0, 0.0), Some(Vector3::new(1.0, 2.0, 3.0)));
}

#[test]
fn a_single_row_holds_for_ever() {
    let mut player = play("t,f0_x,f0_y,f0_z\n0.5,1,2,3\n");
    for time_s in [-1.0, 0.0, 0.5, 9.0] {
        assert_eq!(player.position(0, time_s), Some(Vector3::new(1.0, 2.0, 3.0)));
    }
}

#[test]
fn mistakes_in_the_header_name_the_column_and_the_fingers() {
    assert_eq!(
        message("t,f2_x,f2_y,f2_z\n0,1,2,3\n"),
        "hands/lift.csv:1: column `f2_x`: found a column that is no finger's, allowed: `_x`, `_y`, `_z`, `_qw`, \
         `_qx`, `_qy`, `_qz` or `_buttons` after one of f0, f1"
    );
    assert_eq!(
        message("t,f0_x,f0_z\n0,1,2\n"),
        "hands/lift.csv:1: column `f0_y`: found no such column, allowed: all three coordinates of finger \
         f0, or none"
    );
    assert!(message("t,f0_x,f0_y,f0_z,force\n0,1,2,3,4\n").contains("column `force`"));
    assert!(message("t\n0\n").contains("found no columns beside the time"));
}

#[test]
fn mistakes_in_the_rows_name_line_and_column() {
    assert!(message("t,f0_x,f0_y,f0_z\n").contains("lift.csv:1: found the end of the file"));
    assert!(message("t,f0_x,f0_y,f0_z\n0,1,2,nan\n").contains("lift.csv:2: column `f0_z`: found `nan`"));
    assert!(message("t,f0_x,f0_y,f0_z\n1,1,2,3\n0,1,2,3\n").contains("lift.csv:3: column `t`"));
}

#[test]
fn a_million_rows_are_read_and_played() {
    use std::fmt::Write;
    let mut text = String::from("t,f0_x,f0_y,f0_z\r\n");
    for row in 0..1_000_000 {
        writeln!(text, "{}.{:03},0.123456789,{row},-0.000123\r", row / 1000, row % 1000).unwrap();
    }
    let mut player = play(&text);
    for row in (0..1_000_000).step_by(997) {
        let y = player.position(0, f64::from(row) / 1000.0).unwrap().y;
        assert_eq!(y, f64::from(row));
    }
}

fn rows() -> impl Strategy<Value = Vec<(f64, [f64; 3])>> {
    let row = (1e-9..10.0_f64, prop::array::uniform3(-1e3..1e3_f64));
    prop::collection::vec(row, 1..50).prop_map(|mut rows| {
        let mut time_s = -5.0;
        for row in &mut rows {
            time_s += row.0;
            row.0 = time_s;
        }
        rows
    })
}

fn csv(rows: &[(f64, [f64; 3])]) -> String {
    let lines = rows.iter().map(|(t, [x, y, z])| format!("{t},{x},{y},{z}\n"));
    std::iter::once("t,f0_x,f0_y,f0_z\n".to_owned()).chain(lines).collect()
}

proptest! {
    #[test]
    fn at_the_time_of_a_row_the_position_is_bit_identical(mut rows in rows()) {
        rows[0].1[0] = -0.0;
        let mut player = play(&csv(&rows));
        for (time_s, point) in &rows {
            let position: [f64; 3] = player.position(0, *time_s).unwrap().into();
            prop_assert_eq!(position.map(f64::to_bits), point.map(f64::to_bits));
        }
    }

    /// Oracle: search the two rows from scratch; asked in any order of times.
    #[test]
    fn any_order_of_questions_gives_the_same_answers(
        rows in rows(), times in prop::collection::vec(-10.0..100.0_f64, 1..50),
    ) {
        let mut player = play(&csv(&rows));
        for time_s in times {
            let found = Vector3::from(slow_position(&rows, time_s));
            let difference = player.position(0, time_s).unwrap() - found;
            // Two ways to blend numbers up to 1000: a few units in the last place, times
            // three coordinates.
            prop_assert!(difference.norm() <= 16.0 * f64::EPSILON * 1e3);
        }
    }

    #[test]
    fn no_text_panics(text in any::<String>(), rest in "[t,f0_xyz1-9.e+\\- \r\n]{0,80}") {
        for text in [&text, &rest, &format!("t,f0_x,f0_y,f0_z\n{rest}")] {
            if let Ok(script) = parse(text, &["f0", "f1"]) {
                let _ = HandPlayer::new(script).position(0, 0.5);
            }
        }
    }
}

fn slow_position(rows: &[(f64, [f64; 3])], time_s: f64) -> [f64; 3] {
    let Some(after) = rows.iter().position(|(t, _)| *t > time_s) else {
        return rows[rows.len() - 1].1;
    };
    let Some(before) = after.checked_sub(1) else { return rows[0].1 };
    let ((t0, a), (t1, b)) = (rows[before], rows[after]);
    std::array::from_fn(|i| (a[i] * (t1 - time_s) + b[i] * (time_s - t0)) / (t1 - t0))
}

/// A quarter turn around y in a second, written with the other sign at its end; a button that is let go.
const TURNING: &str = "t,f0_x,f0_y,f0_z,f0_qw,f0_qx,f0_qy,f0_qz,f0_buttons,f1_x,f1_y,f1_z\n\
     0,0,0,0,1,0,-0.0,0,1,1,1,1\n1,1,-2,4,-0.7071067811865476,0,-0.7071067811865476,0,4294967295,1,1,1\n\
     3,1,-2,0,0,0,1,0,0,2,1,1\n";

#[test]
fn positions_are_the_same_bits_with_and_without_columns_for_orientation_and_buttons() {
    let (mut plain, mut turning) = (play(TWO), play(TURNING));
    for step in -10..400 {
        let time_s = f64::from(step) * 0.01;
        for finger in 0..2 {
            let bits = |p: Option<Vector3<f64>>| p.map(|p| <[f64; 3]>::from(p).map(f64::to_bits));
            assert_eq!(
                bits(plain.position(finger, time_s)),
                bits(turning.position(finger, time_s)),
                "{finger} at {time_s}"
            );
        }
    }
}

#[test]
fn orientations_take_the_shorter_way_and_are_held_outside() {
    let mut player = play(TURNING);
    let angle = |player: &mut HandPlayer, time_s| player.orientation(0, time_s).unwrap().angle().to_degrees();
    // Half of the way is exact by symmetry; a rounding or two in the normalisation, times 57 for degrees.
    for (time_s, degrees) in [(0.0, 0.0), (0.5, 45.0), (1.0, 90.0), (2.0, 135.0), (3.0, 180.0), (9.0, 180.0)]
    {
        assert!((angle(&mut player, time_s) - degrees).abs() < 1e-10, "{time_s}");
    }
    let bits = player.orientation(0, 0.0).unwrap().coords.as_slice().to_vec();
    assert_eq!(bits.iter().map(|n| n.to_bits()).collect::<Vec<_>>(), [0.0, -0.0, 0.0, 1.0].map(f64::to_bits));
    assert_eq!(player.orientation(0, f64::NAN), Some(UnitQuaternion::identity()));
    assert_eq!(player.orientation(1, 0.0), None);
    assert_eq!(player.orientation(7, 0.0), None);
    assert!(player.script().has_orientation(0) && !player.script().has_orientation(1));
}

#[test]
fn buttons_are_held_until_the_next_row() {
    let mut player = play(TURNING);
    for (time_s, buttons) in
        [(-1.0, 1), (0.0, 1), (0.999, 1), (1.0, u32::MAX), (2.999, u32::MAX), (3.0, 0), (9.0, 0), (0.5, 1)]
    {
        assert_eq!(player.buttons(0, time_s), Some(buttons), "{time_s}");
    }
    assert_eq!(player.buttons(1, 0.0), None);
    assert!(player.script().has_buttons(0) && !player.script().has_buttons(1));
}

#[test]
fn a_part_of_an_orientation_or_no_position_is_refused_with_the_missing_column() {
    assert_eq!(
        message("t,f0_x,f0_y,f0_z,f0_qw,f0_qx,f0_qz\n0,0,0,0,1,0,0\n"),
        "hands/lift.csv:1: column `f0_qy`: found no such column, allowed: all four numbers of finger f0's \
         orientation, or none"
    );
    for columns in ["f0_buttons", "f0_qw,f0_qx,f0_qy,f0_qz"] {
        assert_eq!(
            message(&format!("t,{columns}\n0\n")),
            "hands/lift.csv:1: column `f0_x`: found no such column, allowed: orientation and buttons of finger \
             f0 together with its three coordinates"
        );
    }
}

#[test]
fn orientations_and_buttons_that_are_none_are_refused_with_their_line() {
    let of = |w: &str, buttons: &str| {
        message(&format!(
            "t,f0_x,f0_y,f0_z,f0_qw,f0_qx,f0_qy,f0_qz,f0_buttons\n0,0,0,0,0.9,0,0,0,0\n1,0,0,0,{w},0,0,0,{buttons}\n"
        ))
    };
    assert_eq!(
        of("2", "0"),
        "hands/lift.csv:3: column `f0_qw`: found an orientation of length 2, allowed: 0.9 to 1.1, which is then \
         made 1"
    );
    assert!(of("0", "0").contains("found an orientation of length 0"));
    for buttons in ["-1", "4294967296", "0.5", "1e3", "nan", "left"] {
        let message = of("1", buttons);
        assert!(
            message.contains("lift.csv:3: column `f0_buttons`")
                && message.contains("a whole number from 0 to 4294967295"),
            "{message}"
        );
    }
}

proptest! {
    /// Oracle: an even turn. The straight line between quaternions of which one is at most 90 degrees of rotation
    /// from the other runs ahead or behind by at most 0.94 degrees, at a quarter of the way or so.
    #[test]
    fn an_orientation_is_near_the_even_turn_and_unit(
        axis in prop::array::uniform3(-1.0..1.0_f64), degrees in 0.0..90.0_f64, part in 0.0..1.0_f64, flip: bool,
    ) {
        let axis = Vector3::from(axis);
        prop_assume!(axis.norm() > 0.1);
        let end = UnitQuaternion::from_scaled_axis(axis.normalize() * degrees.to_radians());
        let sign = if flip { -1.0 } else { 1.0 };
        let [x, y, z, w]: [f64; 4] = (end.coords * sign).into();
        let mut player = play(&format!(
            "t,f0_x,f0_y,f0_z,f0_qw,f0_qx,f0_qy,f0_qz\n0,0,0,0,1,0,0,0\n1,0,0,0,{w},{x},{y},{z}\n"
        ));
        let turn = player.orientation(0, part).unwrap();
        prop_assert!((turn.norm() - 1.0).abs() < 1e-15);
        let even = UnitQuaternion::identity().slerp(&end, part);
        prop_assert!(turn.angle_to(&even).to_degrees() < 0.95);
    }
}
