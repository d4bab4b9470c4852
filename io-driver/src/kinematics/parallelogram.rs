//! The linkage that many haptic arms are built on: a turret, an upper arm, and a forearm that a parallelogram
//! drives from the base.
//!
//! Problem: a turret (`theta1`, about the vertical) carries an upper arm (`theta2` above the
//! horizontal) and a forearm, which a parallelogram drives from the base, so that `theta3` is its
//! *absolute* angle forward of hanging straight down.
//! Model: rigid links `l1` (upper arm) and `l2` (forearm). With the tip's signed distance from
//! the turret's axis `rho = l1 cos theta2 + l2 sin theta3`, and the shoulder, which lies on that axis, at
//! `(0, y0, z0)`:
//!
//! ```text
//! x = rho sin theta1
//! y = y0 - l2 cos theta3 + l1 sin theta2
//! z = z0 + rho cos theta1
//! ```
//!
//! Frames and signs: base frame D, x right, y up, z to the user. Angles are the linkage's; a mechanism that
//! counts them otherwise has a [`JointConvention`](super::JointConvention).
//! Singularities: `det J = rho l1 l2 cos(theta3 - theta2)` vanishes where the tip is on the
//! turret's axis (`rho = 0`) and where the elbow is stretched or folded.
//! Which inverse: in the plane of the arm the tip's distance `r` from the shoulder is
//! `r^2 = l1^2 + l2^2 + 2 l1 l2 sin(theta3 - theta2)`. The sine rises strictly between -90 and
//! +90 degrees of elbow, and the stops lie inside, so there is one elbow.
//! There are two turrets, `theta1` and half a turn further with `rho` negative; stops within +-90
//! degrees leave the one with `cos theta1 >= 0`. The inverse takes exactly these, so it
//! undoes the forward map wherever the joints can be. In front of the axis (`z > z0`) that
//! is the closed form of the paper; behind it, where the arm leans over backwards, `rho < 0`.
//! Invariants: no input panics. On the axis, where every `theta1` would do, it is zero; beside
//! it (`z = z0`), where both turrets are at a stop, the one in front (`rho > 0`) is taken.
//! Cost: forward and Jacobian three sine-cosine pairs, inverse four inverse functions and three
//! roots; no loop, no allocation.
//! Reference: Cavusoglu, Feygin, Tendick, A critical study of the mechanical and electrical
//! properties of the PHANToM haptic interface, Presence 11(6), 2002.

use nalgebra::{Matrix3, Vector3};

use super::{Conditioning, Unreachable};

/// A turret with two links and where its shoulder is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parallelogram {
    upper_arm_m: f64,
    forearm_m: f64,
    shoulder_y_m: f64,
    shoulder_z_m: f64,
}

/// Sines, cosines and what both maps need of a pose.
struct Pose {
    sin: [f64; 3],
    cos: [f64; 3],
    rho: f64,
}

impl Parallelogram {
    /// Upper arm `l1` and forearm `l2`, both positive, with the shoulder `[up, to the user]` of the origin.
    pub fn new([upper_arm_m, forearm_m]: [f64; 2], [shoulder_y_m, shoulder_z_m]: [f64; 2]) -> Self {
        Self { upper_arm_m, forearm_m, shoulder_y_m, shoulder_z_m }
    }

    /// Upper arm `l1` and forearm `l2`.
    pub fn link_lengths_m(&self) -> [f64; 2] {
        [self.upper_arm_m, self.forearm_m]
    }

    /// Largest distance of the tip from the shoulder. No joint torque vector is longer than this
    /// times the force: the turret's column of the Jacobian is perpendicular to the other two and
    /// `|rho|` long, and those two span at most `sqrt(l1^2 + l2^2)`.
    pub fn reach_m(&self) -> f64 {
        self.upper_arm_m + self.forearm_m
    }

    /// Position of the tip at these angles.
    pub fn forward(&self, angles: [f64; 3]) -> Vector3<f64> {
        self.tip(&self.pose(angles))
    }

    fn tip(&self, p: &Pose) -> Vector3<f64> {
        let (l1, l2) = (self.upper_arm_m, self.forearm_m);
        let y = self.shoulder_y_m - l2 * p.cos[2] + l1 * p.sin[1];
        Vector3::new(p.rho * p.sin[0], y, p.rho * p.cos[0] + self.shoulder_z_m)
    }

