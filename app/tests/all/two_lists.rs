//! The fast and the slow list through the whole fast step: frame in, command out.

use bytemuck::Zeroable;
use nalgebra::Vector3;
use phantom3::fast_step::{EventTeller, FastStep};
use phantom3::lists_end::ListsEnd;
use phantom3::rig::{HandMode, Rig};
use phantom3::row::{FingerRow, Row};
use phantom3::slow_thread::SlowThread;
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{Command, Frame};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use world::Scene;
use world::events::{Change, Kind, event_queue};
use world::lists::SlowList;

const DT: f64 = 1e-3;
const MASS: f64 = 0.1;
const ALL_SLOW: &str = "lists = { fast_bodies = 0 }\n";
const FLOATING: &str = "gravity_m_s2 = [0, 0, 0]\n[[finger]]\n";
const STANDING: &str = "[[finger]]\n[[entity]]\nname = \"floor\"\ndamping_n_s_per_m = 2.0\n\
                        shape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }\n\
                        friction = { model = \"coulomb\", mu = 0.3 }\n";

fn cube(rest: &str) -> String {
    format!(
        "[[entity]]\nname = \"cube\"\nshape = {{ kind = \"box\", size_m = [0.04, 0.04, 0.04] }}\n\
         position_m = [0, 0.02, 0]\nstiffness_n_per_m = 500\ndamping_n_s_per_m = 1\nfriction = {{ model = \"coulomb\", mu = 0.3 }}\n{rest}\n"
    )
}

fn step(scene: &str) -> FastStep {
    let file = Path::new("scene.toml");
    let scene = Scene::parse(scene, file).expect("a scene");
    let rig = Rig::new(file, scene, None, None, HandMode::Kinematic, 1_000_000).expect("a rig");
    rig.fast_step().expect("a step")
}

/// A run's steps; the slow list is stepped here, if it is at all.
struct Run {
    step: FastStep,
    slow: Option<SlowList>,
    tick: u64,
}

impl Run {
    fn new(scene: &str) -> Self {
        let mut step = step(scene);
        Self { slow: step.take_slow(), step, tick: 0 }
    }

    /// The first finger, of a tick in which it is there.
    fn tick(&mut self, hip: [f64; 3], slow_runs: bool) -> FingerRow {
        let (mut frame, mut row) = (Frame::zeroed(), Row::empty());
        (frame.tick, frame.device_count, frame.run_tick) = (self.tick + 1, 1, self.tick as i64);
        (frame.devices[0].flags, frame.devices[0].position_m_measured) = (DEVICE_POSITION_VALID, hip);
        self.step.step(&frame, &mut Command::zeroed(), &mut row);
        self.tick += 1;
        if let Some(slow) = self.slow.as_mut().filter(|_| slow_runs && self.tick.is_multiple_of(10)) {
            slow.turn(10, DT);
        }
        row.fingers[0]
    }

    fn here(&self) -> usize {
        self.step.handed().map_or(0, |(here, _)| here)
    }
}

/// Along x, against the middle of the cube's side, from a hand's breadth before it, 0.1 m/s.
fn pushing(tick: u64) -> [f64; 3] {
    [-0.12 + 1e-4 * tick as f64, 0.02, 0.0]
}

#[test]
fn a_slow_cube_that_nobody_hands_over_is_felt_as_one_that_is_fixed() {
    let mut stalled = Run::new(&format!("{ALL_SLOW}{STANDING}{}", cube("mass_kg = 0.1")));
    let mut fixed = Run::new(&format!("{STANDING}{}", cube("")));
    let mut most_n: f64 = 0.0;
    for tick in 0..1050 {
        let [felt, expected] = [&mut stalled, &mut fixed].map(|run| run.tick(pushing(tick), false));
        assert_eq!(felt, expected, "tick {tick}");
        most_n = most_n.max(felt.force_on_user.norm());
    }
    // 500 N/m, 4.9 mm deep; 1 N s/m, 0.1 m/s. Along the surface nothing moves.
    assert!((most_n - 2.55).abs() < 1e-9, "{most_n}");
    assert_eq!(stalled.here(), 0);
    // The slow list goes on: the cube comes, and gives way.
    for tick in 1050..1100 {
        stalled.tick(pushing(tick), true);
    }
    assert_eq!(stalled.here(), 1);
    assert!(stalled.step.bodies()[0].velocity.x > 0.05, "{:?}", stalled.step.bodies()[0]);
}

