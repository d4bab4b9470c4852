//! Does the tip go where a hand moves it?
//!
//! Model: the person is asked to move the tip along one axis; as soon as it is far enough from where it was,
//! its largest component has to be that axis, with that sign.
//! Frames: the device's base frame D: x right, y up, z towards the user.

use nalgebra::Vector3;

/// How far the tip has to go (m): more than a trembling hand, less than any workspace.
pub const DISTANCE_M: f64 = 0.03;

/// One axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandCheck {
    axis: usize,
    start: Vector3<f64>,
}

/// What became of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HandVerdict {
    /// As it should.
    Right,
    /// Along the axis, the other way.
    Reversed,
    /// Along another axis.
    Crossed {
        /// Which.
        axis: usize,
    },
}

impl HandCheck {
    /// The tip is at `start` and is going to be moved along the positive `axis` (0 to 2).
    pub fn new(axis: usize, start: Vector3<f64>) -> Self {
        Self { axis, start }
    }

    /// Takes a position; says something once the tip is far enough.
    pub fn observe(&self, position: Vector3<f64>) -> Option<HandVerdict> {
        let moved = position - self.start;
        if moved.amax() < DISTANCE_M {
            return None;
        }
        let axis = moved.iamax();
        Some(match (axis == self.axis, moved[axis] > 0.0) {
            (true, true) => HandVerdict::Right,
            (true, false) => HandVerdict::Reversed,
            (false, _) => HandVerdict::Crossed { axis },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_that_moves_the_tip_up_sees_it_go_up() {
        let start = Vector3::new(0.1, -0.2, 0.3);
        let check = HandCheck::new(1, start);
        assert_eq!(check.observe(start + Vector3::new(0.01, 0.02, -0.02)), None);
        assert_eq!(check.observe(start + Vector3::new(0.01, 0.031, -0.02)), Some(HandVerdict::Right));
        assert_eq!(check.observe(start + Vector3::new(0.0, -0.031, 0.0)), Some(HandVerdict::Reversed));
        let crossed = check.observe(start + Vector3::new(0.0, 0.01, -0.04));
        assert_eq!(crossed, Some(HandVerdict::Crossed { axis: 2 }));
    }
}
