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

impl ShadingForm {
    /// The force, turned; `None` where nothing sensible comes of it.
    #[inline(always)]
    pub(super) fn turned(
        self,
        force_B: &Vector3<f64>,
        from_B: &Vector3<f64>,
        to_B: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        match self {
            Self::Rotate => rotated(force_B, from_B, to_B),
            Self::Bisect => bisected(force_B, to_B),
        }
    }
}

/// Turned by the smallest rotation that takes one unit vector to the other, but by a right angle at most.
#[inline(always)]
pub(super) fn rotated(
    v_B: &Vector3<f64>,
    from_B: &Vector3<f64>,
    to_B: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let mut cos = from_B.dot(to_B);
    let mut axis_B = from_B.cross(to_B);
    if cos < 0.0 {
        // Farther, a force without friction would pull the finger in.
        (cos, axis_B) = (0.0, axis_B.try_normalize(OPPOSITE)?);
    }
    // Rodrigues' formula with the axis as long as the angle's sine.
    let turned_B = v_B * cos + axis_B.cross(v_B) + axis_B * (axis_B.dot(v_B) / (1.0 + cos));
    turned_B.iter().all(|x| x.is_finite()).then_some(turned_B)
}

fn bisected(force_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<Vector3<f64>> {
    let size_n = force_B.norm();
    //= melder#4.26
    let f1_B = to_B * size_n + force_B;
    //= melder#4.27
    let turned_B = f1_B.try_normalize(OPPOSITE * size_n)? * size_n;
    turned_B.iter().all(|x| x.is_finite()).then_some(turned_B)
}

/// Nearer than this to opposite, two directions have no middle and no plane in common.
const OPPOSITE: f64 = 1e-9;
