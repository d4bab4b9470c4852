//! The driver dies in every way it can, with a force on: what the amplifiers were told, and what they did.

use rt_core::epitaph::{self, Epitaph, EpitaphKind};
use rustix::process::Signal;
use shm_abi::{DriverState, FaultReason, client, stop_socket};
use std::sync::atomic::Ordering;
use system_tests::faults::amplifiers::{Seen, wait_for};
use system_tests::faults::process::End;
use system_tests::faults::stand::{Setup, Stand};

/// Any death: the amplifiers were on before it.
struct Death {
    stand: Stand,
    end: End,
    words: Option<Epitaph>,
    trips_before: u64,
    switched_off_before: u64,
}

/// A driver at full force to which something happens.
fn die(sabotage: &str, strike: impl FnOnce(&Stand)) -> Death {
    die_in(Setup::new("real").sabotaged(sabotage), strike)
}

fn die_in(setup: Setup, strike: impl FnOnce(&Stand)) -> Death {
    let mut stand = Stand::start(setup);
    let app = stand.start_app();
    stand.wait_for_force();
    // A stall of the machine may have let the force go meanwhile; it comes back.
    stand.amplifiers.settle();
    wait_for("a force", || stand.amplifiers.are_enabled());
    let before = stand.amplifiers.tally();
    assert!(before.energised > 0);
    strike(&stand);
    let end = stand.driver.end();
    let words = epitaph::read(&stand.view().epitaph);
    drop(app);
    let (trips_before, switched_off_before) = (before.watchdog_trips, before.switched_off);
    Death { stand, end, words, trips_before, switched_off_before }
}

impl Death {
    /// Zero was the last value written, and it says off: nothing was left to the watchdog.
    fn check_released(&self) {
        self.stand.amplifiers.settle();
        self.stand.amplifiers.check_off("released");
        assert!(self.stand.amplifiers.were_told_off());
        let tally = self.stand.amplifiers.tally();
        assert_eq!(tally.switched_off, self.switched_off_before, "{tally:?}");
        assert_eq!(tally.watchdog_trips, self.trips_before, "{tally:?}");
    }

    /// The registers were cleared behind the last value's back.
    fn check_last_act(&self) {
        self.stand.amplifiers.settle();
        self.stand.amplifiers.check_off("last act");
        let tally = self.stand.amplifiers.tally();
        let acts = u64::from(self.died_pushing());
        assert_eq!(tally.switched_off, self.switched_off_before + acts, "{tally:?}");
        assert_eq!(tally.watchdog_trips, self.trips_before, "{tally:?}");
    }

    /// Nobody could do anything any more: the amplifiers' own watchdog did.
    fn check_watchdog(&self) {
        if !self.died_pushing() {
            return self.check_released();
        }
        wait_for("the watchdog", || self.stand.amplifiers.tally().watchdog_trips == self.trips_before + 1);
        wait_for("the trip", || self.stand.amplifiers.have_tripped());
    }

    /// Whether its last value had the amplifiers on: a stall of the machine may have let the force go.
    fn died_pushing(&self) -> bool {
        let pushed = !self.stand.amplifiers.were_told_off();
        if !pushed {
            eprintln!("the machine stood still just before the strike: no force was on");
        }
        pushed
    }

    fn finish(self) -> Seen {
        self.stand.finish_after_death()
    }
}

#[test]
fn a_driver_whose_loop_panics_leaves_an_epitaph_exit_status_3_and_zero_torque() {
    for act in ["panic", "panic-before-write", "panic-after-write"] {
        let death = die(&format!("{act}@button20"), |stand| stand.amplifiers.press(1 << 20));
        assert_eq!((death.end.status, death.end.signal), (Some(3), None), "{:?}", death.end);
        let words = death.words.as_ref().expect("an epitaph");
        assert_eq!(words.kind, EpitaphKind::Panic, "{words}");
        assert!(words.complete && words.tick > 0, "{words}");
        assert!(words.text.contains("saboteur.rs") && words.text.contains("sabotage"), "{words}");
        let told = "the driver's loop panicked; the motors were written zero: panicked in tick";
        assert!(death.end.err.contains(told), "{:?}", death.end);
        death.check_released();
        death.finish();
    }
}

