//! Messages from a real-time loop, formatted and written by another thread.
//!
//! Problem: formatting allocates, writing to a terminal or a journal blocks for as long as it likes.
//! Model: the loop pushes fixed-size records (a static text, up to three numbers) into a bounded
//! lock-free queue; a slow thread drains, formats and writes them.
//! Invariants: pushing never blocks, allocates or fails; what does not fit is counted and the drain
//! says so once each time the count has grown. Order is kept. Repeating the same message every tick
//! is for the caller to avoid: the queue is then soon full of it.
//! Cost: a push copies 72 bytes and reads the clock, some 60 ns. Draining may do anything.

use crate::clock::monotonic_ns;
use rtrb::{Consumer, Producer, RingBuffer};
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Numbers that fit into a record.
pub const MAX_VALUES: usize = 3;

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogLevel {
    /// Good to know.
    Info,
    /// Something is not as it should be, and the loop copes.
    Warning,
    /// Something failed.
    Error,
}

/// What travels through the queue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogRecord {
    /// When it was pushed, on the monotonic clock.
    pub time_ns: u64,
    /// In which tick.
    pub tick: u64,
    /// How much it matters.
    pub level: LogLevel,
    /// The text; each `{}` stands for the next value.
    pub message: &'static str,
    /// The values, of which the first `value_count` are meant.
    pub values: [f64; MAX_VALUES],
    /// How many values there are.
    pub value_count: u8,
}

impl fmt::Display for LogRecord {
    /// The message with its values; a placeholder without value stays, a value without placeholder
    /// is left out.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = usize::from(self.value_count).min(MAX_VALUES);
        let mut values = self.values[..count].iter();
        let mut parts = self.message.split("{}");
        f.write_str(parts.next().unwrap_or_default())?;
        for part in parts {
            match values.next() {
                Some(value) => write!(f, "{value}{part}")?,
                None => write!(f, "{{}}{part}")?,
            }
        }
        Ok(())
    }
}

/// A formatted message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogLine {
    /// When it was pushed, on the monotonic clock.
    pub time_ns: u64,
    /// In which tick.
    pub tick: u64,
    /// How much it matters.
    pub level: LogLevel,
    /// What it says.
    pub text: String,
}

/// A queue for `capacity` messages, with the loop's end and the slow thread's end.
#[must_use]
pub fn channel(capacity: usize) -> (RtLog, RtLogDrain) {
    let (producer, consumer) = RingBuffer::new(capacity);
    let lost = Arc::new(AtomicU64::new(0));
    let log = RtLog { producer, lost: Arc::clone(&lost) };
    let drain = RtLogDrain { consumer, lost, lost_reported: 0, last_tick: 0 };
    (log, drain)
}

/// The real-time end.
#[derive(Debug)]
pub struct RtLog {
    producer: Producer<LogRecord>,
    lost: Arc<AtomicU64>,
}

impl RtLog {
    /// Logs a message; values beyond the third are left out. Fit for the loop.
    pub fn push(&mut self, level: LogLevel, tick: u64, message: &'static str, values: &[f64]) {
        let value_count = values.len().min(MAX_VALUES);
        let mut kept = [0.0; MAX_VALUES];
        kept[..value_count].copy_from_slice(&values[..value_count]);
        let time_ns = monotonic_ns();
        let value_count = value_count as u8;
        self.push_record(LogRecord { time_ns, tick, level, message, values: kept, value_count });
    }

