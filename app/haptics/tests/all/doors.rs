//! Fingers that go through doors: what they feel on the way, what they feel on either side, and that nobody comes in
//! otherwise.
#![allow(non_snake_case)]

use crate::{common, counting, tardis, trees};

use common::*;
use haptics::{Cuboid, Entity, FADE_S, Finger, Friction, Plane, Shape};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use tardis::*;
use trees::v;

/// A step of half a millimetre changes a spring's force by so much (N).
const A_STEP_N: f64 = K * 5e-4;

fn hulls() -> [(&'static str, Shape); 2] {
    [("solid", solid_hull()), ("open", open_hull())]
}

#[test]
fn a_finger_goes_in_touches_a_wall_that_lies_outside_of_the_hull_and_comes_out() {
    for (name, hull) in hulls() {
        let mut visit = Visit::new(hull, &Friction::None, 0.0);
        visit.go(v(0.01, 0.0, 0.1));
        let (out, jump) = visit.go(v(0.01, 0.0, -0.1));
        assert_eq!(
            (visit.space(), out.entity, jump),
            (INSIDE, None, 0.0),
            "{name}: behind the hull's own back"
        );
        // 5 mm into the right wall, twice as far aside as the hull reaches four times.
        let (out, _) = visit.go(v(0.205, 0.0, -0.1));
        assert_eq!(out.entity, Some(4), "{name}");
        // Differences of numbers of 0.2.
        assert!((out.force_on_user_W + Vector3::x() * K * 5e-3).norm() < 1e-12, "{name}: {out:?}");
        visit.go(v(0.01, 0.0, -0.1));
        let (out, jump) = visit.go(v(0.01, 0.0, 0.1));
        assert_eq!((visit.space(), out.entity, jump), (0, None, 0.0), "{name}: out again");
        visit.go(v(0.04, 0.04, 0.06));
        let (out, _) = visit.go(v(0.04, 0.04, 0.045));
        assert_eq!((visit.space(), out.entity), (0, Some(0)), "{name}");
        assert!((out.force_on_user_W - Vector3::z() * K * 5e-3).norm() < 1e-12, "{name}: {out:?}");
    }
}

#[test]
fn beside_the_door_the_hull_holds_and_from_within_the_walls_do() {
    for (name, hull) in hulls() {
        for aside in [v(0.021, 0.0, 0.0), v(-0.03, 0.0, 0.0), v(0.0, 0.031, 0.0), v(0.0, -0.04, 0.0)] {
            let mut visit = Visit::new(hull.clone(), &Friction::None, 0.0);
            visit.go(aside + v(0.0, 0.0, 0.06));
            let (out, _) = visit.go(aside + v(0.0, 0.0, 0.047));
            assert_eq!((visit.space(), out.entity), (0, Some(0)), "{name} {aside:?}");
            assert!((out.force_on_user_W.z - K * 3e-3).abs() < 1e-12, "{name} {aside:?}: {out:?}");

            let mut visit = Visit::new(hull.clone(), &Friction::None, 0.0);
            visit.finger = visit.finger.within(INSIDE);
            visit.go(aside);
            let (out, _) = visit.go(aside + v(0.0, 0.0, 0.053));
            assert_eq!((visit.space(), out.entity), (INSIDE, Some(6)), "{name} {aside:?}");
            assert!((out.force_on_user_W.z + K * 3e-3).abs() < 1e-12, "{name} {aside:?}: {out:?}");
        }
    }
}

#[test]
fn a_finger_that_is_within_from_the_beginning_feels_the_room_alone() {
    let mut visit = Visit::new(solid_hull(), &Friction::None, 0.0);
    visit.finger = visit.finger.within(INSIDE);
    // In the middle of the solid hull, and through its side.
    let (out, jump) = visit.go(v(0.0, 0.0, 0.0));
    assert_eq!((out.entity, jump), (None, 0.0));
    let (out, jump) = visit.go(v(0.1, 0.0, 0.0));
    assert_eq!((visit.space(), out.entity, jump), (INSIDE, None, 0.0));
}

#[test]
fn a_door_is_where_its_hull_is_however_that_is_turned_and_moved() {
    for (name, hull) in hulls() {
        let mut visit = Visit::new(hull, &Friction::None, 0.0);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.7);
        let at = Isometry3::from_parts(v(-0.02, 0.03, -0.15).into(), turn);
        (visit.entities[0].X_WB, visit.entities[0].previous_X_WB) = (at, at);
        let seen = |x, y, z| (at * nalgebra::Point3::new(x, y, z)).coords;
        visit.go(seen(0.01, 0.02, 0.1));
        let (out, jump) = visit.go(seen(0.01, 0.02, -0.04));
        assert_eq!((visit.space(), out.entity, jump), (INSIDE, None, 0.0), "{name}");
        let mut visit = Visit {
            finger: Finger::new(0.0, 8).unwrap(),
            passage: haptics::Passage::new(&visit.doors),
            ..visit
        };
        visit.go(seen(0.03, 0.02, 0.1));
        let (out, _) = visit.go(seen(0.03, 0.02, 0.045));
        assert_eq!((visit.space(), out.entity), (0, Some(0)), "{name}");
    }
}

