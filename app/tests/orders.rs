//! What people change while a run goes on is never felt as a blow: in every tick the force changes by no more than is stated.

#[path = "../haptics/tests/common/counting.rs"]
mod counting;

use counting::CALLS;
use phantom3::control::desk::{Desk, OrderSource};
use phantom3::control::gradual::{FADE_S, MOST_SPEED_M_S, MOST_STEP_N};
use phantom3::fast_loop::{FastLoop, Turn, WhenFull};
use phantom3::rig::{HandMode, Rig};
use phantom3::row::BodyRow;
use phantom3::row_queue::row_queue;
use phantom3::simulated::SimulatedDevices;
use phantom3::virtual_clock::VirtualDriver;
use shm_abi::segment::ClockMode;
use std::path::{Path, PathBuf};
use world::Scene;

const DT: f64 = 1e-3;
const K: f64 = 500.0;
/// Sums of a few numbers near 1.
const ROUNDING: f64 = 1e-12;

/// A finger 2 mm inside a table.
const TABLE: &str = "gravity_m_s2 = [0, -9.81, 0]\n[[finger]]\n[[entity]]\nname = \"table\"\nstiffness_n_per_m = 500.0\n\
                     shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.002 }\n\
                     friction = { model = \"coulomb\", mu = 0.5 }\n";
/// A plate with a cube on it, and a finger far from both.
const PLATE: &str = "gravity_m_s2 = [0, -9.81, 0]\n[[finger]]\nstart_m = [0.0, 0.5, 0.0]\n[[entity]]\nname = \"plate\"\n\
                     stiffness_n_per_m = 2000.0\nposition_m = [0.0, -0.01, 0.0]\n\
                     shape = { kind = \"box\", size_m = [0.6, 0.02, 0.6] }\nfriction = { model = \"coulomb\", mu = 0.5 }\n\
                     [[entity]]\nname = \"cube\"\nstiffness_n_per_m = 1000.0\ndamping_n_s_per_m = 1.0\nmass_kg = 0.1\n\
                     position_m = [0.0, 0.03, 0.0]\nvelocity_m_s = [0.1, 0.0, 0.0]\n\
                     shape = { kind = \"box\", size_m = [0.05, 0.05, 0.05] }\nfriction = { model = \"coulomb\", mu = 0.5 }\n";

/// A tick of a run: along y where the finger is (m) and what it feels (N), and the bodies.
#[derive(Debug, Clone, PartialEq)]
struct Tick {
    y: f64,
    force: f64,
    bodies: Vec<BodyRow>,
}

/// A directory for scenes and scripts.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("room"))
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let file = self.0.path().join(name);
        std::fs::write(&file, text).expect("room");
        file
    }

    fn rig(&self, scene: &str, hand_mode: HandMode) -> Rig {
        let file = self.write("scene.toml", scene);
        Rig::new(&file, Scene::load(&file).expect("a scene"), None, None, hand_mode, 1_000_000)
            .expect("a rig")
    }

    /// What the script says is refused.
    fn refusal(&self, scene: &str, script: &str, is_recorded: bool) -> String {
        let rig = self.rig(scene, HandMode::Kinematic);
        let source = OrderSource::File(self.write("orders.txt", script));
        Desk::open(&rig, &source, is_recorded).err().expect("refused")
    }

    /// Plays a scene with a script; no tick of it may call the heap.
    fn play(&self, scene: &str, script: &str, hand_mode: HandMode, seconds: f64) -> Vec<Tick> {
        let rig = self.rig(scene, hand_mode);
        let source = OrderSource::File(self.write("orders.txt", script));
        let (mut desk, orders) = Desk::open(&rig, &source, false).expect("good orders");
        let mut driver = VirtualDriver::open(&rig.driver_config(ClockMode::Virtual)).expect("devices");
        let step = rig.fast_step().expect("a step");
        let (rows, mut taken) = row_queue(step.bodies().len());
        let mut fast =
            FastLoop::new(step, rows, WhenFull::Drop, u64::MAX, rig.period_ns).with_control(orders);
        let mut ticks = Vec::new();
        for tick in 1.. {
            let mut calls = 0;
            let turn = driver.tick_with(tick, |tick, driver, commander| {
                let before = CALLS.get();
                let turn = fast.turn(tick, driver, commander);
                calls = CALLS.get() - before;
                turn
            });
            assert!(!matches!(turn, Turn::Fault(_)) && calls == 0, "{turn:?}, {calls} calls in tick {tick}");
            desk.step();
            while let Some((row, bodies)) = taken.receive() {
                let finger = &row.fingers[0];
                ticks.push(Tick { y: finger.hip.y, force: finger.force_on_user.y, bodies: bodies.to_vec() });
            }
            if ticks.len() as f64 * DT >= seconds {
                break;
            }
        }
        assert_eq!(fast.orders_taken(), script.lines().count() as u64);
        ticks
    }
}

