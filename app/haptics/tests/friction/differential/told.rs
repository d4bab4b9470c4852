//! Inputs of a friction law in each tick, recorded by a law that writes them down.

use super::ground::{Drawn, GROUNDS, Ground};
use crate::common::{DEPTH, K, point_finger, table};
use haptics::{Friction, FrictionLaw, FrictionMemory, FrictionQuery, FrictionState};
use nalgebra::Vector3;
use std::sync::{Arc, Mutex};

/// Holds within this (m), and slides to its rim.
const CIRCLE_M: f64 = 1e-3;
const DT_S: f64 = 1e-3;

/// What was asked in one tick.
#[derive(Debug, Clone, Default)]
struct Asked {
    holds: Option<FrictionQuery>,
    last_slide: Option<FrictionQuery>,
    drag: Option<FrictionQuery>,
}

#[derive(Debug, Clone, Default)]
struct Clerk(Arc<Mutex<Asked>>);

impl FrictionLaw for Clerk {
    fn holds(&self, query: &FrictionQuery, _: &mut FrictionMemory) -> bool {
        *self.0.lock().unwrap() = Asked { holds: Some(*query), ..Asked::default() };
        query.gap_m <= CIRCLE_M
    }

    fn slide(&self, query: &FrictionQuery, _: &FrictionMemory) -> f64 {
        self.0.lock().unwrap().last_slide = Some(*query);
        query.gap_m - CIRCLE_M
    }

    fn held_limit_m(&self, _: &FrictionQuery, _: &FrictionMemory) -> f64 {
        CIRCLE_M
    }

    fn drag_m(&self, query: &FrictionQuery, _: &FrictionMemory) -> f64 {
        self.0.lock().unwrap().drag = Some(*query);
        0.0
    }
}

fn assert_near(found: f64, expected: f64, what: &str) {
    // Roundings of places of a centimetre, and 1e-12 of the depth where a slide ended.
    assert!((found - expected).abs() < 1e-14, "{what}: {found}, expected {expected}");
}

/// Out, sliding, back, still, and out again (m a tick).
fn steps() -> impl Iterator<Item = f64> {
    let pieces = [(4.1e-5, 60), (-4.3e-5, 80), (0.0, 3), (1.1e-4, 50), (-1e-5, 5), (0.0, 2), (7e-5, 20)];
    pieces.into_iter().flat_map(|(step_m, ticks)| std::iter::repeat_n(step_m, ticks))
}

#[test]
fn a_law_is_told_gap_and_load_which_way_the_finger_goes_and_how_far_the_god_object_moved() {
    for ground in GROUNDS {
        let clerk = Clerk::default();
        let mut drawn = Drawn::begin(ground, &Friction::own(clerk.clone()), DT_S);
        let (mut s, mut god, mut last_travel_m) = (0.0, 0.0, 0.0);
        let mut state = FrictionState::Stick;
        for (tick, step_m) in steps().enumerate() {
            s += step_m;
            let felt = drawn.to(s);
            let asked = clerk.0.lock().unwrap().clone();
            let told = asked.holds.expect("asked once in a tick");
            let name = |what: &str| format!("{ground:?}, tick {tick}, {what}");
            let gap_m = ground.gap_m(s, god);
            assert_eq!(told.state, state, "{}", name("state of the last tick"));
            assert_near(told.gap_m, gap_m.abs(), &name("gap"));
            assert_near(told.load_m, ground.load_m(s, god), &name("load"));
            assert_eq!((told.travel_m, told.dt_s, told.stiffness_n_per_m), (0.0, DT_S, K));
            let travel_m = (gap_m - ground.gap_m(s - step_m, god)).abs();
            assert_near(told.hip_travel_m, travel_m, &name("the HIP's way"));
            assert_near(told.hip_speed_m_s() * DT_S, told.hip_travel_m, &name("speed"));
            let way = if step_m == 0.0 { 0.0 } else { step_m.signum() };
            assert_near(told.gap_along_hip_m, gap_m * way, &name("gap along the HIP's way"));
            assert_near(told.last_travel_m, last_travel_m, &name("the god-object's last way"));
            assert!(told.last_travel_m == 0.0 || last_travel_m > 1e-13, "{}", name("rest is exactly zero"));
            // On the rim it rests, to rounding.
            let is_held = gap_m.abs() <= CIRCLE_M + 1e-13;
            state = if is_held { FrictionState::Stick } else { FrictionState::Slip };
            assert_eq!(asked.last_slide.is_none(), is_held, "{}", name("who is held does not slide"));
            if let Some(told) = asked.last_slide {
                // Asked before the slide, or after any part of it; on a ball the tangent plane turns with a slide.
                let turned_m = if ground == Ground::Ball { 0.06 * told.travel_m } else { 1e-14 };
                assert!(
                    (told.gap_m + told.travel_m - gap_m.abs()).abs() <= turned_m,
                    "{}: {told:?}",
                    name("slide")
                );
            }
            let gap_now_m = ground.gap_m(s, felt.god_m);
            match asked.drag {
                Some(told) => {
                    assert_eq!(told.state, state);
                    assert_near(told.gap_m, gap_now_m.abs(), &name("spring that is dragged beside"));
                    // The plane has turned meanwhile, by less than a milliradian on the ball.
                    let off_m = (told.gap_along_hip_m - gap_now_m * way).abs();
                    assert!(off_m <= 1e-6 * CIRCLE_M, "{}: {told:?}", name("its part along the HIP's way"));
                }
                None => assert_eq!(step_m, 0.0, "{}", name("only who moves is dragged")),
            }
            last_travel_m = ground.chord_m(felt.god_m - god).abs();
            god = felt.god_m;
        }
    }
}

#[test]
fn across_the_gap_nothing_of_it_is_along_the_motion() {
    let clerk = Clerk::default();
    let (entity, mut finger) = ([table(Friction::own(clerk.clone()))], point_finger());
    let mut told = |x: f64, z: f64| {
        finger.step(&entity, &Vector3::new(x, -DEPTH, z), DT_S);
        clerk.0.lock().unwrap().holds.unwrap()
    };
    told(0.0, 0.0);
    told(8e-4, 0.0);
    let across = told(8e-4, 1e-5);
    assert!((across.gap_along_hip_m - 1e-5).abs() < 1e-17, "only what that step itself made: {across:?}");
    let aslant = told(8e-4 - 3e-5, 1e-5 + 4e-5);
    assert!((aslant.gap_along_hip_m - (-0.6 * 7.7e-4 + 0.8 * 5e-5)).abs() < 1e-17, "{aslant:?}");
}
