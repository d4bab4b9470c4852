//! One run of the campaign: a plan's strikes against a stand, each followed by healing or by the next one.
//!
//! What holds after each kind of death is checked by [`Ward`]; what holds in every run by the amplifiers. Here
//! is what a single strike must not do as long as nothing else goes wrong at the same time.

use crate::faults::amplifiers::wait_for;
use crate::faults::commander::{Commander, answer};
use crate::faults::heal::{Account, Ward, another_phantom3};
use crate::faults::knock;
use crate::faults::madman::rave;
use crate::faults::plan::{FIRST_BUTTON, Plan, SABOTAGES, Strike, Then};
use crate::faults::process::{Running, myself};
use crate::faults::random::Random;
use crate::faults::ring::RingLog;
use crate::faults::stand::{CODE_N, Setup};
use rustix::process::{Pid, Resource, Rlimit, Signal, prlimit};
use shm_abi::client::{self, AttachError};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Name of the test that plays [`super::hog`] when it is started as a process of its own.
pub const HOG_TEST: &str = "campaign::the_hog";

/// How long a stop lasts that comes at a start or at an end (ms).
const STOP_MS: u64 = 40;

/// Plays a plan to its end.
pub fn run(plan: &Plan) -> Account {
    let mut setup = Setup::new("real").sabotaged(&plan.sabotage());
    // A stall of the machine that trips it is one strike more.
    setup.limits.watchdog_ms = 150;
    setup.limits.peak_n = plan.peak_n;
    setup.limits.slew_n_per_s = plan.slew_n_per_s;
    let mut run = Run { ward: Ward::open(setup), random: Random::new(!plan.seed), undisturbed: true };
    for (delay_us, strike, then) in &plan.strikes {
        std::thread::sleep(Duration::from_micros(*delay_us));
        run.strike(*strike, *then);
        match then {
            Then::Heal => run.ward.heal(),
            Then::Next(us) => std::thread::sleep(Duration::from_micros(*us)),
        }
        run.undisturbed = *then == Then::Heal;
    }
    run.ward.heal();
    run.ward.close()
}

struct Run {
    ward: Ward,
    random: Random,
    /// The whole force was there when the strike came, and nothing else goes wrong.
    undisturbed: bool,
}

/// One more than the highest descriptor of a process that lives.
fn descriptors_of(process: u32) -> Option<u64> {
    let entries = std::fs::read_dir(format!("/proc/{process}/fd")).ok()?.flatten();
    let highest: u64 = entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).max()?;
    Some(highest + 1)
}

fn sleep_us(us: u64) {
    std::thread::sleep(Duration::from_micros(us));
}

impl Run {
    fn strike(&mut self, strike: Strike, then: Then) {
        let stays = then != Then::Heal;
        match strike {
            Strike::KillApp => self.kill_app(stays),
            Strike::KillAppStarting(us) => {
                self.signal_app(Signal::KILL);
                self.ward.app.end();
                self.ward.app = self.ward.stand.start_app();
                sleep_us(us);
                self.kill_app(stays);
            }
            Strike::KillAppEnding(us) => {
                self.signal_app(Signal::TERM);
                sleep_us(us);
                self.kill_app(stays);
            }
            Strike::StopApp(ms) => self.stop_app(ms, stays),
            Strike::StopAppStarting(us) => {
                self.signal_app(Signal::KILL);
                self.ward.app.end();
                self.ward.app = self.ward.stand.start_app();
                sleep_us(us);
                self.stop_app(STOP_MS, stays);
            }
            Strike::StopAppEnding(us) => {
                self.signal_app(Signal::TERM);
                sleep_us(us);
                self.stop_app(STOP_MS, stays);
            }
            Strike::UpgradeApp => self.upgrade_app(),
            Strike::SecondApp => self.second_app(),
            Strike::ForeignApp => knock::all_foreigners(&self.ward.stand.socket(), self.undisturbed),
            Strike::Crowd => self.crowd(),
            Strike::Madman(ms) => self.madman(ms),
            Strike::FormerHolder => self.former_holder(),
            Strike::SecondDriver => self.second_driver(),
            Strike::NoDescriptors => self.no_descriptors(),
            Strike::EmergencyStop => self.emergency_stop(),
            Strike::Hog(ms) => self.hog(ms),
            Strike::StopEmulator(ms) => self.stop_emulator(ms, stays),
            Strike::KillEmulator => self.kill_emulator(),
            Strike::Sabotage(button) => self.sabotage(button),
            Strike::StopDriver(ms) => self.stop_driver(ms, stays),
            of_driver => self.end_driver(of_driver, stays),
        }
    }

