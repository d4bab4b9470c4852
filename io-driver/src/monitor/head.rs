//! The head of the screen: the driver, its state, who commands, what was counted.

use crate::monitor::bar;
use crate::monitor::look::Look;
use crate::monitor::state::{Gone, Monitor};
use crate::status::Status;
use ratatui_core::style::{Color, Style, Stylize};
use ratatui_core::text::{Line, Span};
use rt_core::plain_text::Plain;
use std::time::Duration;

/// Longer than a driver sleeps at any rate it can have.
const SILENCE: Duration = Duration::from_secs(1);
const KEYS: &str = "? keys";
/// A part of a line and the next one, where there is room.
const GAP: &str = "   ";
/// Narrower than this there is none.
const WIDE: usize = 60;

pub(super) fn lines(monitor: &Monitor, look: &Look, width: usize) -> Vec<Line<'static>> {
    let status = &look.status;
    let mut lines = vec![title(monitor, status, width)];
    if let Some(gone) = &monitor.gone {
        lines.extend(wrapped(&farewell(gone), width));
    }
    lines.extend(state(monitor, status, width));
    lines.extend(switches(status));
    lines.push(commander(monitor, status));
    let c = &status.counters;
    let gap = if width < WIDE { " " } else { GAP };
    let rate = monitor.rate.hz().map_or_else(|| "... Hz".into(), |hz| format!("{hz:.1} Hz"));
    let bad = |words, count| Span::styled(format!("{gap}{words}"), alarm(count));
    lines.push(Line::from(vec![
        Span::raw(format!("ticks {}{gap}{rate}", c.ticks)),
        bad(format!("overruns {}", c.overruns), c.overruns),
        bad(format!("faults {}", c.faults), c.faults),
    ]));
    lines.push(Line::from(vec![
        Span::raw(format!("replies {} in time", c.replies_fresh)),
        bad(format!("{} missed", c.replies_missed), c.replies_missed),
        bad(format!("{} torn", c.commands_torn), c.commands_torn),
        bad(format!("{} refused", c.commands_refused), c.commands_refused),
    ]));
    lines
}

fn title(monitor: &Monitor, status: &Status, width: usize) -> Line<'static> {
    let mut spans = Vec::new();
    let mut mark = |words, color| spans.extend([Span::raw(words).bg(color).black(), Span::raw(" ")]);
    if monitor.gone.is_some() {
        mark(" DRIVER GONE ", Color::Red);
    }
    if monitor.is_paused {
        mark(" PAUSED ", Color::Yellow);
    }
    let cpu = status.cpu.map_or_else(|| "any CPU".into(), |cpu| format!("CPU {cpu}"));
    let Status { driver_pid, clock, rate_hz, wait, .. } = status;
    let driver = format!("driver {driver_pid}{GAP}{clock} clock{GAP}{rate_hz} Hz{GAP}{cpu}{GAP}{wait} wait");
    spans.push(Span::raw(driver).bold());
    let mut line = Line::from(spans);
    let room = width.saturating_sub(line.width());
    if room > KEYS.len() {
        line.push_span(Span::raw(format!("{KEYS:>room$}")).dark_gray());
    }
    line
}

fn farewell(gone: &Gone) -> String {
    let last_words = gone.last_words.as_ref().map_or_else(String::new, |words| format!(": {words}"));
    let why_not = gone.why_not.as_ref().map_or_else(String::new, |why| format!(" ({why})"));
    Plain(format_args!("The driver has ended{last_words}. Waiting for its return{why_not}")).to_string()
}

/// The state, and why if it is a fault; else how much force is let through.
fn state(monitor: &Monitor, status: &Status, width: usize) -> Vec<Line<'static>> {
    let name = format!(" {} ", status.state.to_uppercase());
    let color = match status.state {
        "active" => Color::Green,
        "idle" => Color::Cyan,
        "fault" => Color::Red,
        _ => Color::Yellow,
    };
    let mut line = Line::from(Span::raw(name).bg(color).black().bold());
    let mut more = Vec::new();
    if let Some(why) = &status.fault {
        line.push_span(" ");
        let mut reason = wrapped(why, width.saturating_sub(line.width())).into_iter();
        line.extend(reason.next().unwrap_or_default());
        more.extend(reason);
    } else {
        line.push_span(format!(" authority {:.2} ", status.authority));
        line.extend(bar::share(status.authority, 8));
    }
    let still = monitor.rate.still_for();
    if still >= SILENCE {
        let words = format!("{GAP}no tick for {} s", still.as_secs());
        line.push_span(Span::raw(words).red().bold());
    }
    more.insert(0, line);
    more
}

fn switches(status: &Status) -> Vec<Line<'static>> {
    let let_go = status.dead_man_held == Some(false);
    let words = [
        status.emergency_stop_pressed.then(|| Line::raw("emergency stop pressed").red().bold()),
        let_go.then(|| Line::raw("dead-man's switch let go: no force").yellow()),
        (status.dead_man_held == Some(true)).then(|| Line::raw("dead-man's switch held")),
        status.commissioning.then(|| Line::raw("commissioning: little force, little speed").yellow()),
    ];
    words.into_iter().flatten().collect()
}

fn commander(monitor: &Monitor, status: &Status) -> Line<'static> {
    match (status.lease, &monitor.commander) {
        (0, _) => Line::raw("nobody commands"),
        (lease, None) => {
            Line::raw(format!("lease {lease}{GAP}commanded by a process not to be seen from here"))
        }
        (lease, Some(who)) => {
            Line::raw(format!("lease {lease}{GAP}commanded by process {} ({})", who.pid, Plain(&who.name)))
        }
    }
}

/// What should be zero.
fn alarm(count: u64) -> Style {
    if count == 0 { Style::new() } else { Style::new().yellow() }
}

/// Bad news, broken between words; a word longer than a line is cut.
fn wrapped(text: &str, width: usize) -> Vec<Line<'static>> {
    let mut rows = vec![String::new()];
    for word in text.split(' ') {
        let row = rows.last_mut().expect("there is one from the beginning");
        if !row.is_empty() && row.chars().count() + 1 + word.chars().count() > width {
            rows.push(word.into());
        } else {
            *row += if row.is_empty() { "" } else { " " };
            *row += word;
        }
    }
    rows.into_iter().map(|row| Line::raw(row).red()).collect()
}
