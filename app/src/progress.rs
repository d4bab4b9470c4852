//! A line that says how far something has come: rewritten in place on a terminal, else now and then.

use io_driver::device::run_time_s;
use io_driver::say;
use rt_core::plain_text::Plain;
use std::io::IsTerminal;
use std::time::{Duration, Instant};

const ON_TERMINAL: Duration = Duration::from_millis(200);
/// Less is no waiting, on a terminal; a file that takes what is said hears later.
pub(crate) const SOON: Duration = Duration::from_secs(1);
const ELSEWHERE: Duration = Duration::from_secs(10);

/// A line that is told anew again and again.
#[derive(Debug)]
pub struct StatusLine {
    on_terminal: bool,
    last: Option<Instant>,
    is_open: bool,
}

impl Default for StatusLine {
    fn default() -> Self {
        Self { on_terminal: std::io::stderr().is_terminal(), last: None, is_open: false }
    }
}

impl StatusLine {
    /// A line whose first words may wait.
    pub fn told_just_now() -> Self {
        let on_terminal = std::io::stderr().is_terminal();
        Self { on_terminal, last: Some(Instant::now()), is_open: false }
    }

    /// Shows what `line` makes, if it is time to.
    pub fn show(&mut self, line: impl FnOnce() -> String) {
        let pause = if self.on_terminal { ON_TERMINAL } else { ELSEWHERE };
        if self.last.is_some_and(|last| last.elapsed() < pause) {
            return;
        }
        self.last = Some(Instant::now());
        let line = Plain(line());
        say::show(if self.on_terminal { format!("\r{line}\x1b[K") } else { format!("{line}\n") });
        self.is_open = self.on_terminal;
    }

    /// Ends the line, so that what follows begins on one of its own.
    pub fn end(&mut self) {
        if std::mem::take(&mut self.is_open) {
            say::show("\n".into());
        }
    }
}

impl Drop for StatusLine {
    fn drop(&mut self) {
        self.end();
    }
}

/// The line of a run.
#[derive(Debug)]
pub struct Progress {
    total_ticks: u64,
    period_ns: u64,
    line: StatusLine,
}

impl Progress {
    /// A line for a run of so many ticks, `u64::MAX` of them for one without an end; the first is shown after a while.
    pub fn new(total_ticks: u64, period_ns: u64) -> Self {
        Self { total_ticks, period_ns, line: StatusLine::told_just_now() }
    }

    /// Shows it, if it is time to.
    pub fn show(&mut self, run_ticks: u64) {
        let (total_ticks, period_ns) = (self.total_ticks, self.period_ns);
        self.line.show(|| {
            let seconds = |ticks: u64| run_time_s(ticks as i64, period_ns);
            let done = run_ticks.min(total_ticks);
            if total_ticks == u64::MAX {
                return format!("{:7.2} s", seconds(done));
            }
            let percent = 100 * done / total_ticks.max(1);
            let total = seconds(total_ticks);
            if run_ticks == 0 {
                format!(
                    "   0.00 s of {total:.2} s  waiting for the force to ramp in (late replies hold it back)"
                )
            } else {
                format!("{:7.2} s of {total:.2} s  {percent:3} %", seconds(done))
            }
        });
    }

    /// Ends the line, so that what follows begins on one of its own.
    pub fn end(&mut self) {
        self.line.end();
    }
}
