//! What is to be seen of the rows of a run.

use crate::displaced::Placed;
use crate::row::{BodyRow, FingerRow, Row};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use view::{ContactMoment, FingerMoment, Moment};

/// Makes moments of rows.
#[derive(Debug, Clone)]
pub struct Moments {
    fingers: usize,
    /// Which entity each body is.
    entities: Vec<usize>,
    /// Where each entity was last.
    poses: Vec<Isometry3<f64>>,
    period_s: f64,
}

impl Moments {
    /// Of a scene with so many fingers, whose entities stand so; `entities` of them are the bodies, in the order of the rows.
    pub fn new(fingers: usize, poses: Vec<Isometry3<f64>>, entities: Vec<usize>, period_ns: u64) -> Self {
        Self { fingers, entities, poses, period_s: period_ns as f64 / 1e9 }
    }

    /// Of a tick, as it began; `placed` are other entities that have been moved.
    pub fn moment(&mut self, row: &Row, bodies: &[BodyRow], placed: &[Placed]) -> Moment {
        for &(entity, stands) in placed {
            if let Some(pose) = self.poses.get_mut(entity as usize) {
                *pose = stands;
            }
        }
        for (body, &entity) in bodies.iter().zip(&self.entities) {
            if let Some(pose) = self.poses.get_mut(entity) {
                let turned = UnitQuaternion::new_normalize(body.orientation);
                *pose = Isometry3::from_parts(body.position.into(), turned);
            }
        }
        let fingers = row.fingers[..self.fingers.min(row.fingers.len())].iter().map(|finger| FingerMoment {
            hip: finger.hip,
            god_object: finger.god_object,
            force: finger.force_on_user,
            entity: finger.entity.map(|entity| entity as usize),
            contact: contact(finger),
            space: finger.space,
        });
        Moment {
            t_s: self.time_s(row),
            poses: self.poses.clone(),
            fingers: fingers.collect(),
            ..Moment::default()
        }
    }

    /// When a tick was (s).
    pub fn time_s(&self, row: &Row) -> f64 {
        row.run_tick as f64 * self.period_s
    }

    /// Time since a body stood where it is in a tick's row (ms).
    pub fn age_ms(&self, row: &Row, body: &BodyRow) -> u64 {
        let ticks = body.as_of.map_or(0, |as_of| row.run_tick.saturating_sub(as_of));
        (1e3 * ticks as f64 * self.period_s).round() as u64
    }

    /// Which entity each body is.
    pub fn bodies(&self) -> &[usize] {
        &self.entities
    }

    /// How many entities there are.
    pub fn entities(&self) -> usize {
        self.poses.len()
    }

    /// The fingers that there are.
    pub fn fingers(&self) -> usize {
        self.fingers
    }
}

fn contact(finger: &FingerRow) -> Option<ContactMoment> {
    let radius_m = finger.friction_radius_m;
    (finger.normal != Vector3::zeros()).then(|| ContactMoment {
        normal: finger.normal,
        friction_radius_m: (radius_m > 0.0).then_some(radius_m),
        feature: finger.feature,
    })
}
