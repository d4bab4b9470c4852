//! An instrumented gimbal: how a finger turns (Melder ch. 5.3.3.1).
//!
//! Model: only by how much the finger has turned since the last tick matters; nobody needs to know where its zero is. What
//! is no orientation (not a number, missing) and what no finger can do in a tick counts as not having turned, and
//! measuring begins anew.

use nalgebra::{UnitQuaternion, Vector3};

/// What a finger's gimbal said last.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Gimbal {
    last: Option<UnitQuaternion<f64>>,
}

impl Gimbal {
    /// By how much the finger has turned since the last tick (rotation vector, rad); `None`: nobody knows.
    pub(crate) fn turn_W(&mut self, orientation: Option<UnitQuaternion<f64>>) -> Option<Vector3<f64>> {
        let now = orientation.filter(is_orientation);
        let before = std::mem::replace(&mut self.last, now)?;
        let turn_W = (now? * before.inverse()).scaled_axis();
        Some(if turn_W.norm() <= MOST_TURN_RAD { turn_W } else { Vector3::zeros() })
    }
}

/// Unit, and all of it numbers.
pub(crate) fn is_orientation(q: &UnitQuaternion<f64>) -> bool {
    (q.as_ref().norm_squared() - 1.0).abs() < 1e-3
}

/// More than this no finger turns in a tick \[rad\]: 500 rad/s at 1 kHz.
const MOST_TURN_RAD: f64 = 0.5;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_that_since_the_last_tick_and_a_jump_is_none() {
        let at = |angle: f64| Some(UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle));
        let mut gimbal = Gimbal::default();
        assert_eq!(gimbal.turn_W(at(1.0)), None);
        assert!((gimbal.turn_W(at(1.25)).unwrap().z - 0.25).abs() < 1e-12);
        assert_eq!(gimbal.turn_W(at(3.0)), Some(Vector3::zeros()));
        assert_eq!(gimbal.turn_W(None), None);
        assert_eq!(gimbal.turn_W(at(1.0)), None);
        let broken = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(f64::NAN, 0.0, 0.0, 0.0));
        assert_eq!(gimbal.turn_W(Some(broken)), None);
        assert_eq!(gimbal.turn_W(at(1.0)), None);
        assert!(gimbal.turn_W(at(1.1)).is_some());
    }
}
