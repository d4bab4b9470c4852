//! The points at which a finger touches an entity.
//!
//! Model: a point finger, and a ball on a closed form, touches at one; a ball in a groove or a corner at two or three.
//! Each force has a friction cone of its own: it lies within `mu` of its own normal force ([`crate::rolling`]). They sum up
//! to the contact's, their torques about the ball's centre are felt where a device can turn. Shading and height maps lean
//! them afterwards.

use nalgebra::Vector3;

use crate::contact::Contact;
use crate::entity::Entity;
use crate::frame::{point_into_world, vector_into_world};
use crate::rolling::Share;

/// One of the points at which a finger touches an entity, in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchPoint {
    /// Where \[m\].
    pub point_W: Vector3<f64>,
    /// Outward unit normal of the entity there.
    pub normal_W: Vector3<f64>,
    /// What the user feels of it \[N\].
    pub force_on_user_W: Vector3<f64>,
}

/// All points at which a finger touches an entity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchPoints {
    points: [TouchPoint; MAX_TOUCH_POINTS],
    count: usize,
}

/// The most points at which a finger touches one entity.
pub const MAX_TOUCH_POINTS: usize = 4;

impl TouchPoints {
    pub(crate) const NONE: Self = Self { points: [TouchPoint::NOWHERE; MAX_TOUCH_POINTS], count: 0 };

    /// A contact at a single point.
    pub(crate) fn single(contact: &Contact, finger_radius_m: f64) -> Self {
        let mut all = Self::NONE;
        all.push(TouchPoint {
            point_W: contact.touch_point_W(finger_radius_m),
            normal_W: contact.normal_W,
            force_on_user_W: contact.force_on_user_W,
        });
        all
    }

    /// Shares of which the force is rendered with this strength. What was done to the contact's force besides is
    /// shared out as the loads are.
    pub(crate) fn of_shares(
        shares: impl Iterator<Item = Share>,
        entity: &Entity,
        contact: &Contact,
        strength: f64,
    ) -> Self {
        let mut all = Self::NONE;
        let (mut parts, mut left_W) = ([0.0; MAX_TOUCH_POINTS], contact.force_on_user_W);
        for (share, part) in entity.shading.turned_shares(&entity.shape, shares).zip(&mut parts) {
            *part = share.part;
            let force_on_user_W = vector_into_world(&entity.X_WB, &(share.force_on_user_B * strength));
            left_W -= force_on_user_W;
            all.push(TouchPoint {
                point_W: point_into_world(&entity.X_WB, &share.at.point_B),
                normal_W: vector_into_world(&entity.X_WB, &share.at.normal_B),
                force_on_user_W,
            });
        }
        for (point, part) in all.points.iter_mut().zip(parts) {
            point.force_on_user_W += left_W * part;
        }
        all
    }

    fn push(&mut self, point: TouchPoint) {
        if let Some(place) = self.points.get_mut(self.count) {
            *place = point;
            self.count += 1;
        }
    }

    /// As a slice; empty while nothing is touched.
    pub fn as_slice(&self) -> &[TouchPoint] {
        self.points.get(..self.count).unwrap_or_default()
    }

    /// Torque of all forces on the user about a point \[N m\].
    pub fn torque_on_user_about_W(&self, centre_W: &Vector3<f64>) -> Vector3<f64> {
        let torque_W = |at: &TouchPoint| (at.point_W - centre_W).cross(&at.force_on_user_W);
        self.as_slice().iter().map(torque_W).sum()
    }
}

impl TouchPoint {
    const NOWHERE: Self = {
        let zero = Vector3::new(0.0, 0.0, 0.0);
        Self { point_W: zero, normal_W: zero, force_on_user_W: zero }
    };
}