    fn end_driver(&mut self, strike: Strike, stays: bool) {
        self.ward.may_die = true;
        match strike {
            Strike::KillDriverStarting(us) => {
                self.signal_driver(Signal::KILL);
                self.ward.replace_driver();
                sleep_us(us);
                self.signal_driver(Signal::KILL);
            }
            Strike::KillDriverEnding(us) => {
                self.signal_driver(Signal::TERM);
                sleep_us(us);
                self.signal_driver(Signal::KILL);
            }
            Strike::StopDriverStarting(us) => {
                self.signal_driver(Signal::KILL);
                self.ward.replace_driver();
                sleep_us(us);
                return self.pause_driver(stays);
            }
            Strike::StopDriverEnding(us) => {
                self.signal_driver(Signal::TERM);
                sleep_us(us);
                self.pause_driver(stays);
            }
            Strike::EndDriver => self.signal_driver(Signal::TERM),
            Strike::EndDriverTwice(us) => {
                self.signal_driver(Signal::TERM);
                sleep_us(us);
                self.signal_driver(Signal::TERM);
            }
            Strike::Signal(number) => {
                self.signal_driver(Signal::from_named_raw(number).expect("a signal of the plan"));
            }
            _ => self.signal_driver(Signal::KILL),
        }
        if !stays {
            // A stopped one does not hear until it goes on.
            self.ward.stand.driver.go_on();
            self.ward.bury_driver();
        }
    }

    fn pause_driver(&mut self, stays: bool) {
        self.signal_driver(Signal::STOP);
        if !stays {
            sleep_us(STOP_MS * 1000);
            self.signal_driver(Signal::CONT);
        }
    }

    fn signal_app(&mut self, signal: Signal) {
        if !self.ward.app.has_ended() {
            self.ward.app.signal(signal);
        }
    }

    fn kill_app(&mut self, stays: bool) {
        self.signal_app(Signal::KILL);
        if !stays {
            self.ward.app.end();
        }
    }

    fn signal_driver(&mut self, signal: Signal) {
        if !self.ward.stand.driver.has_ended() {
            self.ward.stand.driver.signal(signal);
        }
    }

    fn stop_app(&mut self, ms: u64, stays: bool) {
        self.signal_app(Signal::STOP);
        if !stays {
            sleep_us(ms * 1000);
            self.signal_app(Signal::CONT);
        }
    }

    /// The watchdog of the amplifiers may trip meanwhile; the loop that goes on finds out.
    fn stop_driver(&mut self, ms: u64, stays: bool) {
        let before = self.ward.stand.amplifiers.tally();
        self.signal_driver(Signal::STOP);
        if stays {
            return;
        }
        sleep_us(ms * 1000);
        let watchdog_ms = self.ward.stand.setup.limits.watchdog_ms;
        // The emulator looks every half millisecond, if the machine lets it: much later it has tripped.
        if self.undisturbed && ms > watchdog_ms + 100 && self.ward.stand.amplifiers.are_enabled() {
            self.ward.stand.amplifiers.wait_for_trip(before);
        }
        self.signal_driver(Signal::CONT);
    }

    /// The driver stays, the lease moves, and no counter is zeroed.
    fn upgrade_app(&mut self) {
        let driver = self.ward.stand.driver.id();
        let version = self.random.below(2);
        self.signal_app(if version == 0 { Signal::TERM } else { Signal::KILL });
        self.ward.app.go_on();
        self.ward.app.end();
        self.ward.app = Running::start(&mut another_phantom3(&self.ward.stand, version));
        if self.undisturbed {
            self.ward.heal();
            assert_eq!(self.ward.stand.driver.id(), driver, "the driver stays");
        }
    }

    fn second_app(&mut self) {
        let mut second = self.ward.stand.start_app();
        if self.undisturbed {
            let end = second.end();
            // The machine may have let a first one's end be seen late; else it holds the lease.
            assert_eq!(end.status, Some(2), "{end:?}");
            assert!(end.err.contains("the devices are commanded by process"), "{end:?}");
        }
    }

    fn crowd(&mut self) {
        let crowd = knock::crowd(&self.ward.stand.socket(), 70);
        if self.undisturbed {
            self.frames_go_on(50);
        }
        drop(crowd);
    }

    /// Whatever holds the lease is replaced by a commander of our own.
    fn take_lease(&mut self) -> Option<client::Attachment> {
        self.signal_app(Signal::KILL);
        self.ward.app.end();
        let begun = Instant::now();
        loop {
            match client::command(&self.ward.stand.socket(), "campaign") {
                Ok(attachment) => return Some(attachment),
                Err(AttachError::LeaseHeld { .. }) if begun.elapsed() < Duration::from_secs(10) => {
                    sleep_us(500);
                }
                Err(error) => {
                    assert!(!self.undisturbed, "{error}");
                    return None;
                }
            }
        }
    }

    fn madman(&mut self, ms: u64) {
        let Some(attachment) = self.take_lease() else { return };
        let (driver, commander) = (&attachment.driver, attachment.commander.as_ref().expect("the lease"));
        let until = Instant::now() + Duration::from_millis(ms);
        let mut turns = 0u64;
        while Instant::now() < until {
            let tick = driver.latest_tick().unwrap_or(0);
            rave(&mut self.random, commander, driver, tick, commander.lease(), 1);
            turns += 1;
            // Sometimes as fast as it can, sometimes with pauses in which others get to run.
            if turns.is_multiple_of(64) {
                sleep_us(100);
            }
        }
    }