/// A real fault of the CPU: Rust's own message and its SIGABRT come after the last act, and the epitaph tells of
/// the first signal.
#[test]
fn a_driver_whose_loop_overflows_its_stack_switches_off_by_its_last_act() {
    let death = die("overflow@button20", |stand| stand.amplifiers.press(1 << 20));
    assert_eq!((death.end.status, death.end.signal), (None, Some(6)), "{:?}", death.end);
    let words = death.words.as_ref().expect("an epitaph");
    assert_eq!(words.kind, EpitaphKind::Signal(11), "{words}");
    assert!(words.text.starts_with("SIGSEGV: invalid memory reference at address"), "{words}");
    death.check_last_act();
    death.finish();
}

#[test]
fn a_driver_that_is_killed_by_a_signal_that_can_be_caught_switches_off_by_its_last_act() {
    let from_within: [(&str, i32); 2] = [("segv", 11), ("abort", 6)];
    for (act, signal) in from_within {
        let death = die(&format!("{act}@button20"), |stand| stand.amplifiers.press(1 << 20));
        check_signal_death(death, signal);
    }
    let sent = [Signal::SEGV, Signal::BUS, Signal::ILL, Signal::FPE, Signal::ABORT];
    for signal in sent.into_iter().chain([Signal::XCPU, Signal::USR1, Signal::USR2]) {
        check_signal_death(die("", |stand| stand.driver.signal(signal)), signal.as_raw());
    }
}

fn check_signal_death(death: Death, signal: i32) {
    assert_eq!((death.end.status, death.end.signal), (None, Some(signal)), "{:?}", death.end);
    let words = death.words.as_ref().expect("an epitaph");
    assert_eq!((words.kind, words.complete), (EpitaphKind::Signal(signal), true), "{words}");
    death.check_last_act();
    death.finish();
}

/// Shut out by the kernel, the call ends the driver: with its last act, and words that name the call.
#[test]
fn a_driver_that_makes_a_forbidden_call_in_its_loop_switches_off_by_its_last_act() {
    let death = die("forbidden-call@button20", |stand| stand.amplifiers.press(1 << 20));
    // Where the kernel shuts out nothing, the call is made, and is a signal like any other.
    assert!(matches!(death.end.signal, Some(31 | 11)), "{:?}", death.end);
    assert!(death.words.is_some());
    death.check_last_act();
    death.finish();
}

/// The loop hangs with a force on, so that the driver cannot end in order, and somebody insists: the amplifiers
/// do not have to wait for their watchdog.
#[test]
fn a_driver_that_is_told_twice_to_stop_while_its_loop_hangs_switches_off_by_its_last_act() {
    for signal in [Signal::TERM, Signal::INT] {
        let mut setup = Setup::new("real").sabotaged("hang:60000@button20");
        setup.limits.watchdog_ms = 60_000;
        let death = die_in(setup, |stand| {
            stand.amplifiers.press(1 << 20);
            let ticks = || stand.view().latest_tick();
            // It hangs when no frame comes any more; 100 ms are 200 ticks.
            wait_for("the hang", || {
                let before = ticks();
                std::thread::sleep(std::time::Duration::from_millis(100));
                ticks() == before
            });
            stand.driver.signal(signal);
            // Heard sooner, it would be the same request delivered twice.
            std::thread::sleep(2 * rt_core::signals::SAME_REQUEST);
            stand.driver.signal(signal);
        });
        assert_eq!((death.end.status, death.end.signal), (None, Some(signal.as_raw())), "{:?}", death.end);
        death.check_last_act();
        death.finish();
    }
}

/// Nothing inside the process can help here.
#[test]
fn a_driver_that_is_killed_or_exits_without_a_word_is_the_watchdogs() {
    let death = die("", |stand| stand.driver.signal(Signal::KILL));
    assert_eq!((death.end.signal, death.words.is_none()), (Some(9), true), "{:?}", death.end);
    death.check_watchdog();
    death.finish();
    let death = die("exit@button20", |stand| stand.amplifiers.press(1 << 20));
    assert_eq!(death.end.status, Some(0), "{:?}", death.end);
    death.check_watchdog();
    death.finish();
}