#[test]
fn what_nobody_hands_over_is_no_wall_and_is_not_flung_when_it_comes() {
    let row = cube("mass_kg = 0.1\ngrid = { count = [10, 1, 1], spacing_m = [0.1, 1, 1] }");
    for speed_m_s in [0.2, 1.5, 5.0] {
        let mut run = Run::new(&format!("{ALL_SLOW}{STANDING}{row}"));
        let (mut most_n, mut touched, mut gave_way) = (0.0_f64, 0, 0);
        let along = |tick: u64| -0.1 + speed_m_s * 1e-3 * tick as f64;
        let ticks = (1..).find(|tick| along(*tick) > 0.805).unwrap_or(0);
        for tick in 0..ticks {
            let felt = run.tick([along(tick), 0.03, 0.0], false);
            most_n = most_n.max(felt.force_on_user.norm());
            touched += u64::from(felt.entity.is_some());
            gave_way += u64::from(run.step.gives_way()[0]);
        }
        assert!((2.9..=3.0 + 1e-12).contains(&most_n), "{speed_m_s} m/s: {most_n}");
        // At 5 m/s the damper alone presses with more in each tick of a touch.
        let gave_way_always = speed_m_s * 1.0 > 3.0;
        assert!(gave_way > 0 && (touched > gave_way) != gave_way_always, "{touched} {gave_way}");
        assert!(touched >= gave_way && run.here() == 0, "{touched} {gave_way}");
        // The slow list goes on, while the finger stays where it is: within the ninth.
        let mut fastest_m_s = 0.0_f64;
        for _ in 0..200 {
            let felt = run.tick([along(ticks), 0.03, 0.0], true);
            // From there on it only falls: what the finger was behind by is forgotten.
            assert!(felt.force_on_user.norm() <= 3.0 + 1e-9, "{}", felt.force_on_user);
            let speeds = run.step.bodies().iter().map(|body| body.velocity.norm());
            fastest_m_s = fastest_m_s.max(speeds.fold(0.0, f64::max));
        }
        assert!(run.step.handed().expect("two lists").1.came > 0);
        // As fast as a spring with 3 N throws it.
        assert!(fastest_m_s < 3.0 / (500.0 * MASS).sqrt(), "{speed_m_s} m/s: {fastest_m_s}");
    }
}

#[test]
fn while_time_stands_still_what_nobody_hands_over_is_no_wall_either() {
    let mut run = Run::new(&format!("{ALL_SLOW}{STANDING}{}", cube("mass_kg = 0.1")));
    // It begins at x = -0.02.
    let along = |tick: u64| [-0.03 + 5e-4 * tick as f64, 0.02, 0.0];
    for tick in 0..60 {
        // As orders do that fade forces: within the cube 5 mm before the middle.
        if tick == 40 {
            run.step.set_strength(1.0, true);
        }
        let felt = run.tick(along(tick), false).force_on_user.norm();
        // What is bounded since the last tick grows by 500 N/m times 0.5 mm while nothing gives way.
        assert!(felt <= 3.0 + if tick < 40 { 1e-9 } else { 0.25 + 1e-9 }, "tick {tick}: {felt}");
        assert!(tick < 40 || felt >= 2.99, "tick {tick}: {felt}");
    }
}

/// A finger at 1.5 m/s through a row of cubes of which a tick steps no more than these: the largest force (N), the ticks in which
/// something gave way, and what is told of it.
fn through_a_row(most: usize) -> (f64, u64, Vec<Kind>) {
    let row = cube("mass_kg = 0.1\ngrid = { count = [30, 1, 1], spacing_m = [0.1, 1, 1] }");
    let mut run = Run::new(&format!("{STANDING}{row}"));
    let mut teller = EventTeller::new(&mut run.step);
    let (mut sender, mut told) = event_queue(8192);
    let (mut most_n, mut gave_way) = (0.0_f64, 0);
    for tick in 0..2100 {
        run.step.step_at_most(most);
        let felt = run.tick([-0.1 + 1.5e-3 * tick as f64, 0.02, 0.0], false);
        most_n = most_n.max(felt.force_on_user.norm());
        gave_way += u64::from(run.step.gives_way()[0]);
        let row = Row { run_tick: tick, ..Row::empty() };
        teller.tell(&run.step, &row, &mut sender);
    }
    // All are stepped again.
    run.step.step_at_most(usize::MAX);
    for tick in 2100..2250 {
        run.tick([3.05, 0.02, 0.0], false);
        teller.tell(&run.step, &Row { run_tick: tick, ..Row::empty() }, &mut sender);
    }
    let told = std::iter::from_fn(|| told.receive(u64::MAX)).map(|event| event.kind);
    let about = |kind: &Kind| matches!(kind, Kind::GaveWay { .. } | Kind::Overload { .. });
    (most_n, gave_way, told.filter(about).collect())
}

