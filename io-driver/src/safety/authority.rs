//! How much of the commanded force may reach the motors: the driver's state machine.
//!
//! Model: `Starting -> Zeroing -> Idle -> Active`, and from everywhere `Fault`. The share of the force that
//! is let through, the *authority*, is a level counted in ramp ticks, so that full is exactly 1 and zero
//! exactly 0. A fresh reply raises it by one; a reply that is missing while the last one is still young
//! holds it; one that is too old, or a lease that ended, lowers it by a ramp of its own; a fault drops it to
//! zero at once. Where there is a dead-man's switch and nobody holds it, the level sinks as for a reply that is
//! too old, and rises again, from wherever it is, once it is held.
//!
//! `Zeroing` is left by positions that are valid, entered by ones that are not: when a driver starts whose devices
//! have to be zeroed, and when a fault is cleared that cost them their zero.
//!
//! Invariants: authority is 0 unless a lease gave a valid command; it never jumps up; a new lease begins
//! only after the former's force has ramped to zero; Fault is left only on request.
//! Cost: a few comparisons a tick.

use shm_abi::{DriverState, FaultReason, ReplyKind};

/// How fast authority comes and goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ramps {
    /// Ticks from none to all; at least 1.
    pub in_ticks: u64,
    /// Ticks from all to none; at least 1.
    pub out_ticks: u64,
    /// How many ticks an old command may still drive the motors.
    pub max_command_age_ticks: u64,
}

/// The state machine; one call of each method per tick.
#[derive(Debug)]
pub struct Safety {
    ramps: Ramps,
    /// 0 to `ramps.in_ticks`.
    level: u64,
    fault: FaultReason,
    positions_valid: bool,
    attended: bool,
    commanded: bool,
    run_started_at: Option<u64>,
}

impl Safety {
    /// A driver that has just been started.
    pub fn new(ramps: Ramps) -> Self {
        let ramps = Ramps { in_ticks: ramps.in_ticks.max(1), out_ticks: ramps.out_ticks.max(1), ..ramps };
        Self {
            ramps,
            level: 0,
            fault: FaultReason::None,
            positions_valid: false,
            attended: true,
            commanded: false,
            run_started_at: None,
        }
    }

    /// The share of the force that is let through now, 0 to 1.
    pub fn authority(&self) -> f64 {
        self.level as f64 / self.ramps.in_ticks as f64
    }

    /// Whether nothing is let through.
    pub fn is_released(&self) -> bool {
        self.level == 0
    }

    /// The state that the frame tells.
    pub fn state(&self) -> DriverState {
        match (self.fault, self.positions_valid, self.commanded) {
            (FaultReason::None, false, _) => DriverState::Zeroing,
            (FaultReason::None, true, true) => DriverState::Active,
            (FaultReason::None, true, false) => DriverState::Idle,
            _ => DriverState::Fault,
        }
    }

    /// Whether devices may be zeroed: nothing is let through, and nobody is being obeyed who could count on the
    /// positions that will change.
    pub fn may_zero(&self) -> bool {
        self.is_released() && !self.commanded
    }

    /// Why it is in the fault state.
    pub fn fault(&self) -> FaultReason {
        self.fault
    }

    /// Says whether every device knows where it is. Call before the frame is published.
    pub fn set_positions_valid(&mut self, valid: bool) {
        self.positions_valid = valid;
    }

    /// Says whether a dead-man's switch is held, or there is none. Call before the frame is published.
    pub fn set_attended(&mut self, attended: bool) {
        self.attended = attended;
    }

    /// Ticks since this lease first had full authority, counted at the start of `tick`; -1 before.
    pub fn run_tick(&mut self, tick: u64) -> i64 {
        if self.run_started_at.is_none() && self.level == self.ramps.in_ticks {
            self.run_started_at = Some(tick);
        }
        self.run_started_at.map_or(-1, |start| tick.wrapping_sub(start) as i64)
    }

    /// A new lease begins; the former's force is gone by then.
    pub fn begin_lease(&mut self) {
        debug_assert!(self.is_released());
        self.run_started_at = None;
        self.commanded = false;
    }

