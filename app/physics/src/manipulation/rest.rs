//! Who wakes, and who falls asleep.

use haptics::Entity;

use super::{Manipulation, moving, who};
use crate::pair;
use crate::roster::Standing;
use crate::sleep::Rest;
use crate::touch::Touch;

/// Who may sleep is looked for once in so many ticks.
const TICKS_TO_SLEEP: u64 = 16;

impl Manipulation {
    /// Wakes a body that sleeps, and all that will wake with it.
    pub fn wake(&mut self, body: usize, entities: &[Entity]) {
        let mut next = body;
        while self.roster.standing(next) == Standing::Asleep {
            let after = self.roster.next(next);
            if next != body && self.turns.are_enough(self.roster.awake().len()) {
                self.roster.set(next, Standing::Held);
                self.turns.hold(next);
                self.turns.change();
            } else {
                self.begin_to_step(next, entities);
            }
            next = after;
        }
        if self.roster.standing(body) == Standing::Held {
            self.begin_to_step(body, entities);
        }
    }

    fn begin_to_step(&mut self, body: usize, entities: &[Entity]) {
        self.roster.set(body, Standing::Awake);
        let who = who(&self.roster, entities, self.contacts);
        self.pairs.wake(body, &who, &self.broad_phase);
    }

    pub(super) fn wake_entity(&mut self, entity: usize, entities: &[Entity]) {
        if let Some(body) = self.body_of(entity) {
            self.wake(body, entities);
        }
    }

    /// Wakes what somebody who is awake has come near to; says whether there was anything.
    pub(super) fn wake_what_is_met(&mut self, entities: &[Entity], dt_s: f64) -> bool {
        let (mut at, awake) = (0, self.roster.awake().len());
        while at < self.pairs.awake_count() {
            let (key, _) = self.pairs.awake_at(at);
            at += 1;
            let other = self.roster.numbers[key.entity as usize];
            let Some(pair) = other.map(|other| [key.body as usize, other as usize]) else { continue };
            let Some(sleeper) = pair.into_iter().find(|&body| self.roster.standing(body) == Standing::Asleep)
            else {
                continue;
            };
            let speed_m_s: f64 =
                pair.iter().filter_map(|&body| self.struck.speeds_m_s.get(self.roster.place(body)?)).sum();
            let [one, other] = pair.map(|body| &entities[self.roster.entities[body]]);
            if pair::is_near(one, other, pair::REACH_M + speed_m_s * dt_s) {
                self.wake(sleeper, entities);
                // Places have changed, and so has what comes after.
                self.line_up(entities, dt_s);
                at = 0;
            }
        }
        self.roster.awake().len() != awake
    }

    /// Counts for how long who is awake has rested, and puts islands to sleep that have rested for long enough.
    pub(super) fn rest(&mut self, entities: &mut [Entity], touches: &[Touch], dt_s: f64) {
        let Some(sleep) = self.settings.sleep else { return };
        for place in 0..self.roster.awake().len() {
            let body = self.roster.awake()[place];
            let rest = &mut self.roster.rests[body];
            rest.go_on(&moving(&self.roster.bodies[body]), &sleep, dt_s);
            if self.hand.is_tied_to(body) {
                *rest = Rest::default();
            }
        }
        for touch in touches {
            if let Some(body) = self.body_of(touch.entity) {
                self.roster.rests[body] = Rest::default();
            }
        }
        let is_tired = |body: &usize| self.roster.rests[*body].lasts_s >= sleep.after_s;
        if self.ticks.is_multiple_of(TICKS_TO_SLEEP) && self.roster.awake().iter().any(is_tired) {
            self.put_islands_to_sleep(entities, sleep.after_s);
        }
    }

    fn put_islands_to_sleep(&mut self, entities: &mut [Entity], after_s: f64) {
        let awake = self.roster.awake();
        self.sets.begin(awake.len());
        for at in 0..self.pairs.awake_count() {
            let (key, _) = self.pairs.awake_at(at);
            let places =
                [self.roster.place(key.body as usize), self.roster.place_of_entity(key.entity as usize)];
            if let [Some(one), Some(other)] = places
                && key.is_near
            {
                self.sets.join(one, other);
            }
        }
        // Of each set, the least that any of it has rested; it stands at the first.
        let least_s = &mut self.speeds_m_s;
        least_s.clear();
        least_s.extend(awake.iter().map(|&body| self.roster.rests[body].lasts_s));
        for place in 0..awake.len() {
            let first = self.sets.first(place);
            least_s[first] = least_s[first].min(least_s[place]);
        }
        // Numbers and not places: these change when the first one sleeps.
        self.entities.clear();
        self.entities.extend_from_slice(awake);
        for place in 0..self.entities.len() {
            let first = self.sets.first(place);
            if self.speeds_m_s[first] >= after_s {
                let (body, leader) = (self.entities[place], self.entities[first]);
                self.put_to_sleep(body, entities);
                if leader != body {
                    self.roster.join(leader, body);
                }
            }
        }
        let who = who(&self.roster, entities, self.contacts);
        self.pairs.put_to_sleep(|body| self.roster.standing(body) == Standing::Awake, &who);
    }

    fn put_to_sleep(&mut self, body: usize, entities: &mut [Entity]) {
        self.note_change(body);
        let state = &mut self.roster.bodies[body];
        (state.velocity_W, state.angular_momentum_W) = Default::default();
        let entity = &mut entities[self.roster.entities[body]];
        entity.move_to(entity.X_WB);
        self.roster.set(body, Standing::Asleep);
    }
}
