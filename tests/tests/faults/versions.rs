//! Programs of different releases meet, and drivers that are none: whoever cannot share memory parts with a message, and
//! nobody else notices.

use bytemuck::Zeroable;
use patience::prelude::*;
use shm_abi::handshake::{Answer, Request, RequestKind, Verdict};
use shm_abi::layout::DriverHeader;
use shm_abi::{ABI_MAJOR, ABI_MINOR, Frame, LAYOUT_HASH};
use std::io::{Read, Write};
use std::os::unix::net::UnixListener;
use std::sync::atomic::Ordering;
use system_tests::faults::knock::{self, foreigners};
use system_tests::faults::liar::Liar;
use system_tests::faults::press::Table;
use system_tests::faults::process::{End, Running};
use system_tests::faults::ring::{RingLog, Told};
use system_tests::faults::stand::{Setup, Stand};

#[test]
fn apps_of_other_versions_are_refused_with_both_versions_while_the_devices_are_commanded() {
    let mut stand = Stand::start(Setup::new("real"));
    let app = stand.start_app();
    stand.wait_for_force();
    let mut log = RingLog::begin(stand.view());
    for foreigner in foreigners() {
        let answer = knock::ask(&stand.socket(), &foreigner.request).expect("an answer");
        knock::check(&foreigner, &answer);
    }
    log.follow_for(stand.view(), 50);
    log.check_promise(stand.view());
    assert!(log.told.iter().any(Told::is_pushing));
    assert!(log.told.iter().all(|told| told.lease == 1), "no lease was given or taken");
    drop(app);
    stand.driver.must_run();
    stand.finish();
}

/// A minor version adds requests and changes no memory; the layout has the last word.
#[test]
fn an_app_of_another_minor_version_with_the_same_layout_is_served() {
    let stand = Stand::start(Setup::new("real"));
    let observe = Request::new(RequestKind::Observe, "newer");
    let newer = u64::from(ABI_MAJOR) << 32 | u64::from(ABI_MINOR + 1);
    let answer = knock::ask(&stand.socket(), &Request { abi_version: newer, ..observe }).expect("an answer");
    assert_eq!(Verdict::from_word(answer.verdict), Some(Verdict::Granted));
    stand.finish();
}

/// What a driver of another release says, and what the application makes of it.
#[test]
fn an_app_that_meets_a_driver_of_another_version_says_which_both_are() {
    let own = Answer::new(Verdict::Granted);
    let newer = u64::from(ABI_MAJOR + 1) << 32;
    let (theirs, ours) = (format!("{}.0", ABI_MAJOR + 1), format!("{ABI_MAJOR}.{ABI_MINOR}"));
    let cases = [
        (
            Answer { abi_version: newer, verdict: Verdict::WrongVersion as u64, ..own },
            [theirs.clone(), ours.clone()],
        ),
        // One that does not even know that it should have refused.
        (Answer { abi_version: newer, ..own }, [theirs, ours]),
        (
            Answer { layout_hash: !LAYOUT_HASH, verdict: Verdict::WrongLayout as u64, ..own },
            [format!("0x{:016x}", !LAYOUT_HASH), format!("0x{LAYOUT_HASH:016x}")],
        ),
        (Answer { magic: 0x5048, ..own }, ["is not a driver's socket".into(), "name another one".into()]),
    ];
    for (answer, expected) in cases {
        let table = Table::new();
        let socket = table.path("driver.sock");
        let listener = UnixListener::bind(&socket).expect("a socket");
        let driver = std::thread::spawn(move || {
            let mut stream = patience::accepted(&listener);
            let mut request = Request::zeroed();
            stream.read_exact(bytemuck::bytes_of_mut(&mut request)).expect("a request");
            stream.write_all(bytemuck::bytes_of(&answer)).expect("it is told");
        });
        let mut app = table.app("real");
        let end = Running::start(app.args(["--seconds", "1", "--attach"]).arg(&socket)).end();
        driver.bounded_join().expect("it was asked");
        assert_eq!((end.status, end.out.as_str()), (Some(2), ""), "{end:?}");
        for words in expected {
            assert!(end.err.contains(&words), "{words}: {end:?}");
        }
    }
}

/// How the application ends that meets such a driver; whoever waits for ever is killed, and fails the test.
fn end_with(liar: &Liar) -> End {
    let table = Table::new();
    Running::start(table.app("real").args(["--seconds", "80000", "--attach"]).arg(liar.socket())).end()
}

