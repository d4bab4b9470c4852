//! A line that says how far a run has come: rewritten in place on a terminal, else now and then.

use io_driver::device::run_time_s;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

const ON_TERMINAL: Duration = Duration::from_millis(200);
const ELSEWHERE: Duration = Duration::from_secs(10);

/// The line.
#[derive(Debug)]
pub struct Progress {
    total_ticks: u64,
    period_ns: u64,
    on_terminal: bool,
    last: Instant,
    is_open: bool,
}

impl Progress {
    /// A line for a run of so many ticks.
    pub fn new(total_ticks: u64, period_ns: u64) -> Self {
        let on_terminal = std::io::stderr().is_terminal();
        Self { total_ticks, period_ns, on_terminal, last: Instant::now(), is_open: false }
    }

    /// Shows it, if it is time to.
    pub fn show(&mut self, run_ticks: u64) {
        let pause = if self.on_terminal { ON_TERMINAL } else { ELSEWHERE };
        if self.last.elapsed() < pause {
            return;
        }
        self.last = Instant::now();
        let seconds = |ticks: u64| run_time_s(ticks as i64, self.period_ns);
        let done = run_ticks.min(self.total_ticks);
        let percent = 100 * done / self.total_ticks.max(1);
        let total = seconds(self.total_ticks);
        let line = if run_ticks == 0 {
            format!("   0.00 s of {total:.2} s  waiting for the force to ramp in (late replies hold it back)")
        } else {
            format!("{:7.2} s of {total:.2} s  {percent:3} %", seconds(done))
        };
        let mut out = std::io::stderr().lock();
        // Nobody to tell is no reason to stop.
        let _ = if self.on_terminal { write!(out, "\r{line}\x1b[K") } else { writeln!(out, "{line}") };
        let _ = out.flush();
        self.is_open = self.on_terminal;
    }

    /// Ends the line, so that what follows begins on one of its own.
    pub fn end(&mut self) {
        if std::mem::take(&mut self.is_open) {
            let _ = writeln!(std::io::stderr());
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.end();
    }
}
