//! A force between a finger and a body that do not, or not only, touch: a magnet's pull, a surface's hum.
//!
//! Model: as a [`Touch`](crate::Touch), it is that of where both are when the tick begins, less what the change of the
//! body's velocity takes from it on the way, `force - k dt (u - u_start)`; and it never turns round within a tick. So a light
//! body before a steep magnet gives way instead of rattling, and action is reaction: the user is made to feel the force which
//! the body got.

use nalgebra::Vector3;

use crate::row::{Held, Rolling, Row, Torsion};
use crate::solver::Motion;

/// A force between a finger and a body, in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pull {
    /// Index of the entity.
    pub entity: usize,
    /// Which finger's.
    pub finger: usize,
    /// A point of the line that it acts along \[m\].
    pub point_W: Vector3<f64>,
    /// What the user feels \[N\]: as rendered, then as the tick has it.
    pub force_on_user_W: Vector3<f64>,
    /// By how much the force falls while the body follows it, per way \[N/m\], >= 0.
    pub stiffness_n_per_m: f64,
}

/// The most pulls in a tick; who has more of them does not feel the others, since they would move nothing.
pub const MAX_PULLS: usize = 64;

impl Pull {
    /// As a row of this body, whose centre is there and which moves like that when the tick begins; `None`: it does nothing.
    pub(crate) fn row(
        &self,
        body: usize,
        centre_W: &Vector3<f64>,
        motion: &Motion,
        dt_s: f64,
    ) -> Option<Row> {
        let force_W = -self.force_on_user_W;
        let size_n = force_W.norm();
        let arm_W = self.point_W - centre_W;
        let is_possible = size_n > 0.0
            && size_n.is_finite()
            && arm_W.iter().all(|x| x.is_finite())
            && (0.0..f64::INFINITY).contains(&self.stiffness_n_per_m);
        if !is_possible {
            return None;
        }
        let mut row = Row {
            body,
            other: None,
            arms_W: [arm_W, Vector3::zeros()],
            normal_W: force_W / size_n,
            rest_W: force_W,
            stiffness: [self.stiffness_n_per_m, 0.0],
            damping: [0.0; 2],
            mu_hold: 0.0,
            mu_slide: 0.0,
            held: Held::Slip,
            force_W,
            torsion: Torsion::default(),
            rolling: Rolling::default(),
            turning_m: [0.0; 2],
            tie_n: None,
        };
        let velocity_W = motion.at(&arm_W);
        row.rest_W += force_W - row.trial_W(&(velocity_W * dt_s), &velocity_W);
        Some(row)
    }
}
