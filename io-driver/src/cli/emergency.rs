//! `io-driver emergency-stop`.
//!
//! Model: asked in every way there is, at every place where a driver may be, then believed only when seen. The stop goes
//! by datagram first, which never waits and needs no thread, then over a connection. It is done when a new frame shows
//! the fault and no force in any device; in lockstep, where the loop may wait for its commander and tell no new frame,
//! when the driver has heard it and the frame that stands shows that. Who finds no place to look from asks again: the answer
//! to an emergency stop tells what the newest frame shows. Where only others' stops found a place in the queue of datagrams, it
//! is not done before the driver has heard this one over the connection, too: else the others alone could undo it.
//! Invariants: no exit status of 0 without that sight from every driver that was asked. Asking comes before any word.
//! Asking over a connection and looking have threads of their own: neither a driver that does not answer nor one without
//! a free place delays the words that motors may still be on.

use super::EXIT_FAULT;
use super::listeners::Listeners;
use super::places::{NotAsked, Places, is_silent, nobody_asked, tell_of_unheard};
use super::prompt::{PROMPT, PromptWords};
use crate::print::print_outcome;
use crate::say::say;
use shm_abi::client::{self, AttachError};
use shm_abi::segment::ClockMode;
use shm_abi::stop_socket::{self, Sent};
use shm_abi::{DriverView, Frame};
use std::path::Path;
use std::process::ExitCode;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// Time for which we look on after the words that nothing is certain.
const PATIENCE: Duration = Duration::from_secs(5);
/// So long a frame stands of a loop in lockstep that waits for its commander.
const STANDS: Duration = Duration::from_millis(50);
/// Between two looks at the frames.
const LOOK: Duration = Duration::from_micros(500);
/// Between two tries to find a place among those who look on.
const RETRY: Duration = Duration::from_millis(10);
const NAME: &str = "io-driver";

/// A frame that shows that the motors are off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sight {
    /// That of this tick, told since.
    New(u64),
    /// That of this tick, which stands: in lockstep the loop waits for its commander.
    Stands(u64),
}

/// Outcome of a stop at one place.
#[derive(Debug)]
enum News {
    Shown(Sight),
    /// Nobody could be asked, in either way.
    NotAsked(AttachError),
}

/// When a driver answered that it has heard the stop.
type Heard = Arc<OnceLock<Instant>>;

/// Stops the motors, and says whether that was seen.
pub(super) fn emergency_stop(places: &Places) -> ExitCode {
    let begun = Instant::now();
    let sent: Vec<_> = places.sockets.iter().map(|socket| stop_socket::send(socket).ok()).collect();
    let (tell, news) = channel();
    let started = places.sockets.iter().zip(&sent).enumerate().try_for_each(|(index, (socket, sent))| {
        start_threads(socket, *sent, begun, &Teller { index, tell: tell.clone() })
    });
    drop(tell);
    let told = match started {
        Ok(()) => gather(&news, places.sockets.len(), begun),
        Err(_) => ask_and_look(places, &sent, begun),
    };
    judge(places, told)
}

/// Passes on what becomes of the stop at one place.
#[derive(Debug, Clone)]
struct Teller {
    index: usize,
    tell: Sender<(usize, News)>,
}

impl Teller {
    fn tell(&self, news: News) {
        let _ = self.tell.send((self.index, news));
    }
}

/// They end with the process, whatever they wait for.
fn start_threads(socket: &Path, sent: Option<Sent>, begun: Instant, teller: &Teller) -> std::io::Result<()> {
    let heard = Heard::default();
    let (place, ear, asker) = (socket.to_path_buf(), Arc::clone(&heard), teller.clone());
    std::thread::Builder::new().spawn(move || {
        if let Err(error) = ask(&place, sent, &ear) {
            asker.tell(News::NotAsked(error));
        }
    })?;
    let (place, teller) = (socket.to_path_buf(), teller.clone());
    let looks = move || {
        if let Some(sight) = wait_for_zero(&place, sent, &heard, begun + PATIENCE) {
            teller.tell(News::Shown(sight));
        }
    };
    std::thread::Builder::new().spawn(looks).map(drop)
}

