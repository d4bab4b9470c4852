//! The two rings and the two doorbells under real threads and processes, over real mappings.
//!
//! The loom models prove the protocol on a ring of two; here the same code runs on the machine's own memory,
//! page tables and scheduler, with the real sizes. No check depends on speed: what must never happen is
//! looked for as often as the machine allows, and the only time-outs are those that tell a hang.

use crate::common::{command, frame, info, info_of, is_command, is_frame, is_frame_of, wait_until};
use bytemuck::Zeroable;
use patience::limit;
use patience::prelude::*;
use proptest::prelude::*;
use shm_abi::doorbell::{self, Place};
use shm_abi::layout::{RING_COMMANDS, SLEEPS_ON_OTHERS_BELL};
use shm_abi::server::{Server, ServerEvent};
use shm_abi::{
    Command, CommanderMemory, CommanderView, DriverMemory, DriverView, Frame, FrameUnavailable, MAX_DEVICES,
    RING_FRAMES, client,
};
use std::os::fd::AsFd;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A driver's memory and one lease's, each mapped by both sides.
struct Shared {
    memory: DriverMemory,
    view: DriverView,
    commander: CommanderMemory,
    commander_view: CommanderView,
}

fn shared() -> Shared {
    shared_with(crate::common::DEVICES)
}

fn shared_with(devices: usize) -> Shared {
    let memory = DriverMemory::create(&info_of(devices)).unwrap();
    let view = DriverView::map(memory.fd()).unwrap();
    let (commander_view, fd) = CommanderView::create(1).unwrap();
    let commander = CommanderMemory::map(fd.as_fd()).unwrap();
    Shared { memory, view, commander, commander_view }
}

/// How often a reader met what.
#[derive(Debug, Default)]
struct Tally {
    whole: AtomicU64,
    not_yet: AtomicU64,
    overwritten: AtomicU64,
    torn: AtomicU64,
}

fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}

/// Reads one frame at a distance from the newest and checks that the answer is the truth.
fn read_and_judge(view: &DriverView, distance: i64, first: u64, devices: usize, tally: &Tally) {
    const RING: u64 = RING_FRAMES as u64;
    /// The writer works on at most one frame that is not announced, and on a weakly ordered machine its
    /// beginning may be seen before the announcement of the frame before.
    const AHEAD: u64 = 2;
    let before = view.latest_tick();
    let newest = before.unwrap_or(first);
    let Some(tick) = newest.checked_add_signed(distance) else { return };
    // What stood there before must not be seen.
    let mut found = frame(!tick);
    let read = view.read_frame(tick, &mut found);
    let after = view.latest_tick().unwrap_or(first);
    match read {
        Ok(()) => {
            assert!(is_frame_of(&found, tick, devices), "frame {tick} is a mixture: {found:?}");
            count(&tally.whole);
        }
        Err(FrameUnavailable::NotYet(which)) => {
            assert_eq!(which, tick);
            // A tick before the very first one looks like one to come: its slot was never written.
            assert!(
                before.is_none_or(|newest| tick > newest || tick < first),
                "{tick} was there at {newest}"
            );
            count(&tally.not_yet);
        }
        Err(FrameUnavailable::Overwritten(which)) => {
            assert_eq!(which, tick);
            assert!(after + AHEAD >= tick + RING, "{tick} cannot be overwritten at {after}");
            count(&tally.overwritten);
        }
        Err(FrameUnavailable::Torn(which)) => {
            assert_eq!(which, tick);
            let oldest = before.map_or(first, |newest| newest + 1);
            assert!(
                (oldest..=after + AHEAD).any(|writing| writing % RING == tick % RING),
                "nobody wrote into the slot of {tick} between {newest} and {after}"
            );
            count(&tally.torn);
        }
    }
}

