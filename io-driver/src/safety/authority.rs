//! How much of the commanded force may reach the motors: the driver's state machine.
//!
//! Model: `Starting -> Zeroing -> Idle -> Active`, and from everywhere `Fault`. The share of the force that
//! is let through, the *authority*, is a level counted in nanoseconds of the ramp, so that full is exactly 1 and zero
//! exactly 0. A fresh reply raises it by the time since the last tick, but a period at most; a reply that is missing
//! while the last one is still young holds it; one that is too old, or a lease that ended, lowers it by all the time
//! since the last tick, on a ramp of its own; a fault drops it to zero at once. Where there is a dead-man's switch and
//! nobody holds it, the level sinks as for a reply that is too old, and rises again, from wherever it is, once it is
//! held.
//!
//! Time is that of [`Elapsed`]: what was skipped ends forces and lets none grow, and each tick ends them by a period at
//! least. A gap between two ticks is silence, however fresh the reply that follows: beyond the age that a command may have
//! it lowers the level, so that after a stop of the whole process the force begins anew. Amplifiers whose watchdogs let
//! go meanwhile hold nothing, and a hand does not wait.
//!
//! `Zeroing` is left by positions that are valid, entered by ones that are not: when a driver starts whose devices
//! have to be zeroed, and when a fault is cleared that cost them their zero.
//!
//! Invariants: authority is 0 unless a lease gave a valid command; it never rises by more than a period's part of the
//! ramp in a tick, and is gone `max_command_age + out` after the last reply, whatever ticks were skipped; a new lease
//! begins only after the former's force has ramped to zero; Fault is left only on request.
//! Cost: a few comparisons and a division a tick.

use super::elapsed::Elapsed;
use shm_abi::{DriverState, FaultReason, ReplyKind};

/// How fast authority comes and goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ramps {
    /// Time from none to all (ns); at least 1.
    pub in_ns: u64,
    /// Time from all to none (ns); at least 1.
    pub out_ns: u64,
    /// How old a command may be that still drives the motors (ns).
    pub max_command_age_ns: u64,
}

/// How old the newest valid command of a lease is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CommandAge {
    /// Ticks since the one that it answers.
    pub ticks: u64,
    /// Time since then (ns).
    pub ns: u64,
}

/// The state machine; one call of each method per tick.
#[derive(Debug)]
pub struct Safety {
    ramps: Ramps,
    /// 0 to `ramps.in_ns`.
    level_ns: u64,
    fault: FaultReason,
    positions_valid: bool,
    attended: bool,
    commanded: bool,
    run_started_at: Option<u64>,
}

impl Safety {
    /// A driver that has just been started.
    pub fn new(ramps: Ramps) -> Self {
        let ramps = Ramps { in_ns: ramps.in_ns.max(1), out_ns: ramps.out_ns.max(1), ..ramps };
        Self {
            ramps,
            level_ns: 0,
            fault: FaultReason::None,
            positions_valid: false,
            attended: true,
            commanded: false,
            run_started_at: None,
        }
    }

    /// The share of the force that is let through now, 0 to 1.
    pub fn authority(&self) -> f64 {
        self.level_ns as f64 / self.ramps.in_ns as f64
    }

