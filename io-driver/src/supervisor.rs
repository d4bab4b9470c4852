//! Tells systemd how the driver is, if systemd started it.
//!
//! Problem: a loop that hangs leaves its process alive, and who watches only processes sees nothing wrong.
//! Model (sd_notify(3)): `READY=1` once the driver listens, `STATUS=` now and then, `STOPPING=1` at the end, and
//! `WATCHDOG=1` only while the loop's tick counter advances. Without `NOTIFY_SOCKET` nothing happens at all.
//! Invariants: only the socket's thread speaks, never the loop; it makes its one socket at the start, because a
//! driver that has given up its rights can make none; it never waits for systemd.
//! Cost: some datagrams a second.

use crate::say::say;
use rustix::net::{SendAncillaryBuffer, SendFlags, sendmsg};
use shm_abi::segment::ClockMode;
use std::ffi::{OsStr, OsString};
use std::io::{self, IoSlice};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::{Duration, Instant};

/// How often `systemctl status` learns something new.
const STATUS_INTERVAL: Duration = Duration::from_secs(1);
/// So many signs of life fall into the time after which systemd loses patience: a service thread that is held
/// up for half of it is still alive.
const PETS_PER_TIMEOUT: u32 = 4;

/// The service manager that started this process, if one did.
#[derive(Debug)]
pub struct Supervisor {
    listener: Option<Listener>,
}

#[derive(Debug)]
struct Listener {
    socket: UnixDatagram,
    schedule: Schedule,
}

impl Supervisor {
    /// Whoever the environment names. A child that an application started is not the service, whatever
    /// environment it inherited.
    pub fn from_environment(clock: ClockMode, is_child: bool) -> Self {
        let name = std::env::var_os("NOTIFY_SOCKET").filter(|name| !name.is_empty() && !is_child);
        let listener = name.and_then(|name| match connect(&name) {
            Ok(socket) => {
                Some(Listener { socket, schedule: Schedule::new(watchdog(), clock, Instant::now()) })
            }
            Err(error) => {
                // It waits for a word in vain and will end the driver; the journal should tell why.
                say(format_args!(
                    "io-driver: cannot reach the service manager at {}: {error}",
                    name.display()
                ));
                None
            }
        });
        Self { listener }
    }

    /// The driver listens and its loop runs.
    pub fn ready(&self, status: &str) {
        self.tell(&format!("READY=1\nSTATUS={status}"));
    }

    /// To be called often, with the loop's newest tick; says what is due.
    pub fn turn(&mut self, tick: u64, status: impl FnOnce() -> String) {
        let Some(listener) = &mut self.listener else { return };
        let due = listener.schedule.due(tick, Instant::now());
        if due.pet {
            self.tell("WATCHDOG=1");
        }
        if due.status {
            self.tell(&format!("STATUS={}", status()));
        }
    }

    /// The driver ends, for this reason.
    pub fn stopping(&self, reason: &str) {
        self.tell(&format!("STOPPING=1\nSTATUS={reason}"));
    }

    /// A datagram that is lost is followed by the next one.
    fn tell(&self, words: &str) {
        if let Some(listener) = &self.listener {
            let bytes = [IoSlice::new(words.as_bytes())];
            let flags = SendFlags::NOSIGNAL | SendFlags::DONTWAIT;
            let _ = sendmsg(&listener.socket, &bytes, &mut SendAncillaryBuffer::default(), flags);
        }
    }
}

/// A name that begins with `@` lies in no directory.
fn connect(name: &OsStr) -> io::Result<UnixDatagram> {
    let address = match name.as_bytes().strip_prefix(b"@") {
        Some(name) => SocketAddr::from_abstract_name(name)?,
        None => SocketAddr::from_pathname(name)?,
    };
    let socket = UnixDatagram::unbound()?;
    socket.connect_addr(&address)?;
    Ok(socket)
}

/// After how long without a sign of life systemd loses patience with this process; `None`: never.
fn watchdog() -> Option<Duration> {
    watchdog_from(std::env::var_os("WATCHDOG_USEC"), std::env::var_os("WATCHDOG_PID"), std::process::id())
}

fn watchdog_from(timeout_us: Option<OsString>, pid: Option<OsString>, own_pid: u32) -> Option<Duration> {
    let number = |text: OsString| text.to_str()?.parse::<u64>().ok();
    // Somebody else's, inherited.
    if pid.is_some_and(|pid| number(pid) != Some(own_pid.into())) {
        return None;
    }
    timeout_us.and_then(number).filter(|us| *us > 0).map(Duration::from_micros)
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

    #[test]
    fn the_watchdog_counts_if_it_is_this_processes_own() {
        let timeout = |us: &str, pid: Option<&str>| watchdog_from(Some(us.into()), pid.map(Into::into), 42);
        assert_eq!(timeout("2000000", Some("42")), Some(Duration::from_secs(2)));
        assert_eq!(timeout("2000000", None), Some(Duration::from_secs(2)));
        assert_eq!(timeout("2000000", Some("43")), None, "inherited");
        for nonsense in ["", "0", "-1", "soon"] {
            assert_eq!(timeout(nonsense, Some("42")), None, "{nonsense}");
        }
        assert_eq!(watchdog_from(None, None, 42), None);
    }
}