#[test]
fn an_app_that_meets_a_driver_whose_header_cannot_be_starts_nothing_and_says_what_it_found() {
    type Lie = (fn(&DriverHeader), &'static str);
    let lies: [Lie; 5] = [
        (
            |header| header.period_ns.store(0, Ordering::Relaxed),
            "period in nanoseconds: 0, expected 50000 to",
        ),
        // No driver is as fast: a run of seconds would be one of hours.
        (
            |header| header.period_ns.store(1, Ordering::Relaxed),
            "period in nanoseconds: 1, expected 50000 to",
        ),
        (
            |header| header.reply_budget_ns.store(0, Ordering::Relaxed),
            "reply budget in nanoseconds: 0, expected 1 to",
        ),
        (|header| header.ramp_in_ticks.store(0, Ordering::Relaxed), "ramp in in ticks: 0, expected 1 to"),
        (|header| header.device_count.store(99, Ordering::Relaxed), "number of devices: 99, expected 0 to 8"),
    ];
    for (lie, expected) in lies {
        let end = end_with(&Liar::about_itself(lie));
        assert_eq!((end.status, end.out.as_str()), (Some(2), ""), "{end:?}");
        assert!(end.err.contains(expected), "{expected}: {end:?}");
    }
}

#[test]
fn a_run_ends_with_words_when_its_driver_tells_what_cannot_be() {
    type Lie = (fn(&mut Frame), &'static str);
    let later: [Lie; 15] = [
        (|frame| frame.tick = 5, "its ticks go back: found tick 5 after"),
        (|frame| frame.tick += 1 << 40, "its ticks jump: found tick"),
        (|frame| frame.deadline_ns = u64::MAX, "comes from the future"),
        (|frame| frame.run_tick = i64::MAX, "does not go with its ticks: found 9223372036854775807 in tick"),
        // As if it had never begun: a run without end.
        (|frame| frame.run_tick = -1, "does not go with its ticks: found -1 in tick"),
        (|frame| (frame.lease, frame.run_tick) = (99, -1), "no frame under this program's lease for 10 s"),
        (
            |frame| frame.devices[0].position_m_measured[1] = f64::NAN,
            "its position of device 0 is said to be",
        ),
        (|frame| frame.devices[0].position_m_measured[1] = 1e300, "its position of device 0 is said to be"),
        (
            |frame| frame.devices[0].velocity_m_per_s_estimated[2] = -1e300,
            "its velocity of device 0 is said to be",
        ),
        (
            |frame| frame.devices[0].force_on_user_n_applied[0] = f64::NAN,
            "its applied force of device 0 is said to be",
        ),
        (
            |frame| frame.devices[0].force_on_user_n_applied[0] = f64::INFINITY,
            "its applied force of device 0 is said to be",
        ),
        (|frame| frame.device_count = 0, "it tells of too few devices, expected 1 at least: found 0 in tick"),
        (|frame| frame.authority = 1e300, "its authority is none: found 1e300 in tick"),
        (|frame| frame.authority = -0.5, "its authority is none: found -0.5 in tick"),
        (|frame| frame.state = 99, "its state is none that there is: found 99 in tick"),
    ];
    let at_once: [Lie; 2] = [
        (|frame| frame.run_tick = -1, "its time of the run does not begin: found -1 in tick"),
        // As if the run were nearly over.
        (|frame| frame.run_tick += 79_999_000, "began before this program's first answer: found 79999"),
    ];
    let later = later.map(|lie| (lie, false));
    for ((lie, expected), begins_with_it) in later.into_iter().chain(at_once.map(|lie| (lie, true))) {
        let liar = if begins_with_it { Liar::about_all_frames(lie) } else { Liar::about_frames(lie) };
        let end = end_with(&liar);
        assert_eq!(end.status, Some(3), "{expected}: {end:?}");
        assert!(
            end.err.contains("the driver tells what cannot be: ") && end.err.contains(expected),
            "{expected}: {end:?}"
        );
    }
}

/// Each of its frames is sound; only their number is a tenth of what the clock asks for.
#[test]
fn a_run_ends_with_words_when_its_drivers_ticks_are_much_too_slow() {
    let end = end_with(&Liar::about_itself(|header| header.period_ns.store(100_000, Ordering::Relaxed)));
    assert_eq!(end.status, Some(3), "{end:?}");
    let words = "the driver tells what cannot be: its ticks fall behind the clock: found";
    assert!(end.err.contains(words), "{end:?}");
}
