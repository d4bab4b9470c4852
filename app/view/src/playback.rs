//! What is shown between the moments that a run tells of.
//!
//! Model: moments come some hundred times a second, not quite evenly. What is shown is a little late, so that there nearly
//! always is a later moment to go towards. The clock of the run and that of the window are kept together by what comes in.

use crate::moment::Moment;
use std::collections::VecDeque;

/// How late what is shown is (s): some turns of who tells.
const LATE_S: f64 = 0.03;
/// What shows that the clocks have parted (s): a run that stood still, or began anew.
const APART_S: f64 = 0.25;
/// How much of what a moment says of the clocks is believed.
const BELIEF: f64 = 0.1;
/// So many moments are kept.
const KEPT: usize = 16;

/// The newest moments.
#[derive(Debug, Default)]
pub struct Playback {
    moments: VecDeque<Moment>,
    /// The run's clock minus the window's (s).
    ahead_s: f64,
}

impl Playback {
    /// A moment came in at this time of the window's own clock (s).
    pub fn take(&mut self, moment: Moment, now_s: f64) {
        let ahead_s = moment.t_s - now_s;
        let is_apart = (ahead_s - self.ahead_s).abs() > APART_S || self.moments.is_empty();
        self.ahead_s += if is_apart { 1.0 } else { BELIEF } * (ahead_s - self.ahead_s);
        if self.moments.back().is_some_and(|last| moment.t_s < last.t_s) {
            self.moments.clear();
        }
        if self.moments.len() == KEPT {
            self.moments.pop_front();
        }
        self.moments.push_back(moment);
    }

    /// Forgets everything: another scene.
    pub fn clear(&mut self) {
        self.moments.clear();
    }

    /// The newest.
    pub fn newest(&self) -> Option<&Moment> {
        self.moments.back()
    }

    /// What is shown now (s).
    pub fn shown(&self, now_s: f64) -> Option<Moment> {
        let t_s = now_s + self.ahead_s - LATE_S;
        let later = self.moments.iter().position(|moment| moment.t_s >= t_s);
        match later {
            None => self.moments.back().cloned(),
            Some(0) => self.moments.front().cloned(),
            Some(at) => {
                let (before, after) = (&self.moments[at - 1], &self.moments[at]);
                let share = (t_s - before.t_s) / (after.t_s - before.t_s);
                Some(before.towards(after, share))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::moment::FingerMoment;
    use nalgebra::Vector3;

    fn moment(t_s: f64) -> Moment {
        let finger = FingerMoment { hip: Vector3::new(t_s, 0.0, 0.0), ..FingerMoment::default() };
        Moment { t_s, fingers: vec![finger], ..Moment::default() }
    }

    #[test]
    fn what_goes_evenly_is_shown_to_go_evenly_though_moments_come_unevenly() {
        let mut playback = Playback::default();
        let (mut shown, mut worst_m) = (Vec::<f64>::new(), 0.0f64);
        for at in 0..300 {
            let now_s = f64::from(at) * 0.01;
            // Up to 6 ms late, in turn.
            playback.take(moment(100.0 + now_s - f64::from(at % 3) * 0.003), now_s);
            let seen = playback.shown(now_s + 0.004).expect("a moment");
            if at > 100 {
                worst_m = worst_m.max((seen.fingers[0].hip.x - seen.t_s).abs());
                shown.push(seen.t_s);
            }
        }
        // Linear between moments that lie on a line.
        assert!(worst_m < 1e-12, "{worst_m}");
        // 10 ms of run in 10 ms, but for what is believed of 6 ms.
        let steps: Vec<f64> = shown.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(steps.iter().all(|step| (step - 0.01).abs() <= 0.1 * 0.006 + 1e-12), "{steps:?}");
    }

    #[test]
    fn a_run_that_begins_anew_is_shown_from_its_beginning() {
        let mut playback = Playback::default();
        playback.take(moment(5.0), 1.0);
        playback.take(moment(0.0), 1.01);
        assert_eq!(playback.shown(1.02).expect("a moment").t_s, 0.0);
    }
}
