//! The whole chain without hardware: a driver, registers, amplifiers that judge, and behind them, in the emulator's
//! process, an arm with mass, weight and friction in a simulated hand.

use io_driver::device_file::{ArmFile, DeviceFile, builtin};
use io_driver::encoders::JointMap;
use io_driver::kinematics::Mechanism;
use nalgebra::Vector3;
use rustix::process::Signal;
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{DriverState, Frame};
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use system_tests::driver::HANG;
use system_tests::faults::amplifiers::wait_for;
use system_tests::faults::process::{End, Running, io_driver};
use system_tests::faults::ring::RingLog;
use system_tests::faults::stand::{Setup, Stand, end_app};
use system_tests::programs;

/// From the wish to the tip, grasp and arm in series, upwards (N/m).
const HAND_N_PER_M: f64 = 552.4 * 105.3 / (552.4 + 105.3);
const WALL_N_PER_M: f64 = 2000.0;
/// The hand ends at home, so deep in the table (m).
const DEPTH_M: f64 = 0.02;
/// Friction of the arm, and its weight, which no motor carries here (N).
const BAND_N: f64 = 0.04 + 0.09;
/// Two springs in series (N).
const FORCE_N: f64 = HAND_N_PER_M * WALL_N_PER_M / (HAND_N_PER_M + WALL_N_PER_M) * DEPTH_M;

const SCENE: &str = "\
[[finger]]
[[entity]]
name = \"table\"
shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.02 }
stiffness_n_per_m = 2000.0
";

/// A stand whose arm is held by a hand that does not tremble.
fn stand_with(setup: Setup) -> Stand {
    let mut setup = setup;
    setup.emulator.splice(..0, ["--simulated", "--calm"]);
    let stand = Stand::start(setup);
    std::fs::write(stand.path("press.toml"), SCENE).expect("the scene is written");
    stand
}

fn stand() -> Stand {
    stand_with(Setup::new("real"))
}

fn commissioning() -> Stand {
    stand_with(Setup { config: "commissioning = true\n".into(), ..Setup::new("real") })
}

