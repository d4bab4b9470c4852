//! Zeroing over real processes: a driver that does not know where its arm is gives no force, whatever an application
//! does, until somebody who stands at the arm says that it is in its zeroing pose.

use shm_abi::frame::{
    DEVICE_HAS_BUTTONS, DEVICE_NOT_ZEROED, DEVICE_ORIENTATION_MEASURED, DEVICE_POSITION_VALID,
};
use shm_abi::{DriverState, FaultReason, Frame, client};
use std::sync::atomic::Ordering;
use std::time::Duration;
use system_tests::faults::amplifiers::wait_for;
use system_tests::faults::commander::Commander;
use system_tests::faults::process::{End, Running, io_driver};
use system_tests::faults::ring::RingLog;
use system_tests::faults::stand::{Setup, Stand, end_app, is_whole};
use system_tests::{programs, recording};

/// A stand whose driver asks.
fn asking(clock: &'static str) -> Setup {
    Setup { zeroing: "ask", ..Setup::new(clock) }
}

fn zero(stand: &Stand, arguments: &[&str]) -> End {
    io_driver(&[&["zero", "--yes"], arguments].concat(), &stand.socket())
}

fn zeroed(stand: &Stand) {
    let end = zero(stand, &[]);
    assert_eq!(end.status, Some(0), "{end:?}");
}

/// A hand turns the arm by so many counts.
fn turn(stand: &Stand, counts: [i32; 3]) {
    for (place, count) in stand.amplifiers.card.hand.counts.iter().zip(counts) {
        place.store(count, Ordering::Relaxed);
    }
    wait_for("the counters", || frame(stand).devices[0].encoder_counts[..3] == counts.map(i64::from));
}

/// A counter slips by 60 mm between two ticks. Ticks that come 2.4 ms late leave time for such a way: then it slips back.
fn slip(stand: &Stand) {
    for counts in [2000, 0].into_iter().cycle().take(20) {
        turn(stand, [0, counts, 0]);
        if frame(stand).fault != 0 {
            return;
        }
    }
}

