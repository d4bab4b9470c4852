//! Who holds what: two fingers that touch an entity, or one that it is tied to.

use super::fingers::FingerWatch;
use super::{QUIET_S, Teller};
use crate::events::Kind;

/// Entities that are held at once; each needs a finger at least, and a finger touches few.
const MOST: usize = 32;

#[derive(Debug, Default)]
pub(super) struct Grasps {
    held: Vec<Held>,
    /// Entities in touch with fingers, and bit `i`: with finger `i`.
    seen: Vec<(u32, u32)>,
}

#[derive(Debug, Clone, Copy)]
struct Held {
    entity: u32,
    began: u64,
    last: u64,
}

impl Grasps {
    pub(super) fn new() -> Self {
        Self { held: Vec::with_capacity(MOST), seen: Vec::with_capacity(MOST) }
    }

    pub(super) fn look(&mut self, fingers: &[FingerWatch], teller: &mut Teller<'_>) {
        self.seen.clear();
        for (finger, watched) in fingers.iter().enumerate() {
            let bodies = watched.touched().iter().filter(|touched| touched.is_body);
            for touched in bodies {
                self.see(touched.entity, finger);
            }
            if let Some(entity) = watched.tied {
                self.see(entity, finger);
            }
        }
        let is_tied = |entity| fingers.iter().any(|finger| finger.tied == Some(entity));
        let now = teller.now.run_tick;
        for &(entity, holders) in &self.seen {
            if holders.count_ones() < 2 && !is_tied(entity) {
                continue;
            }
            if let Some(held) = self.held.iter_mut().find(|held| held.entity == entity) {
                held.last = now;
            } else if self.held.len() < MOST {
                self.held.push(Held { entity, began: now, last: now });
                teller.tell(Kind::Grasp { entity, fingers: holders });
            }
        }
        self.held.retain(|held| {
            let stays = teller.time_s(now.saturating_sub(held.last)) < QUIET_S;
            if !stays {
                held.tell(teller);
            }
            stays
        });
    }

    /// Number of them.
    pub(super) fn open(&self) -> usize {
        self.held.len()
    }

    /// All are let go.
    pub(super) fn end(&mut self, teller: &mut Teller<'_>) {
        for held in self.held.drain(..) {
            held.tell(teller);
        }
    }

    fn see(&mut self, entity: u32, finger: usize) {
        let bit = 1_u32.checked_shl(finger as u32).unwrap_or(0);
        if let Some((_, holders)) = self.seen.iter_mut().find(|(seen, _)| *seen == entity) {
            *holders |= bit;
        } else if self.seen.len() < MOST {
            self.seen.push((entity, bit));
        }
    }
}

impl Held {
    /// That it is not any more.
    fn tell(&self, teller: &mut Teller<'_>) {
        let lasted_s = teller.time_s(self.last - self.began + 1);
        teller.tell(Kind::Release { entity: self.entity, lasted_s });
    }
}
