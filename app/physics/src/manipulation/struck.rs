//! Bodies that may be struck within the tick, and how far they go in it then.
//!
//! Problem: contact points are looked for as far as a body goes with the velocity that it comes with. A light one that is struck
//! at 12 m/s leaves with up to 24 in the same tick, and would be through a plate 20 mm behind it before anybody looked.
//!
//! Model: of two whose ways may cross in the tick a ball may leave faster by `2 w / (w + w')` times the speed at which they come
//! nearer, `w` being one over its mass (an impact that keeps all energy), and strike the next one. What is not round turns, too:
//! where it is struck `w` is up to [`CORNER`] times as large, and its farthest point gets up to [`WHIP`] times as much. As far
//! as that it looks, and so large is its box. Rows of up to [`IN_A_ROW`] are followed.
//! Cost: a comparison for each body where nothing is fast; else a look at each pair, and boxes of what may be struck.

use haptics::{Entity, Form, Shape};

use super::Manipulation;
use crate::broad_phase::Aabb;
use crate::pair::REACH_M;

/// Bodies of which one strikes the next in a tick.
pub(super) const IN_A_ROW: usize = 4;
/// An impact makes nothing faster than this, times what was fastest.
const MOST_GAIN: f64 = 3.0;
/// Of a box, one over the mass that is felt at a corner, times its mass.
const CORNER: f64 = 7.0;
/// Of a rod that is struck a third of the way from its middle to its end, the speed of that end, in those of where it is struck.
const WHIP: f64 = 1.5;
/// Way in a tick up to which nothing is fast \[m\]: what is struck then goes twice as far, and things are thicker than that.
const FAST_M: f64 = 4e-3;
/// The most that are looked for in a tick: where more may be struck, as in an explosion, everything would be near everything.
const MOST_STRUCK: usize = 16;
/// Boxes that were made larger are made smaller once in so many ticks.
const TICKS_TO_SHRINK: u64 = 16;

/// Bodies that may be struck.
#[derive(Debug, Clone, Default)]
pub(super) struct Struck {
    /// Of each body that is in the tick's arrays, how fast it may leave the tick at most \[m/s\].
    pub(super) speeds_m_s: Vec<f64>,
    /// Of each body, how fast it may be struck in this tick \[m/s\].
    by_body_m_s: Box<[f64]>,
    /// Those that may be in this tick.
    now: Vec<u32>,
    /// Those whose boxes are larger for it, each once.
    large: Vec<u32>,
    is_large: Box<[bool]>,
}

impl Struck {
    pub(super) fn new(bodies: usize, places: usize) -> Self {
        Self {
            speeds_m_s: Vec::with_capacity(places),
            by_body_m_s: vec![0.0; bodies].into(),
            now: Vec::with_capacity(bodies),
            large: Vec::with_capacity(bodies),
            is_large: vec![false; bodies].into(),
        }
    }
}

impl Manipulation {
    /// Takes over how fast bodies are by themselves, behind those that are known to be struck.
    pub(super) fn line_up_struck(&mut self) {
        let Self { struck, speeds_m_s, roster, .. } = self;
        struck.speeds_m_s.clear();
        struck.speeds_m_s.extend_from_slice(speeds_m_s);
        for (may_m_s, &body) in struck.speeds_m_s.iter_mut().zip(roster.awake()) {
            *may_m_s = may_m_s.max(struck.by_body_m_s[body]);
        }
    }