#[test]
fn a_row_that_a_finger_pushes_into_what_waits_for_its_turn_is_no_wall() {
    // Thirty that slide, and those that are struck: 0.3 m g each is 8.8 N.
    let (all_n, gave_way, told) = through_a_row(usize::MAX);
    assert!((9.0..20.0).contains(&all_n) && gave_way == 0 && told.is_empty(), "{all_n} {gave_way} {told:?}");
    for most in [4, 8, 16] {
        let (felt_n, gave_way, told) = through_a_row(most);
        assert!(felt_n < 2.0 * all_n && gave_way > 0, "{most}: {felt_n} N, {gave_way}");
        let yields = told.iter().filter(|kind| matches!(kind, Kind::GaveWay { finger: 0 })).count();
        assert!((1..=22).contains(&yields), "once in a tenth of a second: {yields}");
        let changes: Vec<_> = told
            .iter()
            .filter_map(|kind| {
                if let Kind::Overload { change, waiting } = kind { Some((change, waiting)) } else { None }
            })
            .collect();
        assert!(!changes.is_empty(), "{told:?}");
        for pair in changes.chunks(2) {
            let [(Change::Begins, first), (Change::Ends, at_most)] = pair else { panic!("{changes:?}") };
            assert!(**first > 0 && first <= at_most, "{changes:?}");
        }
    }
}

#[test]
fn what_two_fingers_hold_between_them_among_bodies_that_wait_is_held_as_ever() {
    // A row of cubes that touch; the first of them is between two fingers, with 24 N each.
    let row = cube("mass_kg = 0.1\ngrid = { count = [12, 1, 1], spacing_m = [0.0399, 1, 1] }");
    let scene = STANDING.replacen("[[finger]]", "[[finger]]\n[[finger]]", 1);
    let mut step = step(&format!("{scene}{row}"));
    let (mut waited, mut last) = (0, Row::empty());
    for tick in 0..1500_u64 {
        let aside_m = 0.02 + 0.01 - 2e-4 * tick.min(290) as f64;
        let (mut frame, mut row) = (Frame::zeroed(), Row::empty());
        (frame.tick, frame.device_count, frame.run_tick) = (tick + 1, 2, tick as i64);
        for (device, side) in frame.devices.iter_mut().zip([1.0, -1.0]) {
            (device.flags, device.position_m_measured) = (DEVICE_POSITION_VALID, [0.0, 0.02, side * aside_m]);
        }
        step.step_at_most(4);
        step.step(&frame, &mut Command::zeroed(), &mut row);
        waited += u64::from(step.made().held > 0);
        assert!(!step.gives_way().contains(&true), "{tick}");
        last = row;
    }
    // 500 N/m, 48 mm deep: past the middle, each on the side that it came from.
    let held = [0, 1].map(|finger| last.fingers[finger].force_on_user.norm());
    assert!(waited > 300 && held[0] > 10.0 && (held[0] - held[1]).abs() < 0.1, "{waited} {held:?}");
}

#[test]
fn a_large_island_that_has_not_come_yet_is_felt_as_one_that_is_fixed_until_all_of_it_is_there() {
    let row =
        |mass: &str| cube(&format!("{mass}\ngrid = {{ count = [60, 1, 1], spacing_m = [0.04, 1, 1] }}"));
    let mut coming = Run::new(&format!("{ALL_SLOW}{STANDING}{}", row("mass_kg = 0.1")));
    let mut fixed = Run::new(&format!("{STANDING}{}", row("")));
    let mut waited = 0;
    for tick in 0..1100 {
        // The slow side has one turn, when the finger is 4.9 mm deep.
        let [felt, expected] = [&mut coming, &mut fixed].map(|run| run.tick(pushing(tick), tick == 1049));
        match coming.here() {
            0 => assert_eq!(felt, expected, "tick {tick}"),
            here => assert_eq!(here, 60, "all at once, tick {tick}"),
        }
        waited += u32::from(tick > 1049 && coming.here() == 0);
    }
    // 60 cubes and their 119 pairs, of which none has touched yet, 64 parcels a tick: they are there in the third one.
    assert_eq!((waited, coming.here()), (2, 60));
    // Some 2 N on 6 kg.
    assert!(coming.step.bodies()[0].velocity.x > 1e-4, "it gives way: {:?}", coming.step.bodies()[0]);
}

