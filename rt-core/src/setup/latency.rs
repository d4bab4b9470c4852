//! How late the kernel and the CPU may be when they wake the loop.

use super::report::Guarantee;
use crate::installed::LATENCY_RULE;
use nix::Result;
use nix::sys::prctl::{get_timerslack, set_timerslack};
use std::fs::File;
use std::io::{self, Read, Write};

/// Lets the kernel wake the calling thread at most this late.
pub(super) fn limit_timer_slack(wanted_ns: u64) -> Guarantee {
    // 0 would ask for the default of 50 us.
    let asked = set_timerslack(wanted_ns.max(1));
    judge_timer_slack(wanted_ns, asked, get_timerslack())
}

/// Less than wanted is fine: for a real-time thread newer kernels say 0 and refuse to change it.
fn judge_timer_slack(wanted_ns: u64, asked: Result<()>, found: Result<i32>) -> Guarantee {
    let wanted_ns = wanted_ns.max(1);
    let obtained = found.is_ok_and(|ns| u64::try_from(ns).is_ok_and(|ns| ns <= wanted_ns));
    let remedy = (!obtained).then(|| match asked {
        Err(error) => format!("the kernel refused: {error}"),
        Ok(()) => "the kernel accepted but did not apply it; SCHED_FIFO makes it needless".to_owned(),
    });
    let found = found.map_or_else(|error| format!("unreadable ({error})"), |ns| format!("{ns} ns"));
    Guarantee::asked("timer slack", format!("at most {wanted_ns} ns"), found, remedy)
}

pub(crate) const DMA_LATENCY: &str = "/dev/cpu_dma_latency";

/// Keeps CPUs out of sleep states that take longer than this to leave, as long as the file is open.
pub(super) fn limit_dma_latency(wanted_us: i32) -> (Guarantee, Option<File>) {
    match open_request(wanted_us) {
        Ok((file, in_force_us)) => (judge_dma_latency(wanted_us, Ok(in_force_us)), Some(file)),
        Err(error) => (judge_dma_latency(wanted_us, Err(error.to_string())), None),
    }
}

/// The request, and the limit in force with it: the least that any program asks for.
pub(crate) fn open_request(wanted_us: i32) -> io::Result<(File, i32)> {
    let mut file = File::options().read(true).write(true).open(DMA_LATENCY)?;
    file.write_all(&wanted_us.to_ne_bytes())?;
    let mut in_force = [0; size_of::<i32>()];
    file.read_exact(&mut in_force)?;
    Ok((file, i32::from_ne_bytes(in_force)))
}

/// `found` is the limit in force, or why there is none of ours.
fn judge_dma_latency(wanted_us: i32, found: std::result::Result<i32, String>) -> Guarantee {
    let obtained = found.as_ref().is_ok_and(|us| (0..=wanted_us).contains(us));
    let remedy = (!obtained).then(|| {
        format!(
            "let this user write {DMA_LATENCY}, by a udev rule such as {LATENCY_RULE} and membership in that group"
        )
    });
    let found = found.map_or_else(|error| format!("no request ({error})"), |us| format!("{us} us"));
    Guarantee::asked("dma latency", format!("at most {wanted_us} us"), found, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nix::errno::Errno;
    use patience::prelude::*;

    #[test]
    fn less_slack_than_wanted_is_fine_and_more_is_not() {
        assert!(judge_timer_slack(1, Ok(()), Ok(1)).obtained);
        assert!(judge_timer_slack(0, Ok(()), Ok(1)).obtained, "0 would mean the default, 1 is the least");
        assert!(judge_timer_slack(100, Err(Errno::EPERM), Ok(0)).obtained, "a real-time thread has none");
        let ignored = judge_timer_slack(1, Ok(()), Ok(50_000));
        assert_eq!((ignored.obtained, ignored.found.as_str()), (false, "50000 ns"));
    }

    /// Needs no rights: any thread may ask for less slack.
    #[test]
    fn slack_is_read_back_from_the_kernel() {
        let thread = std::thread::spawn(|| (limit_timer_slack(1_234), get_timerslack()));
        let (guarantee, slack) = thread.bounded_join().unwrap();
        // 0 under a runner that is itself real-time.
        assert!(matches!(slack, Ok(0 | 1_234)), "{slack:?}");
        assert!(guarantee.obtained);
    }

    #[test]
    fn a_wake_up_limit_counts_when_it_is_in_force() {
        assert!(judge_dma_latency(10, Ok(10)).obtained);
        assert!(judge_dma_latency(10, Ok(0)).obtained, "another program asks for less");
        assert!(!judge_dma_latency(0, Ok(2_000_000_000)).obtained, "the kernel's default: no limit");
        let refused = judge_dma_latency(0, Err("Permission denied (os error 13)".to_owned()));
        assert_eq!(refused.found, "no request (Permission denied (os error 13))");
        assert!(refused.remedy.unwrap().contains("udev"));
    }
}
