//! Stiffness of a contact that goes over faces of different stiffness.
//!
//! Problem: a finger that is pressed in deep on soft faces slides onto stiff ones; with their stiffness at that depth the
//! force would leap.
//!
//! Model: on stiffer faces the spring goes on with the normal force that it has, `k' (x - s) = k x`, x being the depth: it is
//! taken to be shorter by s. That is regained as the finger comes out, since s is never more than x, and at a tenth of the
//! way that it goes along the surface. On softer faces the stiffness falls no faster than lets the force fall by 50 N/s. The
//! force thus rises by no more than stiffness times way, and pressing in, crossing and coming out gives no energy but that of
//! the tenth of the way.
//!
//! Cost: two comparisons on an entity of one material.

/// Stiffness in effect, and the spring's shortening.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ContactStiffness {
    /// (N/m).
    in_effect_n_per_m: f64,
    /// Shortening of the spring (m).
    short_m: f64,
    /// Depth of the finger in the last tick (m).
    length_m: f64,
}

impl ContactStiffness {
    /// A contact begins on faces of this stiffness (N/m).
    pub(crate) fn new(stiffness_n_per_m: f64) -> Self {
        Self { in_effect_n_per_m: stiffness_n_per_m, short_m: 0.0, length_m: 0.0 }
    }

    /// The stiffness (N/m) of a tick that begins on faces of such, in which the finger goes so far along them.
    pub(crate) fn step(&mut self, of_faces_n_per_m: f64, along_m: f64, dt_s: f64) -> f64 {
        let Self { in_effect_n_per_m: k, short_m, length_m: x } = *self;
        let sprung_m = (x - short_m).max(0.0);
        if of_faces_n_per_m > k {
            self.short_m = x - k / of_faces_n_per_m * sprung_m;
            self.in_effect_n_per_m = of_faces_n_per_m;
        } else if of_faces_n_per_m < k {
            let by = if dt_s > 0.0 { FALLS_N_PER_S * dt_s / sprung_m } else { f64::INFINITY };
            self.in_effect_n_per_m = of_faces_n_per_m.max(k - by);
        }
        self.short_m = (self.short_m - REGAINED * along_m).max(0.0);
        self.in_effect_n_per_m
    }

    /// Factor of the force of a finger at this depth (m).
    pub(crate) fn share(&mut self, length_m: f64) -> f64 {
        self.length_m = length_m;
        self.short_m = self.short_m.min(length_m);
        if self.short_m > 0.0 { (length_m - self.short_m) / length_m } else { 1.0 }
    }

    /// By how much the force can rise in a tick in which the finger goes so far (m), beside what the spring does (N).
    pub(crate) fn regained_n(&self, way_m: f64) -> f64 {
        if self.short_m > 0.0 { self.in_effect_n_per_m * REGAINED * way_m } else { 0.0 }
    }
}

/// Rate at which a force falls on softer faces.
const FALLS_N_PER_S: f64 = 50.0;
/// Part of the finger's way that a short spring regains.
const REGAINED: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f64 = 1e-3;

    #[test]
    fn onto_stiffer_faces_the_force_goes_on_and_stays_below_what_the_way_explains() {
        let mut stiffness = ContactStiffness::new(500.0);
        stiffness.share(8e-3);
        assert_eq!(stiffness.step(2000.0, 0.0, DT_S), 2000.0);
        // 4 N, of 2000 N/m: 2 of the 8 mm.
        assert!((stiffness.share(8e-3) - 0.25).abs() < 1e-12);
        // Deeper by a millimetre, it is 2 N more.
        stiffness.step(2000.0, 0.0, DT_S);
        assert!((2000.0 * 9e-3 * stiffness.share(9e-3) - 6.0).abs() < 1e-9);
        // Along the surface by 10 mm, a millimetre of spring comes back.
        for _ in 0..100 {
            stiffness.step(2000.0, 1e-4, DT_S);
        }
        assert!((2000.0 * 9e-3 * stiffness.share(9e-3) - 8.0).abs() < 1e-9);
        // Out to 3 mm: there is nothing left, and from there on all of what comes.
        stiffness.step(2000.0, 0.0, DT_S);
        assert_eq!(stiffness.share(3e-3), 0.0);
        stiffness.step(2000.0, 0.0, DT_S);
        assert!((2000.0 * 4e-3 * stiffness.share(4e-3) - 2.0).abs() < 1e-9);
    }

    #[test]
    fn onto_softer_faces_the_force_falls_slowly() {
        let mut stiffness = ContactStiffness::new(2000.0);
        let mut force = 2000.0 * 4e-3 * stiffness.share(4e-3);
        let mut ticks = 0;
        while stiffness.in_effect_n_per_m > 500.0 {
            let now = stiffness.step(500.0, 0.0, DT_S) * 4e-3 * stiffness.share(4e-3);
            assert!(now < force && force - now < 0.05 + 1e-9, "{force} {now}");
            (force, ticks) = (now, ticks + 1);
        }
        // From 8 N to 2 N.
        assert!((force - 2.0).abs() < 1e-9 && ticks == 120, "{force} {ticks}");
        // Without time it is there at once.
        let mut stiffness = ContactStiffness::new(2000.0);
        stiffness.share(4e-3);
        assert_eq!(stiffness.step(500.0, 0.0, 0.0), 500.0);
    }

    #[test]
    fn a_contact_that_presses_nothing_takes_the_stiffness_of_its_faces_at_once() {
        for to in [100.0, 9000.0] {
            let mut stiffness = ContactStiffness::new(1000.0);
            stiffness.share(0.0);
            assert_eq!(stiffness.step(to, 1e-3, DT_S), to);
            assert_eq!(stiffness.share(1e-3), 1.0);
        }
    }
}