proptest! {
    // Each case is a burst of real concurrency; a dozen vary phase and distance enough.
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn readers_at_any_distance_see_whole_frames_and_true_reasons(
        first in 0u64..1 << 40,
        lag in 0..RING_FRAMES as i64,
        devices in 0..=MAX_DEVICES,
    ) {
        const FRAMES: u64 = 4 * RING_FRAMES as u64;
        let ring = RING_FRAMES as i64;
        let Shared { memory, view, .. } = shared_with(devices);
        let done = AtomicBool::new(false);
        let tally = Tally::default();
        std::thread::scope(|scope| {
            // Also by a panic: the scope waits for its readers.
            let _done = patience::Raised(&done);
            // The newest, somewhere within, the one about to be overwritten, long gone, still to come.
            for distance in [0, -lag, 1 - ring, -ring - lag, 1 + lag] {
                let (view, done, tally) = (&view, &done, &tally);
                scope.spawn(move || {
                    while !done.load(Ordering::Relaxed) {
                        read_and_judge(view, distance, first, devices, tally);
                    }
                    read_and_judge(view, distance, first, devices, tally);
                });
            }
            for tick in first..first + FRAMES {
                memory.write_frame(&frame(tick));
                memory.ring(tick, None);
            }
            done.store(true, Ordering::Relaxed);
        });
        // Torn reads are up to chance; the loom models meet them for certain.
        let seen = |counter: &AtomicU64| counter.load(Ordering::Relaxed) > 0;
        prop_assert!(seen(&tally.whole) && seen(&tally.not_yet) && seen(&tally.overwritten), "{tally:?}");
    }

    #[test]
    fn readers_of_the_command_ring_see_whole_commands_of_their_slot(first in 0u64..1 << 40) {
        const COMMANDS: u64 = 50_000;
        let Shared { view, commander, commander_view, .. } = shared();
        let done = AtomicBool::new(false);
        let whole = AtomicU64::new(0);
        std::thread::scope(|scope| {
            // Also by a panic: the scope waits for its readers.
            let _done = patience::Raised(&done);
            for lag in 0..RING_COMMANDS as u64 {
                let (view, done, whole) = (&commander_view, &done, &whole);
                scope.spawn(move || {
                    let mut found = Command::zeroed();
                    while !done.load(Ordering::Relaxed) {
                        let Some(tick) = view.latest_tick().and_then(|newest| newest.checked_sub(lag)) else {
                            continue;
                        };
                        if tick >= first && view.read_command(tick, &mut found).is_ok() {
                            assert!(is_command(&found, found.tick), "a mixture: {found:?}");
                            assert!(found.tick >= tick, "{} is older than the announced {tick}", found.tick);
                            assert_eq!(found.tick % RING_COMMANDS as u64, tick % RING_COMMANDS as u64);
                            count(whole);
                        }
                    }
                });
            }
            for tick in first..first + COMMANDS {
                commander.publish(&command(tick), &view);
            }
            // On a loaded machine the readers may only come to run now.
            wait_until("somebody read a command", || whole.load(Ordering::Relaxed) > 0);
            done.store(true, Ordering::Relaxed);
        });
    }
}

/// Sleeps until `newest` is `expected`; a sleep that lasts as long as its time-out was never woken.
fn sleep_until(expected: u64, newest: impl Fn() -> Option<u64>, sleep: impl Fn(Option<u64>, Duration)) {
    let start = Instant::now();
    loop {
        let seen = newest();
        if seen == Some(expected) {
            return;
        }
        sleep(seen, limit());
        assert!(start.elapsed() < limit(), "slept through the announcement of {expected}");
    }
}

#[test]
fn ten_thousand_rounds_of_sleeping_on_each_other_lose_no_wake_up() {
    const ROUNDS: u64 = 10_000;
    let Shared { memory, view, commander, commander_view } = shared();
    let mut commander_slept = 0;
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for tick in 0..ROUNDS {
                sleep_until(
                    tick,
                    || view.latest_tick(),
                    |seen, timeout| view.sleep_for_frame(seen, &commander, timeout),
                );
                commander.publish(&command(tick), &view);
            }
        });
        let mut answer = Command::zeroed();
        for tick in 0..ROUNDS {
            commander_slept += commander.bell.owner_sleeps.load(Ordering::Relaxed);
            memory.write_frame(&frame(tick));
            memory.ring(tick, Some(&commander_view));
            sleep_until(
                tick,
                || commander_view.latest_tick(),
                |seen, timeout| commander_view.sleep_for_command(seen, &memory, timeout),
            );
            commander_view.read_command(tick, &mut answer).unwrap();
            assert!(is_command(&answer, tick));
        }
    });
    assert!(commander_slept > 0, "nobody ever slept: nothing was tested");
}

/// Observers that sleep on the bell that all share, as any may, to crowd it.
struct Crowd {
    asleep: AtomicU64,
    woken: AtomicU64,
    is_over: AtomicBool,
}

impl Crowd {
    /// Runs `body` while they sleep, then wakes them all.
    fn around(view: &DriverView, memory: &DriverMemory, body: impl FnOnce(&Self)) {
        let crowd =
            Self { asleep: AtomicU64::new(0), woken: AtomicU64::new(0), is_over: AtomicBool::new(false) };
        std::thread::scope(|scope| {
            let _over = patience::Raised(&crowd.is_over);
            for _ in 0..CROWD {
                let spawned = std::thread::Builder::new()
                    .stack_size(64 << 10)
                    .spawn_scoped(scope, || crowd.sleep_on(&view.bell.doorbell));
                spawned.unwrap();
            }
            wait_until("they sleep", || crowd.asleep.load(Ordering::Relaxed) == CROWD);
            // From there to the kernel's queue. If this is too short, the test checks less, but holds.
            std::thread::sleep(Duration::from_millis(200));
            body(&crowd);
            wait_until("everybody has slept and is woken", || {
                doorbell::wake(&memory.bell);
                crowd.woken() == CROWD
            });
        });
    }

