//! The grasp axis: the line that joins the god-objects of two fingers that hold an object between them (Melder ch. 5.3.3).
//!
//! Which two: of all pairs of fingers that press a body towards each other (both within 30 degrees of the line that joins
//! them), the one whose weaker finger presses hardest. Fewer than two fingers, or fingers that do not oppose each other, have
//! no axis; a third finger that helps does not take it away.
//!
//! Model: the torque of gravity about the axis is scaled to `1 - A / A_crit` (eq. 5.16, projected on the axis) by a torque
//! against the rest of it, and turning is damped; `A` is the area of the smaller friction circle, and the model that of its
//! finger. From A_crit on the pads hold, with all torque it takes: they are springs that let nothing sag, for the torque of
//! gravity is theirs as a whole.
//! Scaling gravity takes no energy by itself: with an area that stays as it is, kinetic energy plus the scaled potential
//! energy never grows, and viscous torsion takes it away.
//! Signs: the axis leads from the first finger to the second; torques on the body.

use nalgebra::{UnitQuaternion, Vector3};

use crate::row::Torsion;
use crate::soft_finger::{Circle, SoftFinger, TorsionModel};
use crate::twist::{Hold, Twist};

/// The axis about which two fingers hold a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspAxis {
    /// Which fingers.
    pub fingers: [usize; 2],
    /// The god-object of the first \[m\].
    pub point_W: Vector3<f64>,
    /// Unit, to that of the second.
    pub axis_W: Vector3<f64>,
}

/// A finger that may be one of the two.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pad {
    pub(crate) finger: usize,
    pub(crate) point_W: Vector3<f64>,
    /// Into the body.
    pub(crate) inward_W: Vector3<f64>,
    pub(crate) normal_n: f64,
    /// Along the surface, in size.
    pub(crate) across_n: f64,
    pub(crate) circle: Circle,
}

/// Of fingers on a body, the two that hold it between them: their places in the list.
pub(crate) fn opposed(pads: &[Pad]) -> Option<(usize, usize)> {
    let mut best: Option<(f64, (usize, usize))> = None;
    for (i, one) in pads.iter().enumerate() {
        for (j, other) in pads.iter().enumerate().skip(i + 1) {
            let weaker_n = one.normal_n.min(other.normal_n);
            if weaker_n > best.map_or(0.0, |(n, _)| n) && oppose(one, other) {
                best = Some((weaker_n, (i, j)));
            }
        }
    }
    best.map(|(_, pair)| pair)
}

fn oppose(one: &Pad, other: &Pad) -> bool {
    let between_W = other.point_W - one.point_W;
    let least_m = OPPOSED * between_W.norm();
    one.finger != other.finger
        && least_m > 0.0
        && one.inward_W.dot(&between_W) > least_m
        && -other.inward_W.dot(&between_W) > least_m
}

/// Cosine of the largest angle to the line that joins them.
const OPPOSED: f64 = 0.866;

/// What a body's grasp axis remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct AxisMemory {
    /// Whose axis it was.
    fingers: Option<[usize; 2]>,
    twist: Twist,
    /// Whether it turned.
    is_turning: bool,
    /// Its row in this tick.
    pub(crate) row: Option<usize>,
}

/// The body, seen from the axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hung<'b> {
    pub(crate) orientation: &'b UnitQuaternion<f64>,
    /// Of gravity about the axis \[N m\].
    pub(crate) gravity_nm: f64,
    /// How fast it turns about it \[rad/s\].
    pub(crate) spin_rad_s: f64,
    /// How the fingers' gimbals turned about whatever axis (rotation vector, rad).
    pub(crate) gimbals_W: Vector3<f64>,
}

impl AxisMemory {
    /// No axis in this tick.
    pub(crate) fn end(&mut self) {
        *self = Self::default();
    }