fn hands() -> [HandMode; 2] {
    [HandMode::Kinematic, HandMode::Impedance(SimulatedDevices::default())]
}

/// In each tick after 0.3 s the force changes by no more than this (N) and what the finger's own motion makes of it, of a
/// surface of this stiffness (N/m).
fn assert_bounded(ticks: &[Tick], most_n: f64, stiffness: f64) -> f64 {
    let mut most = 0.0_f64;
    for (at, pair) in ticks.windows(2).enumerate().skip(300) {
        let own = stiffness * (pair[1].y - pair[0].y).abs();
        let changed = (pair[1].force - pair[0].force).abs() - own;
        assert!(changed <= most_n + ROUNDING, "tick {at}: {changed} N beside {own} N");
        most = most.max(changed);
    }
    most
}

fn force_at(ticks: &[Tick], t_s: f64) -> f64 {
    ticks[(t_s / DT).round() as usize].force
}

#[test]
fn stiffness_goes_up_and_down_by_no_more_than_half_a_tenth_of_a_newton_in_a_tick() {
    let script = "at 0.5 stiffness 8\nat 1.5 stiffness 0.25 of table\nat 2.5 damping 2";
    for hand_mode in hands() {
        let is_kinematic = hand_mode == HandMode::Kinematic;
        let ticks = Place::new().play(TABLE, script, hand_mode, 3.0);
        // Half of the bound: damping may change at the same time. Eight times the stiffness is the most that there is.
        let most = assert_bounded(&ticks, 0.5 * MOST_STEP_N, 8.0 * K);
        if is_kinematic {
            assert!(most > 0.4 * MOST_STEP_N, "{most}: it takes no longer than it must");
            for (t_s, times) in [(0.499, 1.0), (1.4, 8.0), (2.4, 2.0), (2.9, 2.0)] {
                let force = force_at(&ticks, t_s);
                assert!((force - times * K * 0.002).abs() < ROUNDING, "at {t_s} s: {force}");
            }
        }
    }
}

#[test]
fn a_reset_fades_out_and_in_within_a_fifth_of_a_second_and_keeps_the_stiffness() {
    let script = "at 0.4 stiffness 2\nat 1.0 reset";
    for hand_mode in hands() {
        let is_kinematic = hand_mode == HandMode::Kinematic;
        let ticks = Place::new().play(TABLE, script, hand_mode, 2.0);
        let strongest = ticks[900..1000].iter().map(|tick| tick.force).fold(0.0, f64::max);
        // A hundredth in a tick as a world goes; as it comes, its contacts that begin inside do so too: two hundredths. The
        // simulated hand sinks in while nothing holds it, and meets more force by as much.
        let deepest = ticks[300..].iter().map(|tick| (0.002 - tick.y) * 2.0 * K).fold(strongest, f64::max);
        assert_bounded(&ticks, 2.0 * deepest * DT / FADE_S, 2.0 * K);
        if is_kinematic {
            assert_eq!(force_at(&ticks, 1.099), 0.0);
            assert!((force_at(&ticks, 1.3) - 2.0 * K * 0.002).abs() < ROUNDING);
        }
    }
}

#[test]
fn a_reset_brings_everything_back_to_the_bit_and_it_goes_on_as_it_did() {
    let ticks = Place::new().play(
        PLATE,
        "at 0.2 move plate to 0.05 0 0 in 0.5\nat 1.0 reset",
        HandMode::Kinematic,
        2.0,
    );
    // It is replaced in the tick in which a hundred ticks of fading are over.
    let begun = ticks.iter().skip(1).position(|tick| tick.bodies == ticks[0].bodies).expect("begun anew") + 1;
    assert_eq!(begun, 1099, "0.1 s after the order");
    for at in 0..200 {
        assert_eq!(ticks[begun + at].bodies, ticks[at].bodies, "{at}");
    }
}