    /// What a reply means whose newest valid command is `age` ticks old (`None`: this lease gave none yet).
    pub fn judge(&self, age: Option<u64>, freshness: u64) -> ReplyKind {
        match age {
            Some(age) if age <= freshness => ReplyKind::Fresh,
            Some(age) if age <= self.ramps.max_command_age_ticks => ReplyKind::Held,
            _ => ReplyKind::Expired,
        }
    }

    /// Returns the authority for this tick's motor values, and moves on to the next tick's.
    pub fn advance(&mut self, reply: ReplyKind) -> f64 {
        if self.fault != FaultReason::None || !self.positions_valid {
            self.release();
            return 0.0;
        }
        self.commanded = self.attended && matches!(reply, ReplyKind::Fresh | ReplyKind::Held);
        match reply {
            _ if !self.attended => self.sink(),
            ReplyKind::Fresh => {
                let now = self.authority();
                self.level = (self.level + 1).min(self.ramps.in_ticks);
                now
            }
            ReplyKind::Held => self.authority(),
            ReplyKind::Expired | ReplyKind::NoLease => self.sink(),
        }
    }

    fn sink(&mut self) -> f64 {
        let step = self.ramps.in_ticks.div_ceil(self.ramps.out_ticks);
        self.level = self.level.saturating_sub(step);
        self.authority()
    }

    /// Enters the fault state; returns whether that is new. The first reason stands, save that an emergency stop
    /// takes the place of any: who would leave another fault has to see that somebody wants it off.
    pub fn enter_fault(&mut self, reason: FaultReason) -> bool {
        self.release();
        let new = self.fault == FaultReason::None;
        if new || reason == FaultReason::EmergencyStop {
            self.fault = reason;
        }
        new
    }

    /// Leaves the fault state; authority begins at zero again.
    pub fn clear_fault(&mut self) {
        self.fault = FaultReason::None;
    }

