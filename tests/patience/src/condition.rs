//! Waits for a condition.

use std::time::{Duration, Instant};

use crate::limit;

/// Between two looks at a condition that does not hold yet.
const PAUSE: Duration = Duration::from_micros(500);

/// Waits until `done` says so. Panics after [`limit`]: "waited 60s in vain: {what}".
#[track_caller]
pub fn until(what: &str, done: impl FnMut() -> bool) {
    until_within(limit(), what, done);
}

/// As [`until`], with a limit of its own.
#[track_caller]
pub fn until_within(limit: Duration, what: &str, mut done: impl FnMut() -> bool) {
    assert!(is_met(limit, || done().then_some(())).is_some(), "waited {limit:?} in vain: {what}");
}

/// Waits until there is something, and returns it. Panics as [`until`] does.
#[track_caller]
pub fn until_some<T>(what: &str, look: impl FnMut() -> Option<T>) -> T {
    let limit = limit();
    is_met(limit, look).unwrap_or_else(|| panic!("waited {limit:?} in vain: {what}"))
}

/// Looks until there is something, once more after the limit: a machine that slept has not waited.
pub(crate) fn is_met<T>(limit: Duration, mut look: impl FnMut() -> Option<T>) -> Option<T> {
    let begun = Instant::now();
    loop {
        let is_late = begun.elapsed() >= limit;
        let found = look();
        if found.is_some() || is_late {
            return found;
        }
        std::thread::sleep(PAUSE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thread::tests::message_of;

    #[test]
    fn what_comes_is_returned_and_what_does_not_come_is_named() {
        let mut looks = 0;
        let third = until_some("the third look", || {
            looks += 1;
            (looks == 3).then_some(looks)
        });
        assert_eq!(third, 3);
        let vain = || until_within(Duration::from_millis(20), "frame 7 is published", || false);
        assert_eq!(message_of(vain), "waited 20ms in vain: frame 7 is published");
    }

    #[test]
    fn a_condition_that_holds_is_met_even_without_any_patience() {
        until_within(Duration::ZERO, "what holds", || true);
    }
}
