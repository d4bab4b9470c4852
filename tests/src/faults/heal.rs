//! A stand to which anything may happen, and how everything is brought back to the whole force.
//!
//! Model: whoever is stopped goes on, whoever is dead is started again, a fault is cleared and a zero given as a
//! person would, until the finger is pressed with the whole force. What the amplifiers did about a dead driver is
//! checked before it gets a successor.

use crate::driver::HANG;
use crate::faults::amplifiers::{Seen, wait_for};
use crate::faults::process::{End, Running};
use crate::faults::ring::RingLog;
use crate::faults::stand::{Setup, Stand, is_whole};
use crate::programs;
use rt_core::epitaph::{self, EpitaphKind};
use rustix::process::Signal;
use shm_abi::{DriverState, client};
use std::time::{Duration, Instant};

/// What happened in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Account {
    /// Values that were written, over all cards.
    pub written: u64,
    /// Values that an emulator judged.
    pub checked: u64,
    /// Values that the test judged once more.
    pub judged_again: u64,
    /// The longest force (uN).
    pub largest_force_un: u64,
    /// Times the amplifiers' watchdog tripped.
    pub trips: u64,
    /// Times registers were cleared by a last act.
    pub last_acts: u64,
    /// Drivers that ended, in whatever way.
    pub deaths: u64,
    /// Faults that were cleared.
    pub cleared: u64,
}

impl Account {
    fn note(&mut self, seen: Seen) {
        self.written += seen.written;
        self.checked += seen.tally.checked;
        self.judged_again += seen.judged_again;
        self.largest_force_un = self.largest_force_un.max(seen.tally.largest_force_un);
        self.trips += seen.tally.watchdog_trips;
        self.last_acts += seen.tally.switched_off;
    }

    /// Adds another run's.
    pub fn add(&mut self, other: Self) {
        self.written += other.written;
        self.checked += other.checked;
        self.judged_again += other.judged_again;
        self.largest_force_un = self.largest_force_un.max(other.largest_force_un);
        self.trips += other.trips;
        self.last_acts += other.last_acts;
        self.deaths += other.deaths;
        self.cleared += other.cleared;
    }

    /// As one line between two processes.
    pub fn to_line(&self) -> String {
        let Self { written, checked, judged_again, largest_force_un, trips, last_acts, deaths, cleared } =
            self;
        format!(
            "{written} {checked} {judged_again} {largest_force_un} {trips} {last_acts} {deaths} {cleared}"
        )
    }

    /// Back from a line.
    pub fn from_line(line: &str) -> Option<Self> {
        let words: Vec<u64> = line.split_whitespace().map_while(|word| word.parse().ok()).collect();
        let [written, checked, judged_again, largest_force_un, trips, last_acts, deaths, cleared] =
            words.try_into().ok()?;
        Some(Self { written, checked, judged_again, largest_force_un, trips, last_acts, deaths, cleared })
    }
}

/// The stand and who plays on it.
#[derive(Debug)]
pub struct Ward {
    /// Card and driver.
    pub stand: Stand,
    /// The application; it may have ended.
    pub app: Running,
    /// What happened so far.
    pub account: Account,
    /// Whether something was done that may end the driver; else its end is a defect.
    pub may_die: bool,
    /// Whether the emulator was killed.
    pub emulator_is_dead: bool,
    driver_was_buried: bool,
}

impl Ward {
    /// At the whole force.
    pub fn open(setup: Setup) -> Self {
        let stand = Stand::start(setup);
        let app = stand.start_app();
        let account = Account::default();
        let mut ward =
            Self { stand, app, account, may_die: false, emulator_is_dead: false, driver_was_buried: false };
        ward.heal();
        ward
    }

    /// Everything back to the whole force; checks what the amplifiers did meanwhile.
    pub fn heal(&mut self) {
        self.stand.amplifiers.press(0);
        for process in [&mut self.stand.driver, &mut self.app, &mut self.stand.amplifiers.process] {
            process.go_on();
        }
        if self.emulator_is_dead {
            self.replace_emulator();
        }
        self.wait_for_force();
        self.may_die = false;
    }

    /// A new driver's process in the place of the former, which ends or has ended. It may not listen yet.
    pub fn replace_driver(&mut self) {
        self.bury_driver();
        self.stand.driver = Running::start(&mut self.stand.driver_command());
        self.driver_was_buried = false;
    }

