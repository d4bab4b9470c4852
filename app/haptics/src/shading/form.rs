//! How a force is turned to the shaded normal.

use nalgebra::Vector3;

/// What becomes of the force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ShadingForm {
    /// It is turned by the smallest rotation that takes the surface's normal to the shaded one: size and friction angle
    /// are kept. What Melder eq. 4.26-4.27 mean.
    #[default]
    Rotate,
    /// As printed in Melder eq. 4.26-4.27, to compare with: the force's direction becomes the middle between its own
    /// and the shaded normal. That turns a force without friction only half way, and halves the friction angle.
    Bisect,
}

/// From the surface's normal to the shaded one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    /// Unit length.
    pub(super) from_B: Vector3<f64>,
    /// Any length.
    pub(super) to_B: Vector3<f64>,
}

impl ShadingForm {
    /// The force, turned; as it was where there is no sensible direction.
    #[inline(always)]
    pub(super) fn turned(self, force_B: &Vector3<f64>, turn: &Turn) -> Vector3<f64> {
        match self {
            Self::Rotate => turn.rotated(force_B),
            Self::Bisect => bisected(force_B, &turn.to_B).unwrap_or(*force_B),
        }
    }
}

impl Turn {
    /// Turned by the smallest rotation that takes one normal to the other, but by a right angle at most.
    #[inline(always)]
    pub(super) fn rotated(&self, v_B: &Vector3<f64>) -> Vector3<f64> {
        let Self { from_B, mut to_B } = *self;
        let mut along = from_B.dot(&to_B);
        if along < 0.0 {
            // Farther, a force without friction would pull the finger in.
            to_B -= from_B * along;
            along = 0.0;
        }
        let length = to_B.norm();
        // Not a number is no length, either.
        if !(length > SMALLEST && length < f64::INFINITY) {
            return *v_B;
        }
        // Two reflections make a rotation: at the plane of the one normal, and at that of the middle of both.
        let middle_B = from_B * length + to_B;
        let reflected_B = v_B - from_B * (2.0 * from_B.dot(v_B));
        reflected_B - middle_B * (reflected_B.dot(&middle_B) / (length * (length + along)))
    }
}

fn bisected(force_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<Vector3<f64>> {
    let to_B = to_B.try_normalize(SMALLEST)?;
    let size_n = force_B.norm();
    //= melder#4.26
    let f1_B = to_B * size_n + force_B;
    //= melder#4.27
    f1_B.try_normalize(OPPOSITE * size_n).map(|direction_B| direction_B * size_n)
}

/// Nearer than this to opposite, two directions have no middle.
const OPPOSITE: f64 = 1e-9;
/// Squares of shorter vectors underflow; a shaded normal may be weighted with areas, which can be tiny.
const SMALLEST: f64 = 1e-150;
