//! The first trial of a device: signs that are right pass, signs that are wrong are found, in low force.

use io_driver::commission::hand_check::HandVerdict;
use io_driver::commission::session::Session;
use nalgebra::Vector3;
use patience::prelude::*;
use rt_core::signals::StopSignals;
use shm_abi::client;
use shm_abi::frame::DEVICE_NOT_ZEROED;
use std::time::Duration;
use system_tests::faults::hosted::Hosted;
use system_tests::faults::process::{End, Running, io_driver};
use system_tests::faults::puppet::Strings;
use system_tests::faults::stand::{Setup, Stand};
use system_tests::programs;

/// A stand whose arm gives way to its motors, with a driver in commissioning mode.
fn stand() -> Stand {
    Stand::start(Setup {
        config: "commissioning = true\n".into(),
        emulator: vec!["--yield", "1"],
        ..Setup::new("real")
    })
}

fn commission(stand: &Stand) -> End {
    let config = stand.path("driver.toml");
    let arguments = ["commission", "--motors-only", "--yes", "--config", &config.to_string_lossy()];
    io_driver(&arguments, &stand.socket())
}

#[test]
fn motors_that_turn_the_right_way_pass_with_less_force_than_a_finger_holds() {
    let stand = stand();
    let end = commission(&stand);
    assert_eq!(end.status, Some(0), "{end:?}");
    for joint in ["turret: right", "upper arm: right", "forearm: right", "All motors turn the right way."] {
        assert!(end.out.contains(joint), "{end:?}");
    }
    let seen = stand.finish();
    assert!(seen.tally.energised > 0);
    // 0.5 N, and the converters' steps.
    assert!(seen.tally.largest_force_un < 510_000, "{seen:?}");
}

#[test]
fn a_reversed_motor_is_found_named_and_does_not_run_away() {
    let mut stand = stand();
    stand.describe_otherwise("[motors]", "sign = [1, 1, 1]", "sign = [1, -1, 1]");
    let end = commission(&stand);
    assert_eq!(end.status, Some(3), "{end:?}");
    let words = "upper arm: WRONG, it turned the other way; change the second `sign` under [motors]";
    assert!(end.out.contains(words) && end.out.contains("forearm: right"), "{end:?}");
    let seen = stand.finish();
    assert!(seen.tally.largest_force_un < 510_000, "{seen:?}");
}

#[test]
fn motors_that_are_plugged_into_each_others_place_are_found() {
    let mut stand = stand();
    stand.describe_otherwise("[motors]", "channel = [0, 1, 2]", "channel = [0, 2, 1]");
    let end = commission(&stand);
    assert_eq!(end.status, Some(3), "{end:?}");
    assert!(end.out.contains("upper arm: WRONG, the forearm turned instead"), "{end:?}");
    assert!(end.out.contains("forearm: WRONG, the upper arm turned instead"), "{end:?}");
    stand.stop_driver();
}

#[test]
fn a_driver_with_full_force_is_not_commissioned() {
    let stand = Stand::start(Setup::new("real"));
    let end = commission(&stand);
    assert_eq!(end.status, Some(2), "{end:?}");
    assert!(end.err.contains("not in commissioning mode; start it with `io-driver run --commissioning`"));
    assert_eq!(stand.finish().tally.energised, 0);
}

/// Not even to zero the device.
#[test]
fn nothing_is_asked_of_a_driver_with_full_force_that_has_yet_to_be_zeroed() {
    let stand = Stand::start(Setup { zeroing: "ask", ..Setup::new("real") });
    let end = commission(&stand);
    assert_eq!((end.status, end.out.as_str()), (Some(2), ""), "{end:?}");
    assert!(end.err.contains("not in commissioning mode"), "{end:?}");
    let frame = stand.view().read_latest().expect("frames");
    assert_ne!(frame.devices[0].flags & DEVICE_NOT_ZEROED, 0, "{frame:?}");
    stand.finish();
}

