//! The entities that move, in the fast step: what the fingers' touches do to them, and what that does to the fingers.
//!
//! Model: fingers render against the entities as they are when the tick begins. Each touch on one that moves is handed to
//! [`physics::Manipulation`], which gives back the force that the body got; the finger's force is changed by the
//! difference. So what is commanded is, times -1, what moved the object.
//!
//! Invariants: nothing moves before a run's t = 0 (the scene is what it says until then), and no stall of the driver is
//! made up for at once: objects are late by what was missed.

use haptics::{ContactState, Entity};
use nalgebra::Vector3;
use physics::{Made, Manipulation, Touch};

use super::DeviceFinger;
use crate::row::{BodyRow, FingerRow};

/// Ticks that a single step of the objects makes up for at most.
const MOST_TICKS: f64 = 4.0;

/// Moving entities and what is known of them.
#[derive(Debug, Clone)]
pub struct Objects {
    manipulation: Manipulation,
    touches: Vec<Touch>,
    /// As the tick began.
    rows: Vec<BodyRow>,
    period_s: f64,
    /// What the last tick took.
    pub made: Made,
}

impl Objects {
    /// With room for this many fingers.
    pub fn new(manipulation: Manipulation, fingers: usize, period_s: f64) -> Self {
        let room = fingers * manipulation.bodies().len() * haptics::MAX_TOUCH_POINTS;
        let mut objects = Self {
            rows: vec![BodyRow::default(); manipulation.bodies().len()],
            touches: Vec::with_capacity(room),
            manipulation,
            period_s,
            made: Made::default(),
        };
        objects.note();
        objects
    }

    /// The bodies as the tick began.
    pub fn rows(&self) -> &[BodyRow] {
        &self.rows
    }

    /// Those that were parked in the last tick.
    pub fn parked_now(&self) -> &[physics::Parked] {
        let parked = self.manipulation.parked();
        &parked[parked.len().saturating_sub(self.made.parked)..]
    }

    /// Takes note of how the bodies are.
    pub fn note(&mut self) {
        for (row, body) in self.rows.iter_mut().zip(self.manipulation.bodies()) {
            let (pose, spin_W) = (body.pose(), body.angular_velocity_W());
            let from_centre_W = pose.translation.vector - body.centre_W;
            *row = BodyRow {
                position: pose.translation.vector,
                orientation: pose.rotation.into_inner(),
                velocity: body.velocity_W + spin_W.cross(&from_centre_W),
                angular_velocity: spin_W,
            };
        }
    }

    /// Moves them by a tick of this length (s), and changes the fingers' forces to those which moved them.
    pub fn step(
        &mut self,
        entities: &mut [Entity],
        fingers: &[DeviceFinger],
        rows: &mut [FingerRow],
        dt_s: f64,
    ) {
        self.touches.clear();
        for (index, finger) in fingers.iter().enumerate() {
            for contact in finger.finger.contacts() {
                if self.manipulation.is_body(contact.entity) {
                    let is_sticking = ContactState::from(contact.friction) == ContactState::Stick;
                    for point in finger.finger.touch_points(entities, contact.entity).as_slice() {
                        if self.touches.len() < self.touches.capacity() {
                            self.touches.push(Touch {
                                entity: contact.entity,
                                finger: index,
                                point_W: point.point_W,
                                normal_W: point.normal_W,
                                force_on_user_W: point.force_on_user_W,
                                is_sticking,
                            });
                        }
                    }
                }
            }
        }
        let rendered = self.touches.iter().map(|touch| -touch.force_on_user_W);
        add_to_rows(rendered, &self.touches, fingers, rows);
        let dt_s = dt_s.min(MOST_TICKS * self.period_s);
        self.made = self.manipulation.step(entities, &mut self.touches, dt_s);
        let got = self.touches.iter().map(|touch| touch.force_on_user_W);
        add_to_rows(got, &self.touches, fingers, rows);
    }
}

/// Adds forces on users, one of each touch, to their fingers' rows; and their torques, where the finger has a radius.
fn add_to_rows(
    forces_W: impl Iterator<Item = Vector3<f64>>,
    touches: &[Touch],
    fingers: &[DeviceFinger],
    rows: &mut [FingerRow],
) {
    for (force_W, touch) in forces_W.zip(touches) {
        let row = &mut rows[touch.finger];
        row.force_on_user += force_W;
        if fingers[touch.finger].finger.radius_m() > 0.0
            && let Some(contact) = fingers[touch.finger].finger.contact(touch.entity)
        {
            row.torque_on_user += (touch.point_W - contact.god_object_W).cross(&force_W);
        }
    }
}
