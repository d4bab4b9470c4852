//! How warm a motor is, and how much current it may therefore have: the I2t model.
//!
//! Problem: a motor stands several times its continuous current for seconds, and burns in a minute. What it
//! stands depends on what it had before.
//! Model: heat flows from the winding through the housing to the air, two masses of which each follows the
//! square of the current with its own time constant,
//!
//! ```text
//! q = (i / i_continuous)^2,   tau_w dw/dt = q - w,   tau_h dh/dt = q - h,   rise = s w + (1 - s) h
//! ```
//!
//! where `s` is the winding's share of the thermal resistance. `rise` is in units of what the continuous
//! current reaches in the end: 1 is the rated temperature. For a current that stands between two calls the
//! solution is exact. Below a rise of 0.9 the amplifier's peak is allowed; from there to 1 the square of the
//! allowed current falls linearly to the one under which the rise stays (at most the continuous one; less while
//! a warm housing still warms a cooler winding), so the rise approaches 1 and never passes it.
//! A driver that starts cannot know what the motors had before. It takes the housing for as warm as it may be and the
//! winding for cool, which it is after a minute or so. One that starts again within seconds may therefore let the rise
//! pass 1 by the winding's share `s` at most, until the winding has cooled: some of its time constants.
//! Invariants: `rise` is finite and at least 0; the continuous current is always allowed to a motor that never
//! had more.
//! Cost: two exponentials if the time between two calls changes, else none.
//! Reference for the thermal network: data sheets of DC motors (thermal resistances and time constants).

/// The thermal numbers of a motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeatSpec {
    /// Current that it stands for ever (A).
    pub continuous_current_a: f64,
    /// How slowly the winding warms (s).
    pub winding_time_constant_s: f64,
    /// How slowly the housing warms (s).
    pub housing_time_constant_s: f64,
    /// The winding's share of the thermal resistance, 0 to 1.
    pub winding_share: f64,
}

/// A motor's warmth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heat {
    spec: HeatSpec,
    winding: f64,
    housing: f64,
    /// What is left of each after the last step, and the step (s) that this is for.
    decay: (f64, f64, f64),
}

/// From here on the allowed current falls.
const DERATING_BEGINS: f64 = 0.9;

impl Heat {
    /// A motor of which nobody knows what it had before.
    pub fn unknown(spec: HeatSpec) -> Self {
        Self { spec, winding: 0.0, housing: 1.0, decay: (1.0, 1.0, 0.0) }
    }

    /// A motor that has had no current for long.
    pub fn cold(spec: HeatSpec) -> Self {
        Self { housing: 0.0, ..Self::unknown(spec) }
    }

    /// Warmth: 0 is the air's, 1 the rated.
    pub fn rise(&self) -> f64 {
        let share = self.spec.winding_share;
        share * self.winding + (1.0 - share) * self.housing
    }

    /// The current (A) flowed for `dt_s`. A current that is not a number counts as none.
    pub fn flow(&mut self, current_a: f64, dt_s: f64) {
        if dt_s != self.decay.2 {
            let left = |tau_s: f64| (-dt_s / tau_s).exp();
            let spec = &self.spec;
            self.decay = (left(spec.winding_time_constant_s), left(spec.housing_time_constant_s), dt_s);
        }
        let ratio = current_a / self.spec.continuous_current_a;
        let target = if ratio.is_nan() { 0.0 } else { (ratio * ratio).min(1e6) };
        self.winding = target + (self.winding - target) * self.decay.0;
        self.housing = target + (self.housing - target) * self.decay.1;
    }

    /// The largest current (A) that it may have now, of an amplifier that gives `peak_a`.
    pub fn allowed_current_a(&self, peak_a: f64) -> f64 {
        let continuous = self.spec.continuous_current_a.min(peak_a);
        let room = ((1.0 - self.rise()) / (1.0 - DERATING_BEGINS)).clamp(0.0, 1.0);
        let least = continuous * continuous * self.steady_load().min(1.0);
        (least + (peak_a * peak_a - least) * room).sqrt()
    }

