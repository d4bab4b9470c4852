//! Order of a recording's rows: ticks rise, and no gap is longer than a run can have.
//!
//! Problem: a replay plays every tick between two rows. One damaged time, or one of another unit, would have it play for
//! ever, or for some days.

use io_driver::device::run_time_s;
use shm_abi::segment::SHORTEST_PERIOD_NS;
use std::ops::RangeInclusive;

/// Ticks of rows, looked at one after the other.
#[derive(Debug, Default)]
pub(super) struct TickOrder {
    times: TimeOrder,
}

/// The same by their times (s), where nobody knows how long a tick is.
#[derive(Debug, Default)]
pub(crate) struct TimeOrder {
    last_s: Option<f64>,
}

/// Between two rows: a driver that is gone is waited for as long (`--grace`).
pub(crate) const LONGEST_GAP_S: f64 = 3600.0;
/// From the beginning of a run: a month.
const LONGEST_RUN_S: f64 = 31.0 * 86_400.0;
/// Rates from one tick in ten seconds, of a recording that somebody thinned out, to the driver's highest.
const PERIODS_NS: RangeInclusive<u64> = SHORTEST_PERIOD_NS..=10_000_000_000;

impl TickOrder {
    /// What is wrong with the next row's tick, if anything is.
    pub(super) fn check(&mut self, tick: u64, period_ns: u64) -> Result<(), String> {
        // A tick beyond the signed ones is beyond every run.
        let tick = i64::try_from(tick).unwrap_or(i64::MAX);
        self.times.check(run_time_s(tick, period_ns))
    }
}

impl TimeOrder {
    /// What is wrong with the next row's time, if anything is.
    pub(crate) fn check(&mut self, t_s: f64) -> Result<(), String> {
        if t_s > LONGEST_RUN_S {
            return Err(format!("t is {t_s:?}; allowed: at most {LONGEST_RUN_S} s"));
        }
        let Some(last_s) = self.last_s.replace(t_s) else { return Ok(()) };
        if t_s <= last_s {
            return Err(format!("t is {t_s:?} after {last_s:?}; allowed: times that rise from row to row"));
        }
        if t_s - last_s > LONGEST_GAP_S {
            return Err(format!(
                "t is {t_s:?} after {last_s:?}; allowed: at most {LONGEST_GAP_S} s from a row to the next"
            ));
        }
        Ok(())
    }
}

/// What is wrong with the length of a tick, if anything is.
pub(super) fn check_period(period_ns: u64) -> Result<(), String> {
    if PERIODS_NS.contains(&period_ns) {
        return Ok(());
    }
    let [least, most] = [PERIODS_NS.start(), PERIODS_NS.end()].map(|ns| *ns as f64 / 1e9);
    Err(format!("a tick has {:?} s; allowed: {least} to {most} s", period_ns as f64 / 1e9))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn check(ticks: &[u64]) -> Result<(), String> {
        let mut order = TickOrder::default();
        ticks.iter().try_for_each(|tick| order.check(*tick, MS))
    }

    #[test]
    fn ticks_that_rise_with_gaps_are_a_recording() {
        assert_eq!(check(&[0, 1, 2, 3_600_002]), Ok(()));
        assert_eq!(check(&[86_400_000]), Ok(()), "one that begins under way");
    }

    #[test]
    fn times_that_stand_fall_or_leap_are_refused_with_both_times() {
        let said = check(&[5, 5]).expect_err("stands");
        assert!(said.contains("t is 0.005 after 0.005") && said.contains("rise"), "{said}");
        assert!(check(&[5, 4]).expect_err("falls").contains("t is 0.004 after 0.005"));
        let said = check(&[0, 3_600_001]).expect_err("leaps");
        assert!(said.contains("at most 3600 s from a row to the next"), "{said}");
        assert!(check(&[1_000_000_000_000_000]).expect_err("leaps").contains("t is 1000000000000.0"));
        assert!(check(&[u64::MAX]).is_err());
    }

    #[test]
    fn ticks_are_neither_nanoseconds_nor_hours_long() {
        assert_eq!((check_period(MS), check_period(50_000)), (Ok(()), Ok(())));
        for period_ns in [0, 1, 49_999, 3_600_000_000_000, u64::MAX] {
            assert!(check_period(period_ns).expect_err("no tick").contains("allowed: 0.00005 to 10 s"));
        }
    }
}
