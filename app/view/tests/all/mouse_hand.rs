//! How a mouse moves a hand, without a window.

use eframe::egui::{Pos2, Rect, pos2, vec2};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use std::sync::Arc;
use view::hand::{Cue, FINE, MouseHand, NOTCH_M, Seen};
use view::pick::Picker;
use view::{FingerMoment, Moment, Stage, Thing, Triangles};
use world::SceneCamera;

const REACH: [Vector3<f64>; 2] = [Vector3::new(-0.2, 0.0, -0.1), Vector3::new(0.2, 0.25, 0.1)];

/// From the front and above, as on the small table; turned to the left a little.
fn camera() -> SceneCamera {
    let eye = Point3::new(0.1, 0.2, 0.4);
    let pose = Isometry3::face_towards(&eye, &(eye + (eye - Point3::new(0.0, 0.04, 0.0))), &Vector3::y());
    SceneCamera { name: "c".into(), pose, field_of_view_deg: 30.0, near_m: 0.01, far_m: 10.0 }
}

fn part() -> Rect {
    Rect::from_min_size(pos2(100.0, 50.0), vec2(900.0, 600.0))
}

fn hand(fingers: usize) -> MouseHand {
    MouseHand::new(fingers, Vector3::new(0.02, 0.1, -0.01), REACH)
}

fn close(a: Pos2, b: Pos2) -> bool {
    // The window's places are f32: a thousand points to seven digits.
    (a - b).length() < 1e-3
}

#[test]
fn a_hand_that_is_dragged_stays_under_the_pointer() {
    let camera = camera();
    let seen = Seen::new(&camera, part());
    let mut hand = hand(3);
    let begun = hand.place();
    for by in [vec2(30.0, 0.0), vec2(-12.5, 40.0), vec2(3.0, -77.0)] {
        let before = seen.project(&hand.place()).expect("seen");
        hand.drag(by, &seen);
        let after = seen.project(&hand.place()).expect("seen");
        assert!(close(after, before + by), "{before:?} {after:?}");
    }
    // In the plane parallel to the picture.
    assert!((hand.place() - begun).dot(&seen.ahead()).abs() < 1e-12);
}

#[test]
fn the_wheel_moves_it_away_where_it_is_seen_and_shift_does_so_finely() {
    let camera = camera();
    let seen = Seen::new(&camera, part());
    let mut hand = hand(2);
    let (begun, at) = (hand.place(), seen.project(&hand.place()).expect("seen"));
    hand.wheel(3.0, false, &seen);
    assert!(((hand.place() - begun).dot(&seen.ahead()) - 3.0 * NOTCH_M).abs() < 1e-12);
    assert!(close(seen.project(&hand.place()).expect("seen"), at));
    hand.wheel(-3.0 / FINE, true, &seen);
    assert!((hand.place() - begun).norm() < 1e-12);
}

#[test]
fn nothing_is_wanted_where_devices_do_not_reach() {
    let camera = camera();
    let seen = Seen::new(&camera, part());
    let mut hand = hand(3);
    for by in [vec2(1e4, 0.0), vec2(-2e4, 2e4), vec2(0.0, -4e4)] {
        hand.drag(by, &seen);
        hand.wheel(f64::from(by.x + by.y), false, &seen);
        let [least, most] = REACH;
        for wish in hand.pass(0.016) {
            assert!(wish.place >= least && wish.place <= most, "{}", wish.place);
        }
    }
}

/// From the hand's place to each finger.
fn stands(hand: &mut MouseHand, dt_s: f64) -> Vec<Vector3<f64>> {
    let place = hand.place();
    hand.pass(dt_s).iter().map(|wish| wish.place - place).collect()
}

