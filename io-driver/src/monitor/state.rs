//! What is shown, and how keys change that.

use crate::monitor::commander::Commander;
use crate::monitor::keys::Key;
use crate::monitor::look::{Latencies, Look};
use crate::monitor::tick_rate::TickRate;
use crate::monitor::{devices, head, latencies};
use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;
use ratatui_core::style::{Style, Stylize};
use ratatui_core::text::Line;

/// The newest look, and what was kept of earlier ones.
#[derive(Debug, Default)]
pub(super) struct Monitor {
    pub(super) look: Option<Look>,
    pub(super) commander: Option<Commander>,
    pub(super) rate: TickRate,
    /// The largest component of a force that was seen on each device (N).
    pub(super) largest_force_n: Vec<f64>,
    /// The latencies when maxima were reset.
    before: Option<Latencies>,
    pub(super) is_paused: bool,
    is_helping: bool,
    pub(super) gone: Option<Gone>,
}

/// A driver that has ended.
#[derive(Debug)]
pub(super) struct Gone {
    pub(super) last_words: Option<String>,
    /// Why there is no other one yet.
    pub(super) why_not: Option<String>,
}

const HELP: [&str; 10] = [
    "q, Esc, Ctrl-C   leave",
    "p                pause, go on",
    "r                forget maxima so far",
    "?                this help, and back",
    "Forces: full bar = the device's peak,",
    "  or the largest seen if it has none.",
    "Latencies: since the start or the last r;",
    "  counts as logarithms, 0.1 us to 10 ms.",
    "Nothing here changes the driver, or what",
    "it counts.",
];

impl Monitor {
    /// Takes a look, unless it is paused.
    pub(super) fn see(&mut self, look: Look, commander: Option<Commander>) {
        if self.is_paused {
            return;
        }
        let status = &look.status;
        if self.look.as_ref().is_none_or(|last| last.status.driver_pid != status.driver_pid) {
            *self = Self { is_helping: self.is_helping, ..Self::default() };
        }
        self.gone = None;
        if let Some(tick) = status.tick {
            self.rate.see(look.at, tick);
        }
        self.largest_force_n.resize(status.devices.len(), 0.0);
        for (largest, device) in self.largest_force_n.iter_mut().zip(&status.devices) {
            let finite = device.force_on_user_n_applied.into_iter().map(f64::abs).filter(|n| n.is_finite());
            *largest = finite.fold(*largest, f64::max);
        }
        self.commander = commander;
        self.look = Some(look);
    }

    /// The driver has ended, with these words if it had any.
    pub(super) fn lose(&mut self, last_words: Option<String>) {
        self.gone = Some(Gone { last_words, why_not: None });
    }

    /// There is no driver still, and why.
    pub(super) fn hear_why_not(&mut self, why: String) {
        if let Some(gone) = &mut self.gone {
            gone.why_not = Some(why);
        }
    }

    /// Leaving is the caller's.
    pub(super) fn press(&mut self, key: Key) {
        match key {
            Key::Leave => {}
            Key::Pause => self.is_paused = !self.is_paused,
            Key::Help => self.is_helping = !self.is_helping,
            Key::Reset => {
                self.before = self.look.as_ref().map(|look| look.latencies.clone());
                self.largest_force_n.fill(0.0);
            }
        }
    }

    /// The latencies since the last reset.
    pub(super) fn latencies(&self, look: &Look) -> Latencies {
        self.before.as_ref().map_or_else(|| look.latencies.clone(), |before| look.latencies.since(before))
    }

    /// Draws into any terminal, even one without cells.
    pub(super) fn draw(&self, area: Rect, buffer: &mut Buffer) {
        let lines = if self.is_helping { HELP.map(Line::from).into() } else { self.lines(area) };
        let is_old = self.gone.is_some() || self.is_paused;
        for (row, line) in (area.top()..area.bottom()).zip(lines) {
            buffer.set_line(area.left(), row, &line, area.width);
        }
        if is_old && !self.is_helping && area.height > 1 {
            let old = Rect { y: area.y + 1, height: area.height - 1, ..area };
            buffer.set_style(old, Style::new().dim());
        }
    }

    /// The head and the devices as far as there is room; the latencies if that leaves enough; then some air.
    fn lines(&self, area: Rect) -> Vec<Line<'static>> {
        let (width, height) = (usize::from(area.width), usize::from(area.height));
        let Some(look) = &self.look else { return vec![Line::raw("waiting for a first look")] };
        let mut lines = head::lines(self, look, width);
        let mut devices = devices::lines(self, look, width);
        let missing = devices::cut_to(&mut devices, height.saturating_sub(lines.len()));
        let latencies = latencies::lines(&self.latencies(look), width);
        let left = height.saturating_sub(lines.len() + devices.len());
        let fits = missing == 0 && left >= latencies.len();
        let is_airy = fits && left >= latencies.len() + 2;
        lines.extend(is_airy.then(Line::default));
        lines.extend(devices);
        match (fits, missing) {
            (true, _) => {
                lines.extend(is_airy.then(Line::default));
                lines.extend(latencies);
            }
            (false, 0) => lines.push(hint("latencies need a taller window".into())),
            (false, _) => lines.push(hint(format!("{missing} more in a taller window"))),
        }
        lines
    }
}

fn hint(words: String) -> Line<'static> {
    Line::raw(words).dark_gray()
}