/// Over a connection; an error if nobody can have heard it by datagram either.
fn ask(socket: &Path, sent: Option<Sent>, heard: &Heard) -> Result<(), AttachError> {
    match client::emergency_stop_over_connection(socket, NAME) {
        Ok(_) => {
            let _ = heard.set(Instant::now());
            Ok(())
        }
        Err(_) if sent.is_some() => Ok(()),
        Err(error) => Err(error),
    }
}

/// Outcome at each place; `None`: it was asked, and nothing has shown it.
type Told = Vec<Option<News>>;

fn gather(news: &Receiver<(usize, News)>, places: usize, begun: Instant) -> Told {
    let mut told: Told = (0..places).map(|_| None).collect();
    let mut is_warned = false;
    while told.iter().any(Option::is_none) {
        let patience = if is_warned { PATIENCE } else { PROMPT };
        match news.recv_timeout(patience.saturating_sub(begun.elapsed())) {
            Ok((index, news)) => told[index] = Some(news),
            Err(_) if !is_warned => {
                is_warned = true;
                say_uncertain();
            }
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => break,
        }
    }
    told
}

/// One after the other, where the system gives no threads: all are asked before anything is said, for nobody may take
/// the words.
fn ask_and_look(places: &Places, sent: &[Option<Sent>], begun: Instant) -> Told {
    let mut told: Vec<(Heard, Option<News>)> = Vec::new();
    for (socket, sent) in places.sockets.iter().zip(sent) {
        let heard = Heard::default();
        let refused = ask(socket, *sent, &heard).err();
        told.push((heard, refused.map(News::NotAsked)));
    }
    let look = |told: &mut Vec<(Heard, Option<News>)>, until: Instant| {
        for ((socket, sent), (heard, news)) in places.sockets.iter().zip(sent).zip(told) {
            if news.is_none() {
                *news = wait_for_zero(socket, *sent, heard, until).map(News::Shown);
            }
        }
    };
    look(&mut told, begun + PROMPT);
    if told.iter().any(|(_, news)| news.is_none()) {
        say_uncertain();
        look(&mut told, begun + PATIENCE);
    }
    told.into_iter().map(|(_, news)| news).collect()
}

fn say_uncertain() {
    say(format_args!(
        "io-driver: the emergency stop is not confirmed within {PromptWords}: the motors may still be on; cut their \
         power"
    ));
}

fn judge(places: &Places, told: Told) -> ExitCode {
    let (mut shown, mut not_asked, mut unseen) = (Vec::new(), Vec::<NotAsked>::new(), Vec::new());
    for (socket, news) in places.sockets.iter().cloned().zip(told) {
        match news {
            Some(News::Shown(sight)) => shown.push((socket, sight)),
            Some(News::NotAsked(error)) => not_asked.push((socket, error)),
            None => unseen.push(socket),
        }
    }
    shown.iter().for_each(|(socket, sight)| print_shown(*sight, &places.told(socket)));
    for socket in &unseen {
        let place = places.told(socket);
        say(format_args!("io-driver: the stop was asked for, and no frame has shown it{place}"));
    }
    if shown.is_empty() && unseen.is_empty() {
        return nobody_asked(places, &not_asked);
    }
    // Whoever could not be looked for may go on.
    let is_one_unheard = !not_asked.is_empty() && {
        let listeners = Listeners::find();
        tell_of_unheard(&not_asked, &listeners) || listeners.is_cut_short()
    };
    let silent: Vec<_> = not_asked.iter().filter(|(_, error)| is_silent(error)).collect();
    for (socket, error) in &silent {
        let place = places.told(socket);
        say(format_args!("io-driver: {error}; the motors may still be on; cut their power{place}"));
    }
    if is_one_unheard || !unseen.is_empty() || !silent.is_empty() {
        return ExitCode::from(EXIT_FAULT);
    }
    ExitCode::SUCCESS
}

fn print_shown(sight: Sight, place: &str) {
    let (tick, stands) = match sight {
        Sight::New(tick) => (tick, ""),
        Sight::Stands(tick) => {
            (tick, ", and none has come after it: in lockstep the loop waits for its commander")
        }
    };
    print_outcome(&format!("emergency stop: tick {tick} shows the fault and no force{stands}{place}"));
}

