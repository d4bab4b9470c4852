//! How a run goes, in one line.

use crate::moment::Moment;
use crate::news::Status;
use std::fmt::Write;

/// Rate, ticks that the driver skipped, replies that were late, latency, sizes of both lists, the force at each finger,
/// whether it stands still, is more than a tick has time for, or is recorded. What nobody told yet is left out.
pub fn status_line(status: &Status, moment: &Moment) -> String {
    let mut line = format!("{:7.2} s", moment.t_s);
    // A string takes everything.
    if status.rate_hz > 0.0 {
        let _ =
            write!(line, " | {:.0} Hz, {} skipped, {} late", status.rate_hz, status.overruns, status.late);
    }
    if let Some([median, most, worst]) = status.latency_ns {
        let us = |ns: u64| ns as f64 / 1e3;
        let _ = write!(line, " | reply {:.0}/{:.0}/{:.0} us", us(median), us(most), us(worst));
    }
    if status.lists != [0, 0] {
        let [fast, slow] = status.lists;
        let _ = write!(line, " | fast {fast}, slow {slow}");
    }
    for (at, finger) in moment.fingers.iter().enumerate() {
        let before = if at == 0 { " | N" } else { "" };
        let _ = write!(line, "{before} {:5.2}", finger.force.norm());
    }
    if status.is_paused {
        line.push_str(" | PAUSED");
    }
    if status.is_overloaded {
        line.push_str(" | IN TURNS");
    }
    if let Some(file) = &status.recording {
        let _ = write!(line, " | RECORDING {file}");
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::moment::FingerMoment;
    use nalgebra::Vector3;

    #[test]
    fn the_line_says_what_is_known_and_nothing_else() {
        let pressed = FingerMoment { force: Vector3::new(0.0, 3.0, 4.0), ..FingerMoment::default() };
        let mut moment =
            Moment { t_s: 12.345, fingers: vec![pressed, FingerMoment::default()], ..Moment::default() };
        let mut status = Status::default();
        assert_eq!(status_line(&status, &moment), "  12.35 s | N  5.00  0.00");
        moment.fingers.clear();
        status = Status {
            rate_hz: 999.7,
            overruns: 2,
            late: 5,
            latency_ns: Some([45_400, 80_000, 120_600]),
            lists: [3, 17],
            recording: Some("a.mcap".into()),
            is_paused: true,
            is_overloaded: true,
            ..status
        };
        let all = "  12.35 s | 1000 Hz, 2 skipped, 5 late | reply 45/80/121 us | fast 3, slow 17 | PAUSED | IN TURNS | RECORDING a.mcap";
        assert_eq!(status_line(&status, &moment), all);
    }
}
