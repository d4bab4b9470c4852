//! Limit surface of a soft pad: what friction and torsion can bear together.
//!
//! Problem: each point of a pressed pad has the friction of its own pressure, in one direction only. A pad that turns has less
//! friction left, and one that slides less torsion; with the full of both at once, objects that are held beside their centre
//! of mass slip too late.
//!
//! Model: the forces that a pad can bear fill an ellipse, `(f / F)^2 + (t / T)^2 <= 1`, where `F` is the most that it bears
//! without a torque, and `T` without a force (Goyal, Ruina and Papadopoulos 1991; the ellipse for pressed pads: Howe and
//! Cutkosky 1996). As long as the springs ask for no more, they get what they ask for. Beyond it the pad slips, and bears the
//! point of the ellipse whose normal is the slip, `(F v, T w)`, where most is lost to friction; a slip begins at the point on
//! the way to what was asked for, and turns to the other within [`TURNS_M`] of sliding. Who asks for less than that of the one
//! leaves more of the other.
//!
//! Limit: which way friction acts is for the spring between god-object and finger to say, which turns along with the object; so
//! what goes on turning for long is braked across its slip, too, as it is without all this.
//! Units: shares of `F` and of `T`, 1 each alone.
//! Invariant: shares are on the ellipse, or 1 where nothing slips.

/// Law by which a pad that bears a force and a torque slips.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LimitSurface {
    /// As real pads: together they bear less of each.
    #[default]
    Ellipse,
    /// The whole of both at once (Melder ch. 5.3.3).
    Uncoupled,
}

/// Shares that a pad bears at most, or is asked for; or its slip.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Shares {
    pub(crate) friction: f64,
    pub(crate) torsion: f64,
}

impl Shares {
    const ALL: Self = Self { friction: 1.0, torsion: 1.0 };

    fn size(&self) -> f64 {
        self.friction.hypot(self.torsion)
    }

    fn over(&self, size: f64) -> Self {
        Self { friction: self.friction / size, torsion: self.torsion / size }
    }
}

/// Memory of a pad that slips.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Slip {
    /// Point of the ellipse.
    at: Option<Shares>,
}

impl Slip {
    /// Most that a pad bears that is asked for so much, both not negative, and has slid by so much since the last tick (m,
    /// and rad times `T / F`).
    pub(crate) fn shares(&mut self, asked: &Shares, slid_m: &Shares) -> Shares {
        let size = asked.size();
        if size.is_nan() || size <= 1.0 {
            self.at = None;
            return Shares::ALL;
        }
        let at = self.at.unwrap_or_else(|| asked.over(size));
        let along = Shares {
            friction: at.friction + slid_m.friction / TURNS_M,
            torsion: at.torsion + slid_m.torsion / TURNS_M,
        };
        let at = along.over(along.size());
        self.at = Some(at);
        let left = |of: f64| (1.0 - of * of).max(0.0).sqrt();
        if asked.friction < at.friction {
            Shares { friction: asked.friction, torsion: left(asked.friction) }
        } else if asked.torsion < at.torsion {
            Shares { friction: left(asked.torsion), torsion: asked.torsion }
        } else {
            at
        }
    }
}

/// Sliding after which a pad slips as if it had always done so, nearly \[m\]. Ours: some of the give of a fingertip.
const TURNS_M: f64 = 5e-4;

#[cfg(test)]
mod tests {
    use super::*;

    fn shares(friction: f64, torsion: f64) -> Shares {
        Shares { friction, torsion }
    }

    #[test]
    fn what_lies_within_the_ellipse_is_borne_and_a_slip_begins_where_it_is_left() {
        let mut slip = Slip::default();
        let still = Shares::default();
        assert_eq!(slip.shares(&shares(0.6, 0.79), &still), Shares::ALL);
        let found = slip.shares(&shares(0.6, 0.81), &still);
        assert!(
            (found.size() - 1.0).abs() < 1e-15 && (found.friction / found.torsion - 0.6 / 0.81).abs() < 1e-12
        );
        // Alone, each bears all.
        assert_eq!(Slip::default().shares(&shares(1.5, 0.0), &still), shares(1.0, 0.0));
        assert_eq!(Slip::default().shares(&shares(0.0, 7.0), &still), shares(0.0, 1.0));
        assert_eq!(Slip::default().shares(&shares(f64::NAN, 0.5), &still), Shares::ALL);
    }

    #[test]
    fn a_pad_that_slides_on_bears_the_point_whose_normal_is_its_slip() {
        for (along, about) in [(1.0, 0.0), (0.0, 1.0), (3.0, 4.0), (1e-3, 1.0)] {
            let mut slip = Slip::default();
            let slid_m = shares(along * 1e-5, about * 1e-5);
            let found = (0..100_000).map(|_| slip.shares(&shares(2.0, 2.0), &slid_m)).last().unwrap();
            let expected = slid_m.over(slid_m.size());
            // What is left of the beginning after so much sliding: a part in a hundred at the slowest.
            let off = shares(found.friction - expected.friction, found.torsion - expected.torsion);
            assert!(off.size() < 0.01, "{found:?} {expected:?}");
        }
        // Who asks for less of the one gets more of the other.
        let mut slip = Slip::default();
        slip.shares(&shares(2.0, 2.0), &Shares::default());
        assert_eq!(slip.shares(&shares(0.6, 2.0), &Shares::default()), shares(0.6, 0.8));
        assert_eq!(slip.shares(&shares(2.0, 0.6), &Shares::default()), shares(0.8, 0.6));
    }
}
