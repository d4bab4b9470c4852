//! One run of cyclictest as a slice.

use crate::jitter::bank::Bank;
use crate::jitter::child::OwnChild;
use crate::jitter::cyclictest::{self, Call};
use crate::jitter::error::JitterError;
use crate::jitter::metric::{Metric, Style};
use crate::jitter::roles::{Role, command_on};
use rustix::process::Signal;
use std::fs::File;
use std::io::{Read, Seek};
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Beyond its own duration: its start, its end, and a busy machine.
const GRACE: Duration = Duration::from_secs(20);

/// A running cyclictest.
#[derive(Debug)]
pub struct CyclictestSlice {
    child: OwnChild,
    /// A pipe would fill and block it; a file takes its megabyte.
    out: File,
    begun: Instant,
    began_ns: u64,
    limit: Duration,
    period_us: u64,
}

impl CyclictestSlice {
    /// Starts it for so many whole seconds.
    ///
    /// # Errors
    /// If it does not start.
    pub fn start(call: &Call, seconds: u64, cpus: &[usize]) -> Result<Self, JitterError> {
        let failed = |error: std::io::Error| JitterError::fault("start cyclictest", error);
        let out = tempfile::tempfile().map_err(failed)?;
        let mut command = command_on(Role::Become, cpus).map_err(failed)?;
        command.arg("cyclictest").args(call.arguments(seconds));
        command.stdout(out.try_clone().map_err(failed)?).stderr(Stdio::null());
        let child = OwnChild::start(&mut command).map_err(failed)?;
        let limit = Duration::from_secs(seconds) + GRACE;
        let began_ns = rt_core::clock::monotonic_ns();
        Ok(Self { child, out, begun: Instant::now(), began_ns, limit, period_us: call.period_us })
    }

    /// True: it has ended, and its values are in the bank.
    ///
    /// # Errors
    /// If it failed, hung or printed something else.
    pub fn poll(&mut self, bank: &mut Bank) -> Result<bool, JitterError> {
        let Some(status) = self.child.ended() else {
            if self.begun.elapsed() > self.limit {
                self.child.end();
                return Err(JitterError::Fault(format!("cyclictest did not end within {:?}", self.limit)));
            }
            return Ok(false);
        };
        if !status.success() {
            return Err(JitterError::Fault(format!("cyclictest failed ({status})")));
        }
        self.take(bank).map(|()| true)
    }

    /// Ends it early; it prints what it has.
    ///
    /// # Errors
    /// As [`poll`](Self::poll).
    pub fn cut_short(&mut self, bank: &mut Bank) -> Result<(), JitterError> {
        self.child.signal(Signal::INT);
        let asked = Instant::now();
        while self.child.ended().is_none() && asked.elapsed() < Duration::from_secs(3) {
            std::thread::sleep(Duration::from_millis(5));
        }
        self.child.end();
        self.take(bank)
    }

    fn take(&mut self, bank: &mut Bank) -> Result<(), JitterError> {
        let mut text = String::new();
        let read = self.out.rewind().and_then(|()| self.out.read_to_string(&mut text));
        read.map_err(|error| JitterError::fault("read cyclictest's output", error))?;
        let measured = cyclictest::parse(&text).map_err(|error| JitterError::Fault(error.to_string()))?;
        let overruns = measured.histogram.counts().iter().enumerate().map(|(bucket, count)| {
            count * (rt_core::histogram::bucket_lower(bucket) / (1000 * self.period_us))
        });
        bank.count(Style::Reference, "ticks", measured.histogram.count());
        bank.count(Style::Reference, "overruns", overruns.sum());
        bank.add_slice(
            Metric::ReferenceWake,
            self.began_ns,
            rt_core::clock::monotonic_ns(),
            &measured.histogram,
        );
        Ok(())
    }
}
