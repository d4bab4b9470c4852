//! A bare waiting loop, seen from here: started, read, explained.

use crate::jitter::bank::{Bank, Sample};
use crate::jitter::child::OwnChild;
use crate::jitter::circumstances::{Subject, Watch};
use crate::jitter::error::JitterError;
use crate::jitter::metric::{Metric, Style};
use crate::jitter::roles::{Role, command_on};
use crate::jitter::waiting_loop::{Hello, LOST, Order, RECORD, Woke};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use std::io::{ErrorKind, Read};
use std::process::{ChildStdout, Stdio};
use std::time::{Duration, Instant};

/// A child that does not say hello by then hangs.
const HELLO_LIMIT: Duration = Duration::from_secs(20);
/// A hello is a few kilobytes.
const LONGEST_HELLO: usize = 1 << 16;

/// A running loop.
#[derive(Debug)]
pub struct LoopSlice {
    child: OwnChild,
    out: ChildStdout,
    buffer: Vec<u8>,
    /// What the child said of itself.
    pub hello: Hello,
    watch: Watch,
    style: Style,
    metric: Metric,
    period_ns: u64,
    last_tick: Option<u64>,
    ended: bool,
}

impl LoopSlice {
    /// Starts it and waits until it runs.
    ///
    /// # Errors
    /// If it does not start.
    pub fn start(order: &Order, style: Style, cpus: &[usize]) -> Result<Self, JitterError> {
        let words =
            serde_json::to_string(order).map_err(|error| JitterError::fault("order a loop", error))?;
        let metric = if style == Style::Hybrid { Metric::HybridWake } else { Metric::ReferenceWake };
        let failed = |error: std::io::Error| JitterError::fault("start a waiting loop", error);
        let mut command = command_on(Role::WaitingLoop, cpus).map_err(failed)?;
        let mut child = OwnChild::start(command.arg(words).stdout(Stdio::piped())).map_err(failed)?;
        let mut out = child.pipes().stdout.take().ok_or_else(|| JitterError::Fault("no pipe".into()))?;
        let flags = fcntl_getfl(&out).map_err(|error| failed(error.into()))?;
        fcntl_setfl(&out, flags | OFlags::NONBLOCK).map_err(|error| failed(error.into()))?;
        let mut buffer = Vec::new();
        let hello = read_hello(&mut out, &mut buffer)?;
        let watch = Watch::new(Subject { pid: child.id(), tid: hello.tid, cpu: order.cpu });
        let period_ns = order.period_ns;
        Ok(Self { child, out, buffer, hello, watch, style, metric, period_ns, last_tick: None, ended: false })
    }

    /// Takes over what has come since the last call. True: the loop has ended and told everything.
    ///
    /// # Errors
    /// If the child ended without telling everything.
    pub fn poll(&mut self, bank: &mut Bank) -> Result<bool, JitterError> {
        self.watch.look();
        let is_open = read_available(&mut self.out, &mut self.buffer)
            .map_err(|error| JitterError::fault("read from the waiting loop", error))?;
        let whole = self.buffer.len() / RECORD * RECORD;
        let bytes: Vec<u8> = self.buffer.drain(..whole).collect();
        for chunk in bytes.chunks_exact(RECORD) {
            let mut record = [0; RECORD];
            record.copy_from_slice(chunk);
            self.take(Woke::from_bytes(&record), bank);
        }
        if !is_open && !self.ended {
            let status = self.child.end().map_or_else(|| "?".into(), |status| status.to_string());
            return Err(JitterError::Fault(format!(
                "the waiting loop ended in the middle of its slice ({status})"
            )));
        }
        Ok(self.ended)
    }

    fn take(&mut self, woke: Woke, bank: &mut Bank) {
        if woke.tick == LOST {
            bank.count(self.style, "samples_lost", woke.late_ns);
            self.ended = true;
            return;
        }
        bank.count(self.style, "ticks", 1);
        bank.count(self.style, "overruns", woke.late_ns / self.period_ns);
        self.last_tick = Some(woke.tick);
        let sample = Sample { tick: woke.tick, from_ns: woke.deadline_ns, value_ns: woke.late_ns };
        let to_ns = woke.deadline_ns + woke.late_ns;
        bank.record(self.metric, sample, || self.watch.around(woke.deadline_ns, to_ns));
    }
}

fn read_hello(out: &mut ChildStdout, buffer: &mut Vec<u8>) -> Result<Hello, JitterError> {
    let begun = Instant::now();
    loop {
        let is_open = read_available(out, buffer)
            .map_err(|error| JitterError::fault("read from the waiting loop", error))?;
        if let Some(end) = buffer.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = buffer.drain(..=end).collect();
            return serde_json::from_slice(&line)
                .map_err(|error| JitterError::fault("understand the loop", error));
        }
        if !is_open || buffer.len() > LONGEST_HELLO || begun.elapsed() > HELLO_LIMIT {
            return Err(JitterError::Fault("the waiting loop did not start; see its message above".into()));
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Appends what is there. False: nothing will come any more.
fn read_available(out: &mut ChildStdout, buffer: &mut Vec<u8>) -> std::io::Result<bool> {
    let mut chunk = [0; 1 << 16];
    loop {
        match out.read(&mut chunk) {
            Ok(0) => return Ok(false),
            Ok(count) => buffer.extend_from_slice(&chunk[..count]),
            Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(true),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}