    fn release(&mut self) {
        self.level = 0;
        self.commanded = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const RAMPS: Ramps = Ramps { in_ticks: 200, out_ticks: 10, max_command_age_ticks: 5 };

    fn active(ramps: Ramps) -> Safety {
        let mut safety = Safety::new(ramps);
        safety.set_positions_valid(true);
        safety.begin_lease();
        for _ in 0..ramps.in_ticks {
            safety.advance(ReplyKind::Fresh);
        }
        safety
    }

    #[test]
    fn authority_ramps_in_over_exactly_the_configured_ticks() {
        let mut safety = Safety::new(RAMPS);
        safety.set_positions_valid(true);
        safety.begin_lease();
        for tick in 0..200 {
            assert_eq!(safety.run_tick(tick), -1);
            let expected = tick as f64 / 200.0;
            assert_eq!(safety.advance(ReplyKind::Fresh), expected);
        }
        assert_eq!(safety.run_tick(200), 0, "t = 0 is the first tick at full authority");
        assert_eq!(safety.advance(ReplyKind::Fresh), 1.0);
        assert_eq!(safety.run_tick(201), 1);
    }

    #[test]
    fn a_held_command_keeps_the_force_and_an_expired_one_ramps_it_to_zero() {
        let mut safety = active(RAMPS);
        assert_eq!(safety.judge(Some(0), 0), ReplyKind::Fresh);
        assert_eq!(safety.judge(Some(5), 0), ReplyKind::Held);
        assert_eq!(safety.judge(Some(6), 0), ReplyKind::Expired);
        assert_eq!(safety.judge(None, 0), ReplyKind::Expired);
        for _ in 0..5 {
            assert_eq!(safety.advance(ReplyKind::Held), 1.0);
        }
        for tick in 1..=10 {
            let expected = 1.0 - f64::from(tick) / 10.0;
            // The levels are integers over 200: exact but for one rounding of the quotient.
            assert!((safety.advance(ReplyKind::Expired) - expected).abs() < 1e-15);
        }
        assert_eq!(safety.authority(), 0.0);
        assert_eq!(safety.state(), DriverState::Idle);
    }

    #[test]
    fn the_ramp_out_ends_in_time_for_ramps_that_do_not_divide() {
        let mut safety = active(Ramps { in_ticks: 7, out_ticks: 3, max_command_age_ticks: 0 });
        for _ in 0..3 {
            safety.advance(ReplyKind::NoLease);
        }
        assert!(safety.is_released());
    }

    #[test]
    fn a_fault_is_zero_at_once_and_stays_until_it_is_cleared() {
        let mut safety = active(RAMPS);
        assert!(safety.enter_fault(FaultReason::DeviceRead));
        assert!(!safety.enter_fault(FaultReason::Panic), "the first reason stands");
        assert_eq!(safety.fault(), FaultReason::DeviceRead);
        for _ in 0..1000 {
            assert_eq!(safety.advance(ReplyKind::Fresh), 0.0);
            assert_eq!(safety.state(), DriverState::Fault);
        }
        assert!(!safety.enter_fault(FaultReason::EmergencyStop));
        assert_eq!(safety.fault(), FaultReason::EmergencyStop, "but a person's wish takes its place");
        assert!(!safety.enter_fault(FaultReason::Panic));
        assert_eq!(safety.fault(), FaultReason::EmergencyStop);
        safety.clear_fault();
        assert_eq!(safety.advance(ReplyKind::Fresh), 0.0, "and then it ramps in again");
        assert_eq!(safety.advance(ReplyKind::Fresh), 1.0 / 200.0);
    }

    #[test]
    fn nothing_is_let_through_while_a_position_is_unknown() {
        let mut safety = active(RAMPS);
        safety.set_positions_valid(false);
        assert_eq!(safety.advance(ReplyKind::Fresh), 0.0);
        assert_eq!(safety.state(), DriverState::Zeroing);
    }

    #[test]
    fn devices_may_be_zeroed_only_while_nobody_is_obeyed() {
        let mut safety = Safety::new(RAMPS);
        assert!(safety.may_zero(), "before anything is known");
        safety.set_positions_valid(true);
        safety.begin_lease();
        safety.advance(ReplyKind::Fresh);
        // The first tick of a ramp lets nothing through yet, and is one of somebody who is obeyed.
        assert_eq!((safety.state(), safety.may_zero()), (DriverState::Active, false));
        let mut safety = active(RAMPS);
        safety.advance(ReplyKind::Expired);
        assert_eq!((safety.state(), safety.may_zero()), (DriverState::Idle, false), "it still ramps out");
        for _ in 0..10 {
            safety.advance(ReplyKind::Expired);
        }
        assert!(safety.may_zero());
        let mut safety = active(RAMPS);
        safety.enter_fault(FaultReason::PositionJump);
        assert!(safety.may_zero());
        safety.set_positions_valid(false);
        safety.clear_fault();
        safety.advance(ReplyKind::Fresh);
        assert_eq!((safety.state(), safety.may_zero()), (DriverState::Zeroing, true));
    }

    #[test]
    fn a_dead_mans_switch_that_is_let_go_ramps_the_force_out_and_held_again_it_ramps_in() {
        let mut safety = active(RAMPS);
        safety.set_attended(false);
        for tick in 1..=10 {
            // As for an expired reply: integers over 200, one rounding of the quotient.
            assert!((safety.advance(ReplyKind::Fresh) - (1.0 - f64::from(tick) / 10.0)).abs() < 1e-15);
        }
        assert_eq!(safety.state(), DriverState::Idle);
        safety.set_attended(true);
        assert_eq!(safety.advance(ReplyKind::Fresh), 0.0);
        assert_eq!(safety.advance(ReplyKind::Fresh), 1.0 / 200.0);
        assert_eq!(safety.state(), DriverState::Active);
    }

    proptest! {
        #[test]
        fn authority_stays_in_range_and_never_jumps_up(
            replies in proptest::collection::vec(0u64..4, 1..400),
            in_ticks in 1u64..50,
            out_ticks in 1u64..50,
        ) {
            let mut safety = Safety::new(Ramps { in_ticks, out_ticks, max_command_age_ticks: 3 });
            safety.set_positions_valid(true);
            let mut former = 0.0;
            for word in replies {
                let now = safety.advance(ReplyKind::from_word(word).expect("a kind"));
                prop_assert!((0.0..=1.0).contains(&now));
                // One level, and the rounding of two quotients.
                prop_assert!(now - former <= 1.0 / in_ticks as f64 + 1e-15);
                former = now;
            }
        }
    }
}
