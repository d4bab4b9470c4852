//! Two of a kind, an application that is replaced under a running driver, and a thread that takes the driver's
//! CPU.

use bytemuck::Zeroable;
use io_driver::device_file::{self, DeviceFile};
use shm_abi::{DriverState, DriverView, Frame, client};
use std::path::Path;
use std::sync::atomic::Ordering;
use system_tests::faults::amplifiers::{emulate, wait_for};
use system_tests::faults::campaign::HOG_TEST;
use system_tests::faults::heal::another_phantom3;
use system_tests::faults::process::{Running, myself};
use system_tests::faults::ring::{RingLog, Told};
use system_tests::faults::stand::{Setup, Stand, end_app};

/// Nothing of the first one's changes: its amplifiers are as on as they were, none of its values is overwritten.
#[test]
fn a_second_driver_of_the_same_card_is_refused_wherever_it_listens_and_the_first_goes_on() {
    let mut stand = Stand::start(Setup::new("real"));
    let app = stand.start_app();
    stand.wait_for_force();
    let mut elsewhere = stand.driver_command();
    elsewhere.arg("--socket").arg(stand.path("other.sock"));
    let same_place = stand.driver_command();
    for mut command in [same_place, without_first_socket(&elsewhere)] {
        let end = Running::start(&mut command).end();
        assert_eq!(end.status, Some(2), "{end:?}");
        assert!(end.err.contains("belongs to another driver; one card has one driver"), "{end:?}");
    }
    let mut log = RingLog::begin(stand.view());
    log.follow_for(stand.view(), 100);
    log.check_promise(stand.view());
    assert!(log.told.iter().any(Told::is_pushing));
    assert!(!stand.path("other.sock").exists());
    stand.driver.must_run();
    drop(app);
    stand.finish();
}

/// `--socket` may be given once.
fn without_first_socket(command: &std::process::Command) -> std::process::Command {
    let mut arguments: Vec<_> = command.get_args().map(std::ffi::OsStr::to_os_string).collect();
    let first = arguments.iter().position(|argument| argument == "--socket").expect("one");
    arguments.drain(first..first + 2);
    let mut other = system_tests::programs::io_driver();
    other.args(arguments);
    other
}

#[test]
fn a_second_emulator_of_the_same_card_is_refused_and_the_first_goes_on() {
    let stand = Stand::start(Setup::new("real"));
    let app = stand.start_app();
    stand.wait_for_force();
    let end = Running::start(&mut emulate(stand.amplifiers.file())).end();
    assert_eq!(end.status, Some(2), "{end:?}");
    let message = format!("is played by process {} already", stand.amplifiers.process.id());
    assert!(end.err.contains(&message), "{end:?}");
    stand.wait_for_force();
    drop(app);
    stand.finish();
}

/// An arm in treacle, which its motors push away: whoever zeroed its counters anew would be seen.
#[test]
fn an_app_is_upgraded_under_a_running_driver_and_no_device_is_zeroed_anew() {
    let mut setup = Setup::new("real");
    setup.emulator = vec!["--yield", "50"];
    let mut stand = Stand::start(setup);
    let (driver, faults) = (stand.driver.id(), &stand.observer.driver.counters.faults);
    let mut old = stand.start_app();
    let mut moved = 0;
    for upgrade in 0..3 {
        wait_for("a force", || {
            stand.view().read_latest().is_some_and(|frame| frame.previous.authority > 0.0)
        });
        wait_for("a movement", || counts(stand.view())[..3].iter().map(|c| c.abs()).sum::<i64>() > moved);
        // Killed, and asked to end: the successor finds the same driver.
        if upgrade % 2 == 0 {
            old.kill();
        } else {
            drop(end_app(old));
        }
        wait_for("the end of the force", || !stand.amplifiers.are_enabled());
        // What was written last is at work until the emulator has seen it.
        stand.amplifiers.settle();
        stand.amplifiers.settle();
        let before = counts(stand.view());
        let mut log = RingLog::begin(stand.view());
        old = Running::start(&mut another_phantom3(&stand, upgrade));
        log.follow(stand.view(), "its first force", |told| told.iter().any(Told::is_pushing));
        let first = log.told.iter().find(|told| told.lease != 0).expect("it got the lease");
        let at_lease = counts_in(stand.view(), first.tick).unwrap_or(before);
        for (before, after) in before.iter().zip(at_lease) {
            assert!((before - after).abs() <= 1, "{before} counts, then {after}");
        }
        check_zero(stand.view());
        moved = before[..3].iter().map(|count| count.abs()).sum();
        assert!(moved > 0, "it was pushed away");
        log.check_promise(stand.view());
        assert!(log.told.iter().all(|told| !matches!(told.state, DriverState::Zeroing | DriverState::Fault)));
    }
    assert_eq!(stand.driver.id(), driver);
    assert_eq!(faults.load(Ordering::Relaxed), 0);
    assert_eq!(stand.view().counters.leases_granted.load(Ordering::Relaxed), 4);
    stand.driver.must_run();
    old.kill();
    stand.finish();
}