#[test]
fn a_hull_that_moves_over_a_resting_finger_takes_it_in_by_the_door_only() {
    for (name, hull) in hulls() {
        for (x, space) in [(0.0, INSIDE), (0.03, 0)] {
            let mut visit = Visit::new(hull.clone(), &Friction::None, 0.0);
            let here = v(x, 0.0, 0.06);
            visit.step(here);
            for tick in 1..=40 {
                visit.entities[0].move_to(Isometry3::translation(0.0, 0.0, 5e-4 * f64::from(tick)));
                visit.step(here);
            }
            assert_eq!(visit.space(), space, "{name} {x}");
            // 10 mm deep where the hull holds it; in the room's front wall otherwise, whose place is where it was.
            let held = visit.finger.contact(0).map_or(0.0, |contact| contact.force_on_user_W.z);
            assert!((held - if space == 0 { K * 0.01 } else { 0.0 }).abs() < 1e-9, "{name} {x}: {held}");
        }
    }
}

#[test]
fn one_tick_is_enough_to_go_in_or_out_and_not_through_the_hull() {
    for (name, hull) in hulls() {
        let mut visit = Visit::new(hull, &Friction::None, 0.0);
        visit.step(v(0.0, 0.0, 0.2));
        // The way goes through the hull's back, which is not in the way of who is inside.
        let out = visit.step(v(0.0, 0.0, -0.2));
        assert_eq!(
            (visit.space(), out.entity, out.force_on_user_W),
            (INSIDE, None, Vector3::zeros()),
            "{name}"
        );
        // As far, and into the opposite wall: met on the way, in this very tick.
        visit.step(v(0.0, 0.0, 0.2));
        assert_eq!(visit.space(), 0, "{name}");
        let out = visit.step(v(0.0, 0.0, -0.36));
        assert_eq!((visit.space(), out.entity), (INSIDE, Some(5)), "{name}");
        assert!((out.force_on_user_W.z - K * 0.01).abs() < 1e-9, "{name}: {out:?}");
        visit.step(v(0.0, 0.0, 0.2));
        visit.step(v(0.03, 0.0, 0.2));
        let out = visit.step(v(0.03, 0.0, 0.04));
        assert_eq!((visit.space(), out.entity), (0, Some(0)), "{name}: beside it");
        // Aslant: what counts is where the way meets the door, not where it ends.
        visit.step(v(0.0185, 0.0, 0.0505));
        visit.step(v(0.0215, 0.0, 0.0485));
        assert_eq!(visit.space(), INSIDE, "{name}");
    }
}

#[test]
fn who_is_held_back_in_front_of_a_door_is_not_through_it() {
    for (name, hull) in hulls() {
        let mut entities = Visit::new(hull, &Friction::None, 0.0).entities;
        // A box of 2 cm that stands before the door.
        let at = Isometry3::translation(0.0, 0.0, 0.065);
        entities.push(Entity::new(Cuboid::new([0.1, 0.1, 0.02]).unwrap(), at, K).unwrap());
        let mut visit = Visit::of(entities, 0.0);
        visit.step(v(0.0, 0.0, 0.1));
        // 27 mm deep in the box, 2 mm beyond the door: a point in front of the box's middle, so it is held by its front.
        for z in [0.09, 0.07, 0.06, 0.052, 0.048] {
            let out = visit.step(v(0.0, 0.0, z));
            assert_eq!(visit.space(), 0, "{name} {z}");
            let held = if z < 0.075 { K * (0.075 - z) } else { 0.0 };
            assert!((out.force_on_user_W.z - held).abs() < 1e-9, "{name} {z}: {out:?}");
        }
    }
}

/// A floor at the door's lower edge, in front of it and, perhaps, behind.
fn with_floors(hull: Shape, friction: &Friction, goes_on: bool) -> Visit {
    let mut entities = vec![entity(hull, Friction::None)];
    entities.extend(room(if goes_on { -HALF[1] } else { -0.2 }));
    entities.push(entity(Plane::new(Vector3::y(), -HALF[1]).unwrap(), Friction::None));
    for floor in [1, 7] {
        entities[floor] = entities[floor].clone().with_friction(friction.clone()).unwrap();
    }
    Visit::of(entities, 0.0)
}