    fn sleep_on(&self, word: &AtomicU32) {
        use rustix::thread::{Timespec, futex};
        // Longer than the test; what they do then is to look whether it failed.
        let timeout = Timespec { tv_sec: 30, tv_nsec: 0 };
        self.asleep.fetch_add(1, Ordering::Relaxed);
        let wait = || futex::wait(word, futex::Flags::empty(), word.load(Ordering::Relaxed), Some(&timeout));
        while wait().is_err() && !self.is_over.load(Ordering::Relaxed) {}
        self.woken.fetch_add(1, Ordering::Relaxed);
    }

    fn woken(&self) -> u64 {
        self.woken.load(Ordering::Relaxed)
    }
}

/// As many as one process may have threads; sixty may attach, and each may have more.
const CROWD: u64 = 1000;

#[test]
fn a_thousand_observers_asleep_on_the_shared_bell_are_never_woken_by_the_loop() {
    const ROUNDS: u64 = 1000;
    let Shared { memory, view, commander, commander_view } = shared();
    Crowd::around(&view, &memory, |crowd| {
        let mut woken = 0;
        std::thread::scope(|scope| {
            scope.spawn(|| {
                for tick in 0..ROUNDS {
                    sleep_until(
                        tick,
                        || view.latest_tick(),
                        |seen, t| view.sleep_for_frame(seen, &commander, t),
                    );
                    commander.publish(&command(tick), &view);
                }
            });
            for tick in 0..ROUNDS {
                memory.write_frame(&frame(tick));
                let now = memory.ring(tick, Some(&commander_view));
                assert!(now <= 1, "{now} sleepers were woken for tick {tick}");
                woken += now;
                sleep_until(
                    tick,
                    || commander_view.latest_tick(),
                    |seen, timeout| commander_view.sleep_for_command(seen, &memory, timeout),
                );
            }
        });
        assert!(woken > 0, "the commander never slept: nothing was tested");
        assert_eq!(crowd.woken(), 0, "observers that the loop woke");
    });
}

#[test]
fn for_a_commander_of_before_1_3_the_loop_wakes_a_few_sleepers_at_most() {
    let Shared { memory, view, commander, commander_view } = shared();
    // As it sleeps: on the bell that all share.
    commander.bell.owner_sleeps.store(SLEEPS_ON_OTHERS_BELL, Ordering::Relaxed);
    Crowd::around(&view, &memory, |crowd| {
        for tick in 0..10 {
            let now = memory.ring(tick, Some(&commander_view));
            assert!(now <= doorbell::OLD_SLEEPERS as usize, "{now} sleepers were woken for tick {tick}");
        }
        assert!(crowd.woken() <= u64::from(10 * doorbell::OLD_SLEEPERS));
    });
}

#[test]
fn a_commander_of_before_1_3_that_sleeps_alone_is_woken_by_the_ring() {
    let Shared { memory, view, commander, commander_view } = shared();
    let (place, flag) = (Place::bell(&view.bell), &commander.bell.owner_sleeps);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            sleep_until(
                0,
                || view.latest_tick(),
                |seen, t| doorbell::sleep(place, &view.bell, seen, flag, t),
            );
        });
        wait_until("it sleeps", || flag.load(Ordering::Relaxed) == SLEEPS_ON_OTHERS_BELL);
        // From the flag to the kernel's queue. If this is too short, the test checks less, but holds.
        std::thread::sleep(Duration::from_millis(50));
        memory.write_frame(&frame(0));
        memory.ring(0, Some(&commander_view));
    });
}

#[test]
fn a_commander_of_today_sleeps_on_the_shared_bell_of_a_driver_of_before_1_3() {
    let Shared { memory, view, commander, .. } = shared();
    memory.header.abi_version.store((1 << 32) | 2, Ordering::Relaxed);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            sleep_until(0, || view.latest_tick(), |seen, t| view.sleep_for_frame(seen, &commander, t));
        });
        let flag = &commander.bell.owner_sleeps;
        wait_until("it sleeps", || flag.load(Ordering::Relaxed) == SLEEPS_ON_OTHERS_BELL);
        std::thread::sleep(Duration::from_millis(50));
        // What that driver does.
        doorbell::ring(&memory.bell, 0, flag);
    });
}