/// Counts go on whatever is called zero; angles do not. The emulator's counters began at zero, at home, so an
/// angle is its count's for ever.
fn check_zero(driver: &DriverView) {
    let text = device_file::builtin("premium-1.5").expect("it is built in");
    let Ok(DeviceFile::Arm(premium)) = DeviceFile::parse(text, Path::new("premium-1.5")) else {
        panic!("a premium")
    };
    let device = driver.read_latest().expect("frames").devices[0];
    let [a, b, c, ..] = device.encoder_counts;
    let expected = premium.joint_map().counts_to_angles([a, b, c]);
    for (found, expected) in device.joint_angle_rad.iter().zip(expected) {
        // The same product; a count is 1.2e-4 rad.
        assert!((found - expected).abs() < 1e-9, "zeroed anew: {device:?}");
    }
}

fn counts(driver: &DriverView) -> [i64; 6] {
    driver.read_latest().expect("frames").devices[0].encoder_counts
}

/// `None` if the ring has gone on.
fn counts_in(driver: &DriverView, tick: u64) -> Option<[i64; 6]> {
    let mut frame = Frame::zeroed();
    driver.read_frame(tick, &mut frame).ok()?;
    Some(frame.devices[0].encoder_counts)
}

/// It takes the loop's CPU for twice as long as the amplifiers wait: they switch themselves off, and the loop
/// that gets its CPU back finds them so. Without the right to take a CPU nobody can do that to it; what a loop
/// that stands still means is shown in `driver_dies` without any right.
#[test]
fn a_hog_on_the_drivers_cpu_is_the_watchdogs_and_the_driver_comes_back() {
    let mut setup = Setup::new("real");
    setup.limits.watchdog_ms = 150;
    let stand = Stand::start(setup);
    let app = stand.start_app();
    stand.wait_for_force();
    let Some(cpu) = stand.view().info().cpu else {
        return eprintln!("skipped: the loop has no CPU of its own");
    };
    let before = stand.amplifiers.tally();
    let overruns = stand.view().counters.overruns.load(Ordering::Relaxed);
    let end = Running::start(&mut myself(HOG_TEST, &format!("{cpu} 300"))).end();
    assert_eq!(end.status, Some(0), "{end:?}");
    if end.out.contains("skipped") {
        eprintln!("{}", end.out);
        drop(app);
        stand.finish();
        return;
    }
    // The kernel keeps 5 % for others, in one piece at the end of each second at most: of 300 ms, 200 at least
    // are the hog's, 400 ticks.
    wait_for("the overruns", || stand.view().counters.overruns.load(Ordering::Relaxed) > overruns + 300);
    wait_for("an end", || !stand.amplifiers.are_enabled() || stand.amplifiers.have_tripped());
    eprintln!("{} trips", stand.amplifiers.tally().watchdog_trips - before.watchdog_trips);
    drop(app);
    client::clear_fault(&stand.socket(), "test").expect("it is told");
    let app = stand.start_app();
    stand.wait_for_force();
    drop(app);
    stand.finish();
}