#[test]
fn a_driver_that_is_asked_to_stop_says_off_to_its_amplifiers() {
    for signal in [Signal::TERM, Signal::INT, Signal::HUP] {
        let death = die("", |stand| stand.driver.signal(signal));
        assert_eq!(death.end.status, Some(0), "{:?}", death.end);
        assert_eq!(death.words.as_ref().map(|words| words.kind), Some(EpitaphKind::Stopped));
        death.check_released();
        death.finish();
    }
    let death = die("", |stand| {
        client::stop(&stand.socket(), "test").expect("it is told");
    });
    assert_eq!(death.end.status, Some(0), "{:?}", death.end);
    death.check_released();
    death.finish();
}

/// What the device says is no position, or none that a hand could have come to, or nothing at all: the driver
/// lives, the motors are off in the same tick, and come back only on request.
#[test]
fn forbidden_values_of_a_device_switch_the_amplifiers_off_until_somebody_clears_the_fault() {
    let forbidden = [
        ("nan", FaultReason::PositionNotFinite),
        ("leap", FaultReason::PositionJump),
        ("unreadable", FaultReason::DeviceRead),
        ("unwritable", FaultReason::DeviceWrite),
    ];
    for (act, reason) in forbidden {
        let stand = Stand::start(Setup::new("real").sabotaged(&format!("{act}@button20")));
        let app = stand.start_app();
        stand.wait_for_force();
        stand.amplifiers.press(1 << 20);
        wait_for_fault(&stand, reason);
        stand.amplifiers.settle();
        stand.amplifiers.check_off(act);
        let tally = stand.amplifiers.tally();
        assert_eq!((tally.switched_off, tally.watchdog_trips), (0, 0), "{act}: {tally:?}");
        drop(app);
        bring_back(&stand);
        stand.finish();
    }
}

/// The loop stands still with a force on. The amplifiers switch themselves off; the loop that goes on finds them
/// tripped, and does not switch them on again until somebody asks.
#[test]
fn a_loop_that_hangs_is_the_watchdogs_and_a_loop_that_goes_on_finds_the_amplifiers_tripped() {
    let mut setup = Setup::new("real").sabotaged("hang:1500@button20");
    setup.limits.watchdog_ms = 500;
    let stand = Stand::start(setup);
    let app = stand.start_app();
    stand.wait_for_force();
    let before = stand.amplifiers.tally();
    stand.amplifiers.press(1 << 20);
    stand.amplifiers.wait_for_trip(before);
    wait_for_fault(&stand, FaultReason::AmplifierTripped);
    wait_for("off", || !stand.amplifiers.are_enabled());
    stand.amplifiers.check_off("after the hang");
    drop(app);
    bring_back(&stand);
    let seen = stand.finish();
    assert_eq!(seen.tally.watchdog_trips, before.watchdog_trips + 1);
}

/// End of a driver whose loop hangs under force, before amplifiers without a watchdog: the driver has to do it.
fn end_of_a_hung_loop(ask: impl FnOnce(&Stand)) -> End {
    let mut setup = Setup::new("real").sabotaged("hang:600000@button20");
    setup.limits.watchdog_ms = 600_000;
    let mut stand = Stand::start(setup);
    let app = stand.start_app();
    stand.wait_for_force();
    stand.amplifiers.press(1 << 20);
    wait_for("a loop that stands", || {
        let tick = stand.view().latest_tick();
        std::thread::sleep(std::time::Duration::from_millis(100));
        stand.view().latest_tick() == tick
    });
    assert!(stand.amplifiers.are_enabled(), "the force stays");
    ask(&stand);
    let end = stand.driver.end();
    assert_eq!(end.status, Some(3), "{end:?}");
    let words = epitaph::read(&stand.view().epitaph).expect("an epitaph");
    assert_eq!(words.kind, EpitaphKind::Fault, "{words}");
    stand.amplifiers.settle();
    stand.amplifiers.check_off("a hung loop");
    drop(app);
    let seen = stand.finish_after_death();
    assert_eq!((seen.tally.watchdog_trips, seen.tally.switched_off), (0, 1));
    end
}

