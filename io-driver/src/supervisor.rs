//! Tells systemd how the driver is, if systemd started it.
//!
//! Problem: a loop that hangs leaves its process alive, and who watches only processes sees nothing wrong.
//! Model (sd_notify(3)): `READY=1` once the driver listens, `STATUS=` now and then, `STOPPING=1` at the end, and
//! `WATCHDOG=1` only while the loop's tick counter advances. Without `NOTIFY_SOCKET` nothing happens at all.
//! Invariant: only the socket's thread speaks, never the loop.
//! Cost: some datagrams a second.

use crate::say::say;
use sd_notify::NotifyState;
use shm_abi::segment::ClockMode;
use std::io;
use std::time::{Duration, Instant};

/// How often `systemctl status` learns something new.
const STATUS_INTERVAL: Duration = Duration::from_secs(1);
/// So many signs of life fall into the time after which systemd loses patience: a service thread that is held
/// up for half of it is still alive.
const PETS_PER_TIMEOUT: u32 = 4;

/// The service manager that started this process, if one did.
#[derive(Debug)]
pub struct Supervisor {
    /// `None`: nobody listens.
    schedule: Option<Schedule>,
}

impl Supervisor {
    /// Whoever the environment names. A child that an application started is not the service, whatever
    /// environment it inherited.
    pub fn from_environment(clock: ClockMode, is_child: bool) -> Self {
        let listens = std::env::var_os("NOTIFY_SOCKET").is_some_and(|socket| !socket.is_empty());
        let schedule = (listens && !is_child)
            .then(|| Schedule::new(sd_notify::watchdog_enabled(), clock, Instant::now()));
        Self { schedule }
    }

    /// The driver listens and its loop runs.
    pub fn ready(&self, status: &str) {
        // Whoever waits for this in vain ends the driver, and then it should stand in the journal why.
        if let Err(error) = self.tell(&[NotifyState::Ready, NotifyState::Status(status)]) {
            say(format_args!("io-driver: cannot tell the service manager that the driver is ready: {error}"));
        }
    }

    /// To be called often, with the loop's newest tick; says what is due.
    pub fn turn(&mut self, tick: u64, status: impl FnOnce() -> String) {
        let Some(schedule) = &mut self.schedule else { return };
        let due = schedule.due(tick, Instant::now());
        // A datagram that is lost is followed by the next one.
        if due.pet {
            let _ = self.tell(&[NotifyState::Watchdog]);
        }
        if due.status {
            let _ = self.tell(&[NotifyState::Status(&status())]);
        }
    }

    /// The driver ends, for this reason.
    pub fn stopping(&self, reason: &str) {
        let _ = self.tell(&[NotifyState::Stopping, NotifyState::Status(reason)]);
    }

    fn tell(&self, states: &[NotifyState<'_>]) -> io::Result<()> {
        if self.schedule.is_some() { sd_notify::notify(states) } else { Ok(()) }
    }
}

/// What is to be said now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Due {
    pet: bool,
    status: bool,
}

/// When to say what; pure.
#[derive(Debug)]
struct Schedule {
    /// Between two signs of life; `None`: nobody waits for them.
    pet_interval: Option<Duration>,
    /// In lockstep a tick lasts as long as the application likes, so its standing still means nothing.
    ticks_by_itself: bool,
    petted_at: Instant,
    petted_in_tick: u64,
    status_at: Instant,
}

impl Schedule {
    fn new(watchdog: Option<Duration>, clock: ClockMode, now: Instant) -> Self {
        Self {
            pet_interval: watchdog.map(|timeout| timeout / PETS_PER_TIMEOUT),
            ticks_by_itself: clock == ClockMode::Real,
            petted_at: now,
            petted_in_tick: 0,
            status_at: now,
        }
    }

    fn due(&mut self, tick: u64, now: Instant) -> Due {
        let status = now.duration_since(self.status_at) >= STATUS_INTERVAL;
        if status {
            self.status_at = now;
        }
        Due { pet: self.pet_is_due(tick, now), status }
    }

    fn pet_is_due(&mut self, tick: u64, now: Instant) -> bool {
        let waited = self.pet_interval.is_some_and(|wait| now.duration_since(self.petted_at) >= wait);
        let lives = !self.ticks_by_itself || tick != self.petted_in_tick;
        if waited && lives {
            (self.petted_at, self.petted_in_tick) = (now, tick);
        }
        waited && lives
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMEOUT: Duration = Duration::from_millis(400);
    const MS: Duration = Duration::from_millis(1);

    /// How many signs of life a driver gives in `ms` if its tick at each millisecond is `tick(ms)`.
    fn pets(clock: ClockMode, watchdog: Option<Duration>, ms: u32, tick: impl Fn(u32) -> u64) -> u32 {
        let begin = Instant::now();
        let mut schedule = Schedule::new(watchdog, clock, begin);
        (1..=ms).map(|at| u32::from(schedule.due(tick(at), begin + MS * at).pet)).sum()
    }

    #[test]
    fn a_loop_that_ticks_gives_four_signs_of_life_in_each_timeout() {
        assert_eq!(pets(ClockMode::Real, Some(TIMEOUT), 2000, u64::from), 20);
    }

    #[test]
    fn a_loop_that_hangs_gives_no_sign_of_life_though_its_process_lives() {
        let hangs_at = |tick: u32| move |ms: u32| u64::from(ms.min(tick));
        assert_eq!(pets(ClockMode::Real, Some(TIMEOUT), 2000, |_| 0), 0, "it never began");
        // Signs at 100 ... 400 ms, one more at 500 for the ticks since 400, then none.
        assert_eq!(pets(ClockMode::Real, Some(TIMEOUT), 2000, hangs_at(450)), 5);
    }

    #[test]
    fn in_lockstep_standing_still_is_no_fault() {
        assert_eq!(pets(ClockMode::Lockstep, Some(TIMEOUT), 2000, |_| 7), 20);
    }

    #[test]
    fn without_a_watchdog_there_are_no_signs_of_life_but_a_status() {
        assert_eq!(pets(ClockMode::Real, None, 2000, u64::from), 0);
        let begin = Instant::now();
        let mut schedule = Schedule::new(None, ClockMode::Real, begin);
        let told: u32 = (1..=2500).map(|at| u32::from(schedule.due(0, begin + MS * at).status)).sum();
        assert_eq!(told, 2, "one each second");
    }
}
