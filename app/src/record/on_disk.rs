//! Content of a file, brought to the disk itself while the file is being written.
//!
//! Problem: what is written lies in the system's memory for up to half a minute, and a power failure takes it away.
//! Model: a thread of its own brings it to the disk (fdatasync(2)), each half second in which something was written. A disk that
//! takes its time delays that thread and not who writes; it is asked again when it has answered.
//! Invariant: a refusal reaches who writes, though the system tells it once.

use rustix::fs::fdatasync;
use std::fs::File;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Between two times.
const EVERY: Duration = Duration::from_millis(500);
/// Enough for one call.
const STACK_BYTES: usize = 64 * 1024;

/// The thread of a file, until it is dropped.
#[derive(Debug)]
pub(super) struct OnDisk {
    asked: Instant,
    /// Rows that the file had then.
    rows: u64,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    /// The disk is to take what there is, or is about to.
    is_asked: AtomicBool,
    is_over: AtomicBool,
    refusal: Mutex<Option<io::Error>>,
}

impl OnDisk {
    /// Starts the thread; `file` is another handle of what is written.
    ///
    /// # Errors
    /// If there can be none.
    pub(super) fn start(file: File) -> io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("on-disk".into())
            .stack_size(STACK_BYTES)
            .spawn(move || of_thread.run(&file))?;
        Ok(Self { asked: Instant::now(), rows: 0, shared, thread: Some(thread) })
    }

    /// Has what is new brought to the disk, if it is time; the file has so many rows.
    ///
    /// # Errors
    /// Refusal of an earlier time.
    pub(super) fn has_rows(&mut self, rows: u64) -> io::Result<()> {
        let is_asked = self.shared.is_asked.load(Ordering::Acquire);
        if is_asked || rows == self.rows || self.asked.elapsed() < EVERY {
            return Ok(());
        }
        self.shared.refused()?;
        (self.asked, self.rows) = (Instant::now(), rows);
        self.shared.is_asked.store(true, Ordering::Release);
        self.wake();
        Ok(())
    }

    /// Ends the thread and closes its handle, when the disk has answered.
    ///
    /// # Errors
    /// As [`Self::has_rows`].
    pub(super) fn end(mut self) -> io::Result<()> {
        self.shared.is_over.store(true, Ordering::Release);
        self.wake();
        if let Some(Err(_)) = self.thread.take().map(JoinHandle::join) {
            return Err(io::Error::other("the thread that brings it to the disk panicked"));
        }
        self.shared.refused()
    }

    fn wake(&self) {
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
    }
}

/// Nobody waits for a disk that may never answer.
impl Drop for OnDisk {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Release);
        self.wake();
    }
}

impl Shared {
    fn run(&self, file: &File) {
        loop {
            if self.is_asked.load(Ordering::Acquire) {
                if let Err(refusal) = rustix::io::retry_on_intr(|| fdatasync(file)) {
                    *self.refusal.lock().unwrap_or_else(PoisonError::into_inner) = Some(refusal.into());
                }
                self.is_asked.store(false, Ordering::Release);
            } else if self.is_over.load(Ordering::Acquire) {
                return;
            } else {
                std::thread::park();
            }
        }
    }

    fn refused(&self) -> io::Result<()> {
        self.refusal.lock().unwrap_or_else(PoisonError::into_inner).take().map_or(Ok(()), Err)
    }
}
