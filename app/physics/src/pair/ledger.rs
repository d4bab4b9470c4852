//! What the springs of a pair hold: never more than what was put into them.
//!
//! Problem: how deep a contact point is, is a matter of geometry, and geometry does not ask for the work. A corner that comes
//! out from behind an edge is deep at once; the lowest point of a rim goes along the rim while the body turns; a point on an
//! arm that turns is by `omega^2 r dt^2 / 2` from where its velocity has it. A spring that is as long as the geometry says
//! is stretched by nobody then, and what it gives back comes from nowhere.
//!
//! Model: a pair keeps account of what its springs hold, along the normals and across them. In a tick its forces work W on the
//! bodies; afterwards the springs may hold what they held less W: what dampers, friction and the tick itself took is in
//! there. If the points, as deep as they are, would hold more, those that are deeper than their force has worked against
//! press with a part of that. They get it back from what dampers and friction take later, so that whatever has come to rest
//! rests on all of its depth.
//! What bodies that are placed into each other hold is theirs: it is in the account when the pair begins, and let out slowly.
//!
//! Invariant: kinetic energy, gravity's and all accounts', less what bodies owe, never grow by what contacts do, however
//! they begin and end; only work that is put in from outside adds to them.
//!
//! Why (each step has its test in `tests/all/ledger.rs`):
//! 1. *No account goes below zero.* A tick's forces work with the velocities that they were found with. A spring that begins it
//!    with force r and ends it with f <= r works `f (r - f) / k` at most, with a damper or at the limit of friction less: half of
//!    what it held, `r^2 / 2k`, at most. What presses is never more than the account. So a pair that ends has nothing to be
//!    forgiven, and what it loses is lost. (Where no answer was found a force may be another one; what it gave too much is owed
//!    as in 3.)
//! 2. *What bodies get is what pairs give, less what the tick takes.* The tick turns that work into kinetic energy and height but
//!    for half of the mass times the velocity's change squared, and the like of turning: `dw J dw / 2`, which it takes. That
//!    is refunded to pairs that do not press with all of their depth, never more than once.
//! 3. *What turning gives is owed.* Bodies of uneven inertia turn faster in the tick by d than when it begins: they get
//!    `-dw J (dw / 2 + d)`, `d J d / 2` at most, for nothing. The body owes that, not the pair: it is kept while it flies, sleeps
//!    or changes hands, and is paid with what the next ticks take, and by the next pair that holds anything. Whoever turns evenly
//!    never owes.
//! 4. *Accounts begin empty*, unless somebody from outside has put one of both there ([`Pair::was_put`](super::Pair::was_put)):
//!    not where a body has come by itself, however deep it is found.
//! 5. *What impulses put in is owed*, beyond what the tick took: beside a spring an impulse may push the body into it, and the
//!    spring holds that; on an arm that turns it may give a little (`tests/all/energy.rs`).
//!
//! So mechanical energy is never above what it began with and what was put in by more than what is owed at the time; and that is
//! never forgiven. What is not in there: that axes turn under an angular momentum that stands still makes kinetic energy swing by
//! itself (`integrator/midpoint.rs`). It holds for the `implicit` integrator; that impulses alone work on nothing is shown in
//! `restitution/bounce.rs`.

use crate::collide::MAX_POINTS;

/// The account of a pair.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ledger {
    /// What its springs may hold \[J\].
    held_j: f64,
    /// What they would hold at their full length \[J\], when they were last seen.
    full_j: f64,
    /// The account is cut to this \[J\].
    most_j: f64,
    /// Whether there is something that has not been paid for.
    owes: bool,
    lets_out: bool,
}

/// Squares of how far springs are stretched \[m^2\]: as geometry has it, and as the work has it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Stretched {
    pub(super) found: f64,
    pub(super) worked: f64,
}

impl Ledger {
    /// Enters what its springs worked on the bodies in the tick \[J\].
    pub(super) fn enter(&mut self, work_j: f64) {
        self.held_j -= if work_j.is_finite() { work_j } else { 0.0 };
    }