fn frame(stand: &Stand) -> Frame {
    let begun = std::time::Instant::now();
    loop {
        if let Some(frame) = stand.view().read_latest() {
            return frame;
        }
        assert!(begun.elapsed() < system_tests::driver::HANG, "no frame");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn state(stand: &Stand) -> Option<DriverState> {
    DriverState::from_word(frame(stand).state)
}

fn flags(stand: &Stand) -> u64 {
    frame(stand).devices[0].flags
}

/// Ticks go by with a commander that pushes; all of them at no force, and the amplifiers never on.
fn stays_without_force(stand: &Stand, ticks: usize) {
    let before = stand.amplifiers.tally().energised;
    let mut log = RingLog::begin(stand.view());
    log.follow_for(stand.view(), ticks);
    for told in &log.told {
        assert_eq!(
            (told.state, told.authority, told.applied_n),
            (DriverState::Zeroing, 0.0, 0.0),
            "{told:?}"
        );
    }
    stand.amplifiers.settle();
    assert_eq!(stand.amplifiers.tally().energised, before);
    stand.amplifiers.check_off("not zeroed");
}

#[test]
fn a_driver_that_restarts_with_the_arm_elsewhere_gives_no_force_until_it_is_zeroed_at_home() {
    let mut stand = Stand::start(asking("real"));
    zeroed(&stand);
    let app = stand.start_app();
    stand.wait_for_force();
    // The driver crashes, the arm is let go and comes to lie elsewhere, and the driver is started again.
    stand.driver.signal(rustix::process::Signal::KILL);
    stand.driver.end();
    stand.amplifiers.wait_for_trip(Default::default());
    app.kill();
    stand.restart_driver();
    turn(&stand, [300, -200, 100]);
    assert_eq!(flags(&stand), DEVICE_NOT_ZEROED);
    let pusher = Commander::start(stand.command(), [0.0, 2.0, 0.0]);
    stays_without_force(&stand, 500);
    drop(pusher);
    turn(&stand, [0; 3]);
    zeroed(&stand);
    assert_eq!(frame(&stand).devices[0].position_m_measured, [0.0; 3], "the tip is at home");
    let app = stand.start_app();
    stand.wait_for_force();
    end_app(app);
    // What the killed driver's watchdog saw is in the tally; every value was good.
    stand.finish();
}

#[test]
fn an_application_is_told_which_device_to_zero_and_how() {
    let stand = Stand::start(asking("real"));
    let end = stand.start_app().end();
    assert_eq!(end.status, Some(2), "{end:?}");
    let command = format!("`io-driver zero --device f0 --socket {}`", stand.socket().display());
    assert!(end.err.contains("does not know yet where its device f0 is"), "{end:?}");
    assert!(end.err.contains(&command), "{end:?}");
    let status = io_driver(&["status"], &stand.socket());
    assert!(status.out.contains("state       zeroing"), "{status:?}");
    let words = "not zeroed: bring it into its zeroing pose, then `io-driver zero --device f0`";
    assert!(status.out.contains(words), "{status:?}");
    zeroed(&stand);
    let status = io_driver(&["status"], &stand.socket());
    assert!(status.out.contains("state       idle") && !status.out.contains("zeroed"), "{status:?}");
    stand.finish();
}

#[test]
fn an_application_waits_its_grace_for_a_driver_that_came_back_to_be_zeroed() {
    let mut stand = Stand::start(asking("real"));
    zeroed(&stand);
    let mut command = stand.app();
    let mut app = Running::start(command.args(["--grace", "120"]));
    stand.wait_for_force();
    stand.driver.signal(rustix::process::Signal::TERM);
    stand.driver.end();
    stand.restart_driver();
    app.hear("the driver is back: the driver does not know yet where its device f0 is");
    assert_eq!(frame(&stand).lease, 0, "it waits without the lease");
    zeroed(&stand);
    stand.wait_for_force();
    end_app(app);
    stand.finish();
}

#[test]
fn a_zero_tells_the_pose_the_counts_and_the_tip_before_and_after() {
    let stand = Stand::start(asking("real"));
    turn(&stand, [40, 50, -60]);
    let end = zero(&stand, &["--device", "f0"]);
    assert_eq!(end.status, Some(0), "{end:?}");
    assert!(end.out.contains("upper arm level, forearm hanging straight down"), "{end:?}");
    assert!(
        end.out.contains("counts 40 50 -60; its tip was not known, and is (0.0, 0.0, 0.0) mm"),
        "{end:?}"
    );
    let again = zero(&stand, &[]);
    assert_eq!(again.status, Some(2), "{again:?}");
    assert!(again.err.contains("name those that are to be zeroed anew: --device one of f0"), "{again:?}");
    turn(&stand, [140, 50, -60]);
    let anew = zero(&stand, &["--device", "f0"]);
    assert_eq!(anew.status, Some(0), "{anew:?}");
    // A hundred counts of the turret, 175/13 motor turns a turn, at 0.215 m: 2.45 mm.
    assert!(anew.out.contains("its tip was (2.4, 0.0, -0.0) mm, and is (0.0, 0.0, 0.0) mm"), "{anew:?}");
    stand.finish();
}

#[test]
fn a_zero_is_refused_while_somebody_commands_and_changes_nothing() {
    let stand = Stand::start(Setup::new("real"));
    let app = stand.start_app();
    let mut log = stand.wait_for_force();
    log.forget();
    let end = zero(&stand, &["--device", "f0"]);
    assert_eq!(end.status, Some(2), "{end:?}");
    let words = format!("the devices are commanded by process {} (phantom3)", app.id());
    assert!(end.err.contains(&words), "{end:?}");
    // The driver judges by itself, whatever a program asks.
    let view = client::observe(&stand.socket(), "test").unwrap().driver;
    let asked_in = view.latest_tick().unwrap();
    client::zero(&stand.socket(), "test", 0).unwrap();
    log.follow(stand.view(), "ticks after that", |told| told.iter().any(|t| t.tick > asked_in + 1000));
    log.follow(stand.view(), "the force goes on", |told| told.last().is_some_and(is_whole));
    assert!(log.told.iter().all(|told| told.state != DriverState::Zeroing), "never not valid");
    end_app(app);
    stand.finish();
}

#[test]
fn a_zero_is_refused_while_the_arm_moves_and_changes_nothing() {
    let stand = Stand::start(asking("real"));
    let stop = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let counts = &stand.amplifiers.card.hand.counts;
            while !stop.load(Ordering::Relaxed) {
                counts[1].fetch_add(5, Ordering::Relaxed);
                std::thread::sleep(Duration::from_millis(5));
            }
        });
        let raised = patience::Raised(&stop);
        let end = zero(&stand, &["--wait", "1"]);
        client::zero(&stand.socket(), "test", 0).unwrap();
        let after = frame(&stand).tick + 200;
        wait_for("ticks after that", || frame(&stand).tick > after);
        let flags = flags(&stand);
        drop(raised);
        assert_eq!(end.status, Some(3), "{end:?}");
        assert!(end.err.contains("device f0 did not stand still for half a second within 1 s"), "{end:?}");
        assert_eq!(flags, DEVICE_NOT_ZEROED);
    });
    zeroed(&stand);
    stand.finish();
}