/// The frame that shows that the motors are off; `None`: the driver is gone, or no frame shows that in time.
fn wait_for_zero(socket: &Path, sent: Option<Sent>, heard: &Heard, until: Instant) -> Option<Sight> {
    let mut first_told = None;
    let attachment = loop {
        match client::observe(socket, NAME) {
            Ok(attachment) => break attachment,
            Err(AttachError::NoDriver { .. } | AttachError::DriverGone { .. }) => return None,
            Err(_) if Instant::now() > until => return None,
            Err(_) => match ask_what_it_shows(socket, &mut first_told) {
                Some(tick) => return Some(Sight::New(tick)),
                None => std::thread::sleep(RETRY),
            },
        }
    };
    let driver = &attachment.driver;
    // What stands there already may be old, and the loop dead.
    let stale = driver.latest_tick();
    let is_own = || sent == Some(Sent::Queued) || heard.get().is_some();
    loop {
        match driver.read_latest().filter(Frame::shows_emergency_stop) {
            Some(frame) if Some(frame.tick) > stale && is_own() => return Some(Sight::New(frame.tick)),
            Some(frame) if may_stand(driver, heard) => return Some(Sight::Stands(frame.tick)),
            _ if !attachment.connection.is_open() || Instant::now() > until => return None,
            _ => std::thread::sleep(LOOK),
        }
    }
}

/// Stops the motors once more, for the sake of the answer. Tick of the frame that shows that they are off, if it is later
/// than that of the first answer.
fn ask_what_it_shows(socket: &Path, first_told: &mut Option<u64>) -> Option<u64> {
    let (tick, is_stopped) = client::emergency_stop_over_connection(socket, NAME).ok()?.latest()?;
    let first = *first_told.get_or_insert(tick);
    (is_stopped && tick > first).then_some(tick)
}

/// An earlier frame may tell how things stand: in lockstep no motor is written between one frame and the next
/// but with the reply to it, and what was heard is collected meanwhile. There is no card that runs in lockstep.
fn may_stand(driver: &DriverView, heard: &Heard) -> bool {
    driver.info().clock_mode == ClockMode::Lockstep
        && heard.get().is_some_and(|heard| heard.elapsed() > STANDS)
}

#[cfg(test)]
mod tests {
    use super::super::told::memory;
    use super::*;
    use bytemuck::Zeroable;
    use patience::BoundedThread;
    use shm_abi::server::Server;
    use shm_abi::{DriverState, FaultReason};
    use std::sync::atomic::{AtomicBool, Ordering};

    /// Somebody else's stop, which is all that a frame shows, can be undone by him alone.
    #[test]
    fn a_stop_for_which_the_queue_had_no_room_is_done_once_the_driver_has_heard_it() {
        let directory = tempfile::tempdir().expect("a directory");
        let socket = directory.path().join("driver.sock");
        let mut server = Server::bind(&socket).expect("nobody else");
        let is_over = AtomicBool::new(false);
        let (fault, why) = (DriverState::Fault as u64, FaultReason::EmergencyStop as u64);
        std::thread::scope(|scope| {
            let serving = scope.spawn(|| {
                let memory = memory();
                for tick in 1.. {
                    if is_over.load(Ordering::Relaxed) {
                        break;
                    }
                    memory.write_frame(&Frame { tick, state: fault, fault: why, ..Frame::zeroed() });
                    memory.ring(tick, None);
                    server.poll(&memory, Duration::from_millis(1), &mut Vec::new()).expect("it waits");
                }
            });
            let heard = Heard::default();
            let look = |sent| {
                let until = Instant::now() + Duration::from_millis(200);
                wait_for_zero(&socket, sent, &heard, until)
            };
            let seen = [Some(Sent::Queued), Some(Sent::QueueFull), None].map(look);
            assert!(matches!(seen, [Some(Sight::New(_)), None, None]), "{seen:?}");
            heard.set(Instant::now()).expect("once");
            let seen = [Some(Sent::QueueFull), None].map(look);
            assert!(matches!(seen, [Some(Sight::New(_)), Some(Sight::New(_))]), "{seen:?}");
            is_over.store(true, Ordering::Relaxed);
            serving.bounded_join().expect("no panic");
        });
    }
}