#[test]
fn a_driver_whose_loop_hangs_for_ever_is_stopped_all_the_same_with_the_motors_off() {
    let end = end_of_a_hung_loop(|stand| {
        client::stop(&stand.socket(), "test").expect("it is told");
    });
    assert!(end.err.contains("the driver's loop hangs"), "{end:?}");
}

/// By connection and by datagram: nobody has to know that `stop` would do more.
#[test]
fn an_emergency_stop_switches_the_motors_off_behind_a_loop_that_hangs() {
    end_of_a_hung_loop(|stand| {
        client::emergency_stop_over_connection(&stand.socket(), "test").expect("it is told");
    });
    end_of_a_hung_loop(|stand| {
        stop_socket::send(&stand.socket()).expect("it is heard");
    });
}

/// Amplifiers that let go by themselves, tell nobody and come back: what they held is not there any more.
#[test]
fn after_a_gap_the_force_begins_anew_however_soon_the_application_answers() {
    let mut setup = Setup::new("real");
    setup.limits.watchdog_ms = 600_000;
    let stand = Stand::start(setup);
    let app = stand.start_app();
    stand.wait_for_force();
    // It comes on in 200 ms, which a busy machine may let pass before anybody looks: then once more.
    let begins_anew = (0..10).any(|_| {
        let mut frame = stand.view().read_latest().expect("frames");
        wait_for("all of the force", || {
            frame = stand.view().read_latest().expect("frames");
            frame.authority > 0.99
        });
        stand.driver.signal(Signal::STOP);
        let stopped_at = stand.view().read_latest().expect("frames").tick;
        std::thread::sleep(std::time::Duration::from_millis(300));
        stand.driver.signal(Signal::CONT);
        wait_for("ticks", || {
            frame = stand.view().read_latest().expect("frames");
            frame.tick > stopped_at + 305
        });
        frame.authority < 0.9
    });
    assert!(begins_anew, "all of the force was there after each of ten gaps");
    drop(app);
    stand.finish();
}

#[test]
fn a_driver_that_is_stopped_and_continued_finds_its_amplifiers_tripped() {
    let stand = Stand::start(Setup::new("real"));
    let app = stand.start_app();
    stand.wait_for_force();
    let before = stand.amplifiers.tally();
    stand.driver.signal(Signal::STOP);
    stand.amplifiers.wait_for_trip(before);
    stand.driver.signal(Signal::CONT);
    wait_for_fault(&stand, FaultReason::AmplifierTripped);
    wait_for("off", || !stand.amplifiers.are_enabled());
    drop(app);
    bring_back(&stand);
    stand.finish();
}

fn wait_for_fault(stand: &Stand, reason: FaultReason) {
    wait_for("the fault", || {
        let frame = stand.view().read_latest();
        frame.is_some_and(|f| f.state == DriverState::Fault as u64 && f.fault == reason as u64)
    });
    assert_eq!(stand.view().counters.faults.load(Ordering::Relaxed), 1, "{reason:?}");
}

/// Somebody looks, lets go of the buttons, clears the fault, and a new application works.
fn bring_back(stand: &Stand) {
    stand.amplifiers.press(0);
    client::clear_fault(&stand.socket(), "test").expect("it is told");
    wait_for("the end of the fault", || {
        stand.view().read_latest().is_some_and(|frame| frame.state != DriverState::Fault as u64)
    });
    // A position that jumped cost the zero; the arm rests at home all the while.
    wait_for("positions", || {
        let frame = stand.view().read_latest().expect("frames");
        let is_zeroing = frame.state == DriverState::Zeroing as u64;
        if is_zeroing {
            client::zero(&stand.socket(), "test", 0).expect("it is told");
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        !is_zeroing
    });
    let app = stand.start_app();
    stand.wait_for_force();
    drop(app);
}