#[test]
fn a_finger_that_is_drawn_over_a_floor_through_the_door_feels_one_floor() {
    for (name, hull) in hulls() {
        for friction in [Friction::None, Friction::coulomb(0.5).unwrap(), stiction()] {
            let mut visit = with_floors(hull.clone(), &friction, true);
            let low = -HALF[1] - 2e-3;
            visit.go(v(0.0, 0.0, 0.1));
            visit.go(v(0.0, low, 0.1));
            let (here, jump) = visit.go(v(0.0, low, 0.0));
            assert_eq!((visit.space(), here.entity), (INSIDE, Some(1)), "{name} {friction:?}");
            // A floor without any door.
            let mut plain = Visit::of(vec![visit.entities[7].clone()], 0.0);
            plain.doors.clear();
            plain.go(v(0.0, 0.0, 0.1));
            plain.go(v(0.0, low, 0.1));
            let (there, plain_jump) = plain.go(v(0.0, low, 0.0));
            // The new contact begins a micrometre above the floor and so that much beside.
            let differs = (here.force_on_user_W - there.force_on_user_W).norm();
            assert!(differs < K * 4e-6, "{name} {friction:?}: {differs}");
            assert!(jump < plain_jump + A_STEP_N, "{name} {friction:?}: {jump} {plain_jump}");
            let (_, jump) = visit.go(v(0.0, low, 0.1));
            assert_eq!(visit.space(), 0, "{name} {friction:?}: and out");
            assert!(jump < plain_jump + 3.0 * A_STEP_N, "{name} {friction:?}: {jump}");
        }
    }
}

#[test]
fn a_floor_that_ends_at_the_door_is_left_without_a_jump() {
    for moves in [false, true] {
        let mut visit = with_floors(solid_hull(), &stiction(), false);
        if moves {
            visit.moves = |entity| entity == 7;
        }
        let low = -HALF[1] - 2e-3;
        visit.go(v(0.0, 0.0, 0.1));
        visit.go(v(0.0, low, 0.1));
        let (mut last, mut jump) = (visit.step(v(0.0, low, 0.1)), 0.0f64);
        for tick in 1..200 {
            let out = visit.step(v(0.0, low, 0.1 - 5e-4 * f64::from(tick)));
            jump = jump.max((out.force_on_user_W - last.force_on_user_W).norm());
            last = out;
        }
        assert_eq!((visit.space(), last.force_on_user_W), (INSIDE, Vector3::zeros()));
        let pressed = K * 2e-3;
        // All of 2 mm within 20 ticks; of what moves nothing is felt that did not move it.
        let most = if moves { 2.0 * pressed } else { pressed * (DT / FADE_S) * 1.5 + A_STEP_N };
        assert!(jump < most, "{moves}: {jump} of {pressed}");
        assert_eq!(jump > 0.9 * pressed, moves, "{jump}");
    }
}

#[test]
fn a_finger_that_is_pressed_on_the_hull_slides_into_the_opening_and_goes_through() {
    for (name, hull) in hulls() {
        for friction in [Friction::None, Friction::coulomb(0.4).unwrap(), stiction()] {
            for depth in [1e-3, 8e-3] {
                let mut visit = Visit::new(hull.clone(), &friction, 0.0);
                visit.go(v(0.035, 0.0, 0.06));
                visit.go(v(0.035, 0.0, DOOR_Z - depth));
                let (out, _) = visit.go(v(0.0, 0.0, DOOR_Z - depth));
                assert_eq!((visit.space(), out.entity), (INSIDE, None), "{name} {friction:?} {depth}");
                // And the same way out: on the room's front wall, and off it.
                visit.go(v(0.035, 0.0, DOOR_Z - depth));
                let (out, _) = visit.go(v(0.035, 0.0, DOOR_Z + depth));
                assert_eq!((visit.space(), out.entity), (INSIDE, Some(6)), "{name} {friction:?} {depth}");
                let (out, _) = visit.go(v(0.0, 0.0, DOOR_Z + depth));
                assert_eq!((visit.space(), out.entity), (0, None), "{name} {friction:?} {depth}");
            }
        }
    }
}