    /// Makes bodies look as far as they go if those strike them that are known to be fast. Says whether there are more of them now.
    pub(super) fn look_behind_struck(&mut self, entities: &[Entity], dt_s: f64) -> bool {
        let fastest_m_s = self.speeds_m_s.iter().copied().fold(0.0, f64::max);
        if fastest_m_s * dt_s <= FAST_M {
            return false;
        }
        let mut is_more = false;
        for at in 0..self.pairs.awake_count() {
            let (key, _) = self.pairs.awake_at(at);
            let other = self.roster.place_of_entity(key.entity as usize);
            let other = other.or_else(|| self.place_of_driven(key.entity as usize));
            let (Some(one), Some(other)) = (self.roster.place(key.body as usize), other) else { continue };
            let both = [one, other];
            let may_m_s = both.map(|place| self.struck.speeds_m_s[place]);
            if (may_m_s[0] + may_m_s[1]) * dt_s <= REACH_M || !self.may_cross(both, entities, dt_s) {
                continue;
            }
            let is_round = both
                .map(|place| matches!(entities[self.entities[place]].shape, Shape::Form(Form::Sphere(_))));
            let per_kg = both.map(|place| self.motions[place].inverse_mass);
            for (place, by) in [(0, 1), (1, 0)] {
                let own_m_s = self.speeds_m_s[both[place]];
                let (felt, whip) = if is_round[place] { (1.0, 1.0) } else { (CORNER, WHIP) };
                let share = felt * per_kg[place] / (felt * per_kg[place] + per_kg[by]);
                let leaves_m_s = own_m_s + 2.0 * whip * share * (own_m_s + may_m_s[by]);
                let leaves_m_s = leaves_m_s.min(MOST_GAIN * fastest_m_s);
                // Nearer than its own thickness it is found before it is through anything.
                if (leaves_m_s - may_m_s[place]) * dt_s > thickness_m(&entities[self.entities[both[place]]]) {
                    self.struck.speeds_m_s[both[place]] = leaves_m_s;
                    let body = self.roster.awake()[both[place]];
                    if self.struck.by_body_m_s[body] == 0.0 {
                        self.struck.now.push(body as u32);
                    }
                    self.struck.by_body_m_s[body] = leaves_m_s;
                    is_more = true;
                }
            }
        }
        if self.struck.now.len() > MOST_STRUCK {
            let Struck { now, by_body_m_s, .. } = &mut self.struck;
            now.drain(..).for_each(|body| by_body_m_s[body as usize] = 0.0);
            self.line_up_struck();
            return false;
        }
        if is_more {
            self.make_boxes_large(entities, dt_s);
        }
        is_more
    }

    /// True if the ways of two of these places may cross in the tick.
    fn may_cross(&self, places: [usize; 2], entities: &[Entity], dt_s: f64) -> bool {
        let ways = places.map(|place| {
            let way_W = self.motions[place].velocity_W * dt_s;
            let aside_m = (self.struck.speeds_m_s[place] * dt_s - way_W.norm()).max(0.0);
            let around = Aabb::of_entity(&entities[self.entities[place]])?;
            Some(around.swept(&way_W).grown(aside_m + 0.5 * REACH_M))
        });
        matches!(ways, [Some(one), Some(other)] if one.overlaps(&other))
    }

    /// Begins the pairs with all that they may reach.
    fn make_boxes_large(&mut self, entities: &[Entity], dt_s: f64) {
        self.neighbours.clear();
        for &body in &self.struck.now {
            let entity = self.roster.entities[body as usize];
            let way_m = self.struck.by_body_m_s[body as usize] * dt_s;
            if self.broad_phase.may_go(entity, &entities[entity], way_m) {
                self.neighbours.push(body);
                self.is_marked[body as usize] = true;
                if !std::mem::replace(&mut self.struck.is_large[body as usize], true) {
                    self.struck.large.push(body);
                }
            }
        }
        self.follow_neighbours(entities);
    }

    /// Nobody is expected to be struck any more in this tick. Now and then their boxes become smaller again; those who are awake are
    /// noted as neighbours, and marked.
    pub(super) fn forget_struck(&mut self, entities: &[Entity], dt_s: f64) {
        let Self { struck, roster, broad_phase, neighbours, is_marked, .. } = self;
        let Struck { now, by_body_m_s, large, is_large, .. } = struck;
        now.drain(..).for_each(|body| by_body_m_s[body as usize] = 0.0);
        if !self.ticks.is_multiple_of(TICKS_TO_SHRINK) {
            return;
        }
        for body in large.drain(..) {
            let number = body as usize;
            is_large[number] = false;
            let entity = roster.entities[number];
            let is_smaller =
                broad_phase.shrink(entity, &entities[entity], &(roster.bodies[number].velocity_W * dt_s));
            if is_smaller
                && roster.place(number).is_some()
                && !std::mem::replace(&mut is_marked[number], true)
            {
                neighbours.push(body);
            }
        }
    }
}

/// Half of the smallest size of the box around an entity \[m\].
fn thickness_m(entity: &Entity) -> f64 {
    Aabb::of_entity(entity).map_or(0.0, |around| 0.5 * (around.high_W - around.low_W).min())
}