/// An application that is stopped, and a zero that it does not see: asked for, and not confirmed yet. A device that its
/// commander has not seen without its place stays not valid.
fn unseen(stand: &Stand) -> [Running; 2] {
    let app = stand.start_app();
    stand.wait_for_force();
    app.signal(rustix::process::Signal::STOP);
    wait_for("the force to ramp out", || {
        let frame = frame(stand);
        frame.authority == 0.0 && frame.state != DriverState::Active as u64
    });
    let begun = std::time::Instant::now();
    let mut zeroing = programs::io_driver();
    zeroing.args(["zero", "--yes", "--device", "f0", "--socket"]).arg(stand.socket());
    let mut zeroing = Running::start(&mut zeroing);
    zeroing.hear(
        "io-driver: the zero is not confirmed within 100 ms: positions may be those of before or wrong",
    );
    // Half a second of rest comes first; it is looked on for five seconds after that.
    assert!(begun.elapsed() < Duration::from_secs(4), "{:?}", begun.elapsed());
    [app, zeroing]
}

#[test]
fn a_zero_that_a_stopped_commander_does_not_see_is_told_of_at_once_and_not_called_done() {
    let stand = Stand::start(Setup::new("real"));
    let [app, mut zeroing] = unseen(&stand);
    let end = zeroing.end();
    assert_eq!(end.status, Some(3), "{end:?}");
    assert!(end.err.contains("the process that holds the lease has not answered since"), "{end:?}");
    app.kill();
    stand.finish();
}

#[test]
fn whoever_interrupts_a_zero_that_was_asked_for_is_not_told_that_nothing_was_zeroed() {
    let stand = Stand::start(Setup::new("real"));
    let [app, mut zeroing] = unseen(&stand);
    zeroing.signal(rustix::process::Signal::INT);
    let end = zeroing.end();
    assert_eq!(end.status, Some(3), "{end:?}");
    assert!(end.err.contains("interrupted; it was asked to zero by then, and may have"), "{end:?}");
    app.kill();
    stand.finish();
}

#[test]
fn one_signal_ends_the_wait_for_enter() {
    let stand = Stand::start(asking("real"));
    let (input, _held) = std::io::pipe().unwrap();
    let mut command = programs::io_driver();
    command.args(["zero", "--socket"]).arg(stand.socket());
    let mut zeroing = Running::start_reading(&mut command, input);
    let lines = zeroing.take_lines();
    while !lines.recv_timeout(Duration::from_secs(30)).expect("it asks").contains("Press Enter") {}
    zeroing.signal(rustix::process::Signal::INT);
    let end = zeroing.end();
    assert_eq!(end.status, Some(3), "{end:?}");
    assert!(end.err.contains("interrupted; nothing was zeroed"), "{end:?}");
    stand.finish();
}

#[test]
fn a_jump_costs_the_zero_and_clearing_the_fault_leads_to_zeroing() {
    for zeroing in ["ask", "at-start"] {
        let stand = Stand::start(Setup { zeroing, ..Setup::new("real") });
        if zeroing == "ask" {
            zeroed(&stand);
        }
        wait_for("a position", || flags(&stand) == DEVICE_POSITION_VALID);
        slip(&stand);
        let frame = frame(&stand);
        assert_eq!(frame.fault, FaultReason::PositionJump as u64, "{zeroing}");
        assert_eq!(frame.devices[0].flags, DEVICE_NOT_ZEROED);
        assert_eq!(io_driver(&["clear-fault"], &stand.socket()).status, Some(0));
        wait_for("the fault's end", || state(&stand) != Some(DriverState::Fault));
        let pusher = Commander::start(stand.command(), [0.0, 2.0, 0.0]);
        stays_without_force(&stand, 500);
        drop(pusher);
        turn(&stand, [0; 3]);
        zeroed(&stand);
        wait_for("idle", || state(&stand) == Some(DriverState::Idle));
        stand.finish();
    }
}

