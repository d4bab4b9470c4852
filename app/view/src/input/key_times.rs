//! Times of keys.
//!
//! Problem: a window hears of keys when it draws. Where drawing takes a third of a second, a press of 50 ms and its end come in
//! together, and somebody's response time is known to no better than that.
//! Model: somebody else ([`KeyHeard`]) hears the same keys as they come, and when that was. What the window hears later is
//! matched with that by key and direction, in order. A window hears in a picture of what came before the one before it, so
//! what it has not told of by then it never will: an input method took it. A window that nobody helps so has its own time.

use std::collections::VecDeque;

/// A key that went down or up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyHeard {
    /// The numbers that X11 gives its symbols, on all levels of the key.
    pub symbols: Vec<u32>,
    /// Whether it went down.
    pub is_pressed: bool,
    /// When, on the system's monotonic clock (ns).
    pub at_ns: u64,
}

/// Keys that were heard and that the window has not told of yet.
#[derive(Debug, Default)]
pub struct KeyTimes {
    heard: VecDeque<KeyHeard>,
    /// When the last two pictures began (ns).
    pictures_ns: [u64; 2],
}

/// From somebody who hears keys to the window, by way of an input method or of a machine that has no time for it (ns).
const ON_THE_WAY_NS: u64 = 1_000_000_000;
/// No more are kept.
const MOST: usize = 1024;

impl KeyTimes {
    /// Keeps one.
    pub fn hear(&mut self, heard: KeyHeard) {
        if self.heard.len() < MOST {
            self.heard.push_back(heard);
        }
    }

    /// A picture begins now: what came before the last two is forgotten.
    pub fn begin_picture(&mut self, now_ns: u64) {
        let [before_ns, last_ns] = self.pictures_ns;
        self.heard.retain(|heard| heard.at_ns + ON_THE_WAY_NS >= before_ns);
        self.pictures_ns = [last_ns, now_ns];
    }

    /// When the first of those happened that are this key, by the number of one of its symbols, going this way.
    pub fn take(&mut self, code: u32, is_pressed: bool) -> Option<u64> {
        let is_it = |heard: &KeyHeard| heard.is_pressed == is_pressed && heard.symbols.contains(&code);
        let at = self.heard.iter().position(is_it)?;
        self.heard.remove(at).map(|heard| heard.at_ns)
    }
}

/// The symbol of a key of the number pad as that of the key that means the same; all others as they are.
pub fn without_pad(symbol: u32) -> u32 {
    match symbol {
        // Operators and digits are so far beyond ASCII; Return is, too, and keeps its own number.
        0xffaa..=0xffb9 => symbol - 0xff80,
        0xff8d => 0xff0d,
        // Home, arrows, pages and End, in the same order.
        0xff95..=0xff9c => symbol - 0x45,
        0xff9e => 0xff63,
        0xff9f => 0xffff,
        _ => symbol,
    }
}

/// Times of a server's clock, which counts milliseconds and begins anew after 2^32 of them, on our own.
///
/// Model: an event arrives some time after it happened, so the least difference between both clocks that was seen is the one
/// between them, but for that event's delay. It is let grow slowly, so that clocks of two machines may drift apart.
/// Invariant: nothing happened after it arrived.
#[derive(Debug, Clone, Copy, Default)]
pub struct ServerClock {
    /// The last event's time, counted on (ns); its arrival, and how much later our clock is (ns).
    last: Option<(u64, u64, i64)>,
}

/// No clock that a machine has runs faster by more than this share.
const DRIFT: f64 = 1e-4;

impl ServerClock {
    /// When an event happened on our clock (ns) that has this time of the server's (ms) and arrived now (ns).
    pub fn time_ns(&mut self, server_ms: u32, arrived_ns: u64) -> u64 {
        let (server_ns, later_ns) = match self.last {
            None => {
                let server_ns = u64::from(server_ms) * MILLISECOND_NS;
                (server_ns, i64::MAX)
            }
            Some((before_ns, was_ns, later_ns)) => {
                let before_ms = (before_ns / MILLISECOND_NS) as u32;
                let on_ms = i64::from(server_ms.wrapping_sub(before_ms).cast_signed());
                let server_ns = before_ns.saturating_add_signed(on_ms * MILLISECOND_NS as i64);
                let drift_ns = (DRIFT * arrived_ns.saturating_sub(was_ns) as f64) as i64;
                (server_ns, later_ns.saturating_add(drift_ns))
            }
        };
        let later_ns = later_ns.min(arrived_ns.cast_signed() - server_ns.cast_signed());
        self.last = Some((server_ns, arrived_ns, later_ns));
        server_ns.saturating_add_signed(later_ns)
    }
}

