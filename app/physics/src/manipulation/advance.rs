//! The end of a tick: motion, and who is near whom then.

use haptics::Entity;
use nalgebra::Vector3;

use super::{Manipulation, Parked, Reason, who};
use crate::body::Body;
use crate::integrator::Limits;
use crate::roster::Standing;

impl Manipulation {
    /// Takes the bodies to the end of the tick; says how many had to be parked.
    pub(super) fn advance(&mut self, entities: &mut [Entity], dt_s: f64) -> usize {
        let settings = self.settings;
        let limits = Limits { speed_m_s: settings.most_speed_m_s, spin_rad_s: settings.most_spin_rad_s };
        let before_parked = self.parked.len();
        for place in 0..self.roster.awake().len() {
            let number = self.roster.awake()[place];
            let (before, mut body) = (self.bodies[place], self.bodies[place]);
            settings.integrator.advance(&mut body, &self.gets[place], &limits, dt_s);
            let why = if !body.is_finite() {
                Some(Reason::NotANumber)
            } else {
                (body.centre_W.norm() > settings.world_radius_m).then_some(Reason::LeftTheWorld)
            };
            if let Some(why) = why {
                body = Body { velocity_W: Vector3::zeros(), angular_momentum_W: Vector3::zeros(), ..before };
                self.parked.push(Parked { entity: self.entities[place], why });
            }
            entities[self.entities[place]].move_to(body.pose());
            self.roster.bodies[number] = body;
            self.note_change(number);
        }
        for at in before_parked..self.parked.len() {
            let Some(body) = self.body_of(self.parked[at].entity) else { continue };
            self.roster.set(body, Standing::Parked);
        }
        self.parked.len() - before_parked
    }

    /// Finds who is near whom now.
    pub(super) fn keep_up(&mut self, entities: &[Entity], dt_s: f64) {
        self.neighbours.clear();
        self.forget_struck(entities, dt_s);
        let Self { broad_phase, roster, neighbours, is_marked, .. } = self;
        for &body in roster.awake() {
            let entity = roster.entities[body];
            let way_W = roster.bodies[body].velocity_W * dt_s;
            if broad_phase.moved(entity, &entities[entity], &way_W)
                && !std::mem::replace(&mut is_marked[body], true)
            {
                neighbours.push(body as u32);
            }
        }
        self.follow_neighbours(entities);
    }

    /// Begins and ends the pairs of the neighbours, which are marked; unmarks them.
    pub(super) fn follow_neighbours(&mut self, entities: &[Entity]) {
        let Self { broad_phase, roster, neighbours, is_marked, .. } = self;
        let who = who(roster, entities, self.contacts);
        self.pairs.follow_all(neighbours, is_marked, &who, broad_phase);
        for &body in &*neighbours {
            is_marked[body as usize] = false;
        }
    }
}