    /// Waits for the driver's end and checks what it left behind, once.
    pub fn bury_driver(&mut self) {
        if std::mem::replace(&mut self.driver_was_buried, true) {
            return;
        }
        let end = self.stand.driver.end();
        self.account.deaths += 1;
        // The judge must be awake.
        self.stand.amplifiers.process.go_on();
        self.check_what_is_left(&end);
    }

    /// Off by the driver's own doing wherever it could do anything; else by the watchdog.
    fn check_what_is_left(&self, end: &End) {
        let amplifiers = &self.stand.amplifiers;
        // Before there are handlers the first request ends it, and then the registers are what the former left.
        let had_handlers = self.stand.observer.driver_pid == u64::from(self.stand.driver.id());
        let could_act =
            end.signal.is_none_or(|signal| signal != 9 && (had_handlers || ![1, 15].contains(&signal)));
        if could_act {
            amplifiers.check_off(&format!("{:?} {:?}", end.status, end.signal));
        }
        assert!(matches!(end.status, None | Some(0 | 3)), "{end:?}");
        if end.status == Some(3) && had_handlers {
            let words = epitaph::read(&self.stand.view().epitaph).expect("an epitaph");
            assert_eq!(words.kind, EpitaphKind::Panic, "{words}");
        }
        if amplifiers.are_enabled() && !self.emulator_is_dead {
            wait_for("the watchdog of a dead driver", || amplifiers.have_tripped());
        }
    }

    /// The driver goes too: it holds the old card.
    fn replace_emulator(&mut self) {
        if !self.driver_was_buried {
            self.may_die = true;
            if !self.stand.driver.has_ended() {
                // Not SIGTERM, which may have come before and would be taken for "now".
                self.stand.driver.signal(Signal::HUP);
            }
            self.bury_driver();
        }
        let seen = self.stand.restart_amplifiers();
        self.account.note(seen);
        self.emulator_is_dead = false;
    }

    /// Starts what has ended and clears what can be cleared until the whole force is there.
    fn wait_for_force(&mut self) {
        let begun = Instant::now();
        let mut log = RingLog::begin(self.stand.view());
        // Of commands since then: the dead are obeyed for some ticks more.
        let mut since = self.stand.view().latest_tick().unwrap_or(0);
        while log.told.iter().filter(|told| is_whole(told) && told.command_tick > since).count() < ENOUGH {
            assert!(
                begun.elapsed() < HANG,
                "no force; last {:?}, {:?}",
                log.told.last(),
                self.stand.amplifiers
            );
            std::thread::sleep(Duration::from_micros(500));
            if self.stand.driver.has_ended() {
                self.replace_dead_driver();
            }
            if self.stand.observer.driver_pid != u64::from(self.stand.driver.id()) {
                let Some(observer) = self.stand.try_to_observe() else { continue };
                self.stand.observer = observer;
                log = RingLog::begin(self.stand.view());
                since = 0;
            }
            if self.app.has_ended() {
                self.app = self.stand.start_app();
            }
            log.catch_up(self.stand.view());
            if log.told.last().is_some_and(|told| told.state == DriverState::Fault) {
                // It is not heard by one that is about to end.
                let _ = client::clear_fault(&self.stand.socket(), "test");
                self.account.cleared += 1;
                std::thread::sleep(Duration::from_millis(5));
            }
            if log.told.last().is_some_and(|told| told.state == DriverState::Zeroing) {
                // A position that jumped cost the zero. The arm rests at home; refused until it has rested long enough.
                let _ = client::zero(&self.stand.socket(), "test", 0);
                std::thread::sleep(Duration::from_millis(20));
            }
        }
        log.check_promise(self.stand.view());
    }

    fn replace_dead_driver(&mut self) {
        assert!(self.may_die, "the driver ended by itself: {:?}", self.stand.driver.end());
        self.replace_driver();
    }

    /// Ends everything in order; every value that was ever written must have been good.
    pub fn close(self) -> Account {
        let Self { stand, app, mut account, .. } = self;
        drop(app);
        account.note(stand.finish());
        account
    }
}

/// Frames of the whole force after which it is there.
const ENOUGH: usize = 5;

/// A copy of `phantom3` under another name, as an upgrade would put it there.
pub fn another_phantom3(stand: &Stand, version: u64) -> std::process::Command {
    let copy = stand.path(&format!("phantom3-{version}"));
    if !copy.exists() {
        std::fs::copy(programs::phantom3_file(), &copy).expect("a copy");
    }
    stand.prepare_app(programs::copied(&copy))
}
