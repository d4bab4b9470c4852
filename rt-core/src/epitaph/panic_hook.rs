//! Records a panic as epitaph.
//!
//! Problem: the message of a panic goes to standard error, which nobody reads on a robot.
//! Model: a hook before the former one writes where and what. The place comes first: a long message
//! may be cut, the place must not be.
//! Invariants: the hook itself does not allocate. It sees every panic of the process, on whatever
//! thread and whether caught or not: for a program in which every panic is the end.

use super::{EpitaphKind, EpitaphRef, EpitaphWords, FixedText};
use std::fmt::Write as _;
use std::panic::{self, PanicHookInfo};
use std::sync::atomic::{AtomicU64, Ordering};

/// Writes every panic's place and message into `cell`, then calls the hook that was there before.
/// `tick` is read when it happens.
pub fn install_panic_hook(cell: &'static EpitaphWords, tick: &'static AtomicU64) {
    let former = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        let text = describe(info);
        EpitaphRef::new(cell).write(EpitaphKind::Panic, tick.load(Ordering::Relaxed), text.as_str());
        former(info);
    }));
}

fn describe(info: &PanicHookInfo<'_>) -> FixedText {
    let mut text = FixedText::new();
    if let Some(place) = info.location() {
        let _ = write!(text, "{}:{}: ", place.file(), place.line());
    }
    let _ = text.write_str(message(info));
    text
}

/// `panic!` leaves a `&str` or a `String`; `panic_any` may leave anything.
fn message<'a>(info: &'a PanicHookInfo<'_>) -> &'a str {
    let payload = info.payload();
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("(no text)")
}
