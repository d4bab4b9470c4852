//! What is to be seen at one moment: where everything is and what the fingers feel.

use haptics::Feature;
use nalgebra::{Isometry3, Vector3};

/// A moment of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Moment {
    /// Since the first tick at full authority (s).
    pub t_s: f64,
    /// Of each entity, its frame in the world.
    pub poses: Vec<Isometry3<f64>>,
    /// The fingers.
    pub fingers: Vec<FingerMoment>,
    /// Entities that can move and touch another one, in ascending order.
    pub colliding: Vec<usize>,
}

/// A finger then; world frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FingerMoment {
    /// Where the device says it is (m).
    pub hip: Vector3<f64>,
    /// Where it is felt to be (m).
    pub god_object: Vector3<f64>,
    /// On the user (N).
    pub force: Vector3<f64>,
    /// Which entity it touches.
    pub entity: Option<usize>,
    /// What the touched surface is like there; `None`: nothing of it is drawn.
    pub contact: Option<ContactMoment>,
    /// Which space it is in: 0 the world, otherwise behind a door.
    pub space: u32,
}

/// Where a finger touches a surface; world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactMoment {
    /// Outward from what is touched; unit length.
    pub normal: Vector3<f64>,
    /// Of the circle around the HIP's foot on the tangent plane within which the finger sticks (m); `None`: no friction.
    pub friction_radius_m: Option<f64>,
    /// What kind of piece of the surface it is.
    pub feature: Feature,
}

impl Moment {
    /// Which space is seen: that of the first finger that went in somewhere, otherwise the world.
    pub fn seen_space(&self) -> u32 {
        self.fingers.iter().map(|finger| finger.space).find(|space| *space != 0).unwrap_or(0)
    }

    /// Between this moment (`share` 0) and a later one (1).
    #[must_use]
    pub fn towards(&self, later: &Self, share: f64) -> Self {
        let between = |a: &Vector3<f64>, b: &Vector3<f64>| a.lerp(b, share);
        let pose =
            |(a, b): (&Isometry3<f64>, &Isometry3<f64>)| a.try_lerp_slerp(b, share, 1e-9).unwrap_or(*b);
        let finger = |(a, b): (&FingerMoment, &FingerMoment)| FingerMoment {
            hip: between(&a.hip, &b.hip),
            god_object: between(&a.god_object, &b.god_object),
            force: between(&a.force, &b.force),
            entity: b.entity,
            contact: b.contact,
            space: b.space,
        };
        Self {
            t_s: self.t_s + share * (later.t_s - self.t_s),
            poses: self.poses.iter().zip(&later.poses).map(pose).collect(),
            fingers: self.fingers.iter().zip(&later.fingers).map(finger).collect(),
            colliding: later.colliding.clone(),
        }
    }
}
