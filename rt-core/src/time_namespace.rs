//! Time namespaces: whether another process reads the same `CLOCK_MONOTONIC` as this one.
//!
//! Problem: time stamps cross process borders, and in another time namespace (time_namespaces(7), `unshare -T`) the same
//! clock is shifted by any number of seconds. Ages and deadlines mean nothing across such a border.
//! Model: the kernel tells the shift of each process against the machine's own clock in /proc/PID/timens_offsets.
//! Cost: two small files of /proc are read. Not for a loop.

use std::fs;

/// True if that process has the same clock; `None`: the kernel does not tell.
#[must_use]
pub fn is_clock_shared_with(pid: u64) -> Option<bool> {
    if pid == 0 {
        return None;
    }
    let (own, other) = (shift_of("self")?, shift_of(&pid.to_string())?);
    Some(own == other)
}

/// Seconds and nanoseconds by which a process's monotonic clock is ahead.
fn shift_of(process: &str) -> Option<[i64; 2]> {
    parse(&fs::read_to_string(format!("/proc/{process}/timens_offsets")).ok()?)
}

fn parse(text: &str) -> Option<[i64; 2]> {
    let line = text.lines().find_map(|line| line.strip_prefix("monotonic"))?;
    let mut numbers = line.split_whitespace().map(str::parse);
    Some([numbers.next()?.ok()?, numbers.next()?.ok()?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_shares_its_clock_with_itself_and_of_one_that_is_not_there_nothing_is_known() {
        assert_ne!(is_clock_shared_with(std::process::id().into()), Some(false));
        assert_eq!(is_clock_shared_with(0), None);
        assert_eq!(is_clock_shared_with(u64::MAX), None);
    }

    #[test]
    fn the_shift_of_the_monotonic_clock_is_read_and_that_of_others_is_not() {
        assert_eq!(parse("monotonic       -100000         5\nboottime  7  0\n"), Some([-100_000, 5]));
        for other in ["", "boottime 7 0\n", "monotonic\n", "monotonic x 0\n"] {
            assert_eq!(parse(other), None, "{other:?}");
        }
    }
}
