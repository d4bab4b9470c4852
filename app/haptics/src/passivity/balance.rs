//! Energy balance of a part of the force: fed into the hand and not paid for.

/// One account.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Balance {
    /// Energy fed and not paid for (J); negative: credit.
    unpaid_j: f64,
    /// Energy of the springs in the last tick (J).
    stored_j: f64,
}

/// An interval between two ticks, as an account sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Interval {
    /// Energy fed (J); negative: taken.
    pub(super) fed_j: f64,
    /// Payment of a debt (J).
    pub(super) paid_j: f64,
    /// Energy of the springs now (J).
    pub(super) stored_j: f64,
    /// Whether forces act a tick after they were chosen.
    pub(super) is_late: bool,
}

impl Balance {
    /// (J).
    pub(super) fn unpaid_j(&self) -> f64 {
        self.unpaid_j
    }

    /// Sums an interval up.
    pub(super) fn take(&mut self, interval: &Interval, bound_j: f64) {
        if !interval.fed_j.is_nan() {
            self.unpaid_j += interval.fed_j;
        }
        // A debt becomes smaller, and no credit.
        if self.unpaid_j > 0.0 {
            self.unpaid_j = (self.unpaid_j - interval.paid_j).max(0.0);
        }
        let before_j = std::mem::replace(&mut self.stored_j, interval.stored_j);
        // A force that is on its way was the springs' when it was chosen.
        let credit_j = if interval.is_late { self.stored_j.max(before_j) } else { self.stored_j };
        self.unpaid_j = self.unpaid_j.max(-credit_j).min(bound_j);
    }

    /// Energy that may be fed from now on (J), with nothing on its way.
    pub(super) fn budget_j(&self, bound_j: f64) -> f64 {
        bound_j - self.unpaid_j
    }

    /// The same beside what is on its way and may feed so much (J), which has been paid for in the tick before.
    pub(super) fn budget_beside_j(&self, due_j: f64, bound_j: f64) -> f64 {
        (self.budget_j(bound_j) - due_j.max(0.0)).clamp(0.0, bound_j + self.stored_j)
    }

    /// Credit is lost, debts stay.
    pub(super) fn forget(&mut self) {
        *self = Self { unpaid_j: self.unpaid_j.max(0.0), stored_j: 0.0 };
    }
}