    /// What the pads do about the axis; `None`: their model knows none.
    pub(crate) fn torsion(
        &mut self,
        axis: &GraspAxis,
        soft: &SoftFinger,
        circle: &Circle,
        hung: &Hung<'_>,
    ) -> Option<Torsion> {
        if self.fingers != Some(axis.fingers) {
            let twist = Twist::begin(*hung.orientation);
            *self = Self { fingers: Some(axis.fingers), twist, is_turning: false, row: None };
        }
        let (critical_m2, damping) = self.critical(soft, hung.spin_rad_s)?;
        let gimbals_W = if soft.follows(circle) { hung.gimbals_W } else { Vector3::zeros() };
        self.twist.carry(hung.orientation, &axis.axis_W, &gimbals_W);
        //= melder#5.16
        let share = (circle.area_m2() / critical_m2).min(1.0);
        let holds = share >= 1.0;
        if !holds {
            self.twist.relax();
        }
        let hold = Hold {
            stiffness_nm_per_rad: if holds { soft.stiffness_nm_per_rad } else { 0.0 },
            damping_nm_s_per_rad: if holds { damping.max(soft.damping_nm_s_per_rad) } else { damping },
            most_nm: MOST_NM,
        };
        let mut torsion = self.twist.torsion(&hold);
        torsion.rest_nm -= share * hung.gravity_nm;
        Some(torsion)
    }

    /// The critical area that counts now (m^2), and the damping (N m s/rad).
    fn critical(&mut self, soft: &SoftFinger, spin_rad_s: f64) -> Option<(f64, f64)> {
        match soft.model {
            TorsionModel::Viscous { critical_area_m2, damping_nm_s_per_rad } => {
                Some((critical_area_m2, damping_nm_s_per_rad))
            }
            TorsionModel::StickSlip {
                critical_area_at_rest_m2,
                critical_area_turning_m2,
                damping_nm_s_per_rad,
            } => {
                let least_rad_s = if self.is_turning { STOPS_RAD_S } else { STARTS_RAD_S };
                self.is_turning = spin_rad_s.abs() > least_rad_s;
                let critical_m2 =
                    if self.is_turning { critical_area_turning_m2 } else { critical_area_at_rest_m2 };
                Some((critical_m2, damping_nm_s_per_rad))
            }
            TorsionModel::None | TorsionModel::Coulomb { .. } => None,
        }
    }

    /// Remembers how the tick ended.
    pub(crate) fn settle(&mut self, torsion: &Torsion, spin_rad_s: f64, dt_s: f64) {
        self.twist.settle(torsion, spin_rad_s, dt_s);
    }
}

/// What turns faster than this turns \[rad/s\].
const STARTS_RAD_S: f64 = 0.2;
/// What turned and is slower than this rests \[rad/s\].
const STOPS_RAD_S: f64 = 0.02;
/// No two pads hold more \[N m\].
const MOST_NM: f64 = 10.0;

#[cfg(test)]
mod tests {
    use super::*;

    fn pad(finger: usize, at: [f64; 3], inward: [f64; 3], normal_n: f64) -> Pad {
        let (point_W, inward_W) = (at.into(), inward.into());
        Pad { finger, point_W, inward_W, normal_n, ..Pad::default() }
    }

    #[test]
    fn the_axis_joins_the_two_fingers_that_press_each_other_hardest() {
        let left = pad(0, [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], 2.0);
        let right = pad(1, [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], 3.0);
        let below = pad(2, [0.0, -1.0, 0.0], [0.0, 1.0, 0.0], 9.0);
        let weak = pad(3, [1.0, 0.1, 0.0], [-1.0, 0.0, 0.0], 1.0);
        assert_eq!(opposed(&[left, right]), Some((0, 1)));
        assert_eq!(opposed(&[below, left, weak, right]), Some((1, 3)));
        // A hook: both press upwards.
        let hook =
            [pad(0, [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 2.0), pad(1, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 2.0)];
        assert_eq!(opposed(&hook), None);
        assert_eq!(opposed(&[left]), None);
        assert_eq!(opposed(&[]), None);
        // At one place there is no line.
        assert_eq!(opposed(&[left, pad(1, [-1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], 2.0)]), None);
    }
}