#[test]
fn what_pressed_beside_the_opening_fades_when_a_finger_slides_into_it() {
    for (friction, radius) in
        [(Friction::None, 0.0), (Friction::coulomb(0.4).unwrap(), 0.0), (Friction::None, 2e-3)]
    {
        for out_again in [false, true] {
            let depth = if out_again { -0.02 } else { 0.02 };
            let mut visit = Visit::new(solid_hull(), &friction, radius);
            if out_again {
                visit.finger = visit.finger.within(INSIDE);
                visit.go(v(0.035, 0.0, 0.0));
            } else {
                visit.go(v(0.035, 0.0, 0.06));
            }
            let (pressing, _) = visit.go(v(0.035, 0.0, DOOR_Z - depth));
            let pressed = pressing.force_on_user_W.norm();
            assert!(pressed > 0.9 * K * 0.02, "{pressed}");
            let (_, jump) = visit.go(v(0.0, 0.0, DOOR_Z - depth));
            // All of it within 20 ticks.
            assert!(jump < pressed * (DT / FADE_S) * 1.1 + 3.0 * A_STEP_N, "{radius} m: {jump} of {pressed}");
            let still = (0..21).map(|_| visit.step(v(0.0, 0.0, DOOR_Z - depth)).force_on_user_W.norm());
            assert_eq!(still.last(), Some(0.0), "{radius} m");
        }
    }
}

#[test]
fn a_ball_goes_through_an_opening_that_it_fits_and_feels_the_rim_of_one_that_is_there() {
    let radius = 5e-3;
    for (name, hull) in hulls() {
        let mut visit = Visit::new(hull.clone(), &Friction::None, radius);
        visit.go(v(0.0, 0.0, 0.1));
        let (out, jump) = visit.go(v(0.0, 0.0, -0.1));
        assert_eq!(
            (visit.space(), out.entity, jump),
            (INSIDE, None, 0.0),
            "{name}: in the middle nothing is felt"
        );
        let (out, jump) = visit.go(v(0.0, 0.0, 0.1));
        assert_eq!((visit.space(), out.entity, jump), (0, None, 0.0), "{name}");
        // Beside it the wall is felt a radius before, from either side.
        visit.go(v(0.03, 0.0, 0.1));
        let (out, _) = visit.go(v(0.03, 0.0, DOOR_Z + 3e-3));
        assert!((out.force_on_user_W.z - K * 2e-3).abs() < 1e-9, "{name}: {out:?}");
    }
    // 4 mm from the rim: the rim is felt, harder until the centre is in its plane, and then fades.
    let mut visit = Visit::new(open_hull(), &Friction::None, radius);
    visit.go(v(0.016, 0.0, 0.1));
    let (out, _) = visit.go(v(0.016, 0.0, DOOR_Z + 1e-4));
    assert!((out.force_on_user_W + Vector3::x() * K * 1e-3).norm() < 0.1 * K * 1e-3, "{out:?}");
    let (out, jump) = visit.go(v(0.016, 0.0, 0.0));
    assert_eq!((visit.space(), out.force_on_user_W), (INSIDE, Vector3::zeros()));
    assert!(jump < A_STEP_N, "{jump}");
    // A solid hull has no rim, but the ball's place is the same.
    let mut visit = Visit::new(solid_hull(), &Friction::None, radius);
    visit.go(v(0.016, 0.0, 0.1));
    let (out, jump) = visit.go(v(0.016, 0.0, 0.0));
    assert_eq!((visit.space(), out.entity, jump), (INSIDE, None, 0.0));
}

#[test]
fn what_is_in_another_space_is_not_felt_and_does_not_pull() {
    let own = |space| ball(0.05, Friction::None).within(space);
    let mut finger = point_finger();
    assert_eq!(finger.step(&[own(INSIDE)], &v(0.0, 0.04, 0.0), DT).entity, None);
    assert_eq!(finger.step(&[own(0)], &v(0.0, 0.04, 0.0), DT).entity, Some(0));
    assert_eq!(finger.step(&[own(INSIDE)], &v(0.0, 0.04, 0.0), DT).entity, None, "its contact is over");
}

/// Whether a god-object that was there and is here now went through the door: +1 in, -1 out; `None`: that is not to be seen
/// from outside.
///
/// On the door's plane, which is a wall everywhere else, it slid along first: by no more than this, of which nobody tells
/// how far.
fn signed_crossing(from: &Vector3<f64>, to: &Vector3<f64>, slid_m: f64) -> Option<i32> {
    let (before, after) = (from.z - DOOR_Z, to.z - DOOR_Z);
    let slides = before.abs() < 2e-6;
    let at = if slides { *to } else { from + (to - from) * (before / (before - after)) };
    let beside_m = (at.x.abs() - HALF[0]).max(at.y.abs() - HALF[1]);
    let way = match (before > -2e-6 && after < -1e-6, before < 2e-6 && after > 1e-6) {
        (true, false) => 1,
        (false, true) => -1,
        _ => return Some(0),
    };
    // Who comes beside it is held there, and may slide into it in the same tick.
    if beside_m.abs() < slid_m && (slides || beside_m > 0.0) {
        return None;
    }
    Some(if beside_m < 1e-6 { way } else { 0 })
}

