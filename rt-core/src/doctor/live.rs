//! The machine at hand: its real files, and probes that really try.

use super::machine::{FileStatus, MOST_BYTES, Tree};
use super::probe::{GapProbe, LockProbe, Probes, PromotionProbe};
use crate::clock::monotonic_ns;
use crate::setup::latency::open_request;
use crate::setup::memory::lock_all;
use crate::setup::placement::pin;
use crate::setup::scheduling::promote;
use crate::sys::mapped_word;
use crate::usage::ResourceUsage;
use nix::errno::Errno;
use nix::sys::mman::munlockall;
use nix::time::{ClockId, clock_getres};
use std::fs::{self, File};
use std::hint::{black_box, spin_loop};
use std::io::{self, Read};
use std::os::unix::fs::{FileExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Files below a directory; `/` is the machine itself.
#[derive(Clone, Debug)]
pub struct LiveTree {
    root: PathBuf,
}

impl Default for LiveTree {
    fn default() -> Self {
        Self::below("/")
    }
}

impl LiveTree {
    /// The files below `root`.
    pub fn below(root: impl Into<PathBuf>) -> Self {
        Self { root: root.into() }
    }

    fn at(&self, path: &str) -> PathBuf {
        self.root.join(path.trim_start_matches('/'))
    }
}

impl Tree for LiveTree {
    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        // A pipe that lies there by mistake must not hold the doctor up.
        let file = File::options().read(true).custom_flags(libc::O_NONBLOCK).open(self.at(path))?;
        let mut content = Vec::new();
        file.take(MOST_BYTES as u64).read_to_end(&mut content)?;
        Ok(content)
    }

    fn list(&self, path: &str) -> io::Result<Vec<String>> {
        let entries = fs::read_dir(self.at(path))?.collect::<io::Result<Vec<_>>>()?;
        let mut names: Vec<String> =
            entries.into_iter().filter_map(|entry| entry.file_name().into_string().ok()).collect();
        names.sort_unstable();
        Ok(names)
    }

    fn status(&self, path: &str) -> io::Result<FileStatus> {
        let meta = fs::symlink_metadata(self.at(path))?;
        Ok(FileStatus {
            mode: meta.mode() & 0o7777,
            uid: meta.uid(),
            gid: meta.gid(),
            is_directory: meta.is_dir(),
        })
    }

    fn link(&self, path: &str) -> io::Result<String> {
        Ok(fs::read_link(self.at(path))?.to_string_lossy().into_owned())
    }
}

/// Probes of the machine at hand.
#[derive(Clone, Copy, Debug, Default)]
pub struct LiveProbes;

/// A gap longer than this is counted: about what the kernel's own tick takes at worst.
const LONG_GAP_NS: u64 = 20_000;
/// Lowest real-time priority: above all ordinary threads, below every loop that has work to do.
const SPINNING_PRIORITY: u8 = 1;
/// Model-specific register that counts system management interrupts on Intel's processors.
const MSR_SMI_COUNT: u64 = 0x34;
/// What the loop of the page-fault probe uses.
const LOOP_BYTES: usize = 1 << 20;
/// How often it does.
const LOOP_ROUNDS: usize = 50;

impl Probes for LiveProbes {
    fn promotion(&self, cpu: usize, priority: u8) -> PromotionProbe {
        let body = move || {
            let placed = pin(cpu).map_err(|errno| errno as i32);
            let promotion = promote(priority);
            PromotionProbe {
                placed,
                asked: promotion.asked.map_err(|errno| errno as i32),
                found: promotion
                    .found
                    .map(|found| (found.policy, found.priority))
                    .map_err(|errno| errno as i32),
                rtprio_limit: promotion.rtprio_limit,
            }
        };
        on_a_thread(body).unwrap_or(PromotionProbe {
            placed: Err(Errno::EAGAIN as i32),
            asked: Err(Errno::EAGAIN as i32),
            found: Err(Errno::EAGAIN as i32),
            rtprio_limit: 0,
        })
    }