#[test]
fn two_fingers_oppose_each_other_and_of_three_the_thumb_the_others() {
    let camera = camera();
    let seen = Seen::new(&camera, part());
    let mut hand = hand(3);
    hand.face(&seen);
    for fingers in [2, 3] {
        hand.grip.set_fingers(fingers);
        let stands = stands(&mut hand, 0.0);
        let others = stands[1..fingers].iter().sum::<Vector3<f64>>() / (fingers - 1) as f64;
        assert!((stands[0] + others).norm() < 1e-15, "the thumb on one side, the others on the other");
        let across = others.normalize();
        assert!((across.dot(&seen.right()) - 1.0).abs() < 0.05 && across.y == 0.0, "left and right as seen");
        assert_eq!(hand.grip.fingers(), fingers);
    }
    hand.grip.set_fingers(1);
    let alone = stands(&mut hand, 0.0);
    assert_eq!(alone[0], Vector3::zeros());
    assert!(alone[1].y > 0.05 && alone[2].y > 0.05, "the others are out of the way");
    // There are no more than there are.
    hand.grip.set_fingers(9);
    assert_eq!(hand.grip.fingers(), 3);
    let mut poor = self::hand(1);
    poor.grip.set_fingers(2);
    assert_eq!((poor.grip.fingers(), poor.wishes().len()), (1, 1));
}

#[test]
fn a_grip_closes_gradually_to_less_than_what_is_held_and_opens_to_more() {
    let mut hand = hand(2);
    let width = |stands: &[Vector3<f64>]| (stands[1] - stands[0]).norm();
    let open_m = width(&stands(&mut hand, 0.0));
    assert!(open_m > 0.06, "around a cube of 5 cm");
    hand.grip.close();
    let mut last_m = open_m;
    for _ in 0..100 {
        let now_m = width(&stands(&mut hand, 0.016));
        // 0.08 m/s
        assert!(now_m <= last_m && last_m - now_m < 0.08 * 0.016 + 1e-12, "{last_m} {now_m}");
        last_m = now_m;
    }
    assert!(last_m < 0.02, "{last_m}");
    hand.grip.open();
    hand.pass(10.0);
    hand.grip.close();
    // Felt between two fingers it goes on slowly, and when it is enough no further; what one finger feels is not held.
    for (entities, force_n, pace) in
        [([Some(3), Some(4)], 1.5, 0.08), ([Some(3); 2], 0.5, 0.02), ([Some(3); 2], 1.2, 0.0)]
    {
        let felt = |entity| FingerMoment {
            entity,
            force: Vector3::new(force_n, 0.0, 0.0),
            ..FingerMoment::default()
        };
        let fingers = entities.map(felt).to_vec();
        hand.feel(&Moment { fingers, ..Moment::default() });
        let before_m = width(&stands(&mut hand, 0.0));
        let after_m = width(&stands(&mut hand, 0.1));
        assert!((before_m - after_m - 0.1 * pace).abs() < 1e-12, "{force_n} N: {before_m} {after_m}");
    }
    hand.grip.open();
    assert_eq!(width(&stands(&mut hand, 10.0)), open_m);
}

#[test]
fn who_walks_around_an_open_hand_finds_it_turned_along_and_one_that_holds_stays() {
    let mut camera = camera();
    let mut hand = hand(2);
    hand.face(&Seen::new(&camera, part()));
    let before = stands(&mut hand, 0.0);
    let quarter = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.7);
    camera.pose = Isometry3::from_parts(Vector3::zeros().into(), quarter) * camera.pose;
    hand.grip.close();
    hand.face(&Seen::new(&camera, part()));
    assert!((stands(&mut hand, 0.0)[0] - before[0]).norm() < 1e-15, "it holds something");
    hand.grip.open();
    hand.pass(1.0);
    hand.face(&Seen::new(&camera, part()));
    let turned = stands(&mut hand, 0.0);
    assert!((turned[0] - quarter * before[0]).norm() < 1e-12);
    hand.grip.turn(-0.7);
    let back = stands(&mut hand, 0.0);
    assert!((back[0] - before[0]).norm() < 1e-12, "and turned by hand");
}