    /// It pushes to the side; its successor does not.
    fn former_holder(&mut self) {
        let Some(attachment) = self.take_lease() else { return };
        let commander = Commander::start(attachment, [2.0, 0.0, 0.0]);
        sleep_us(5000);
        let former = commander.retire();
        let Some(observer) = self.ward.stand.try_to_observe() else { return };
        let stop = AtomicBool::new(false);
        let undisturbed = self.undisturbed;
        let ward = &mut self.ward;
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let mut lease = former.lease();
                while !stop.load(Ordering::Relaxed) {
                    answer(&observer.driver, &former, lease, [2.0, 0.0, 0.0]);
                    lease = former.lease() + (lease + 1) % 3;
                    sleep_us(50);
                }
            });
            let seen = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                if !undisturbed {
                    return sleep_us(5000);
                }
                ward.heal();
                let mut log = RingLog::begin(ward.stand.view());
                log.follow_for(ward.stand.view(), 100);
                for told in &log.told {
                    assert!(told.first_applied_n[0].abs() < CODE_N, "the former holder pushes: {told:?}");
                }
            }));
            stop.store(true, Ordering::Relaxed);
            seen.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        });
    }

    fn second_driver(&mut self) {
        let mut second = Running::start(&mut self.ward.stand.driver_command());
        if self.undisturbed {
            let end = second.end();
            assert_eq!(end.status, Some(2), "{end:?}");
            assert!(end.err.contains("belongs to another driver; one card has one driver"), "{end:?}");
            self.frames_go_on(50);
        }
    }

    /// The loop needs none, and the socket answers again once there are some.
    fn no_descriptors(&mut self) {
        let pid = Pid::from_raw(self.ward.stand.driver.id().cast_signed()).expect("a process id");
        let limit = |current| prlimit(Some(pid), Resource::Nofile, Rlimit { current, maximum: Some(1024) });
        // As many as it has: below that even `poll` would refuse, which no limit set beforehand can cause.
        let Some(open) = descriptors_of(self.ward.stand.driver.id()) else { return };
        if limit(Some(open)).is_err() {
            return;
        }
        let crowd = knock::crowd(&self.ward.stand.socket(), 10);
        sleep_us(5000);
        if self.undisturbed {
            self.frames_go_on(50);
        }
        let _ = limit(Some(1024));
        drop(crowd);
    }

    fn emergency_stop(&mut self) {
        let told = client::emergency_stop(&self.ward.stand.socket(), "campaign");
        if self.undisturbed {
            told.expect("it is told");
            let amplifiers = &self.ward.stand.amplifiers;
            wait_for("off", || !amplifiers.are_enabled());
            amplifiers.check_off("emergency stop");
        }
    }

    fn hog(&mut self, ms: u64) {
        let cpu = rt_core::cpu::online_cpus().last().copied().unwrap_or(0);
        let end = Running::start(&mut myself(HOG_TEST, &format!("{cpu} {ms}"))).end();
        assert_eq!(end.status, Some(0), "{end:?}");
    }

    fn stop_emulator(&mut self, ms: u64, stays: bool) {
        let emulator = &mut self.ward.stand.amplifiers.process;
        if self.ward.emulator_is_dead {
            return;
        }
        emulator.signal(Signal::STOP);
        if !stays {
            sleep_us(ms * 1000);
            emulator.signal(Signal::CONT);
        }
    }

    /// The driver finds a card without life, which is a fault, and asks nothing of it any more.
    fn kill_emulator(&mut self) {
        if std::mem::replace(&mut self.ward.emulator_is_dead, true) {
            return;
        }
        self.ward.stand.amplifiers.process.signal(Signal::KILL);
        self.ward.stand.amplifiers.process.end();
        if self.undisturbed {
            let amplifiers = &self.ward.stand.amplifiers;
            wait_for("off", || !amplifiers.are_enabled() && amplifiers.were_told_off());
        }
    }

    fn sabotage(&mut self, button: u32) {
        let faults = || self.ward.stand.view().counters.faults.load(Ordering::Relaxed);
        let before = faults();
        self.ward.stand.amplifiers.press(1 << button);
        self.ward.may_die = true;
        if !self.undisturbed {
            return;
        }
        if SABOTAGES[(button - FIRST_BUTTON) as usize].starts_with("hang") {
            return sleep_us(50_000);
        }
        let view = &self.ward.stand.observer.driver;
        let driver = &mut self.ward.stand.driver;
        wait_for("the sabotage", || {
            driver.has_ended() || view.counters.faults.load(Ordering::Relaxed) > before
        });
    }

    /// The loop goes on.
    fn frames_go_on(&self, frames: usize) {
        let mut log = RingLog::begin(self.ward.stand.view());
        log.follow_for(self.ward.stand.view(), frames);
        log.check_promise(self.ward.stand.view());
    }
}
