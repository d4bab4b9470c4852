//! How fast the tip moves, and when that is a fault.
//!
//! Problem: an arm that nobody holds and that is driven the wrong way accelerates within milliseconds; a
//! broken encoder jumps. Both have to be seen from positions that come in steps of 0.03 mm.
//! Model: the mean velocity over a window of some ticks, (p_k - p_j) / (t_k - t_j): a step of the encoder
//! counts as 0.03 mm over the whole window, 7 mm/s for 4 ms. It lags by half the window. A jump is a
//! position that nothing could have reached since the last one.
//! Invariants: time is counted in ticks of the schedule, so skipped ones do not make a movement look fast. A tick
//! in which the loop steps aside ([`rt_core::phase_keeper`]) is 0.38 of a period longer than it counts: for one window
//! of four ticks a movement then looks a tenth faster than it is.
//! Cost: constant; no allocation.

use nalgebra::Vector3;
use shm_abi::FaultReason;

/// Length of the window (ns). Short against the 20 ms in which a runaway arm of 100 g under 8 N reaches
/// 1.6 m/s, long against encoder steps.
const WINDOW_NS: u64 = 4_000_000;
/// Places for positions: enough for the window at 16 kHz.
const PLACES: usize = 64;
/// Nothing at the end of an arm moves so fast (m/s): a stepped 8 N on 30 g for 0.1 s.
const IMPOSSIBLE_M_PER_S: f64 = 25.0;

/// The velocity of one tip and its limit.
#[derive(Debug, Clone)]
pub struct Speed {
    limit_m_per_s: f64,
    period_s: f64,
    window_ticks: u64,
    /// Tick and position, the newest at `newest`.
    places: [(u64, Vector3<f64>); PLACES],
    newest: usize,
    filled: usize,
}

impl Speed {
    /// A speed above the limit is a fault; infinite: none is, and neither is a jump.
    pub fn new(limit_m_per_s: f64, period_ns: u64) -> Self {
        let window_ticks = (WINDOW_NS / period_ns.max(1)).clamp(2, PLACES as u64 - 1);
        Self {
            limit_m_per_s,
            period_s: period_ns as f64 / 1e9,
            window_ticks,
            places: [(0, Vector3::zeros()); PLACES],
            newest: 0,
            filled: 0,
        }
    }

    /// Takes the position of a tick; returns the velocity (m/s), or that it is a fault.
    ///
    /// # Errors
    /// [`FaultReason::PositionJump`] and [`FaultReason::Overspeed`].
    pub fn observe(&mut self, tick: u64, position: Vector3<f64>) -> Result<Vector3<f64>, FaultReason> {
        let jumped = self.filled > 0 && self.has_jumped(tick, position);
        self.newest = (self.newest + 1) % PLACES;
        self.places[self.newest] = (tick, position);
        self.filled = (self.filled + 1).min(PLACES);
        let velocity = self.velocity();
        if jumped {
            // What came before is on the other side of the jump.
            self.filled = 1;
            return Err(FaultReason::PositionJump);
        }
        if velocity.norm() > self.limit_m_per_s { Err(FaultReason::Overspeed) } else { Ok(velocity) }
    }

    /// Forgets what was observed: the next position is not compared with it.
    pub fn forget(&mut self) {
        self.filled = 0;
    }

    fn has_jumped(&self, tick: u64, position: Vector3<f64>) -> bool {
        let (last_tick, last) = self.places[self.newest];
        let elapsed_s = tick.saturating_sub(last_tick).max(1) as f64 * self.period_s;
        self.limit_m_per_s.is_finite() && (position - last).norm() > IMPOSSIBLE_M_PER_S * elapsed_s
    }

    /// Over the youngest positions that span the window, or over all there are. A position that is older than
    /// the window because ticks were skipped is taken if there is no other.
    pub(super) fn velocity(&self) -> Vector3<f64> {
        let (tick, position) = self.places[self.newest];
        let mut oldest = (tick, position);
        for back in 1..self.filled {
            oldest = self.places[(self.newest + PLACES - back) % PLACES];
            if tick.saturating_sub(oldest.0) >= self.window_ticks {
                break;
            }
        }
        let elapsed_s = tick.saturating_sub(oldest.0) as f64 * self.period_s;
        if elapsed_s > 0.0 { (position - oldest.1) / elapsed_s } else { Vector3::zeros() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn the_velocity_of_a_steady_movement_is_exact_at_every_rate() {
        for period_ns in [MS, MS / 2, MS / 4, MS / 8, MS / 20, 100 * MS] {
            let mut speed = Speed::new(f64::INFINITY, period_ns);
            for tick in 1..200u64 {
                let at = Vector3::new(0.5, -0.2, 0.1) * (tick as f64 * period_ns as f64 / 1e9);
                let velocity = speed.observe(tick, at).unwrap();
                let expected = if tick == 1 { Vector3::zeros() } else { Vector3::new(0.5, -0.2, 0.1) };
                // Differences of positions up to 10 m over at least 1 ms: 2e-15 / 1e-3.
                assert!((velocity - expected).norm() < 1e-11, "{period_ns} {tick} {velocity}");
            }
        }
    }

    #[test]
    fn one_encoder_count_looks_like_seven_millimetres_a_second_for_a_window() {
        let mut speed = Speed::new(f64::INFINITY, MS);
        for tick in 1..10 {
            speed.observe(tick, Vector3::zeros()).unwrap();
        }
        let step = Vector3::new(29.2e-6, 0.0, 0.0);
        for tick in 10..14 {
            let velocity = speed.observe(tick, step).unwrap();
            assert!((velocity.x - 29.2e-6 / 4e-3).abs() < 1e-15);
        }
        assert_eq!(speed.observe(14, step).unwrap(), Vector3::zeros());
    }

    #[test]
    fn faster_than_the_limit_is_a_fault_and_just_below_is_none() {
        for (v, is_fault) in [(0.99, false), (1.01, true)] {
            let mut speed = Speed::new(1.0, MS);
            let mut faults = 0;
            for tick in 1..20u64 {
                let seen = speed.observe(tick, Vector3::x() * v * tick as f64 * 1e-3);
                faults += usize::from(seen == Err(FaultReason::Overspeed));
            }
            assert_eq!(faults > 0, is_fault, "{v} m/s");
        }
    }

    #[test]
    fn skipped_ticks_do_not_make_a_movement_look_fast() {
        let mut speed = Speed::new(1.0, MS);
        for tick in [1, 2, 3, 40, 41, 300, 301, 302] {
            let velocity = speed.observe(tick, Vector3::x() * 0.9 * tick as f64 * 1e-3).unwrap();
            assert!(tick == 1 || (velocity.x - 0.9).abs() < 1e-11);
        }
    }

    #[test]
    fn a_jump_is_a_fault_of_its_own_once() {
        let mut speed = Speed::new(2.0, MS);
        speed.observe(1, Vector3::zeros()).unwrap();
        speed.observe(2, Vector3::zeros()).unwrap();
        assert_eq!(speed.observe(3, Vector3::x() * 0.1), Err(FaultReason::PositionJump));
        assert_eq!(speed.observe(4, Vector3::x() * 0.1), Ok(Vector3::zeros()));
    }

    #[test]
    fn a_device_without_limit_may_jump() {
        let mut speed = Speed::new(f64::INFINITY, MS);
        speed.observe(1, Vector3::zeros()).unwrap();
        assert!(speed.observe(2, Vector3::x() * 0.5).is_ok());
    }
}