#[test]
fn a_sleep_without_end_sleeps_instead_of_returning_at_once() {
    let Shared { memory, view, commander, commander_view } = shared();
    std::thread::scope(|scope| {
        let sleeper = scope.spawn(|| view.sleep_for_frame(None, &commander, Duration::MAX));
        wait_until("it sleeps", || commander.bell.owner_sleeps.load(Ordering::Relaxed) != 0);
        std::thread::sleep(Duration::from_millis(50));
        let slept = !sleeper.is_finished();
        memory.write_frame(&frame(0));
        memory.ring(0, Some(&commander_view));
        assert!(slept, "it came back though nothing had happened");
    });
}

#[test]
fn a_sleeper_that_has_not_seen_the_newest_frame_does_not_sleep() {
    let Shared { memory, view, commander, .. } = shared();
    memory.write_frame(&frame(0));
    memory.ring(0, None);
    let start = Instant::now();
    view.sleep_for_frame(None, &commander, limit());
    assert!(start.elapsed() < limit(), "slept though frame 0 was there");
    assert_eq!(commander.bell.owner_sleeps.load(Ordering::Relaxed), 0, "the flag comes down again");
}

#[test]
fn a_frame_that_was_never_written_is_not_there_yet_whatever_its_number() {
    let Shared { view, .. } = shared();
    let mut found = Frame::zeroed();
    for tick in [0, 1, RING_FRAMES as u64, u64::MAX / 2, 1 << 63, u64::MAX] {
        assert_eq!(view.read_frame(tick, &mut found), Err(FrameUnavailable::NotYet(tick)));
    }
    assert_eq!(view.read_latest(), None);
}

#[test]
fn devices_that_a_driver_has_not_are_zero_whatever_stood_in_the_readers_frame() {
    for devices in [0, 1, 3, MAX_DEVICES] {
        let Shared { memory, view, .. } = shared_with(devices);
        // A frame of a former driver that had more devices, and a count that lies.
        let mut found = frame(1);
        memory.write_frame(&frame(2));
        view.read_frame(2, &mut found).unwrap();
        assert!(is_frame_of(&found, 2, devices), "{devices} devices: {found:?}");
        // A reader of 1.0 copies the whole slot.
        let slot = &memory.frames[2].words;
        let mut whole = Frame::zeroed();
        for (word, shared) in
            bytemuck::cast_mut::<_, [u64; shm_abi::layout::FRAME_WORDS]>(&mut whole).iter_mut().zip(slot)
        {
            *word = shared.load(Ordering::Relaxed);
        }
        assert!(is_frame_of(&whole, 2, devices), "{devices} devices: {whole:?}");
    }
}

const CHILD_SOCKET: &str = "SHM_ABI_TEST_COMMANDER_SOCKET";
const PROCESS_ROUNDS: u64 = 5_000;

#[test]
fn two_processes_exchange_whole_frames_and_commands_by_sleeping_on_each_other() {
    let directory = tempfile::tempdir().unwrap();
    let socket = directory.path().join("driver.sock");
    let memory = DriverMemory::create(&info()).unwrap();
    let mut server = Server::bind(&socket).unwrap();
    let mut child = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "concurrent::body_of_the_commanding_process"])
        .env(CHILD_SOCKET, &socket)
        .spawn()
        .unwrap();
    let mut events = Vec::new();
    wait_until("the child commands", || {
        server.poll(&memory, Duration::from_millis(10), &mut events).unwrap();
        !events.is_empty()
    });
    let Some(ServerEvent::LeaseGranted { view, .. }) = events.pop() else { panic!("no lease: {events:?}") };
    let mut answer = Command::zeroed();
    for tick in 0..PROCESS_ROUNDS {
        memory.write_frame(&frame(tick));
        memory.ring(tick, Some(&view));
        sleep_until(
            tick,
            || view.latest_tick(),
            |seen, timeout| view.sleep_for_command(seen, &memory, timeout),
        );
        view.read_command(tick, &mut answer).unwrap();
        assert!(is_command(&answer, tick));
    }
    assert!(child.bounded_wait().success());
}

/// Runs only in the process that the test above starts.
#[test]
fn body_of_the_commanding_process() {
    let Some(socket) = std::env::var_os(CHILD_SOCKET).map(PathBuf::from) else { return };
    let attached = client::command(&socket, "child").unwrap();
    let own = attached.commander.unwrap();
    let driver = attached.driver;
    let mut found = Frame::zeroed();
    for tick in 0..PROCESS_ROUNDS {
        sleep_until(tick, || driver.latest_tick(), |seen, t| driver.sleep_for_frame(seen, &own, t));
        driver.read_frame(tick, &mut found).unwrap();
        assert!(is_frame(&found, tick));
        own.publish(&command(tick), &driver);
    }
}