#[test]
fn a_cube_that_was_slow_is_pushed_from_the_first_tick_like_one_that_never_was() {
    let scene = |lists: &str| format!("{lists}{STANDING}{}", cube("mass_kg = 0.1"));
    let mut runs = [Run::new(&scene(ALL_SLOW)), Run::new(&scene(""))];
    assert!(runs[0].slow.is_some() && runs[1].slow.is_none());
    // It comes to rest in either.
    for _ in 0..4000 {
        for run in &mut runs {
            run.tick(pushing(0), true);
        }
    }
    assert_eq!([runs[0].here(), runs[1].step.made().awake], [0, 0]);
    let mut touched = 0;
    for tick in 0..2000 {
        let [one, other] = runs.each_mut().map(|run| run.tick(pushing(tick), true));
        touched += u64::from(one.entity.is_some());
        // Both slept with the same corners on the floor; what is left are roundings.
        assert!((one.force_on_user - other.force_on_user).norm() < 1e-9, "tick {tick}: {one:?} {other:?}");
        let [one, other] = [&runs[0], &runs[1]].map(|run| run.step.bodies()[0]);
        assert!((one.position - other.position).norm() < 1e-9, "tick {tick}: {one:?} {other:?}");
    }
    assert!(touched > 500 && runs[0].here() == 1, "{touched}");
    assert!(runs[0].step.handed().expect("two lists").1.waits.most_ticks() <= 11);
}

#[test]
fn what_moves_when_it_is_handed_over_keeps_its_momentum_and_gets_what_the_user_feels() {
    // It floats towards a finger that waits for it, far away at first.
    let moving = cube("mass_kg = 0.1\nvelocity_m_s = [-0.1, 0.0, 0.0]\nrotation_locked = true");
    let mut run = Run::new(&format!("{ALL_SLOW}{FLOATING}{moving}"));
    let (mut was_slow, mut touched) = (false, 0);
    let mut momentum = Vector3::new(-0.1 * MASS, 0.0, 0.0);
    for tick in 0..2000 {
        let felt = run.tick([-0.1, 0.02, 0.0], true);
        was_slow |= run.here() == 0 && tick > 300;
        // As the tick began: what it has got by then.
        let state = run.step.bodies()[0];
        // Roundings of 0.01 kg m/s in a thousand sums.
        assert!((state.velocity * MASS - momentum).norm() < 1e-14, "tick {tick}: {state:?}");
        momentum -= felt.force_on_user * DT;
        touched += u64::from(felt.entity.is_some());
    }
    assert!(was_slow && touched > 10, "{touched}");
    assert!(momentum.x > 0.0, "it was thrown back: {momentum}");
}

/// A thousand balls that fly by below a finger at 1 m/s, all of them slow; the slow list has a turn every ten ticks.
#[test]
fn what_flies_by_near_a_finger_does_not_leap_and_tells_as_of_when_it_is_there() {
    let balls = "[[entity]]\nname = \"ball\"\nshape = { kind = \"sphere\", radius_m = 0.01 }\nposition_m = [0, 0, 0]\n\
                 velocity_m_s = [1, 0, 0]\nmass_kg = 0.1\nstiffness_n_per_m = 500\n\
                 grid = { count = [40, 1, 25], spacing_m = [0.04, 1, 0.04] }\n";
    let mut run = Run::new(&format!("{ALL_SLOW}{FLOATING}{balls}"));
    let hip = [0.8, 0.06, 0.5];
    let (mut near, mut leaps, mut oldest) = (0, 0, [0, 0]);
    let began: Vec<_> = run.step.bodies().to_vec();
    let mut before = began.clone();
    for tick in 0..400 {
        run.tick(hip, true);
        for (body, (before, began)) in run.step.bodies().iter().zip(before.iter().zip(&began)) {
            let is_near = (body.position - Vector3::from(hip)).norm() < 0.09;
            let step_m = (body.position - before.position).norm();
            assert!(!is_near || step_m < 2e-3 + 1e-12, "tick {tick}: {step_m} m");
            near += usize::from(is_near);
            leaps += usize::from(step_m > 9e-3);
            // On its way it is there between two ticks.
            let as_of = body.as_of.expect("it does not rest");
            let way_m = body.position.x - began.position.x;
            assert!(
                (-1e-9..1e-3).contains(&(way_m - 1e-3 * as_of as f64)),
                "tick {tick}, as of {as_of}: {way_m}"
            );
            // After the first turns, and the words of them.
            if tick > 100 {
                let age = &mut oldest[usize::from(!is_near)];
                *age = (tick - as_of).max(*age);
            }
        }
        before = run.step.bodies().to_vec();
    }
    assert_eq!(run.here(), 0);
    assert!(near > 400 * 8 && leaps > 1000, "{near} near, {leaps} leaps elsewhere");
    // A turn's ten ticks, and up to nine for a way of 10 mm, on half of which 2 mm in a tick are the bound; 320 places a turn for
    // 1000 elsewhere.
    assert!(oldest[0] <= 19 && (20..=60).contains(&oldest[1]), "{oldest:?}");
}

