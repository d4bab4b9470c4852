//! What was so in the last seconds, as lines are drawn of it.
//!
//! Model: ticks are gathered by equal shares of time. Of each share the least and the greatest value are kept: a line of that
//! many points has every peak, however short, and drawing it takes the same time at any rate.

use std::collections::VecDeque;

/// So much is kept (s).
pub const KEPT_S: f64 = 10.0;
/// In so many shares: more than a panel is wide, in points of the screen.
const SHARES: i64 = 400;
const SHARE_S: f64 = KEPT_S / SHARES as f64;

/// Some lines over the same time.
#[derive(Debug, Default)]
pub struct History {
    shares: VecDeque<Share>,
    newest_s: f64,
}

#[derive(Debug)]
struct Share {
    number: i64,
    /// Of each line, the least and the greatest value.
    ranges: Vec<[f64; 2]>,
}

impl History {
    /// The lines' values at a time (s). Time that goes back begins anew; a value that is no number is left out.
    pub fn push(&mut self, t_s: f64, values: impl Iterator<Item = f64>) {
        if t_s < self.newest_s {
            self.shares.clear();
        }
        self.newest_s = t_s;
        let number = (t_s / SHARE_S).floor() as i64;
        while self.shares.front().is_some_and(|first| first.number <= number - SHARES) {
            self.shares.pop_front();
        }
        if self.shares.back().is_none_or(|last| last.number != number) {
            self.shares.push_back(Share { number, ranges: Vec::new() });
        }
        let Some(share) = self.shares.back_mut() else { return };
        for (line, value) in values.enumerate() {
            if share.ranges.len() <= line {
                share.ranges.push([f64::INFINITY, f64::NEG_INFINITY]);
            }
            let [least, greatest] = &mut share.ranges[line];
            // Comparisons with what is no number change nothing.
            (*least, *greatest) = (least.min(value), greatest.max(value));
        }
    }

    /// Points of a line: seconds before now, which are negative, and values. Each share has two, the least and the greatest,
    /// in the order in which they come nearer to the share before.
    pub fn line(&self, line: usize) -> Vec<[f64; 2]> {
        let mut points = Vec::with_capacity(2 * self.shares.len());
        let mut last = 0.0_f64;
        for share in &self.shares {
            let Some([least, greatest]) = share.ranges.get(line).filter(|[least, most]| least <= most) else {
                continue;
            };
            let begins_s = share.number as f64 * SHARE_S - self.newest_s;
            let at_s = (begins_s + 0.5 * SHARE_S).clamp(-KEPT_S, 0.0);
            let (first, then) = if (last - least).abs() <= (last - greatest).abs() {
                (least, greatest)
            } else {
                (greatest, least)
            };
            points.push([at_s, *first]);
            if first != then {
                points.push([at_s, *then]);
            }
            last = *then;
        }
        points
    }

    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.shares.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_of_one_tick_is_in_the_line_wherever_it_falls() {
        for at in [0, 1, 12, 24, 25, 4_999, 9_990] {
            for peak in [7.0, -7.0] {
                let mut history = History::default();
                for tick in 0..10_000 {
                    let value = if tick == at { peak } else { (f64::from(tick) * 0.01).sin() };
                    history.push(f64::from(tick) * 1e-3, [value].into_iter());
                }
                let line = history.line(0);
                assert!(line.iter().any(|[_, value]| *value == peak), "{peak} at tick {at}");
                assert!(line.len() <= 2 * SHARES as usize, "{}", line.len());
            }
        }
    }

    #[test]
    fn no_point_is_older_than_what_is_kept_nor_later_than_now() {
        let mut history = History::default();
        for tick in 0..25_000 {
            history.push(f64::from(tick) * 1e-3, [f64::from(tick)].into_iter());
        }
        let line = history.line(0);
        assert!(line.iter().all(|[t_s, _]| (-KEPT_S..=0.0).contains(t_s)));
        assert!(line.is_sorted_by(|[a, _], [b, _]| a <= b));
        // A share of what is kept, at most, is gone too early.
        let oldest = line[0][1];
        assert!((14_999.0 - 25.0..=14_999.0 + 50.0).contains(&oldest), "{oldest}");
        assert_eq!(line.last().map(|[_, value]| *value), Some(24_999.0));
    }

    #[test]
    fn lines_are_kept_apart_and_what_is_no_number_is_left_out() {
        let mut history = History::default();
        history.push(0.0, [1.0, f64::NAN].into_iter());
        history.push(0.001, [3.0, 5.0].into_iter());
        let values = |line| history.line(line).iter().map(|[_, value]| *value).collect::<Vec<_>>();
        assert_eq!((values(0), values(1), values(2)), (vec![1.0, 3.0], vec![5.0], vec![]));
    }

    #[test]
    fn a_time_that_goes_back_begins_anew() {
        let mut history = History::default();
        history.push(5.0, [1.0].into_iter());
        history.push(0.0, [2.0].into_iter());
        assert_eq!(history.line(0).len(), 1);
    }
}
