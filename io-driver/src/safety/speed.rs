//! How fast the tip may move, and which of its positions are impossible.
//!
//! Problem: an arm that nobody holds and that is driven the wrong way accelerates within milliseconds; a
//! broken encoder jumps. Both have to be seen from positions that come in steps of 0.03 mm.
//! Model: the speed is that of the device's own estimate (see [`crate::velocity`]), which is on time where something
//! accelerates and which one encoder count hardly moves. A jump is a position that nothing could have reached since
//! the last one; it is looked for in the positions, which no estimate has smoothed.
//! Invariants: time is counted in ticks of the schedule, so skipped ones do not make a movement look fast. A tick
//! in which the loop steps aside ([`rt_core::phase_keeper`]) is 0.38 of a period longer than it counts: a movement
//! then looks faster than it is by that part of the estimate's window, a tenth where that is four ticks.
//! Cost: constant; no allocation.

use nalgebra::Vector3;
use shm_abi::FaultReason;

/// Nothing at the end of an arm moves so fast (m/s): a stepped 8 N on 30 g for 0.1 s.
const IMPOSSIBLE_M_PER_S: f64 = 25.0;

/// The limit of one tip's speed.
#[derive(Debug, Clone)]
pub struct Speed {
    limit_m_per_s: f64,
    period_s: f64,
    /// Tick and position of the last observation.
    last: Option<(u64, Vector3<f64>)>,
}

impl Speed {
    /// A speed above the limit is a fault; infinite: none is, and neither is a jump.
    pub fn new(limit_m_per_s: f64, period_ns: u64) -> Self {
        Self { limit_m_per_s, period_s: period_ns as f64 / 1e9, last: None }
    }

    /// Takes the position (m) and the estimated velocity (m/s) of a tick.
    ///
    /// # Errors
    /// [`FaultReason::PositionJump`] and [`FaultReason::Overspeed`].
    pub fn observe(
        &mut self,
        tick: u64,
        position: Vector3<f64>,
        velocity: Vector3<f64>,
    ) -> Result<(), FaultReason> {
        let last = self.last.replace((tick, position));
        if last.is_some_and(|last| self.has_jumped(last, tick, position)) {
            return Err(FaultReason::PositionJump);
        }
        if velocity.norm() > self.limit_m_per_s { Err(FaultReason::Overspeed) } else { Ok(()) }
    }

    /// Forgets what was observed: the next position is not compared with it.
    pub fn forget(&mut self) {
        self.last = None;
    }

    fn has_jumped(&self, last: (u64, Vector3<f64>), tick: u64, position: Vector3<f64>) -> bool {
        let elapsed_s = tick.saturating_sub(last.0).max(1) as f64 * self.period_s;
        self.limit_m_per_s.is_finite() && (position - last.1).norm() > IMPOSSIBLE_M_PER_S * elapsed_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn faster_than_the_limit_is_a_fault_and_just_below_is_none() {
        for (v, is_fault) in [(0.99, false), (1.01, true)] {
            let mut speed = Speed::new(1.0, MS);
            let mut faults = 0;
            for tick in 1..20u64 {
                let seen = speed.observe(tick, Vector3::x() * v * tick as f64 * 1e-3, Vector3::x() * v);
                faults += usize::from(seen == Err(FaultReason::Overspeed));
            }
            assert_eq!(faults > 0, is_fault, "{v} m/s");
        }
    }

    #[test]
    fn a_jump_is_a_fault_of_its_own_once_whatever_the_estimate_makes_of_it() {
        let mut speed = Speed::new(2.0, MS);
        speed.observe(1, Vector3::zeros(), Vector3::zeros()).unwrap();
        speed.observe(2, Vector3::zeros(), Vector3::zeros()).unwrap();
        let (there, seen) = (Vector3::x() * 0.1, Vector3::x() * 100.0);
        assert_eq!(speed.observe(3, there, seen), Err(FaultReason::PositionJump));
        assert_eq!(speed.observe(4, there, Vector3::zeros()), Ok(()));
    }

    #[test]
    fn many_skipped_ticks_are_time_to_get_anywhere() {
        let mut speed = Speed::new(2.0, MS);
        speed.observe(1, Vector3::zeros(), Vector3::zeros()).unwrap();
        assert_eq!(speed.observe(101, Vector3::x() * 0.1, Vector3::x()), Ok(()));
    }

    #[test]
    fn what_is_forgotten_is_not_jumped_from() {
        let mut speed = Speed::new(2.0, MS);
        speed.observe(1, Vector3::zeros(), Vector3::zeros()).unwrap();
        speed.forget();
        assert_eq!(speed.observe(2, Vector3::x() * 0.1, Vector3::zeros()), Ok(()));
    }

    #[test]
    fn a_device_without_limit_may_jump() {
        let mut speed = Speed::new(f64::INFINITY, MS);
        speed.observe(1, Vector3::zeros(), Vector3::zeros()).unwrap();
        assert!(speed.observe(2, Vector3::x() * 0.5, Vector3::x() * 500.0).is_ok());
    }
}
