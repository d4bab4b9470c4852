//! An object tied to a single finger while a button is held (Melder ch. 3.1.3).
//!
//! Problem: one point can push an object, not lift it; "it becomes necessary to attach the virtual object to the haptic
//! interface through the use of an external system, such as a button".
//! Model: a spring with damper between the HIP and the body's point that was there when the tie began, as stiff to a pull as
//! to a push, up to a largest force; and, if wanted, a rotational spring to the orientation which the body had, or to that
//! turned along with the gimbal. Both count at the end of the tick, so none is too stiff for a light body: the spring
//! answers to what the body's velocity changes by in the tick (no drag on a hand that carries), the damper to how the body
//! moves relative to the hand.
//! Begin and end: nothing is stretched when it begins. When it ends, the force that it has left may only fall, to nothing
//! within the fade time: neither the hand nor the object is kicked. A touch of the same finger goes on as it is.
//! Signs: forces and torques on the body; the user gets them times -1.

use haptics::ParameterError;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use crate::body::Body;
use crate::gimbal::is_orientation;
use crate::mass::positive;
use crate::row::{Held, Rolling, Row, Torsion};

/// How an attached object turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum HeldOrientation {
    /// As it likes: it hangs by its point.
    #[default]
    Free,
    /// It keeps the orientation it had.
    Locked,
    /// It turns along with the finger's gimbal; without one, as `Locked`.
    Gimbal,
}

impl HeldOrientation {
    /// The names in a scene, in the order of the variants.
    pub const NAMES: [&'static str; 3] = ["free", "locked", "gimbal"];

    /// That of this name; `None` where there is none.
    pub fn of_name(name: &str) -> Option<Self> {
        let all = [Self::Free, Self::Locked, Self::Gimbal];
        Self::NAMES.iter().position(|known| *known == name).map(|at| all[at])
    }
}

/// How a finger ties what it touches to itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attachment {
    /// \[N/m\]
    pub stiffness_n_per_m: f64,
    /// Of the body's point relative to the hand \[N s/m\].
    pub damping_n_s_per_m: f64,
    /// It never pulls or presses with more \[N\].
    pub most_force_n: f64,
    /// How the object turns.
    pub orientation: HeldOrientation,
    /// \[N m/rad\]
    pub stiffness_nm_per_rad: f64,
    /// \[N m s/rad\]
    pub damping_nm_s_per_rad: f64,
    /// It never turns with more, about any of the world's axes \[N m\].
    pub most_torque_nm: f64,
    /// In which the force is gone when the button is let go \[s\].
    pub fade_s: f64,
}

impl Default for Attachment {
    fn default() -> Self {
        Self {
            stiffness_n_per_m: 1000.0,
            damping_n_s_per_m: 5.0,
            most_force_n: 20.0,
            orientation: HeldOrientation::Free,
            stiffness_nm_per_rad: 1.0,
            damping_nm_s_per_rad: 0.01,
            most_torque_nm: 1.0,
            fade_s: 0.02,
        }
    }
}

impl Attachment {
    /// The same, checked.
    ///
    /// # Errors
    /// A stiffness or limit that is not finite or not positive; a damping or fade time that is not finite or negative.
    pub fn validated(self) -> Result<Self, ParameterError> {
        positive("stiffness_n_per_m", self.stiffness_n_per_m)?;
        positive("most_force_n", self.most_force_n)?;
        positive("stiffness_n_m_per_rad", self.stiffness_nm_per_rad)?;
        positive("most_torque_n_m", self.most_torque_nm)?;
        for (parameter, value) in [
            ("damping_n_s_per_m", self.damping_n_s_per_m),
            ("damping_n_m_s_per_rad", self.damping_nm_s_per_rad),
            ("fade_s", self.fade_s),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(ParameterError::OutOfRange { parameter, value, allowed: "a finite number >= 0" });
            }
        }
        Ok(self)
    }
}

/// A tie between a finger and a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bond {
    pub(crate) body: usize,
    /// Where the HIP was when it began, in the entity's frame \[m\].
    point_B: Vector3<f64>,
    /// Of the last tick \[m\].
    hip_W: Vector3<f64>,
    /// What the body's orientation should be.
    target: UnitQuaternion<f64>,
    /// In the last tick, on the body.
    force_W: Vector3<f64>,
    torques_nm: [f64; 3],
    /// What it may still do after the button was let go \[N\], and by how much less each second \[N/s\].
    fading: Option<(f64, f64)>,
    /// Its rows of this tick: the tie, and three that turn.
    rows: Option<(usize, usize)>,
}

/// A finger in a tick, as its tie sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TiedFinger<'b> {
    pub(crate) hip_W: Vector3<f64>,
    pub(crate) velocity_W: Option<Vector3<f64>>,
    pub(crate) is_held: bool,
    /// By how much the gimbal turned in the tick.
    pub(crate) turn_W: Option<Vector3<f64>>,
    /// Its body's place among those that are stepped.
    pub(crate) place: usize,
    pub(crate) body: &'b Body,
    pub(crate) dt_s: f64,
}

impl Bond {
    /// Begins between the HIP and what of the body is there.
    pub(crate) fn begin(body: usize, hip_W: Vector3<f64>, state: &Body) -> Self {
        let pose: Isometry3<f64> = state.pose();
        Self {
            body,
            point_B: pose.inverse_transform_point(&Point3::from(hip_W)).coords,
            hip_W,
            target: state.orientation,
            force_W: Vector3::zeros(),
            torques_nm: [0.0; 3],
            fading: None,
            rows: None,
        }
    }