    /// Angles that bring the tip there.
    ///
    /// # Errors
    /// Out of reach, by how much.
    pub fn inverse(&self, tip: Vector3<f64>) -> Result<[f64; 3], Unreachable> {
        if !tip.iter().all(|c| c.is_finite()) {
            return Err(Unreachable::NotFinite);
        }
        let (l1, l2) = (self.upper_arm_m, self.forearm_m);
        let forward_of_axis = tip.z - self.shoulder_z_m;
        let side = if forward_of_axis < 0.0 { -1.0 } else { 1.0 };
        let rho = side * tip.x.hypot(forward_of_axis);
        let above_shoulder = tip.y - self.shoulder_y_m;

        let elbow = self.elbow_sine(rho.hypot(above_shoulder))?.asin();
        let (sin_elbow, cos_elbow) = elbow.sin_cos();
        // On the axis atan2(0, 0) is zero, the documented choice. atan2 also keeps theta2 exact
        // at full stretch, where the paper's acos loses half of the digits.
        let theta1 = (side * tip.x).atan2(side * forward_of_axis);
        let theta2 = wrap(above_shoulder.atan2(rho) + (l2 * cos_elbow).atan2(l1 + l2 * sin_elbow));
        Ok([theta1, theta2, theta2 + elbow])
    }

    /// Velocity of the tip per rate of each angle.
    pub fn jacobian(&self, angles: [f64; 3]) -> Matrix3<f64> {
        self.slopes(&self.pose(angles))
    }

    /// Both at once, for little more than one.
    pub fn forward_and_jacobian(&self, angles: [f64; 3]) -> (Vector3<f64>, Matrix3<f64>) {
        let pose = self.pose(angles);
        (self.tip(&pose), self.slopes(&pose))
    }

    fn slopes(&self, p: &Pose) -> Matrix3<f64> {
        let (l1, l2) = (self.upper_arm_m, self.forearm_m);
        let ([s1, s2, s3], [c1, c2, c3]) = (p.sin, p.cos);
        Matrix3::new(
            p.rho * c1,
            -l1 * s2 * s1,
            l2 * c3 * s1,
            0.0,
            l1 * c2,
            l2 * s3,
            -p.rho * s1,
            -l1 * s2 * c1,
            l2 * c3 * c1,
        )
    }

    /// How near the pose is to a singularity.
    // The turret's column is perpendicular to the other two, so |rho| is one singular value and
    // the eigenvalues of the 2 x 2 Gram matrix of the others are the squares of the rest.
    pub fn singularity(&self, angles: [f64; 3]) -> Conditioning {
        let (l1, l2, rho) = (self.upper_arm_m, self.forearm_m, self.pose(angles).rho.abs());
        let (sin_elbow, cos_elbow) = (angles[2] - angles[1]).sin_cos();
        let mean = 0.5 * (l1 * l1 + l2 * l2);
        let largest = (mean + (0.5 * (l1 * l1 - l2 * l2)).hypot(l1 * l2 * sin_elbow)).sqrt();
        // Their product is |l1 l2 cos|; dividing keeps digits that subtracting would lose.
        let smallest = (l1 * l2 * cos_elbow / largest).abs();
        Conditioning { smallest: smallest.min(rho), largest: largest.max(rho) }
    }

    fn pose(&self, angles: [f64; 3]) -> Pose {
        let (sin, cos) = (angles.map(f64::sin), angles.map(f64::cos));
        Pose { sin, cos, rho: self.upper_arm_m * cos[1] + self.forearm_m * sin[2] }
    }

    /// Sine of the elbow's bend `theta3 - theta2` at distance `r` of tip from shoulder.
    fn elbow_sine(&self, r: f64) -> Result<f64, Unreachable> {
        let (l1, l2) = (self.upper_arm_m, self.forearm_m);
        let (reach_m, hole_m) = (self.reach_m(), (l1 - l2).abs());
        // Rounding may put the tip of a stretched arm a few units in the last place outside.
        let rounding = 16.0 * f64::EPSILON * reach_m;
        if r > reach_m + rounding {
            return Err(Unreachable::TooFar { beyond_m: r - reach_m, reach_m });
        }
        if r < hole_m - rounding {
            return Err(Unreachable::TooNear { short_m: hole_m - r, hole_m });
        }
        Ok(((r * r - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)).clamp(-1.0, 1.0))
    }
}

/// The same direction between -180 and +180 degrees. Only an arm that leans backwards and down
/// gets here; its stops are far away.
fn wrap(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    if angle > PI { angle - TAU } else { angle }
}