    /// The `q` under which the rise stays what it is now: what the two masses give off, by their shares.
    fn steady_load(&self) -> f64 {
        let HeatSpec { winding_time_constant_s, housing_time_constant_s, winding_share, .. } = self.spec;
        let of_winding = winding_share / winding_time_constant_s;
        let of_housing = (1.0 - winding_share) / housing_time_constant_s;
        (of_winding * self.winding + of_housing * self.housing) / (of_winding + of_housing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Maxon RE25: 3.1 K/W from winding to housing, 14 K/W from there to the air.
    const RE25: HeatSpec = HeatSpec {
        continuous_current_a: 1.24,
        winding_time_constant_s: 12.0,
        housing_time_constant_s: 612.0,
        winding_share: 3.1 / 17.1,
    };
    const PEAK_A: f64 = 5.5;

    #[test]
    fn warming_follows_the_closed_form_however_it_is_cut_into_steps() {
        for dt_s in [1e-3, 0.1, 1.0] {
            let mut heat = Heat::cold(RE25);
            for _ in 0..(60.0 / dt_s) as usize {
                heat.flow(2.0, dt_s);
            }
            let q = (2.0f64 / 1.24).powi(2);
            let s = RE25.winding_share;
            let closed =
                q * (s * (1.0 - (-60.0f64 / 12.0).exp()) + (1.0 - s) * (1.0 - (-60.0f64 / 612.0).exp()));
            // 60,000 steps of an ulp or two each: 60,000 * 4e-16.
            assert!((heat.rise() - closed).abs() < 1e-10, "{dt_s}: {} {closed}", heat.rise());
        }
    }

    #[test]
    fn the_continuous_current_is_allowed_for_ever_and_reaches_exactly_the_rated_warmth() {
        let mut heat = Heat::cold(RE25);
        for _ in 0..100_000 {
            assert!(heat.allowed_current_a(PEAK_A) >= 1.24);
            heat.flow(1.24, 1.0);
        }
        assert!((heat.rise() - 1.0).abs() < 1e-12, "after 160 time constants of the housing");
    }

    #[test]
    fn a_stalled_motor_is_cut_back_to_its_continuous_current_before_it_is_too_warm() {
        let mut heat = Heat::cold(RE25);
        let mut full_s: f64 = 0.0;
        let mut warmest: f64 = 0.0;
        for _ in 0..3_600_000 {
            let allowed = heat.allowed_current_a(PEAK_A);
            full_s += if allowed == PEAK_A { 1e-3 } else { 0.0 };
            heat.flow(allowed, 1e-3);
            warmest = warmest.max(heat.rise());
        }
        let q = (PEAK_A / 1.24f64).powi(2);
        let s = RE25.winding_share;
        let rise = q * (s * (1.0 - (-full_s / 12.0).exp()) + (1.0 - s) * (1.0 - (-full_s / 612.0).exp()));
        // The closed form reaches 0.9 in the tick in which full current ends; q dt / tau_w s is a tick's share.
        assert!((rise - 0.9).abs() < 3e-4, "{full_s} s at the peak");
        // Within a millisecond the rise gains at most q dt / tau_w s = 3e-4 beyond where derating would stop it.
        assert!(warmest < 1.0 + 3e-4, "{warmest}");
        assert!(
            (heat.allowed_current_a(PEAK_A) - 1.24).abs() < 0.02,
            "after an hour, near the continuous one"
        );
    }

    #[test]
    fn a_driver_that_starts_allows_a_short_peak_and_no_long_one() {
        let mut heat = Heat::unknown(RE25);
        assert_eq!(heat.allowed_current_a(PEAK_A), PEAK_A);
        for _ in 0..1000 {
            heat.flow(PEAK_A, 1e-3);
        }
        assert!(heat.allowed_current_a(PEAK_A) < PEAK_A, "after a second");
    }

    /// With the heat that it gives off it neither warms nor cools: the slope of the closed form's sum of exponentials,
    /// `s (q - w) / tau_w + (1 - s) (q - h) / tau_h`, is nothing.
    #[test]
    fn under_its_steady_load_the_rise_stays_what_it_is() {
        for spec in [RE25, HeatSpec { winding_time_constant_s: 3.0, winding_share: 0.7, ..RE25 }] {
            for (winding, housing) in [(0.0, 1.0), (1.0, 0.0), (2.0, 0.75), (0.3, 1.1), (0.0, 0.0)] {
                let heat = Heat { winding, housing, ..Heat::cold(spec) };
                let q = heat.steady_load();
                let (s, tau_w, tau_h) =
                    (spec.winding_share, spec.winding_time_constant_s, spec.housing_time_constant_s);
                let slope = s * (q - winding) / tau_w + (1.0 - s) * (q - housing) / tau_h;
                // Sums of quotients below one.
                assert!(slope.abs() < 1e-15, "{winding} {housing}: {slope}");
                // And that is what `flow` does: in a microsecond no more than its square.
                let mut later = heat;
                later.flow(spec.continuous_current_a * q.sqrt(), 1e-6);
                assert!((later.rise() - heat.rise()).abs() < 1e-12, "{winding} {housing}");
            }
        }
    }

    #[test]
    fn too_warm_it_is_allowed_the_current_under_which_it_stays_and_never_more_than_the_continuous_one() {
        // At a rise of 1 and more: the winding is cooler than the housing, or the other way round.
        for (winding, housing) in [(0.2, 1.3), (3.0, 0.6), (1.0, 1.0)] {
            let heat = Heat { winding, housing, ..Heat::cold(RE25) };
            assert!(heat.rise() >= 1.0);
            let stays_a = RE25.continuous_current_a * heat.steady_load().sqrt();
            let allowed_a = heat.allowed_current_a(PEAK_A);
            // A square and its root.
            assert!(
                (allowed_a - stays_a.min(RE25.continuous_current_a)).abs() < 1e-12,
                "{winding} {housing}"
            );
        }
        let derated = Heat { winding: 0.95, housing: 0.95, ..Heat::cold(RE25) };
        // Half way between the two squares.
        let least_a = RE25.continuous_current_a * 0.95f64.sqrt();
        let half_a = (0.5 * (least_a * least_a + PEAK_A * PEAK_A)).sqrt();
        assert!((derated.allowed_current_a(PEAK_A) - half_a).abs() < 1e-9);
        assert!(derated.allowed_current_a(0.5) <= 0.5, "an amplifier that gives less than the motor stands");
    }

    #[test]
    fn a_current_that_is_not_a_number_does_no_harm() {
        let mut heat = Heat::unknown(RE25);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            heat.flow(bad, 1e-3);
            assert!(heat.rise().is_finite() && (0.0..=PEAK_A).contains(&heat.allowed_current_a(PEAK_A)));
        }
    }

    proptest! {
        #[test]
        fn no_sequence_of_allowed_currents_makes_it_too_warm(
            shares in proptest::collection::vec((0.0..1.0f64, 1u32..5000), 1..60),
        ) {
            let mut heat = Heat::cold(RE25);
            for (share, ticks) in shares {
                for _ in 0..ticks {
                    heat.flow(share * heat.allowed_current_a(PEAK_A), 1e-3);
                    prop_assert!(heat.rise() < 1.0 + 3e-4);
                }
            }
        }
    }
}