    /// Appends its rows; says whether it goes on.
    pub(crate) fn gather(&mut self, of: &Attachment, finger: &TiedFinger<'_>, rows: &mut Vec<Row>) -> bool {
        self.rows = None;
        if !finger.hip_W.iter().all(|x| x.is_finite()) || !is_orientation(&self.target) {
            return false;
        }
        let Some(most_n) = self.most_n(of, finger) else { return false };
        let first = rows.len();
        if first + ROWS_OF_BOND > rows.capacity() {
            return true;
        }
        rows.push(self.tie(of, finger, most_n));
        if of.orientation != HeldOrientation::Free && self.fading.is_none() {
            self.turn(of, finger, rows);
        }
        self.hip_W = finger.hip_W;
        self.rows = Some((first, rows.len()));
        true
    }

    /// The most force in this tick; `None`: it is over.
    fn most_n(&mut self, of: &Attachment, finger: &TiedFinger<'_>) -> Option<f64> {
        if finger.is_held && self.fading.is_none() {
            return Some(of.most_force_n);
        }
        let left_n = self.force_W.norm();
        let (most_n, per_s) = self.fading.unwrap_or((left_n, left_n / of.fade_s));
        let next_n = most_n - per_s * finger.dt_s;
        self.fading = Some((next_n, per_s));
        (next_n > 0.0).then_some(next_n)
    }

    fn tie(&self, of: &Attachment, finger: &TiedFinger<'_>, most_n: f64) -> Row {
        let (body, dt_s) = (finger.body, finger.dt_s);
        let point_W = (body.pose() * Point3::from(self.point_B)).coords;
        let arm_W = point_W - body.centre_W;
        let (k, b) = (of.stiffness_n_per_m, of.damping_n_s_per_m);
        let known_W = finger.velocity_W.filter(|v| v.iter().all(|x| x.is_finite()));
        let hand_W = known_W.unwrap_or_else(|| (finger.hip_W - self.hip_W) / dt_s);
        let velocity_W = body.velocity_W + body.angular_velocity_W().cross(&arm_W);
        Row {
            body: finger.place,
            other: None,
            arms_W: [arm_W, Vector3::zeros()],
            normal_W: Vector3::y(),
            rest_W: (finger.hip_W - point_W) * k + velocity_W * (k * dt_s) + hand_W * b,
            stiffness: [k; 2],
            damping: [b; 2],
            mu_hold: 0.0,
            mu_slide: 0.0,
            held: Held::Stick,
            force_W: self.force_W,
            torsion: Torsion::default(),
            rolling: Rolling::default(),
            turning_m: [0.0; 2],
            tie_n: Some(most_n),
        }
    }

    fn turn(&mut self, of: &Attachment, finger: &TiedFinger<'_>, rows: &mut Vec<Row>) {
        if let Some(turn_W) = finger.turn_W.filter(|_| of.orientation == HeldOrientation::Gimbal) {
            let target = UnitQuaternion::from_scaled_axis(turn_W) * self.target;
            self.target = UnitQuaternion::new_normalize(target.into_inner());
        }
        let off_W = (finger.body.orientation * self.target.inverse()).scaled_axis();
        for (axis, torque_nm) in self.torques_nm.into_iter().enumerate() {
            let mut axis_W = Vector3::zeros();
            axis_W[axis] = 1.0;
            rows.push(Row::turning(
                finger.place,
                axis_W,
                Torsion {
                    rest_nm: -of.stiffness_nm_per_rad * off_W[axis],
                    stiffness_nm_per_rad: of.stiffness_nm_per_rad,
                    damping_nm_s_per_rad: of.damping_nm_s_per_rad,
                    most_nm: of.most_torque_nm,
                    torque_nm,
                },
            ));
        }
    }

    /// Remembers how the tick ended; returns force and torque on the user.
    pub(crate) fn settle(&mut self, rows: &[Row]) -> (Vector3<f64>, Vector3<f64>) {
        let Some((first, end)) = self.rows else { return Default::default() };
        let mut torque_W = Vector3::zeros();
        if let Some(own) = rows.get(first..end).filter(|own| !own.is_empty()) {
            self.force_W = own[0].force_W;
            for (row, torque_nm) in own[1..].iter().zip(&mut self.torques_nm) {
                *torque_nm = row.torsion.torque_nm;
                torque_W += row.normal_W * *torque_nm;
            }
        }
        (-self.force_W, -torque_W)
    }
}

/// The most rows of a tie.
pub(crate) const ROWS_OF_BOND: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_that_no_tie_has_are_refused_by_name() {
        let good = Attachment::default();
        good.validated().unwrap();
        let bad = Attachment { stiffness_n_per_m: -1.0, ..good };
        assert_eq!(
            bad.validated().unwrap_err().to_string(),
            "stiffness_n_per_m is -1; allowed is a finite number > 0"
        );
        assert!(Attachment { fade_s: f64::NAN, ..good }.validated().is_err());
        assert!(Attachment { most_force_n: f64::INFINITY, ..good }.validated().is_err());
        for name in HeldOrientation::NAMES {
            assert!(HeldOrientation::of_name(name).is_some());
        }
        assert_eq!(HeldOrientation::of_name("loose"), None);
    }
}