/// As after a driver was restarted, whose frames count from the beginning.
#[test]
fn places_are_as_of_ticks_of_the_run_and_not_of_a_driver() {
    let ball = "[[entity]]\nname = \"ball\"\nshape = { kind = \"sphere\", radius_m = 0.01 }\nposition_m = [0, 0, 0]\n\
                velocity_m_s = [1, 0, 0]\nmass_kg = 0.1\nstiffness_n_per_m = 500\n";
    let mut run = Run::new(&format!("{ALL_SLOW}{FLOATING}{ball}"));
    for offset_ticks in [0, 100] {
        run.step.count_from(offset_ticks);
        run.tick = 0;
        for tick in 0..100 {
            run.tick([9.0, 0.0, 0.0], true);
            let as_of = run.step.bodies()[0].as_of.expect("it does not rest");
            assert!((offset_ticks + tick).abs_diff(as_of) <= 11, "tick {tick} from {offset_ticks}: {as_of}");
        }
    }
    assert!((run.step.bodies()[0].position.x - 0.19).abs() < 1e-9, "{}", run.step.bodies()[0].position.x);
}

#[test]
fn whenever_a_run_ends_each_body_is_in_one_list() {
    let grid = "grid = { count = [10, 1, 6], spacing_m = [0.1, 1, 0.1] }";
    let scene = format!("{ALL_SLOW}{STANDING}{}", cube(&format!("mass_kg = 0.1\n{grid}")));
    for ticks in [1, 7, 300, 1234] {
        let mut step = step(&scene);
        let run_ticks = Arc::<AtomicU64>::default();
        let slow = step.take_slow().expect("a slow list");
        let thread = SlowThread::start(slow, Arc::clone(&run_ticks), 1_000_000).expect("a thread");
        let mut run = Run { step, slow: None, tick: 0 };
        for tick in 0..ticks {
            // To and fro over the cubes, far faster than the slow list has turns.
            let x = 0.5 + 0.5 * (0.02 * tick as f64).sin();
            run.tick([x, 0.05, 0.25 + 0.25 * (0.017 * tick as f64).cos()], false);
            run_ticks.store(tick, Ordering::Relaxed);
            if tick % 8 == 0 {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        let remains = thread.end().expect("no panic");
        let end = run.step.end_lists(Some(remains)).expect("two lists");
        let ListsEnd { fast, slow, left_out, .. } = end;
        assert_eq!((fast + slow.expect("it came back"), left_out), (60, 0), "{end}");
        assert!(ticks < 1000 || end.handed.came > 0, "{end}");
    }
}

#[test]
fn a_slow_thread_whose_run_failed_ends_with_it() {
    let mut step = step(&format!("{ALL_SLOW}{FLOATING}{}", cube("mass_kg = 0.1")));
    let run_ticks = Arc::<AtomicU64>::default();
    let slow = step.take_slow().expect("a slow list");
    drop(SlowThread::start(slow, Arc::clone(&run_ticks), 1_000_000).expect("a thread"));
    assert_eq!(Arc::strong_count(&run_ticks), 1, "nobody else has it any more");
    assert!(step.end_lists(None).expect("two lists").slow.is_none());
}