#[test]
fn a_card_that_was_switched_off_and_on_has_to_be_zeroed_again() {
    let stand = Stand::start(asking("real"));
    zeroed(&stand);
    stand.amplifiers.card.inputs.session.fetch_add(2, Ordering::Relaxed);
    wait_for("the fault", || state(&stand) == Some(DriverState::Fault));
    assert_eq!(frame(&stand).fault, FaultReason::DeviceRead as u64);
    assert_eq!(io_driver(&["clear-fault"], &stand.socket()).status, Some(0));
    wait_for("zeroing", || state(&stand) == Some(DriverState::Zeroing));
    zeroed(&stand);
    wait_for("idle", || state(&stand) == Some(DriverState::Idle));
    stand.finish();
}

#[test]
fn wrong_words_are_refused_with_what_is_missing() {
    let stand = Stand::start(asking("real"));
    for (arguments, words) in [
        (&["--device", "f9"][..], "no device \"f9\"; --device one of f0"),
        (&["--wait", "nan"][..], "--wait: found NaN, allowed: 0 to 86400 s"),
    ] {
        let end = zero(&stand, arguments);
        assert_eq!(end.status, Some(2), "{end:?}");
        assert!(end.err.contains(words), "{end:?}");
    }
    let unattended = io_driver(&["zero"], &stand.socket());
    assert!(
        unattended.status != Some(0) && unattended.err.contains("standard input has ended"),
        "{unattended:?}"
    );
    let nowhere = io_driver(&["zero"], &stand.path("nobody.sock"));
    assert_eq!(nowhere.status, Some(2), "{nowhere:?}");
    assert!(nowhere.err.contains("no driver is running"), "{nowhere:?}");
    stand.finish();
}

/// A handle with a gimbal and two buttons. Its registers are anybody's, since the emulator was told of no handle.
const HANDLE: &str = "\n[gimbal]\ncounts_per_rev = 4000\nreduction = [1.0, 1.0, 1.0]\nsign = [1, 1, 1]\n\
                      channel = [3, 4, 5]\nhome_angles_rad = [0.0, 0.0, 0.0]\n";

#[test]
fn a_gimbal_and_buttons_reach_the_recording_and_are_no_columns_without_a_handle() {
    let mut stand = Stand::start(Setup::new("real"));
    record(&stand, "plain.csv");
    let plain = recording::Table::read(&stand.path("plain.csv"));
    stand.stop_driver();
    let text = std::fs::read_to_string(stand.path("arm.toml")).unwrap();
    std::fs::write(stand.path("arm.toml"), format!("buttons = 2\n{text}{HANDLE}")).unwrap();
    stand.restart_driver();
    // A quarter turn of yaw after the zero.
    wait_for("a position", || flags(&stand) & DEVICE_POSITION_VALID != 0);
    stand.amplifiers.card.inputs.counters[3].store(1000, Ordering::Relaxed);
    stand.amplifiers.press(0b10);
    wait_for("the gimbal", || frame(&stand).devices[0].encoder_counts[3] == 1000);
    let device = frame(&stand).devices[0];
    assert_eq!(device.flags, DEVICE_POSITION_VALID | DEVICE_ORIENTATION_MEASURED | DEVICE_HAS_BUTTONS);
    assert_eq!(device.buttons, 0b10);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for (found, wanted) in device.orientation_wxyz_measured.into_iter().zip([half, 0.0, half, 0.0]) {
        // The sine and the cosine of an eighth of a turn, and products with one.
        assert!((found - wanted).abs() < 1e-15, "{device:?}");
    }
    record(&stand, "handle.csv");
    let told = recording::Table::read(&stand.path("handle.csv"));
    let added = ["f0_qw", "f0_qx", "f0_qy", "f0_qz", "f0_buttons"];
    let expected: Vec<&str> = plain.columns().iter().map(String::as_str).chain(added).collect();
    assert_eq!(told.columns(), expected);
    assert!(told.numbers("f0_qy").iter().all(|y| (y - half).abs() < 1e-15));
    assert!(told.texts("f0_buttons").iter().all(|buttons| *buttons == "2"));
    stand.finish();
}

fn record(stand: &Stand, file: &str) {
    let mut command = programs::phantom3();
    command.args(["run", "press.toml", "--headless", "--seconds", "0.1", "--record", file, "--attach"]);
    command.arg(stand.socket()).current_dir(stand.path(""));
    let end = Running::start(&mut command).end();
    assert_eq!(end.status, Some(0), "{end:?}");
}
