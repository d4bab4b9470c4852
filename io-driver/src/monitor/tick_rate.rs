//! How fast the ticks come, by the monitor's own clock.

use std::collections::VecDeque;
use std::time::Duration;

/// The looks of the last second.
#[derive(Debug, Default)]
pub(super) struct TickRate {
    looks: VecDeque<(Duration, u64)>,
    /// When the tick was another one for the last time.
    moved: Duration,
}

const WINDOW: Duration = Duration::from_secs(1);
/// Over less than this, 5 ms of a busy machine would be a percent and more.
const SHORTEST: Duration = Duration::from_millis(300);

impl TickRate {
    pub(super) fn see(&mut self, at: Duration, tick: u64) {
        if self.looks.back().is_none_or(|(_, last)| *last != tick) {
            self.moved = at;
        }
        self.looks.push_back((at, tick));
        // The oldest one may lie before the window, so that a second is covered.
        while self.looks.get(1).is_some_and(|(second, _)| at.saturating_sub(*second) >= WINDOW) {
            self.looks.pop_front();
        }
    }

    /// Ticks per second; `None` until they were watched for a while.
    pub(super) fn hz(&self) -> Option<f64> {
        let ((from, first), (to, last)) = (self.looks.front()?, self.looks.back()?);
        let window = to.saturating_sub(*from);
        (window >= SHORTEST).then(|| last.saturating_sub(*first) as f64 / window.as_secs_f64())
    }

    /// Since when there was no new tick.
    pub(super) fn still_for(&self) -> Duration {
        self.looks.back().map_or(Duration::ZERO, |(last, _)| last.saturating_sub(self.moved))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_is_that_of_the_last_second_and_silence_is_noticed() {
        let mut rate = TickRate::default();
        assert_eq!(rate.hz(), None);
        let ms = Duration::from_millis;
        (0..40).for_each(|look| rate.see(ms(100 * look), 50 * look));
        // 50 ticks in 0.1 s, all of it exact in binary but for the quotient's last bits.
        assert!((rate.hz().unwrap() - 500.0).abs() < 1e-9);
        (40..70).for_each(|look| rate.see(ms(100 * look), 50 * 39));
        assert_eq!(rate.hz(), Some(0.0));
        assert_eq!(rate.still_for(), ms(3000));
    }
}
