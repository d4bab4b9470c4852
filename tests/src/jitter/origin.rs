//! Where times are counted from, and wall-clock time for people.

use rt_core::clock::monotonic_ns;
use std::time::{SystemTime, UNIX_EPOCH};

/// One moment on both clocks.
#[derive(Debug, Clone, Copy)]
pub struct Origin {
    monotonic_ns: u64,
    unix_ns: u64,
}

impl Origin {
    /// This moment.
    pub fn now() -> Self {
        Self { monotonic_ns: monotonic_ns(), unix_ns: unix_now_ns() }
    }

    /// Its monotonic time (ns).
    pub fn monotonic_ns(self) -> u64 {
        self.monotonic_ns
    }

    /// From the origin to a monotonic time (ns); 0 before it.
    pub fn since_ns(self, monotonic_ns: u64) -> u64 {
        monotonic_ns.saturating_sub(self.monotonic_ns)
    }

    /// A monotonic time as UTC, by the wall clock as it is set now.
    pub fn utc(self, at_ns: u64) -> String {
        let ago = monotonic_ns().saturating_sub(at_ns);
        utc_text(unix_now_ns().saturating_sub(ago))
    }

    /// The origin as UTC.
    pub fn start_utc(self) -> String {
        utc_text(self.unix_ns)
    }

    /// The origin as a name for a directory: `20260131-174501`, UTC.
    pub fn file_name(self) -> String {
        let text = utc_text(self.unix_ns);
        text.chars()
            .take(19)
            .filter(|c| *c != '-' && *c != ':')
            .map(|c| if c == 'T' { '-' } else { c })
            .collect()
    }
}

/// Now, as UTC.
pub fn utc_now() -> String {
    utc_text(unix_now_ns())
}

fn unix_now_ns() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as u64)
}

/// RFC 3339 with milliseconds.
fn utc_text(unix_ns: u64) -> String {
    let (seconds, ms) = (unix_ns / 1_000_000_000, unix_ns / 1_000_000 % 1000);
    let (year, month, day) = civil(seconds / 86_400);
    let (hour, minute, second) = (seconds / 3600 % 24, seconds / 60 % 60, seconds % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{ms:03}Z")
}

/// Year, month and day of a day since 1970 (H. Hinnant, "chrono-compatible low-level date algorithms").
fn civil(days: u64) -> (u64, u64, u64) {
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let march_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * march_month + 2) / 5 + 1;
    let month = if march_month < 10 { march_month + 3 } else { march_month - 9 };
    (400 * era + year_of_era + u64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        // `date -u -d @951782399` and so on.
        assert_eq!(utc_text(0), "1970-01-01T00:00:00.000Z");
        assert_eq!(utc_text(951_782_399_007_000_000), "2000-02-28T23:59:59.007Z");
        assert_eq!(utc_text(951_782_400_000_000_000), "2000-02-29T00:00:00.000Z");
        assert_eq!(utc_text(1_798_761_599_999_000_000), "2026-12-31T23:59:59.999Z");
    }

    #[test]
    fn a_directory_is_named_by_date_and_time() {
        let origin = Origin { monotonic_ns: 0, unix_ns: 951_782_399_007_000_000 };
        assert_eq!(origin.file_name(), "20000228-235959");
    }
}
