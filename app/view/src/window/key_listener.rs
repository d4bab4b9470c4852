//! Hears the window's keys as they come, and when.
//!
//! Model: a thread with a connection of its own to the X server, which tells it of the same keys as the window; it sleeps
//! until one comes, and draws nothing. An event has the server's time, which is that of the keyboard; what differs between
//! that clock and ours is asked for when the window opens, and with each event again.
//! A window of Wayland's has nobody to ask: its keys have the time at which the window heard of them.

use crate::input::{KeyHeard, KeyTimes, ServerClock, without_pad};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;
use winit::raw_window_handle::{HasWindowHandle, RawWindowHandle};
use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xkb::{self, ConnectionExt as _};
use x11rb::protocol::xproto::{
    AtomEnum, ChangeWindowAttributesAux, ConnectionExt as _, CreateWindowAux, EventMask, PropMode, Window,
    WindowClass,
};
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

/// A key that the window tells of was heard by then, or never is.
const PATIENCE: Duration = Duration::from_millis(10);
/// So often the server is asked what time it is.
const QUESTIONS: u32 = 8;

/// What was heard of a window's keys.
#[derive(Debug)]
pub(super) struct KeyListener {
    /// `None`: nobody listens.
    heard: Option<Receiver<KeyHeard>>,
    times: KeyTimes,
}

impl KeyListener {
    /// Listens to a window, if it is the X server's.
    pub(super) fn start(window: &impl HasWindowHandle) -> Self {
        let id = window.window_handle().ok().and_then(|handle| match handle.as_raw() {
            RawWindowHandle::Xlib(handle) => u32::try_from(handle.window).ok(),
            RawWindowHandle::Xcb(handle) => Some(handle.window.get()),
            _ => None,
        });
        let (send, heard) = channel();
        // A server that tells us nothing leaves keys their window's time.
        let ears = id.and_then(|id| Ears::open(id).ok());
        let thread = ears.and_then(|ears| {
            let listen = move || {
                // The window or the server is gone.
                let _ = ears.listen(&send);
            };
            std::thread::Builder::new().name("keys".into()).spawn(listen).ok()
        });
        Self { heard: thread.map(|_| heard), times: KeyTimes::default() }
    }

    /// A picture begins.
    pub(super) fn begin_picture(&mut self) {
        if let Some(heard) = &self.heard {
            heard.try_iter().for_each(|heard| self.times.hear(heard));
            self.times.begin_picture(monotonic_ns());
        }
    }

    /// When a key of which the window tells now went down or up, on the system's monotonic clock (ns).
    pub(super) fn time_ns(&mut self, code: u32, is_pressed: bool) -> u64 {
        let now_ns = monotonic_ns();
        let Some(heard) = &self.heard else { return now_ns };
        loop {
            if let Some(at_ns) = self.times.take(code, is_pressed) {
                return at_ns.min(now_ns);
            }
            let Ok(more) = heard.recv_timeout(PATIENCE) else { return now_ns };
            self.times.hear(more);
        }
    }
}

/// A connection that hears a window's keys.
struct Ears {
    connection: RustConnection,
    window: Window,
    clock: ServerClock,
    symbols: Symbols,
}

/// The symbols of all keys, so many of each.
struct Symbols {
    first: u8,
    each: usize,
    all: Vec<u32>,
}

type Answer<T> = Result<T, Box<dyn std::error::Error>>;

impl Ears {
    fn open(window: Window) -> Answer<Self> {
        let (connection, screen) = x11rb::connect(None)?;
        let root = connection.setup().roots[screen].root;
        let symbols = Symbols::read(&connection)?;
        // A key that is held goes down once, and up once.
        connection.xkb_use_extension(1, 0)?.reply()?;
        let once = xkb::PerClientFlag::DETECTABLE_AUTO_REPEAT;
        let none = xkb::BoolCtrl::default();
        connection
            .xkb_per_client_flags(xkb::ID::USE_CORE_KBD.into(), once, once, none, none, none)?
            .reply()?;
        let clock = ask_time(&connection, root)?;
        let mask = EventMask::KEY_PRESS | EventMask::KEY_RELEASE | EventMask::STRUCTURE_NOTIFY;
        let attributes = ChangeWindowAttributesAux::new().event_mask(mask);
        connection.change_window_attributes(window, &attributes)?.check()?;
        Ok(Self { connection, window, clock, symbols })
    }

    fn listen(mut self, out: &Sender<KeyHeard>) -> Answer<()> {
        let mut held = [false; 256];
        loop {
            let (key, is_pressed) = match self.connection.wait_for_event()? {
                Event::KeyPress(key) => (key, true),
                Event::KeyRelease(key) => (key, false),
                Event::MappingNotify(_) => {
                    self.symbols = Symbols::read(&self.connection)?;
                    continue;
                }
                Event::DestroyNotify(gone) if gone.window == self.window => return Ok(()),
                _ => continue,
            };
            let at_ns = self.clock.time_ns(key.time, monotonic_ns());
            if std::mem::replace(&mut held[usize::from(key.detail)], is_pressed) != is_pressed {
                out.send(KeyHeard { symbols: self.symbols.of(key.detail), is_pressed, at_ns })?;
            }
        }
    }
}

/// The server's clock: it tells when it changed a property.
fn ask_time(connection: &RustConnection, root: Window) -> Answer<ServerClock> {
    let window = connection.generate_id()?;
    let told = CreateWindowAux::new().event_mask(EventMask::PROPERTY_CHANGE);
    connection.create_window(0, window, root, 0, 0, 1, 1, 0, WindowClass::INPUT_ONLY, 0, &told)?;
    let mut clock = ServerClock::default();
    for _ in 0..QUESTIONS {
        connection.change_property32(
            PropMode::REPLACE,
            window,
            AtomEnum::WM_NAME,
            AtomEnum::INTEGER,
            &[0],
        )?;
        connection.flush()?;
        loop {
            if let Event::PropertyNotify(told) = connection.wait_for_event()? {
                clock.time_ns(told.time, monotonic_ns());
                break;
            }
        }
    }
    connection.destroy_window(window)?;
    connection.flush()?;
    Ok(clock)
}

impl Symbols {
    fn read(connection: &RustConnection) -> Answer<Self> {
        let (first, last) = (connection.setup().min_keycode, connection.setup().max_keycode);
        let told = connection.get_keyboard_mapping(first, last - first + 1)?.reply()?;
        let all = told.keysyms.into_iter().map(without_pad).collect();
        Ok(Self { first, each: usize::from(told.keysyms_per_keycode), all })
    }

    fn of(&self, key: u8) -> Vec<u32> {
        let from = usize::from(key.saturating_sub(self.first)) * self.each;
        self.all.get(from..from + self.each).unwrap_or_default().to_vec()
    }
}

fn monotonic_ns() -> u64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    now.tv_sec.unsigned_abs() * 1_000_000_000 + now.tv_nsec.unsigned_abs()
}
