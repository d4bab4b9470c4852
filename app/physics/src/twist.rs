//! How far something has been turned against what holds it: the anchor of torsional friction.
//!
//! Model: as a contact point keeps its stretch ([`crate::Anchor`]), what holds by torsion keeps the angle by which the body
//! has turned about the axis relative to the finger. The angle grows by what the body's orientation did from tick to tick,
//! read off the poses and not integrated from speeds, so that what is at rest stays where it is for ever. On the limit the
//! angle slides along: it is what the spring of the limit is turned by.
//! Signs: positive about the axis; the torque on the body is `-stiffness angle`.

use nalgebra::{UnitQuaternion, Vector3};

use crate::row::Torsion;

/// An angle that is remembered.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Twist {
    /// By how much the body has turned against what holds it \[rad\].
    angle_rad: f64,
    /// Of the body when that was read.
    orientation: UnitQuaternion<f64>,
    /// In the last tick \[N m\].
    torque_nm: f64,
}

/// What resists turning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hold {
    pub(crate) stiffness_nm_per_rad: f64,
    pub(crate) damping_nm_s_per_rad: f64,
    /// The torque stays within this \[N m\].
    pub(crate) most_nm: f64,
}

impl Twist {
    /// Begins where the body is.
    pub(crate) fn begin(orientation: UnitQuaternion<f64>) -> Self {
        Self { orientation, ..Self::default() }
    }

    /// Takes note of how the body has turned since the last tick, and the finger (rotation vector, rad).
    pub(crate) fn carry(
        &mut self,
        orientation: &UnitQuaternion<f64>,
        axis_W: &Vector3<f64>,
        finger_W: &Vector3<f64>,
    ) {
        let body_W = (orientation * self.orientation.inverse()).scaled_axis();
        self.angle_rad += axis_W.dot(&(body_W - finger_W));
        self.orientation = *orientation;
        if !self.angle_rad.is_finite() {
            self.angle_rad = 0.0;
        }
    }

    /// Torque of the spring that holds, before any limit \[N m\].
    pub(crate) fn asked_nm(&self, stiffness_nm_per_rad: f64) -> f64 {
        -stiffness_nm_per_rad * self.angle_rad
    }

    /// What it does in this tick.
    pub(crate) fn torsion(&self, hold: &Hold) -> Torsion {
        Torsion {
            rest_nm: self.asked_nm(hold.stiffness_nm_per_rad),
            stiffness_nm_per_rad: hold.stiffness_nm_per_rad,
            damping_nm_s_per_rad: hold.damping_nm_s_per_rad,
            most_nm: hold.most_nm,
            torque_nm: self.torque_nm.clamp(-hold.most_nm.max(0.0), hold.most_nm.max(0.0)),
        }
    }

    /// Remembers how the tick ended; `spin_rad_s` is how fast the body turns about the axis in it.
    pub(crate) fn settle(&mut self, torsion: &Torsion, spin_rad_s: f64, dt_s: f64) {
        self.torque_nm = torsion.torque_nm;
        if torsion.stiffness_nm_per_rad > 0.0 {
            // No spring is turned by more than the limit turns it: the rest of the angle slides along. What the damper adds
            // to the torque is not the spring's. The angle is kept as it was before the turn that will be found.
            let turn_rad = spin_rad_s * dt_s;
            let most_rad = torsion.most_nm.max(0.0) / torsion.stiffness_nm_per_rad;
            self.angle_rad = (self.angle_rad + turn_rad).clamp(-most_rad, most_rad) - turn_rad;
        }
    }

    /// Lets go of what it is turned by: it begins anew where the body is.
    pub(crate) fn relax(&mut self) {
        (self.angle_rad, self.torque_nm) = (0.0, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angle_is_that_about_the_axis_and_a_finger_that_turns_along_stretches_nothing() {
        let axis = Vector3::x();
        let mut twist = Twist::begin(UnitQuaternion::identity());
        let hold = Hold { stiffness_nm_per_rad: 2.0, damping_nm_s_per_rad: 0.0, most_nm: 10.0 };
        // Four times round, a tenth of a radian at a time; the finger goes along for half of it.
        for step in 1..=250 {
            let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.1 * f64::from(step));
            let finger = if step % 2 == 0 { Vector3::x() * 0.1 } else { Vector3::zeros() };
            twist.carry(&turned, &axis, &finger);
        }
        // 250 roundings of numbers of 25.
        assert!((twist.torsion(&hold).rest_nm + 2.0 * 12.5).abs() < 1e-11);
        // Across the axis, nothing.
        let before = twist;
        let across = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.3) * twist.orientation;
        twist.carry(&across, &axis, &Vector3::zeros());
        assert!((twist.angle_rad - before.angle_rad).abs() < 1e-12);
    }

    #[test]
    fn on_the_limit_the_angle_is_what_the_limit_turns_it_by() {
        let axis = Vector3::x();
        let mut twist = Twist::begin(UnitQuaternion::identity());
        let hold = Hold { stiffness_nm_per_rad: 2.0, damping_nm_s_per_rad: 0.0, most_nm: 0.5 };
        twist.carry(&UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 1.0), &axis, &Vector3::zeros());
        let ended = Torsion { torque_nm: -0.5, ..twist.torsion(&hold) };
        twist.settle(&ended, 3.0, 1e-3);
        let next = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 1.003);
        twist.carry(&next, &axis, &Vector3::zeros());
        assert!((twist.torsion(&hold).rest_nm + 0.5).abs() < 1e-12);
    }
}