/// How often walks went through the door, and how often nobody could tell.
#[derive(Default)]
struct Told {
    crossings: u32,
    untold: u32,
}

/// A walk that goes on in its direction for a while, about the door; whether it ends inside.
fn walk(visit: &mut Visit, noise: &mut Noise, ticks: u32, told: &mut Told) -> bool {
    let speed = 10f64.powf(noise.between(-4.0, -1.7));
    let mut hip = v(noise.between(-0.06, 0.06), noise.between(-0.06, 0.06), noise.between(0.052, 0.12));
    let mut way = noise.vector(speed);
    visit.step(hip);
    let (mut from, mut is_inside) = (hip, false);
    for _ in 0..ticks {
        if noise.uniform() < 0.1 {
            let home = v(0.0, 0.0, noise.between(0.03, 0.07)) - hip;
            way = noise.vector(0.5 * speed) + home.cap_magnitude(speed);
        }
        let slid_m = (hip - from).norm() + way.norm();
        hip += way;
        let out = visit.step(hip);
        // Where all that it touches holds it.
        let to =
            hip + visit.finger.contacts().map(|contact| contact.god_object_W - hip).sum::<Vector3<f64>>();
        match signed_crossing(&from, &to, slid_m) {
            Some(crossed) if crossed == if is_inside { -1 } else { 1 } => {
                is_inside = !is_inside;
                told.crossings += 1;
            }
            Some(_) => {}
            None => {
                told.untold += u32::from(is_inside != (visit.space() == INSIDE));
                is_inside = visit.space() == INSIDE;
            }
        }
        assert_eq!(visit.space() == INSIDE, is_inside, "from {from:?} to {to:?}: {out:?}");
        // Walls have no other hole: who is in the room is in the room.
        let is_in_room = to.x.abs() < 0.2 + 1e-9 && to.z > -0.35 - 1e-9 && to.z < DOOR_Z + 2e-6;
        assert!(!is_inside || is_in_room, "{to:?}");
        assert!(out.force_on_user_W.iter().all(|x| x.is_finite()));
        from = to;
    }
    is_inside
}

#[test]
fn ten_thousand_random_walks_end_where_the_crossings_of_the_door_say() {
    let (mut noise, mut told, mut inside) = (Noise(19), Told::default(), 0);
    for number in 0..10_000 {
        // With friction the god-object is where the surface holds it. In the plane of the door it could be in the opening,
        // and through it, within one tick: of that nothing is seen outside.
        let sticks = number % 4 == 0;
        let hull = if number % 4 < 2 { open_hull_once() } else { solid_hull() };
        let mut visit = Visit::new(hull, &Friction::None, 0.0);
        if sticks {
            visit.entities[0] = visit.entities[0].clone().with_friction(stiction()).unwrap();
        }
        inside += u32::from(walk(&mut visit, &mut noise, 300, &mut told));
    }
    let Told { crossings, untold } = told;
    println!("{crossings} crossings and {untold} that nobody could tell, {inside} ended inside");
    assert!(crossings > 10_000 && inside > 1000 && untold < crossings / 4, "{crossings} {untold} {inside}");
}

/// Built once.
fn open_hull_once() -> Shape {
    static HULL: std::sync::OnceLock<Shape> = std::sync::OnceLock::new();
    HULL.get_or_init(open_hull).clone()
}

#[test]
fn a_step_through_a_door_never_allocates() {
    for (name, hull) in hulls() {
        for radius in [0.0, 5e-3] {
            let mut visit = Visit::new(hull.clone(), &stiction(), radius);
            visit.step(v(0.0, 0.0, 0.06));
            let before = counting::CALLS.get();
            let mut changes = 0;
            for tick in 0..20_000 {
                let was = visit.space();
                let t = f64::from(tick) * DT;
                visit.step(v(0.03 * (7.0 * t).sin(), 0.0, DOOR_Z + 0.02 * (31.0 * t).cos()));
                changes += u32::from(visit.space() != was);
            }
            assert_eq!(counting::CALLS.get() - before, 0, "{name} {radius}");
            assert!(changes > 20, "{name} {radius}: {changes}");
        }
    }
}
