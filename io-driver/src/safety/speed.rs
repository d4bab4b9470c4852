//! How fast the tip may move, and which of its positions are impossible.
//!
//! Problem: an arm that nobody holds and that is driven the wrong way accelerates within milliseconds; a
//! broken encoder jumps. Both have to be seen from positions that come in steps of 0.03 mm.
//! Model: the speed is that of the device's own estimate (see [`crate::velocity`]), which is on time where something
//! accelerates and which one encoder count hardly moves. A jump is a position that nothing could have reached since
//! the last one; it is looked for in the positions, which no estimate has smoothed.
//! Invariants: it is time that counts, so ticks that were skipped do not make a movement look fast.
//! Cost: constant; no allocation.

use nalgebra::Vector3;
use shm_abi::FaultReason;

/// Nothing at the end of an arm moves so fast (m/s): a stepped 8 N on 30 g for 0.1 s.
const IMPOSSIBLE_M_PER_S: f64 = 25.0;

/// The limit of one tip's speed.
#[derive(Debug, Clone)]
pub struct Speed {
    limit_m_per_s: f64,
    last: Option<Vector3<f64>>,
    /// Time since then (ns) in which it could not be read.
    unseen_ns: u64,
}

impl Speed {
    /// A speed above the limit is a fault; infinite: none is, and neither is a jump.
    pub fn new(limit_m_per_s: f64) -> Self {
        Self { limit_m_per_s, last: None, unseen_ns: 0 }
    }

    /// Takes the position (m) and the estimated velocity (m/s), so long (ns) after the last ones.
    ///
    /// # Errors
    /// [`FaultReason::PositionJump`] and [`FaultReason::Overspeed`].
    pub fn observe(
        &mut self,
        elapsed_ns: u64,
        position: Vector3<f64>,
        velocity: Vector3<f64>,
    ) -> Result<(), FaultReason> {
        let last = self.last.replace(position);
        let elapsed_ns = elapsed_ns.saturating_add(std::mem::take(&mut self.unseen_ns));
        if last.is_some_and(|last| self.has_jumped(position - last, elapsed_ns)) {
            return Err(FaultReason::PositionJump);
        }
        if velocity.norm() > self.limit_m_per_s { Err(FaultReason::Overspeed) } else { Ok(()) }
    }

    /// It could not be read for so long (ns): the next position may be the farther from the last one.
    pub fn overlook(&mut self, elapsed_ns: u64) {
        self.unseen_ns = self.unseen_ns.saturating_add(elapsed_ns);
    }

    /// Forgets what was observed: the next position is not compared with it.
    pub fn forget(&mut self) {
        self.last = None;
        self.unseen_ns = 0;
    }

    fn has_jumped(&self, way: Vector3<f64>, elapsed_ns: u64) -> bool {
        let elapsed_s = elapsed_ns as f64 / 1e9;
        self.limit_m_per_s.is_finite() && way.norm() > IMPOSSIBLE_M_PER_S * elapsed_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn faster_than_the_limit_is_a_fault_and_just_below_is_none() {
        for (v, is_fault) in [(0.99, false), (1.01, true)] {
            let mut speed = Speed::new(1.0);
            let mut faults = 0;
            for tick in 1..20u64 {
                let seen = speed.observe(MS, Vector3::x() * v * tick as f64 * 1e-3, Vector3::x() * v);
                faults += usize::from(seen == Err(FaultReason::Overspeed));
            }
            assert_eq!(faults > 0, is_fault, "{v} m/s");
        }
    }

    #[test]
    fn exactly_the_limit_is_none() {
        assert_eq!(Speed::new(1.0).observe(MS, Vector3::zeros(), Vector3::y()), Ok(()));
    }

    #[test]
    fn a_jump_is_a_fault_of_its_own_once_whatever_the_estimate_makes_of_it() {
        let mut speed = Speed::new(2.0);
        speed.observe(MS, Vector3::zeros(), Vector3::zeros()).unwrap();
        speed.observe(MS, Vector3::zeros(), Vector3::zeros()).unwrap();
        let (there, seen) = (Vector3::x() * 0.1, Vector3::x() * 100.0);
        assert_eq!(speed.observe(MS, there, seen), Err(FaultReason::PositionJump));
        assert_eq!(speed.observe(MS, there, Vector3::zeros()), Ok(()));
    }

    #[test]
    fn skipped_ticks_are_time_to_get_somewhere_and_no_time_is_none() {
        let mut speed = Speed::new(2.0);
        speed.observe(MS, Vector3::zeros(), Vector3::zeros()).unwrap();
        assert_eq!(speed.observe(100 * MS, Vector3::x() * 0.1, Vector3::x()), Ok(()));
        // 25 m/s for 4 ms are 0.1 m.
        assert_eq!(speed.observe(4 * MS, Vector3::x() * 0.199, Vector3::x()), Ok(()));
        let back = speed.observe(4 * MS, Vector3::x() * 0.098, Vector3::x());
        assert_eq!(back, Err(FaultReason::PositionJump), "101 mm");
        assert_eq!(speed.observe(0, Vector3::x() * 0.098, Vector3::zeros()), Ok(()));
        assert!(speed.observe(0, Vector3::x() * 0.099, Vector3::zeros()).is_err());
    }

    #[test]
    fn time_in_which_it_could_not_be_read_counts_as_well() {
        let mut speed = Speed::new(2.0);
        speed.observe(MS, Vector3::zeros(), Vector3::zeros()).unwrap();
        (0..3).for_each(|_| speed.overlook(MS));
        // 25 m/s for 4 ms are 0.1 m.
        assert_eq!(speed.observe(MS, Vector3::x() * 0.099, Vector3::zeros()), Ok(()));
        assert!(speed.observe(MS, Vector3::zeros(), Vector3::zeros()).is_err(), "and only once");
    }

    #[test]
    fn what_is_forgotten_is_not_jumped_from() {
        let mut speed = Speed::new(2.0);
        speed.observe(MS, Vector3::zeros(), Vector3::zeros()).unwrap();
        speed.forget();
        assert_eq!(speed.observe(MS, Vector3::x() * 0.1, Vector3::zeros()), Ok(()));
    }

    #[test]
    fn a_device_without_limit_may_jump() {
        let mut speed = Speed::new(f64::INFINITY);
        speed.observe(MS, Vector3::zeros(), Vector3::zeros()).unwrap();
        assert!(speed.observe(MS, Vector3::x() * 0.5, Vector3::x() * 500.0).is_ok());
    }
}
