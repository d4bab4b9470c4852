//! The orders of a recording, given again in the ticks in which they were taken.

use super::stage::Stage;
use crate::book::Book;
use crate::control::desk::{Desk, Means};
use crate::control::queue::OrderReceiver;
use crate::control::ticks_to_silence;
use io_driver::device::Extras;
use io_driver::say::say;
use std::collections::VecDeque;

/// So many ticks before they are due: what they need takes memory.
const AHEAD_TICKS: u64 = 200;

/// Orders that are still to come.
pub(super) struct Orders {
    desk: Desk,
    left: VecDeque<(u64, String)>,
}

impl Orders {
    /// Of a recording that begins in this tick where another scene ended, if it does: there its own one takes over. `None`:
    /// there are no orders.
    pub(super) fn new(
        stage: &Stage,
        mut orders: Vec<(u64, String)>,
        begins: Option<u64>,
        extras: &[Extras],
        book: &Book,
    ) -> Result<Option<(Self, OrderReceiver)>, String> {
        if let Some(tick) = begins {
            let faded = ticks_to_silence(stage.rig.period_ns as f64 / 1e9);
            orders.insert(0, (tick.saturating_sub(faded), "reset".into()));
        }
        if orders.is_empty() {
            return Ok(None);
        }
        let means = Means { extras: extras.to_vec(), book: book.clone(), ..Means::default() };
        let (desk, receiver) = Desk::silent(&stage.rig, means)?;
        Ok(Some((Self { desk, left: orders.into() }, receiver)))
    }

    /// Gives what is due soon. What this scene cannot do is told and left out.
    pub(super) fn give(&mut self, run_tick: u64) {
        self.desk.step();
        while self.left.front().is_some_and(|(tick, _)| *tick <= run_tick + AHEAD_TICKS)
            && let Some((tick, words)) = self.left.pop_front()
        {
            // Where fingers were in the world is in the recording's rows, wherever their devices stood.
            if words.starts_with("camera ") {
                continue;
            }
            // Where another scene takes over the recording ends; until then forces fade as before a reset.
            let is_swap = words.split_whitespace().next() == Some("swap");
            if let Err(error) = self.desk.order(tick, if is_swap { "reset" } else { &words }) {
                say(format_args!("phantom3: the order `{words}` is left out: {error}"));
            }
        }
    }
}