#[test]
fn a_cube_on_a_plate_that_is_moved_goes_where_the_plate_goes() {
    let scene = PLATE.replace("velocity_m_s = [0.1, 0.0, 0.0]", "");
    let script = "at 0.5 move plate to 0.1 -0.01 0.05 in 0.2\nat 0.6 move plate to 0.1 0.04 0.05 in 1";
    let ticks = Place::new().play(&scene, script, HandMode::Kinematic, 3.0);
    let place = |at: usize| ticks[at].bodies[0].position;
    let way = place(2999) - place(499);
    // mu g, 4.9 m/s^2, is just less than the path's largest; over 0.11 m it is bounded by speed, and that is 3.5 m/s^2.
    assert!((way - nalgebra::Vector3::new(0.1, 0.05, 0.05)).norm() < 1e-3, "{way}");
    let fastest =
        ticks.windows(2).map(|pair| (pair[1].bodies[0].position - pair[0].bodies[0].position).norm() / DT);
    let fastest = fastest.skip(490).fold(0.0, f64::max);
    // The springs of its feet swing by some percent.
    assert!(fastest > 0.9 * MOST_SPEED_M_S && fastest < 1.1 * MOST_SPEED_M_S, "{fastest}");
}

#[test]
fn a_table_that_rises_into_a_finger_presses_it_by_its_way_in_each_tick() {
    let script = "at 0.5 move table to 0 0.02 0 in 0.01";
    for hand_mode in hands() {
        let ticks = Place::new().play(TABLE, script, hand_mode.clone(), 1.5);
        let most = assert_bounded(&ticks, K * MOST_SPEED_M_S * DT, K);
        // A hand gives way to it.
        let least = if hand_mode == HandMode::Kinematic { 0.05 } else { 0.02 };
        assert!(most > least, "{most}");
        if hand_mode == HandMode::Kinematic {
            let force = force_at(&ticks, 1.4);
            assert!((force - K * 0.022).abs() < ROUNDING, "{force}");
        }
    }
}

#[test]
fn another_scene_takes_over_while_nothing_is_felt() {
    let place = Place::new();
    let harder = TABLE.replace("500.0", "1500.0").replace("\"table\"", "\"wall\"");
    let beside =
        PLATE[PLATE.find("[[entity]]").unwrap()..].replace("position_m = [0.0,", "position_m = [1.0,");
    let other = place.write("other.toml", &format!("{harder}{beside}"));
    let script = format!("at 0.5 swap {}\nat 1.5 stiffness 0.5 of wall", other.display());
    for hand_mode in hands() {
        let ticks = place.play(TABLE, &script, hand_mode.clone(), 2.5);
        let deepest = ticks[300..].iter().map(|tick| (0.002 - tick.y) * 3.0 * K).fold(0.0, f64::max);
        assert_bounded(&ticks, 2.0 * deepest * DT / FADE_S, 3.0 * K);
        if hand_mode == HandMode::Kinematic {
            for (t_s, force) in [(0.4, 1.0), (0.599, 0.0), (1.4, 3.0), (2.4, 1.5)] {
                assert!((force_at(&ticks, t_s) - force).abs() < ROUNDING, "{t_s}: {}", force_at(&ticks, t_s));
            }
        }
    }
}

#[test]
fn what_cannot_be_done_is_refused_before_the_run_begins_with_its_line() {
    let place = Place::new();
    let two = place.write("two.toml", &TABLE.replacen("[[finger]]", "[[finger]]\n[[finger]]", 1));
    let swap = |file: &Path| format!("at 1 swap {}", file.display());
    let (to_two, to_none) = (swap(&two), swap(Path::new("no-such.toml")));
    let refused: [(&str, bool, &str); 8] = [
        (
            "at 1 reset\n\nat 2 stiffness 2 of tabel",
            false,
            "orders.txt:3: there is no entity tabel; allowed: plate, cube",
        ),
        ("at 1 move cube to 0 0 0 in 1", false, "orders.txt:1: cube cannot be moved: it moves by itself"),
        ("at 2 reset\nat 1 reset", false, "orders.txt:2: found at 1, allowed: 2 s or later"),
        ("at 1 stiffness 5\nat 2 stiffness 5", false, "orders.txt:2: plate would have 25 times"),
        ("at 1 fly", false, "orders.txt:1: found fly, allowed: reset; stiffness FACTOR"),
        (&to_two, false, "need 2 devices, the run has 1"),
        (&to_two, true, "leave out --record"),
        (&to_none, false, "no-such.toml"),
    ];
    for (script, is_recorded, expected) in refused {
        let said = place.refusal(PLATE, script, is_recorded);
        assert!(said.contains(expected), "{script}: {said}");
    }
    let many = "at 1 reset\n".repeat(33);
    assert!(place.refusal(PLATE, &many, false).contains("orders.txt:33: too much for a script"));
}