    fn memory_lock(&self) -> LockProbe {
        let locking = lock_all();
        // Best effort: the process ends soon.
        let _ = munlockall();
        LockProbe {
            asked: locking.asked.map_err(|errno| errno as i32),
            status: locking.status,
            limit: locking.limit,
        }
    }

    fn gaps(&self, cpu: usize, length: Duration) -> Result<GapProbe, String> {
        on_a_thread(move || {
            pin(cpu).map_err(|errno| format!("cannot run on CPU {cpu}: {errno}"))?;
            let was_fifo =
                promote(SPINNING_PRIORITY).found.is_ok_and(|found| found.policy == libc::SCHED_FIFO);
            let (smi, usage) = (read_smi_count(cpu), ResourceUsage::of_thread());
            let (largest_ns, long_gaps) = spin(length);
            let preemptions = ResourceUsage::of_thread().delta(&usage).involuntary_switches;
            let smi =
                smi.ok().zip(read_smi_count(cpu).ok()).map(|(before, after)| after.wrapping_sub(before));
            Ok(GapProbe { largest_ns, long_gaps, was_fifo, preemptions, smi })
        })?
    }

    fn loop_faults(&self, cpu: usize) -> Result<u64, String> {
        on_a_thread(move || {
            pin(cpu).map_err(|errno| format!("cannot run on CPU {cpu}: {errno}"))?;
            let mut block = vec![1_u8; LOOP_BYTES];
            let before = ResourceUsage::of_thread();
            for round in 0..LOOP_ROUNDS {
                block.iter_mut().step_by(64).for_each(|byte| *byte = byte.wrapping_add(round as u8));
                black_box(&mut block);
                std::thread::sleep(Duration::from_millis(1));
            }
            let faults = ResourceUsage::of_thread().delta(&before);
            Ok(faults.minor_faults + faults.major_faults)
        })?
    }

    fn held_dma_latency_us(&self) -> Result<i32, String> {
        open_request(0).map(|(_file, us)| us).map_err(|error| error.to_string())
    }

    fn kernel_tick_ns(&self) -> Result<u64, String> {
        // The coarse clock is the one that the tick moves on.
        let resolution = clock_getres(ClockId::CLOCK_MONOTONIC_COARSE).map_err(|errno| errno.to_string())?;
        Ok(resolution.tv_sec() as u64 * 1_000_000_000 + resolution.tv_nsec() as u64)
    }

    fn smi_count(&self, cpu: usize) -> Result<u32, String> {
        read_smi_count(cpu).map_err(|error| error.to_string())
    }

    fn mapped_word(&self, path: &str, offset: usize) -> Result<u32, String> {
        mapped_word::read(Path::new(path), offset).map_err(|error| error.to_string())
    }
}

/// Reads the clock for so long; longest gap (ns) and number of long ones.
fn spin(length: Duration) -> (u64, u64) {
    let start = monotonic_ns();
    let end = start.saturating_add(u64::try_from(length.as_nanos()).unwrap_or(u64::MAX));
    let (mut before, mut largest, mut long_gaps) = (start, 0, 0);
    while before < end {
        spin_loop();
        let now = monotonic_ns();
        let gap = now - before;
        largest = largest.max(gap);
        long_gaps += u64::from(gap > LONG_GAP_NS);
        before = now;
    }
    (largest, long_gaps)
}

fn read_smi_count(cpu: usize) -> io::Result<u32> {
    let mut value = [0; size_of::<u64>()];
    File::open(format!("/dev/cpu/{cpu}/msr"))?.read_exact_at(&mut value, MSR_SMI_COUNT)?;
    // The upper half is reserved.
    Ok(u64::from_ne_bytes(value) as u32)
}

/// What becomes of a thread's policy and affinity ends with it.
fn on_a_thread<T: Send + 'static>(body: impl FnOnce() -> T + Send + 'static) -> Result<T, String> {
    let thread = std::thread::Builder::new().name("doctor-probe".into()).spawn(body);
    thread.map_err(|error| error.to_string())?.join().map_err(|_| "the probe panicked".to_owned())
}
