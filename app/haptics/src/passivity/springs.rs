//! Springs of a finger's contacts: their energy, and the part of it that presses along normals.

use nalgebra::Vector3;

use super::Pressing;
use crate::finger::Finger;

/// Remembers a finger's contacts from tick to tick.
#[derive(Debug)]
pub struct Springs {
    /// Of the last tick, by ascending numbers of their entities.
    last: Vec<Pressed>,
    /// Room for those of the next.
    next: Vec<Pressed>,
}

/// A contact.
#[derive(Debug, Clone, Copy)]
struct Pressed {
    entity: usize,
    normal_W: Vector3<f64>,
    god_object_W: Vector3<f64>,
    normal_n: f64,
}

impl Springs {
    /// For a finger that touches so many entities at most.
    pub fn new(contacts: usize) -> Self {
        let room = || Vec::with_capacity(contacts);
        Self { last: room(), next: room() }
    }

    /// Nothing is known of the last tick.
    pub fn reset(&mut self) {
        self.last.clear();
    }

    /// What the springs of all contacts hold under their present forces \[J\], and what of it presses, where a share of the
    /// forces is rendered. Once in a tick; `hip_W` is where the finger is \[m\].
    pub fn of(&mut self, finger: &Finger, rendered: f64, hip_W: &Vector3<f64>) -> (f64, Pressing) {
        let (mut springs_j, mut all) = (0.0, Pressing::NOTHING);
        self.next.clear();
        for contact in finger.contacts().take(self.next.capacity()) {
            let spring_j = |force_squared: f64| 0.5 * force_squared / contact.stiffness_n_per_m;
            springs_j += spring_j(contact.force_on_user_W.norm_squared());
            let normal_n = contact.normal_force_n * rendered;
            all.force_on_user_W += contact.force_on_user_W * rendered;
            all.normal_on_user_W += contact.normal_W * normal_n;
            all.stored_j += spring_j(contact.normal_force_n * contact.normal_force_n);
            let now = Pressed {
                entity: contact.entity,
                normal_W: contact.normal_W,
                god_object_W: contact.god_object_W,
                normal_n,
            };
            if let Ok(at) = self.last.binary_search_by_key(&contact.entity, |last| last.entity) {
                all.followed_j += now.followed_j(&self.last[at], hip_W);
            }
            self.next.push(now);
        }
        std::mem::swap(&mut self.last, &mut self.next);
        (springs_j, all)
    }
}

impl Pressed {
    /// [`Pressing::followed_j`].
    fn followed_j(&self, last: &Self, hip_W: &Vector3<f64>) -> f64 {
        let turned_m = (self.god_object_W - hip_W).dot(&(self.normal_W - last.normal_W));
        let followed_m = (self.god_object_W - last.god_object_W).dot(&last.normal_W);
        last.normal_n * (turned_m + followed_m).max(0.0)
    }
}