/// The hand goes there evenly, at 20 mm/s: far from the 250 mm/s that are a fault of commissioning, even if this thread
/// is kept from running for a while.
fn go(stand: &Stand, from: Vector3<f64>, to: Vector3<f64>) {
    let steps = ((to - from).norm() / 2e-4).ceil();
    for step in 1..=steps as u32 {
        reach(stand, from + (to - from) * (f64::from(step) / steps));
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// An application's finger above the table goes down to home, and is there.
fn press(stand: &Stand) -> Running {
    let above = Vector3::y() * (DEPTH_M + 0.01);
    go(stand, Vector3::zeros(), above);
    let app = stand.start_app();
    let mut log = RingLog::begin(stand.view());
    log.follow(stand.view(), "authority", |told| told.last().is_some_and(|told| told.authority == 1.0));
    go(stand, above, Vector3::zeros());
    app
}

fn premium() -> ArmFile {
    match DeviceFile::parse(builtin("premium-1.5").unwrap(), Path::new("premium-1.5")) {
        Ok(DeviceFile::Arm(premium)) => *premium,
        other => panic!("{other:?}"),
    }
}

/// The tip (m) as the card's counters have it, whether or not a driver looks.
fn tip(stand: &Stand) -> Vector3<f64> {
    let premium = premium();
    let counters = &stand.amplifiers.card.inputs.counters;
    // Sixteen bits, less than half a turn from home.
    let counts = [0, 1, 2].map(|joint| i64::from(counters[joint].load(Ordering::Relaxed) as u16 as i16));
    premium.mechanism.forward(JointMap::new(&premium.encoders).counts_to_angles(counts))
}

/// The hand wants to take the tip there (m), in its own time.
fn reach(stand: &Stand, place: Vector3<f64>) {
    let premium = premium();
    let joints = premium.mechanism.inverse(place).expect("within reach");
    let counts = JointMap::new(&premium.encoders).angles_to_counts(joints);
    for (word, count) in stand.amplifiers.card.hand.counts.iter().zip(counts) {
        word.store(count as i32, Ordering::Relaxed);
    }
}

fn frame(stand: &Stand) -> Frame {
    let begun = Instant::now();
    loop {
        if let Some(frame) = stand.view().read_latest() {
            return frame;
        }
        assert!(begun.elapsed() < HANG, "no frame");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// The wall's force on a hand that rests is that of two springs in series, but for what friction and weight take.
#[test]
fn a_stiff_wall_through_the_card_lifts_the_hand_out_of_it() {
    let stand = stand();
    let app = press(&stand);
    let near = |force_n: f64| (force_n - FORCE_N).abs() < BAND_N;
    // A mean over half a second, since a loaded machine's delays make a stiff wall hum.
    let mut log = RingLog::begin(stand.view());
    log.follow(stand.view(), "the wall's force", |told| {
        let last = &told[told.len().saturating_sub(1000)..];
        last.len() == 1000 && near(last.iter().map(|told| told.applied_n).sum::<f64>() / 1000.0)
    });
    let lifted = tip(&stand).y;
    let expected = FORCE_N / HAND_N_PER_M;
    assert!((lifted - expected).abs() < BAND_N / HAND_N_PER_M + 1e-3, "{lifted} m of {expected} m");
    end_app(app);
    wait_for("the hand's return", || tip(&stand).y < BAND_N / HAND_N_PER_M + 1e-3);
    let seen = stand.finish();
    assert!(seen.tally.energised > 1000 && seen.tally.watchdog_trips == 0, "{seen:?}");
}

#[test]
fn a_driver_that_is_killed_while_it_pushes_lets_the_tip_fall_back_into_the_hand() {
    let mut stand = stand();
    let app = press(&stand);
    wait_for("the push", || tip(&stand).y > 0.8 * DEPTH_M);
    let before = stand.amplifiers.tally();
    stand.driver.signal(Signal::KILL);
    stand.amplifiers.wait_for_trip(before);
    assert!(stand.amplifiers.are_enabled(), "nobody told them to be off: it was the watchdog");
    wait_for("the tip's fall", || tip(&stand).y < BAND_N / HAND_N_PER_M + 1e-3);
    drop(app);
    assert_eq!(stand.driver.end().signal, Some(Signal::KILL.as_raw()));
    assert_eq!(stand.finish_after_death().tally.watchdog_trips, 1);
}

/// The whole dialogue, with the hand moved as the words ask for.
fn commission(stand: &Stand) -> End {
    let config = stand.path("driver.toml");
    let mut command = programs::io_driver();
    command.args(["commission", "--yes", "--config"]).arg(config).arg("--socket").arg(stand.socket());
    let mut session = Running::start(&mut command);
    let lines = session.take_lines();
    let (mut said, mut at) = (String::new(), Vector3::zeros());
    for line in lines {
        let axis = ["5 cm to the right", "5 cm up", "5 cm towards you"].iter().position(|w| line.contains(w));
        if let Some(axis) = axis {
            let end = at + Vector3::ith(axis, 0.05);
            go(stand, at, end);
            at = end;
        }
        said += &line;
        said.push('\n');
    }
    let end = session.end();
    End { out: said, ..end }
}

#[test]
fn an_arm_with_weight_and_friction_in_a_persons_hand_passes_commissioning() {
    let stand = commissioning();
    let end = commission(&stand);
    assert_eq!(end.status, Some(0), "{end:?}");
    let words = [
        "to the right (x): right",
        "up (y): right",
        "towards you (z): right",
        "turret: right",
        "upper arm: right",
        "forearm: right",
        "All counters and motors turn the right way.",
    ];
    assert!(words.iter().all(|words| end.out.contains(words)), "{end:?}");
    let seen = stand.finish();
    // 0.5 N, and the converters' steps.
    assert!(seen.tally.energised > 0 && seen.tally.largest_force_un < 510_000, "{seen:?}");
}

#[test]
fn a_motor_with_the_wrong_sign_is_found_before_anything_runs_away() {
    let mut stand = commissioning();
    stand.describe_otherwise("[motors]", "sign = [1, 1, 1]", "sign = [1, 1, -1]");
    let mut log = RingLog::begin(stand.view());
    let config = stand.path("driver.toml").to_string_lossy().into_owned();
    let end = io_driver(&["commission", "--motors-only", "--yes", "--config", &config], &stand.socket());
    log.catch_up(stand.view());
    assert_eq!(end.status, Some(3), "{end:?}");
    let words = "forearm: WRONG, it turned the other way; change the third `sign` under [motors]";
    assert!(end.out.contains(words) && end.out.contains("upper arm: right"), "{end:?}");
    assert!(log.told.iter().all(|told| told.state != DriverState::Fault), "nothing ran away");
    // What turned it, a few tenths of a newton on a hand of 60 N/m and more, moved it by millimetres.
    assert!(tip(&stand).norm() < 0.01, "{}", tip(&stand));
    let seen = stand.finish();
    assert!(seen.tally.largest_force_un < 510_000, "{seen:?}");
}

#[test]
fn a_counter_with_the_wrong_sign_is_found_before_any_motor_is_tried() {
    let mut stand = commissioning();
    stand.describe_otherwise("[encoders]", "sign = [1, 1, 1]", "sign = [-1, 1, 1]");
    let end = commission(&stand);
    assert_eq!(end.status, Some(3), "{end:?}");
    let words =
        "to the right (x): WRONG, it was counted the other way; change the `sign` of the first counter";
    assert!(end.out.contains(words) && end.out.contains("up (y): right"), "{end:?}");
    assert_eq!(stand.finish().tally.energised, 0, "no motor was tried");
}

#[test]
fn an_arm_that_is_let_go_falls_and_no_motor_is_judged_by_that() {
    let setup = Setup { config: "commissioning = true\n".into(), ..Setup::new("real") };
    let mut stand = stand_with(Setup { emulator: vec!["--hand-model", "nobody"], ..setup });
    let config = stand.path("driver.toml").to_string_lossy().into_owned();
    let end = io_driver(&["commission", "--motors-only", "--yes", "--config", &config], &stand.socket());
    // It is too fast, or it has fallen already and lies against its stops, where the first joint is free.
    assert!(end.status == Some(3) || end.status == Some(2), "{end:?}");
    assert!(!end.out.contains("WRONG"), "{end:?}");
    let _ = io_driver(&["stop"], &stand.socket());
    stand.driver.end();
    stand.finish_after_death();
}

#[test]
fn counters_that_were_switched_on_anywhere_are_zeroed_in_a_calm_hand() {
    let stand = stand_with(Setup {
        zeroing: "ask",
        emulator: vec!["--counter-offset", "-31234"],
        ..Setup::new("real")
    });
    let device = frame(&stand).devices[0];
    assert_eq!(device.flags & DEVICE_POSITION_VALID, 0);
    assert!((device.encoder_counts[0] + 31_234).abs() < 100, "{:?}", device.encoder_counts);
    let end = io_driver(&["zero", "--yes"], &stand.socket());
    assert_eq!(end.status, Some(0), "{end:?}");
    wait_for("the zero", || frame(&stand).devices[0].flags & DEVICE_POSITION_VALID != 0);
    // It was zeroed where the hand holds it, less what the arm's weight makes of that.
    let measured = Vector3::from(frame(&stand).devices[0].position_m_measured);
    assert!(measured.norm() < 1e-3, "{measured}");
    stand.finish();
}

#[test]
fn a_hand_file_moves_the_arm_and_presses_its_buttons() {
    let place = tempfile::tempdir().expect("a directory");
    let file = place.path().join("hand.csv");
    std::fs::write(
        &file,
        "t,f0_x,f0_y,f0_z,f1_x,f1_y,f1_z,f1_buttons\n0,0,0,0,0,0,0,0\n1,0,0,0,0.05,0.02,0,2\n2,0,0,0,0.05,0.02,0,2\n",
    )
    .expect("a hand file");
    let arguments =
        ["--hand", file.to_str().expect("text"), "--finger", "f1"].map(|word| &*word.to_owned().leak());
    let stand = stand_with(Setup { emulator: arguments.to_vec(), ..Setup::new("real") });
    // Within friction and weight of where the file leaves it, sideways 65 N/m.
    let end = Vector3::new(0.05, 0.02, 0.0);
    wait_for("the hand's way", || (tip(&stand) - end).norm() < 3.5e-3);
    wait_for("its button", || stand.amplifiers.card.inputs.buttons.load(Ordering::Relaxed) == 2);
    stand.finish();
}