    /// Whether nothing is let through.
    pub fn is_released(&self) -> bool {
        self.level_ns == 0
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
        if self.run_started_at.is_none() && self.level_ns == self.ramps.in_ns {
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

    /// What a reply means whose newest valid command is so old (`None`: this lease gave none yet), where one of
    /// `freshness` ticks ago is as fresh as they come.
    pub fn judge(&self, age: Option<CommandAge>, freshness: u64) -> ReplyKind {
        match age {
            Some(age) if age.ticks <= freshness => ReplyKind::Fresh,
            Some(age) if age.ns <= self.ramps.max_command_age_ns => ReplyKind::Held,
            _ => ReplyKind::Expired,
        }
    }

    /// Returns the authority for the motor values of a tick, so long after the former ones.
    pub fn advance(&mut self, reply: ReplyKind, elapsed: Elapsed) -> f64 {
        if self.fault != FaultReason::None || !self.positions_valid {
            self.release();
            return 0.0;
        }
        self.commanded = self.attended && matches!(reply, ReplyKind::Fresh | ReplyKind::Held);
        match reply {
            _ if !self.attended => self.sink(elapsed.passed_ns()),
            ReplyKind::Fresh => {
                self.sink(self.silent_ns(elapsed));
                self.rise(elapsed)
            }
            ReplyKind::Held => self.sink(self.silent_ns(elapsed)),
            ReplyKind::Expired | ReplyKind::NoLease => self.sink(elapsed.passed_ns()),
        }
    }

    /// For how long the motors held what was older than a command may be, in a gap before this tick.
    fn silent_ns(&self, elapsed: Elapsed) -> u64 {
        let skipped_ns = elapsed.passed_ns() - elapsed.growth_ns();
        skipped_ns.saturating_sub(self.ramps.max_command_age_ns)
    }

    /// What it gains counts for the next tick, so that a ramp begins at nothing.
    fn rise(&mut self, elapsed: Elapsed) -> f64 {
        let now = self.authority();
        self.level_ns = self.level_ns.saturating_add(elapsed.growth_ns()).min(self.ramps.in_ns);
        now
    }

    fn sink(&mut self, passed_ns: u64) -> f64 {
        let Ramps { in_ns, out_ns, .. } = self.ramps;
        // No more than the whole ramp, and rounded towards its end.
        let part = u128::from(passed_ns.min(out_ns)) * u128::from(in_ns);
        let step = part.div_ceil(u128::from(out_ns)) as u64;
        self.level_ns = self.level_ns.saturating_sub(step);
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
        self.level_ns = 0;
        self.commanded = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::SafetyConfig;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;
    const RAMPS: Ramps = Ramps { in_ns: 200 * MS, out_ns: 10 * MS, max_command_age_ns: 5 * MS };
    const TICK: Elapsed = Elapsed::new(MS, MS);

    fn active(ramps: Ramps) -> Safety {
        let mut safety = Safety::new(ramps);
        safety.set_positions_valid(true);
        safety.begin_lease();
        for _ in 0..ramps.in_ns.div_ceil(MS) {
            safety.advance(ReplyKind::Fresh, TICK);
        }
        assert_eq!(safety.authority(), 1.0);
        safety
    }

    fn age(ticks: u64, ns: u64) -> Option<CommandAge> {
        Some(CommandAge { ticks, ns })
    }

    #[test]
    fn authority_ramps_in_over_exactly_the_configured_ticks() {
        let mut safety = Safety::new(RAMPS);
        safety.set_positions_valid(true);
        safety.begin_lease();
        for tick in 0..200 {
            assert_eq!(safety.run_tick(tick), -1);
            let expected = tick as f64 / 200.0;
            assert_eq!(safety.advance(ReplyKind::Fresh, TICK), expected);
        }
        assert_eq!(safety.run_tick(200), 0, "t = 0 is the first tick at full authority");
        assert_eq!(safety.advance(ReplyKind::Fresh, TICK), 1.0);
        assert_eq!(safety.run_tick(201), 1);
    }

    #[test]
    fn a_held_command_keeps_the_force_and_an_expired_one_ramps_it_to_zero() {
        let mut safety = active(RAMPS);
        assert_eq!(safety.judge(age(0, 0), 0), ReplyKind::Fresh);
        assert_eq!(safety.judge(age(5, 5 * MS), 0), ReplyKind::Held);
        assert_eq!(safety.judge(age(5, 5 * MS + 1), 0), ReplyKind::Expired, "it is time that counts");
        assert_eq!(safety.judge(age(1, 6 * MS), 0), ReplyKind::Expired, "however few the ticks");
        assert_eq!(
            safety.judge(age(1, 6 * MS), 1),
            ReplyKind::Fresh,
            "as fresh as a reply to the last tick can be"
        );
        assert_eq!(safety.judge(age(2, 6 * MS), 1), ReplyKind::Expired);
        assert_eq!(safety.judge(None, 0), ReplyKind::Expired);
        for _ in 0..5 {
            assert_eq!(safety.advance(ReplyKind::Held, TICK), 1.0);
        }
        for tick in 1..=10 {
            let expected = 1.0 - f64::from(tick) / 10.0;
            // The levels are integers over 200: exact but for one rounding of the quotient.
            assert!((safety.advance(ReplyKind::Expired, TICK) - expected).abs() < 1e-15);
        }
        assert_eq!(safety.authority(), 0.0);
        assert_eq!(safety.state(), DriverState::Idle);
    }

    /// At 1 kHz and the default settings, as the safety page tells it: a tick without a reply waits for the reply's
    /// budget, half a tick, so that zero comes 9.5 ms after a reply at once.
    #[test]
    fn by_default_the_ninth_tick_without_a_reply_is_zero_and_the_fifth_costs_a_fifth() {
        let usual = SafetyConfig::usual(MS);
        let ramps = Ramps {
            in_ns: usual.ramp_in_ns,
            out_ns: usual.ramp_out_ns,
            max_command_age_ns: usual.max_command_age_ns,
        };
        let mut safety = active(ramps);
        let mut missed = |ticks: u64| safety.advance(safety.judge(age(ticks, ticks * MS), 0), TICK);
        let shares: Vec<f64> = (1..=10).map(&mut missed).collect();
        assert_eq!(shares, [1.0, 1.0, 1.0, 1.0, 0.8, 0.6, 0.4, 0.2, 0.0, 0.0]);
        // Back by a two hundredth a millisecond, from the tick after the first answer.
        for tick in 0..=200 {
            assert_eq!(safety.advance(ReplyKind::Fresh, TICK), f64::from(tick) / 200.0, "tick {tick}");
        }
    }

    #[test]
    fn the_ramp_out_ends_in_time_for_ramps_that_do_not_divide() {
        let mut safety = active(Ramps { in_ns: 7 * MS, out_ns: 3 * MS, max_command_age_ns: 0 });
        for _ in 0..3 {
            assert!(!safety.is_released());
            safety.advance(ReplyKind::NoLease, TICK);
        }
        assert!(safety.is_released());
    }

    #[test]
    fn skipped_time_ramps_a_force_out_and_none_in() {
        let long = |ms: u64| Elapsed::new(ms * MS, MS);
        let mut safety = active(RAMPS);
        assert_eq!(safety.advance(ReplyKind::Expired, long(4)), 0.6, "four of ten milliseconds");
        assert_eq!(safety.advance(ReplyKind::Fresh, long(6)), 0.6);
        assert_eq!(safety.authority(), 121.0 / 200.0, "one tick's part of the ramp, whatever was skipped");
        assert_eq!(safety.advance(ReplyKind::Held, long(6)), 121.0 / 200.0);
        assert_eq!(safety.advance(ReplyKind::NoLease, long(u64::MAX / MS)), 0.0);
        assert!(safety.is_released());
    }

    /// The whole process was stopped, or its CPU taken away, and the first reply is in time again.
    #[test]
    fn a_gap_is_silence_however_fresh_the_reply_that_follows() {
        let long = |ms: u64| Elapsed::new(ms * MS, MS);
        for reply in [ReplyKind::Fresh, ReplyKind::Held] {
            // A tick and the 5 ms that a command may be old are no silence; 10 ms more are all of the ramp.
            for (gap_ms, left) in [(1, 1.0), (6, 1.0), (7, 0.9), (11, 0.5), (16, 0.0), (3000, 0.0)] {
                let mut safety = active(RAMPS);
                assert_eq!(safety.advance(reply, long(gap_ms)), left, "{gap_ms} ms");
            }
        }
        let mut safety = active(RAMPS);
        safety.advance(ReplyKind::Fresh, long(u64::MAX / MS));
        assert_eq!(safety.advance(ReplyKind::Fresh, TICK), 1.0 / 200.0, "and it ramps in");
    }

    #[test]
    fn a_ramp_takes_the_same_time_at_every_rate() {
        for period_ns in [MS / 8, MS / 3, MS, 4 * MS] {
            let tick = Elapsed::new(period_ns, period_ns);
            let mut safety = Safety::new(RAMPS);
            safety.set_positions_valid(true);
            safety.begin_lease();
            for (reply, ramp_ns, end) in
                [(ReplyKind::Fresh, RAMPS.in_ns, 1.0), (ReplyKind::NoLease, RAMPS.out_ns, 0.0)]
            {
                for _ in 0..ramp_ns.div_ceil(period_ns) {
                    assert_ne!(safety.authority(), end, "{period_ns}");
                    safety.advance(reply, tick);
                }
                assert_eq!(safety.authority(), end, "{period_ns}");
            }
        }
    }

    #[test]
    fn the_time_of_a_run_begins_anew_with_each_lease() {
        let mut safety = active(RAMPS);
        assert_eq!((safety.run_tick(7), safety.run_tick(9)), (0, 2));
        for _ in 0..10 {
            safety.advance(ReplyKind::NoLease, TICK);
        }
        assert_eq!(safety.run_tick(19), 12, "until somebody else begins");
        safety.begin_lease();
        assert_eq!(safety.run_tick(20), -1);
        for _ in 0..200 {
            assert_eq!(safety.run_tick(21), -1);
            safety.advance(ReplyKind::Fresh, TICK);
        }
        assert_eq!((safety.run_tick(221), safety.run_tick(222)), (0, 1));
    }

    #[test]
    fn a_fault_is_zero_at_once_and_stays_until_it_is_cleared() {
        let mut safety = active(RAMPS);
        assert!(safety.enter_fault(FaultReason::DeviceRead));
        assert!(!safety.enter_fault(FaultReason::Panic), "the first reason stands");
        assert_eq!(safety.fault(), FaultReason::DeviceRead);
        for _ in 0..1000 {
            assert_eq!(safety.advance(ReplyKind::Fresh, TICK), 0.0);
            assert_eq!(safety.state(), DriverState::Fault);
        }
        assert!(!safety.enter_fault(FaultReason::EmergencyStop));
        assert_eq!(safety.fault(), FaultReason::EmergencyStop, "but a person's wish takes its place");
        assert!(!safety.enter_fault(FaultReason::Panic));
        assert_eq!(safety.fault(), FaultReason::EmergencyStop);
        safety.clear_fault();
        assert_eq!(safety.advance(ReplyKind::Fresh, TICK), 0.0, "and then it ramps in again");
        assert_eq!(safety.advance(ReplyKind::Fresh, TICK), 1.0 / 200.0);
    }

    #[test]
    fn nothing_is_let_through_while_a_position_is_unknown() {
        let mut safety = active(RAMPS);
        safety.set_positions_valid(false);
        assert_eq!(safety.advance(ReplyKind::Fresh, TICK), 0.0);
        assert_eq!(safety.state(), DriverState::Zeroing);
    }

    #[test]
    fn devices_may_be_zeroed_only_while_nobody_is_obeyed() {
        let mut safety = Safety::new(RAMPS);
        assert!(safety.may_zero(), "before anything is known");
        safety.set_positions_valid(true);
        safety.begin_lease();
        safety.advance(ReplyKind::Fresh, TICK);
        // The first tick of a ramp lets nothing through yet, and is one of somebody who is obeyed.
        assert_eq!((safety.state(), safety.may_zero()), (DriverState::Active, false));
        let mut safety = active(RAMPS);
        safety.advance(ReplyKind::Expired, TICK);
        assert_eq!((safety.state(), safety.may_zero()), (DriverState::Idle, false), "it still ramps out");
        for _ in 0..10 {
            safety.advance(ReplyKind::Expired, TICK);
        }
        assert!(safety.may_zero());
        let mut safety = active(RAMPS);
        safety.enter_fault(FaultReason::PositionJump);
        assert!(safety.may_zero());
        safety.set_positions_valid(false);
        safety.clear_fault();
        safety.advance(ReplyKind::Fresh, TICK);
        assert_eq!((safety.state(), safety.may_zero()), (DriverState::Zeroing, true));
    }

    #[test]
    fn a_dead_mans_switch_that_is_let_go_ramps_the_force_out_and_held_again_it_ramps_in() {
        let mut safety = active(RAMPS);
        safety.set_attended(false);
        for tick in 1..=10 {
            // As for an expired reply: integers over 200, one rounding of the quotient.
            assert!((safety.advance(ReplyKind::Fresh, TICK) - (1.0 - f64::from(tick) / 10.0)).abs() < 1e-15);
        }
        assert_eq!(safety.state(), DriverState::Idle);
        safety.set_attended(true);
        assert_eq!(safety.advance(ReplyKind::Fresh, TICK), 0.0);
        assert_eq!(safety.advance(ReplyKind::Fresh, TICK), 1.0 / 200.0);
        assert_eq!(safety.state(), DriverState::Active);
    }

    proptest! {
        /// What is skipped may end a force and never makes one; a driver that hears nothing is silent in time.
        #[test]
        fn authority_stays_in_range_falls_with_time_and_rises_by_a_tick_at_most(
            ticks in proptest::collection::vec((0u64..4, 0u64..20 * MS, any::<bool>()), 1..400),
            in_ns in 1..50 * MS,
            out_ns in 1..50 * MS,
        ) {
            let mut safety = Safety::new(Ramps { in_ns, out_ns, max_command_age_ns: 3 * MS });
            safety.set_positions_valid(true);
            let (mut former, mut sinking_ns) = (0.0, 0);
            for (word, passed_ns, attended) in ticks {
                safety.set_attended(attended);
                let reply = ReplyKind::from_word(word).expect("a kind");
                let elapsed = Elapsed::new(passed_ns, MS);
                let now = safety.advance(reply, elapsed);
                prop_assert!((0.0..=1.0).contains(&now));
                // A period's part of the ramp, and the rounding of two quotients.
                prop_assert!(now - former <= MS as f64 / in_ns as f64 + 1e-15);
                let sinks = !attended || matches!(reply, ReplyKind::Expired | ReplyKind::NoLease);
                sinking_ns = if sinks { sinking_ns + passed_ns } else { 0 };
                prop_assert!(sinking_ns < out_ns || now == 0.0, "{now} after {sinking_ns} of {out_ns}");
                former = now;
            }
        }
    }
}