/// A level square of 20 cm at this height.
fn square(height_m: f64) -> Thing {
    let places = [[-0.1, -0.1], [-0.1, 0.1], [0.1, 0.1], [0.1, -0.1]].map(|[x, z]| Point3::new(x, 0.0, z));
    let triangles = Triangles {
        places: places.to_vec(),
        normals: vec![Vector3::y(); 4],
        corners: vec![[0, 1, 2], [0, 2, 3]],
        ..Triangles::default()
    };
    Thing {
        entity: 0,
        triangles: Arc::new(triangles),
        pose: Isometry3::translation(0.0, height_m, 0.0),
        colour: [1.0; 4],
        is_coloured: true,
        texture: None,
        casts_shadow: true,
        space: 0,
    }
}

#[test]
fn the_ring_is_on_the_first_thing_straight_below_the_fingers() {
    let things = vec![square(0.0), square(0.03), square(0.2)];
    let picker = Picker::new(&Stage { things, ..Stage::default() });
    let finger = |x: f64| FingerMoment { hip: Vector3::new(x, 0.1, 0.02), ..FingerMoment::default() };
    // The whole is moved by 5 cm; one finger is beside it then.
    let moment = Moment {
        poses: vec![Isometry3::translation(0.05, 0.01, 0.0)],
        fingers: vec![finger(-0.06), finger(0.04)],
        ..Moment::default()
    };
    let cue = hand(2).cue(&picker, &moment).expect("something is below");
    // Sums and quotients of numbers below one.
    assert!((cue.from - Vector3::new(-0.01, 0.1, 0.02)).norm() < 1e-12, "{}", cue.from);
    assert!((cue.to - Vector3::new(-0.01, 0.04, 0.02)).norm() < 1e-12, "{}", cue.to);
    assert_eq!(cue.feet.len(), 1);
    assert!((cue.feet[0] - Vector3::new(0.04, 0.04, 0.02)).norm() < 1e-12);
    // What both fingers touch they hold.
    let touching = |finger: &FingerMoment| FingerMoment { entity: Some(0), ..*finger };
    let fingers = moment.fingers.iter().map(touching).collect();
    assert_eq!(hand(2).cue(&picker, &Moment { fingers, ..moment.clone() }), None);
    let below = |x: f64, y: f64| Cue::below(&picker, &moment, &[Vector3::new(x, y, 0.0)], |_| false);
    assert_eq!(below(0.3, 0.1), None, "beside everything");
    assert_eq!(below(0.0, -0.1), None, "below everything");
}

#[test]
fn fingers_stay_where_they_began_until_somebody_moves_the_hand_and_then_come_into_the_grip() {
    let starts = [Vector3::new(-0.1, 0.2, 0.05), Vector3::new(0.12, 0.05, 0.0)];
    let camera = camera();
    let seen = Seen::new(&camera, part());
    let mut hand = MouseHand::starting_at(&starts, REACH);
    for _ in 0..100 {
        hand.face(&seen);
        hand.drag(vec2(0.0, 0.0), &seen);
        let wishes = hand.pass(0.016);
        assert!(wishes.iter().zip(&starts).all(|(wish, start)| wish.place == *start));
    }
    hand.grip.close();
    let mut before: Vec<Vector3<f64>> = starts.to_vec();
    for _ in 0..100 {
        let wishes = hand.pass(0.016);
        for (wish, before) in wishes.iter().zip(&mut before) {
            // 0.15 m/s into the grip, and a finger's share of the grip's own 0.08 m/s.
            assert!((wish.place - *before).norm() < 0.2 * 0.016, "{} {before}", wish.place);
            *before = wish.place;
        }
    }
    let middle = 0.5 * (before[0] + before[1]);
    assert!((middle - hand.place()).norm() < 1e-9 && (before[0] - before[1]).norm() < 0.02, "{before:?}");
}