    /// Loses a part of what it holds beyond this \[J\], of what dampers and friction took: where points stand for others that come and
    /// go, all of it would be spent on them, and what rocks would rock for ever.
    pub(super) fn lose_beyond(&mut self, worked_j: f64) {
        self.held_j -= LOST * (self.held_j - worked_j).max(0.0);
    }

    /// Pays what a body owes, as far as it goes; says what is left of that \[J\].
    pub(super) fn pay(&mut self, owed_j: f64) -> f64 {
        let paid_j = owed_j.min(self.held_j.max(0.0));
        self.held_j -= paid_j;
        owed_j - paid_j
    }

    /// What it has given that it did not have \[J\]: that is somebody else's to pay.
    pub(super) fn take_debt(&mut self) -> f64 {
        let debt_j = (-self.held_j).max(0.0);
        self.held_j += debt_j;
        debt_j
    }

    /// Enters what is left over elsewhere \[J\].
    pub(super) fn refund(&mut self, spare_j: f64) {
        self.held_j += spare_j;
    }

    /// Whether something has not been paid for.
    pub(super) fn owes(&self) -> bool {
        self.owes
    }

    /// What the springs may hold \[J\].
    pub(super) fn held_j(&self) -> f64 {
        self.held_j
    }

    /// Springs that begin with all that they hold at their full length \[J\], and whether they get it slowly.
    pub(super) fn of(full_j: f64, lets_out: bool) -> Self {
        Self { held_j: full_j, lets_out, ..Self::default() }
    }

    /// True while it holds more than anything has pressed: what was there from the start, and is let out.
    pub(super) fn lets_out(&self) -> bool {
        self.lets_out
    }

    /// Whether nothing was pressed when it was last seen: a contact that is lost while it is pressed may come back.
    pub(super) fn is_closed(&self) -> bool {
        self.full_j == 0.0
    }

    /// Cuts the account to what the springs would hold at their full length \[J\], as they are now or have been since
    /// something had to be paid for: what is taken while they are short may lengthen them when they press again.
    pub(super) fn cut(&mut self, full_j: f64, is_let_out: bool) {
        self.full_j = full_j;
        self.owes |= is_let_out;
        self.most_j = if self.owes { self.most_j.max(full_j) } else { full_j };
        self.held_j = self.held_j.min(self.most_j);
    }

    /// How far each spring may be stretched, in squares, if all have this stiffness (N/m).
    pub(super) fn allow(
        &mut self,
        springs: &[Stretched],
        stiffness_n_per_m: f64,
        is_let_out: bool,
    ) -> Allowed {
        let (mut sure, mut more) = (0.0, 0.0);
        for spring in springs {
            sure += spring.found.min(spring.worked);
            more += (spring.found - spring.worked).max(0.0);
        }
        let left = 2.0 * self.held_j / stiffness_n_per_m - sure;
        let allowed = if left >= more - ROUNDING * (sure + more) {
            Allowed::Everything
        } else if left >= 0.0 {
            Allowed::Beyond(left / more)
        } else {
            // Less than nothing is paid back by dampers first.
            Allowed::Only((1.0 + left / sure).max(0.0))
        };
        self.owes = is_let_out || allowed != Allowed::Everything;
        self.lets_out &= self.owes;
        allowed
    }
}

/// What of the springs' stretches the account pays for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Allowed {
    Everything,
    /// This share of what they are stretched beyond what was worked.
    Beyond(f64),
    /// This share of what was worked.
    Only(f64),
}

impl Allowed {
    /// The square of how far this spring may be stretched \[m^2\].
    pub(super) fn of(self, spring: &Stretched) -> f64 {
        match self {
            Self::Everything => spring.found,
            Self::Beyond(share) if spring.found > spring.worked => {
                spring.worked + (spring.found - spring.worked) * share
            }
            Self::Beyond(_) => spring.found,
            Self::Only(share) => spring.found.min(spring.worked) * share,
        }
    }
}

