//! What of a fast step others are told: [`world::events`].
//!
//! Frames and signs: a finger's contact tells its own force on the user, as rendered or, on a body, as that moved it; what
//! fields and guides add and passivity takes is not part of it.

use super::FastStep;
use crate::row::Row;
use haptics::ContactState;
use physics::{Reason, Standing};
use world::events::{EventSender, Kind, List, MOST_TOUCHED, PairForce, Touching, Watch, Why};
use world::lists::Handed;

/// Pairs of entities that are watched at once.
const MOST_PAIRS: usize = 2048;

/// Tells, after each step, what is new.
pub struct EventTeller {
    watch: Watch,
    out: EventSender,
    touching: Vec<Touching>,
    /// Of each body, whether another thread has it.
    elsewhere: Vec<bool>,
    handed: Handed,
    /// In which space each finger was.
    spaces: Vec<u32>,
}

impl EventTeller {
    /// Of this step, to that queue.
    pub fn new(step: &FastStep, out: EventSender) -> Self {
        let bodies = step.bodies().len();
        let pairs = bodies.saturating_mul(step.entities().len()).min(MOST_PAIRS);
        let manipulation = step.objects.manipulation();
        Self {
            watch: Watch::new(step.fingers.len(), pairs, step.period_s),
            out,
            touching: Vec::with_capacity(MOST_TOUCHED),
            elsewhere: (0..bodies).map(|body| manipulation.standing(body) == Standing::Elsewhere).collect(),
            handed: Handed::default(),
            spaces: step.fingers.iter().map(|finger| finger.finger.space()).collect(),
        }
    }

    /// Tells what the last step, which was that of this row, brought.
    pub fn tell(&mut self, step: &FastStep, row: &Row) {
        self.watch.begin(row.run_tick);
        for (finger, row) in (0..step.fingers.len()).zip(&row.fingers) {
            self.find_touching(step, finger);
            self.watch.finger(finger, &self.touching, row.buttons, row.attached, &mut self.out);
        }
        self.watch.grasps(&mut self.out);
        self.tell_doors(step);
        self.tell_pairs(step);
        for parked in step.parked_now() {
            let why = match parked.why {
                Reason::LeftTheWorld => Why::LeftTheWorld,
                Reason::NotANumber => Why::NotANumber,
            };
            self.watch.tell(Kind::Parked { entity: parked.entity as u32, why }, &mut self.out);
        }
        self.tell_lists(step);
    }

    fn find_touching(&mut self, step: &FastStep, finger: usize) {
        self.touching.clear();
        for contact in step.fingers[finger].finger.contacts().take(MOST_TOUCHED) {
            let is_body = step.objects.manipulation().is_body(contact.entity);
            let moved_W = is_body.then(|| step.objects.touch_force_W(finger, contact.entity)).flatten();
            self.touching.push(Touching {
                entity: contact.entity as u32,
                force_on_user_W: moved_W.unwrap_or(contact.force_on_user_W),
                slips: ContactState::from(contact.friction) == ContactState::Slip,
                is_body,
            });
        }
    }

    fn tell_doors(&mut self, step: &FastStep) {
        for ((finger, own), was) in (0..).zip(&step.fingers).zip(&mut self.spaces) {
            let to = own.finger.space();
            let from = std::mem::replace(was, to);
            if from != to {
                self.watch.tell(Kind::Door { finger, from, to }, &mut self.out);
            }
        }
    }

    fn tell_pairs(&mut self, step: &FastStep) {
        let manipulation = step.objects.manipulation();
        let pairs = manipulation
            .pair_forces()
            .map(|(entities, force_W)| PairForce { entities: entities.map(|entity| entity as u32), force_W });
        let rests = |entities: [u32; 2]| manipulation.rest_together(entities.map(|entity| entity as usize));
        self.watch.pairs(pairs, step.objects.stepped_s(), rests, &mut self.out);
    }

    /// Looks for who has been handed over only if anybody was.
    fn tell_lists(&mut self, step: &FastStep) {
        let Some((_, handed)) = step.handed() else { return };
        if (handed.came, handed.went) == (self.handed.came, self.handed.went) {
            return;
        }
        self.handed = handed;
        let manipulation = step.objects.manipulation();
        for (body, was) in self.elsewhere.iter_mut().enumerate() {
            let is = manipulation.standing(body) == Standing::Elsewhere;
            if std::mem::replace(was, is) != is {
                let (entity, to) =
                    (manipulation.entity_of(body) as u32, if is { List::Slow } else { List::Fast });
                self.watch.tell(Kind::ListChange { entity, to }, &mut self.out);
            }
        }
    }
}