    /// Logs a record made elsewhere. Fit for the loop.
    pub fn push_record(&mut self, record: LogRecord) {
        if self.producer.push(record).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// How many messages were lost in all, for whoever does not drain them.
#[derive(Clone, Debug)]
pub struct LostCount(Arc<AtomicU64>);

impl LostCount {
    /// It.
    #[must_use]
    pub fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

/// The slow end.
#[derive(Debug)]
pub struct RtLogDrain {
    consumer: Consumer<LogRecord>,
    lost: Arc<AtomicU64>,
    lost_reported: u64,
    last_tick: u64,
}

impl RtLogDrain {
    /// Takes the messages that are there, oldest first, then says how many were lost since the last
    /// time. Ends even while the loop goes on pushing.
    pub fn drain(&mut self, mut sink: impl FnMut(LogLine)) {
        // Read first: a message lost after this is reported next time, behind its predecessors.
        let lost = self.lost();
        for _ in 0..self.consumer.slots() {
            let Ok(record) = self.consumer.pop() else { break };
            self.last_tick = record.tick;
            let (time_ns, tick, level) = (record.time_ns, record.tick, record.level);
            sink(LogLine { time_ns, tick, level, text: record.to_string() });
        }
        if lost > self.lost_reported {
            sink(self.loss_report(lost - self.lost_reported));
            self.lost_reported = lost;
        }
    }

    /// How many messages were lost in all.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// The same for another thread.
    #[must_use]
    pub fn lost_count(&self) -> LostCount {
        LostCount(Arc::clone(&self.lost))
    }

    /// True once the loop's end is gone and everything was drained.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        // In this order: the loop may push and then end between the two looks.
        self.consumer.is_abandoned() && self.consumer.is_empty()
    }

    fn loss_report(&self, count: u64) -> LogLine {
        let text = match count {
            1 => "1 message was lost: the log was full".to_owned(),
            _ => format!("{count} messages were lost: the log was full"),
        };
        LogLine { time_ns: monotonic_ns(), tick: self.last_tick, level: LogLevel::Warning, text }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use patience::prelude::*;

    fn texts(drain: &mut RtLogDrain) -> Vec<String> {
        let mut texts = Vec::new();
        drain.drain(|line| texts.push(line.text));
        texts
    }

    #[test]
    fn placeholders_take_the_values_in_order() {
        let (mut log, mut drain) = channel(4);
        log.push(LogLevel::Info, 7, "force {} N exceeds {} N", &[12.5, 8.0]);
        let mut lines = Vec::new();
        drain.drain(|line| lines.push(line));
        assert_eq!(lines.len(), 1);
        assert_eq!((lines[0].tick, lines[0].level), (7, LogLevel::Info));
        assert_eq!(lines[0].text, "force 12.5 N exceeds 8 N");
        assert!(lines[0].time_ns > 0);
    }

    #[test]
    fn missing_and_surplus_values_do_no_harm() {
        let (mut log, mut drain) = channel(8);
        log.push(LogLevel::Info, 0, "{} and {}", &[1.0]);
        log.push(LogLevel::Info, 0, "plain", &[1.0, 2.0]);
        log.push(LogLevel::Info, 0, "{}{}{}{}", &[1.0, 2.0, 3.0, 4.0]);
        log.push(LogLevel::Info, 0, "", &[]);
        log.push(LogLevel::Info, 0, "{}", &[f64::NAN]);
        assert_eq!(texts(&mut drain), ["1 and {}", "plain", "123{}", "", "NaN"]);
    }

    #[test]
    fn an_absurd_value_count_is_clipped() {
        let record = LogRecord {
            time_ns: 0,
            tick: 0,
            level: LogLevel::Error,
            message: "{}",
            values: [4.0; 3],
            value_count: 255,
        };
        assert_eq!(record.to_string(), "4");
    }

    #[test]
    fn what_does_not_fit_is_counted_and_reported_once() {
        let (mut log, mut drain) = channel(2);
        for _ in 0..5 {
            log.push(LogLevel::Info, 3, "tick", &[]);
        }
        assert_eq!(drain.lost(), 3);
        assert_eq!(texts(&mut drain), ["tick", "tick", "3 messages were lost: the log was full"]);
        assert_eq!(texts(&mut drain), Vec::<String>::new());
        for _ in 0..3 {
            log.push(LogLevel::Info, 4, "again", &[]);
        }
        assert_eq!(texts(&mut drain), ["again", "again", "1 message was lost: the log was full"]);
    }

    #[test]
    fn the_drain_is_finished_when_the_log_is_gone_and_empty() {
        let (mut log, mut drain) = channel(2);
        log.push(LogLevel::Info, 0, "last", &[]);
        assert!(!drain.is_finished());
        drop(log);
        assert!(!drain.is_finished(), "one message is still in the queue");
        assert_eq!(texts(&mut drain), ["last"]);
        assert!(drain.is_finished());
    }

    #[test]
    fn across_threads_every_message_arrives_in_order_or_is_counted() {
        const PUSHED: u64 = 100_000;
        let (mut log, mut drain) = channel(64);
        let loop_thread = std::thread::spawn(move || {
            (1..=PUSHED).for_each(|tick| log.push(LogLevel::Info, tick, "", &[]));
        });
        let (mut arrived, mut last_tick) = (0, 0);
        patience::watched(patience::limit(), "the end of the queue", || {
            while !drain.is_finished() {
                drain.drain(|line| {
                    // Loss reports repeat the tick before them.
                    if line.level == LogLevel::Info {
                        assert!(line.tick > last_tick);
                        last_tick = line.tick;
                        arrived += 1;
                    }
                });
            }
        });
        loop_thread.bounded_join().unwrap();
        assert_eq!(arrived + drain.lost(), PUSHED);
    }
}