#[test]
fn a_commissioning_driver_gives_an_application_little_force() {
    let setup = Setup { config: "commissioning = true\n".into(), ..Setup::new("real") };
    let stand = Stand::start(setup);
    let peak_n = stand.view().info().devices[0].peak_force_n;
    assert_eq!(peak_n, 0.5, "and says so");
    let app = stand.start_app();
    patience::until("1000 torques are written", || stand.amplifiers.tally().energised >= 1000);
    drop(app);
    let seen = stand.finish();
    // The application asks for 1.2 N.
    assert!((480_000..510_000).contains(&seen.tally.largest_force_un), "{seen:?}");
}

#[test]
fn a_tip_that_goes_where_the_hand_moves_it_passes_and_another_does_not() {
    let signals = StopSignals::install().unwrap();
    let cases = [
        (0, Vector3::x(), HandVerdict::Right),
        (1, Vector3::y(), HandVerdict::Right),
        (2, -Vector3::z(), HandVerdict::Reversed),
        (1, Vector3::x(), HandVerdict::Crossed { axis: 0 }),
    ];
    for (axis, direction, expected) in cases {
        let strings = Strings::default();
        let config = "[safety]\ncommissioning = true\n[[device]]\nbackend = \"ideal\"\n";
        let driver = Hosted::start(config, vec![strings.device("d", 0.5)]);
        let attachment = client::command(driver.socket(), "test").unwrap();
        let mut session = Session::new(attachment, 0, &signals).unwrap();
        let verdict = std::thread::scope(|scope| {
            let check = scope.spawn(move || session.check_by_hand(axis));
            let mut moved_m = 0.0;
            patience::until("the check by hand ends", || {
                // A tenth of a metre a second, from whenever the check begins.
                moved_m += 1e-4;
                strings.move_to(Vector3::new(0.1, 0.2, 0.3) + direction * moved_m);
                std::thread::sleep(Duration::from_millis(1));
                check.is_finished()
            });
            check.bounded_join().unwrap()
        });
        assert_eq!(verdict.unwrap(), expected);
    }
}

#[test]
fn a_driver_that_is_stopped_ends_the_session_instead_of_holding_it() {
    let stand = stand();
    let config = stand.path("driver.toml");
    let mut command = programs::io_driver();
    command.args(["commission", "--motors-only", "--yes", "--config"]).arg(&config);
    let mut session = Running::start(command.arg("--socket").arg(stand.socket()));
    let lines = session.take_lines();
    assert!(lines.iter().any(|line| line.contains("turret ...")), "it begins with the turret");
    stand.driver.signal(rustix::process::Signal::STOP);
    let end = session.end();
    stand.driver.signal(rustix::process::Signal::CONT);
    assert_eq!(end.status, Some(3), "{end:?}");
    assert!(end.err.contains("the driver has told nothing for 5 s"), "{end:?}");
    // Its amplifiers have tripped meanwhile, which is a fault of the driver's that comes after.
    stand.finish();
}

#[test]
fn wrong_words_are_refused_with_what_is_missing() {
    let stand = Stand::start(Setup { config: "commissioning = true\n".into(), ..Setup::new("real") });
    let config = stand.path("driver.toml");
    let said = |arguments: &[&str]| {
        let mut command = programs::io_driver();
        command.args(["commission", "--socket"]).arg(stand.socket()).args(arguments);
        let output = command.stdin(std::process::Stdio::null()).bounded_output().unwrap();
        let (status, _, err) = programs::said(&output);
        assert_eq!(status, Some(2), "{err}");
        err
    };
    let config = config.to_string_lossy();
    assert!(said(&["--config", "nowhere.toml"]).contains("cannot read nowhere.toml"));
    let stranger = said(&["--config", &config, "--device", "f9"]);
    assert!(stranger.contains("no device \"f9\"; --device one of f0"), "{stranger}");
}

#[test]
fn an_arm_that_has_to_be_zeroed_is_zeroed_before_its_motors_are_tried() {
    let stand = Stand::start(Setup {
        config: "commissioning = true\n".into(),
        emulator: vec!["--yield", "1"],
        zeroing: "ask",
        ..Setup::new("real")
    });
    let end = commission(&stand);
    assert_eq!(end.status, Some(0), "{end:?}");
    let words = ["First its zeroing pose.", "f0: zeroed at counts", "All motors turn the right way."];
    assert!(words.iter().all(|words| end.out.contains(words)), "{end:?}");
    stand.finish();
}