const MILLISECOND_NS: u64 = 1_000_000;

#[cfg(test)]
mod tests {
    use super::*;

    fn heard(symbol: u32, is_pressed: bool, at_ns: u64) -> KeyHeard {
        KeyHeard { symbols: vec![symbol | 0x20, symbol], is_pressed, at_ns }
    }

    #[test]
    fn each_press_and_each_end_of_one_has_its_own_time_in_order() {
        let mut times = KeyTimes::default();
        for (symbol, is_pressed, at_ns) in
            [(0x59, true, 10), (0x50, true, 15), (0x59, false, 30), (0x59, true, 50), (0x59, false, 70)]
        {
            times.hear(heard(symbol, is_pressed, at_ns));
        }
        let mut y = |is_pressed| times.take(0x59, is_pressed);
        assert_eq!(
            [y(true), y(false), y(true), y(false), y(true)],
            [Some(10), Some(30), Some(50), Some(70), None]
        );
        assert_eq!(times.take(0x50, true), Some(15), "another key");
    }

    #[test]
    fn what_the_window_never_told_of_is_no_time_of_a_later_press() {
        let second = |s: u64| s * 1_000_000_000;
        let mut times = KeyTimes::default();
        // Pictures of three seconds: what came in during the last two is not lost.
        times.begin_picture(second(3));
        times.hear(heard(0x59, true, second(4)));
        times.begin_picture(second(6));
        times.begin_picture(second(9));
        times.hear(heard(0x59, true, second(10)));
        assert_eq!(times.take(0x59, true), Some(second(4)));
        times.begin_picture(second(12));
        times.begin_picture(second(15));
        times.begin_picture(second(18));
        times.hear(heard(0x59, true, second(19)));
        assert_eq!((times.take(0x59, true), times.take(0x59, true)), (Some(second(19)), None));
    }

    /// Two short pictures, and one of seconds, in which the window is told at last.
    #[test]
    fn a_key_that_is_late_has_its_own_time_and_not_the_next_one_s() {
        let ms = |ms: u64| ms * MILLISECOND_NS;
        let mut times = KeyTimes::default();
        for begins_ms in [6_700, 7_200, 7_300] {
            times.begin_picture(ms(begins_ms));
            if begins_ms == 6_700 {
                times.hear(heard(0x59, true, ms(6_820)));
            }
        }
        times.hear(heard(0x59, true, ms(7_499)));
        times.begin_picture(ms(13_788));
        assert_eq!([(); 2].map(|()| times.take(0x59, true)), [Some(ms(6_820)), Some(ms(7_499))]);
    }

    #[test]
    fn keys_of_the_number_pad_are_known_by_what_they_mean() {
        // KP_7, KP_Add, KP_Home, KP_Left, KP_End, KP_Enter, KP_Delete; and a letter.
        let pad = [0xffb7, 0xffab, 0xff95, 0xff96, 0xff9c, 0xff8d, 0xff9f, 0x41].map(without_pad);
        assert_eq!(pad, [0x37, 0x2b, 0xff50, 0xff51, 0xff57, 0xff0d, 0xffff, 0x41]);
    }

    #[test]
    fn delays_of_single_events_do_not_count_and_nothing_happens_after_it_arrived() {
        let mut clock = ServerClock::default();
        // Ours is 7 s later than the server's; arrivals are late by 0.2 ms, then 5 ms, 40 ms, 0.3 ms.
        let mut last = 0;
        for (k, delay_us) in [200, 5_000, 40_000, 300].into_iter().enumerate() {
            let server_ms = 1000 + 20 * k as u32;
            let happened_ns = 7_000_000_000 + u64::from(server_ms) * MILLISECOND_NS;
            let arrived_ns = happened_ns + delay_us * 1000;
            let told_ns = clock.time_ns(server_ms, arrived_ns);
            assert!(told_ns <= arrived_ns && told_ns >= happened_ns, "{k}");
            // The least delay, and what clocks may drift until the third event arrived, after 80 ms.
            assert!(told_ns - happened_ns <= 200_000 + 8_000, "{k}: {}", told_ns - happened_ns);
            assert!(told_ns > last);
            last = told_ns;
        }
    }

    #[test]
    fn a_clock_that_begins_anew_after_fifty_days_goes_on() {
        let mut clock = ServerClock::default();
        let at_ns = 5_000_000_000;
        let before_ns = clock.time_ns(u32::MAX - 4, at_ns);
        let after_ns = clock.time_ns(15, at_ns + 20 * MILLISECOND_NS);
        // 0xfffffffb to 0x0000000f: 20 ms.
        assert_eq!(after_ns - before_ns, 20 * MILLISECOND_NS);
    }
}