/// Along the normal, across it and in turning.
pub(super) const MAX_SPRINGS: usize = SPRINGS_OF_POINT * MAX_POINTS;
pub(super) const SPRINGS_OF_POINT: usize = 3;
/// Part of what is held beyond what was worked that is lost in a tick.
const LOST: f64 = 0.1;
/// Of sums of so many squares.
const ROUNDING: f64 = 1e-14;

#[cfg(test)]
mod tests {
    use super::*;

    const K: f64 = 800.0;

    fn holds_j(allowed: Allowed, springs: &[Stretched]) -> f64 {
        springs.iter().map(|spring| 0.5 * K * allowed.of(spring)).sum()
    }

    fn spring(found_m: f64, worked_m: f64) -> Stretched {
        Stretched { found: found_m * found_m, worked: worked_m * worked_m }
    }

    #[test]
    fn springs_hold_what_was_worked_and_of_more_what_is_left() {
        let springs = [spring(2e-3, 2e-3), spring(3e-3, 1e-3), spring(1e-3, 2e-3), spring(2e-3, 0.0)];
        let full_j: f64 = springs.iter().map(|spring| 0.5 * K * spring.found).sum();
        let sure_j: f64 = springs.iter().map(|spring| 0.5 * K * spring.found.min(spring.worked)).sum();
        for held_j in [0.0, 0.5 * sure_j, sure_j, 0.5 * (sure_j + full_j), full_j, 2.0 * full_j] {
            let mut ledger = Ledger::of(held_j, false);
            let allowed = ledger.allow(&springs, K, false);
            // Roundings of a few squares.
            let expected_j = held_j.min(full_j);
            assert!((holds_j(allowed, &springs) - expected_j).abs() < 1e-13 * full_j, "{held_j} {allowed:?}");
            assert!(springs.iter().all(|spring| allowed.of(spring) <= spring.found * (1.0 + 1e-15)));
            assert_eq!(ledger.owes(), held_j < full_j);
            if held_j >= sure_j {
                // What was worked for is not taken away for the sake of what was not.
                assert!(springs.iter().all(|s| allowed.of(s) >= s.found.min(s.worked) * (1.0 - 1e-15)));
            }
        }
    }

    #[test]
    fn what_is_owed_presses_with_nothing_and_is_paid_back_first() {
        let springs = [spring(2e-3, 1e-3)];
        let mut ledger = Ledger::of(-1e-3, false);
        assert_eq!(holds_j(ledger.allow(&springs, K, false), &springs), 0.0);
        ledger.refund(2e-3);
        let allowed = ledger.allow(&springs, K, false);
        assert!((holds_j(allowed, &springs) - 1e-3).abs() < 1e-18);
    }

    #[test]
    fn an_account_pays_what_it_has_and_hands_on_what_it_has_not() {
        let mut ledger = Ledger::of(3.0, false);
        assert_eq!(ledger.pay(1.0), 0.0);
        assert_eq!((ledger.pay(5.0), ledger.held_j()), (3.0, 0.0));
        ledger.enter(2.0);
        assert_eq!((ledger.take_debt(), ledger.held_j(), ledger.take_debt()), (2.0, 0.0, 0.0));
        ledger.enter(-2.0);
        ledger.enter(f64::NAN);
        assert_eq!((ledger.take_debt(), ledger.held_j()), (0.0, 2.0));
    }

    #[test]
    fn what_is_taken_while_springs_are_short_is_kept_as_long_as_something_is_not_paid_for() {
        let mut ledger = Ledger::of(1.0, false);
        ledger.cut(1.0, true);
        ledger.cut(0.2, true);
        assert_eq!(ledger.held_j(), 1.0);
        assert_eq!(ledger.allow(&[], K, false), Allowed::Everything);
        ledger.cut(0.2, false);
        assert_eq!(ledger.held_j(), 0.2);
    }
}
