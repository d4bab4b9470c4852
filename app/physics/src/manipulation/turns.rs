//! Turns of what moves, where that is more than a tick has time for.
//!
//! Problem: a finger in a heap wakes all of it, and a tick of a hundred mixed things takes several ticks' time; the finger would
//! get no answers, and feel nothing.
//! Model: no more than [so many](Manipulation::step_at_most) bodies are stepped in a tick. Three quarters of the places are for
//! those that are nearest to the fingers; the others go round among all that is left. Who waits is [`Standing::Held`]: fixed
//! where it is for who is stepped, like what sleeps. It keeps its velocity and goes on with it in its turn: what is far from
//! fingers moves more slowly than it would. What is [driven](Manipulation::drive) has to wait as well: it would go through who
//! is fixed only for want of time ([`Manipulation::pace_of_driven`]).
//! Invariants: nothing gets energy by it, for what is fixed does no work, and what a contact holds stays in its account; who a
//! finger touches is stepped; no allocation.
//! Cost: turns change once in [`TURN`] ticks, or where more woke than may be stepped: then a distance for each that is here,
//! and two walks through all pairs.

use haptics::Entity;
use nalgebra::Vector3;

use super::{MAX_DRIVEN, Manipulation, who};
use crate::collide::bounding_ball;
use crate::pair::REACH_M;
use crate::roster::{Roster, Standing};
use crate::touch::Touch;

/// Bodies that are stepped, and those that wait.
#[derive(Debug, Clone)]
pub(super) struct Turns {
    /// The most bodies in a tick.
    most: usize,
    /// Places of fingers \[m\].
    near: Vec<Vector3<f64>>,
    /// Those that wait, and some that do not any more.
    held: Vec<u32>,
    /// Way that driven entities have gone in all ticks, of each tick the longest \[m\].
    driven_way_m: f64,
    /// Something that is to be driven on waits for turns.
    pub(super) hurry: bool,
    /// The same when a body began to wait, of each that does \[m\]; of the others infinite.
    held_at_m: Box<[f64]>,
    /// Entities that were driven while somebody waited.
    moved: Vec<u32>,
    /// Of each that is stepped or waits, how far it is from a finger \[m\].
    all: Vec<(f64, u32)>,
    /// Of each body, whether it is stepped from now on.
    is_chosen: Box<[bool]>,
    /// The last one whose turn came because all have one.
    last: u32,
    /// Tick in which turns change at the latest.
    change_at: u64,
}

impl Turns {
    pub(super) fn new(bodies: usize) -> Self {
        Self {
            most: usize::MAX,
            near: Vec::with_capacity(MOST_NEAR),
            held: Vec::with_capacity(2 * bodies),
            driven_way_m: 0.0,
            hurry: false,
            held_at_m: vec![f64::INFINITY; bodies].into(),
            moved: Vec::with_capacity(2 * MAX_DRIVEN),
            all: Vec::with_capacity(bodies),
            is_chosen: vec![false; bodies].into(),
            last: 0,
            change_at: 0,
        }
    }

    /// Takes note of one that waits from now on.
    pub(super) fn hold(&mut self, body: usize) {
        self.held_at_m[body] = self.driven_way_m;
        if self.held.len() < self.held.capacity() {
            self.held.push(body as u32);
        }
    }

    /// Turns change in the next tick.
    pub(super) fn change(&mut self) {
        self.change_at = 0;
    }

    /// Takes note that this entity was driven on.
    pub(super) fn was_driven(&mut self, entity: usize) {
        let entity = entity as u32;
        if !self.held.is_empty() && self.moved.len() < self.moved.capacity() && !self.moved.contains(&entity)
        {
            self.moved.push(entity);
        }
    }

    /// Takes note that none of those that were driven went farther than this \[m\].
    pub(super) fn driven_went(&mut self, way_m: f64) {
        self.driven_way_m += way_m;
    }

    /// Share of its speed with which something may be driven on near this body, which waits.
    pub(super) fn pace_near(&self, body: usize) -> f64 {
        if self.driven_way_m - self.held_at_m[body] < MOST_WAY_M { SLOW } else { 0.0 }
    }

    /// True if so many are as many as may be stepped.
    pub(super) fn are_enough(&self, awake: usize) -> bool {
        awake >= self.most
    }
}

impl Manipulation {
    /// From now on no more bodies than this are stepped in a tick, but for who is touched or struck in it; of more those that are
    /// nearest to these places, and all others in turns.
    pub fn step_at_most(&mut self, most: usize, near_W: impl Iterator<Item = Vector3<f64>>) {
        self.turns.most = most.max(1);
        self.turns.near.clear();
        let are_numbers = |near_W: &Vector3<f64>| near_W.iter().all(|x| x.is_finite());
        self.turns.near.extend(near_W.filter(are_numbers).take(MOST_NEAR));
    }

    /// Number of bodies that wait for their turn.
    pub fn held(&self) -> usize {
        self.turns.held.iter().filter(|body| self.roster.standing(**body as usize) == Standing::Held).count()
    }

    /// After the forces of a tick were found: those with which bodies that wait hold what is touched, and what that pushes.
    pub(super) fn find_what_waiting_holds(&mut self, touches: &mut [Touch]) {
        let Self { roster, room, pairs, driven, held_W, bodies, settings, .. } = self;
        let islands = room.solver.islands();
        held_W.clear();
        held_W.resize(islands.iter().len(), Vector3::zeros());
        let waits = |entity: usize| {
            let standing = roster.numbers[entity].map(|body| roster.standing(body as usize));
            standing.is_some_and(|standing| standing == Standing::Held || standing.is_away())
                && driven.iter().all(|driven| driven.entity != entity)
        };
        for (_, pair) in pairs.iter_awake() {
            let [one, other] = pair.entities;
            for (leaning, fixed, sign) in [(one, other, 1.0), (other, one, -1.0)] {
                let place = roster.place_of_entity(leaning);
                if let Some(island) = place.and_then(|place| islands.island_of(place))
                    && waits(fixed)
                {
                    held_W[island] += pair.force_W(&room.rows) * sign;
                }
            }
        }
        let beyond_weight_n = |island: usize| {
            let members = islands.iter().nth(island).unwrap_or_default();
            let mass_kg: f64 = members.iter().map(|&place| bodies[place].mass.mass_kg).sum();
            let up_W = -settings.gravity_W.try_normalize(0.0).unwrap_or_default();
            let bears_n = held_W[island].dot(&up_W).clamp(0.0, mass_kg * settings.gravity_W.norm());
            (held_W[island] - up_W * bears_n).norm()
        };
        for touch in touches {
            let place = roster.place_of_entity(touch.entity);
            let held = place.and_then(|place| islands.island_of(place));
            let held = held.filter(|&island| held_W[island] != Vector3::zeros());
            touch.held_by_waiting_n = held.map_or(0.0, beyond_weight_n);
        }
    }

    /// Before a tick: who is stepped in it.
    pub(super) fn take_turns(&mut self, entities: &mut [Entity], touches: &[Touch]) {
        let is_over = self.roster.awake().len() > self.turns.most;
        if !is_over && (self.turns.held.is_empty() || self.ticks < self.turns.change_at) {
            return;
        }
        // What is driven waits for all near it, wherever the fingers are.
        let hurry = std::mem::take(&mut self.turns.hurry);
        self.turns.change_at = self.ticks + if hurry { HURRIED_TURN } else { TURN };
        self.see_all(entities, touches);
        self.choose(hurry);
        self.change_turns(entities);
    }

    /// Lists who is stepped or waits, with how far it is from a finger.
    fn see_all(&mut self, entities: &[Entity], touches: &[Touch]) {
        let Self { turns, roster, hand, is_marked: is_seen, .. } = self;
        let Turns { near, held, all, is_chosen, .. } = turns;
        all.clear();
        let apart_m = |body: usize| {
            let radius_m = bounding_ball(&entities[roster.entities[body]].shape).map_or(0.0, |ball| ball.1);
            let to_centre_m = |near_W: &Vector3<f64>| (near_W - roster.bodies[body].centre_W).norm();
            near.iter().map(to_centre_m).fold(f64::INFINITY, f64::min) - radius_m
        };
        let is_touched = |body: usize| touches.iter().any(|touch| touch.entity == roster.entities[body]);
        for &body in roster.awake() {
            is_chosen[body] = false;
            let is_at_hand = hand.is_tied_to(body) || is_touched(body);
            all.push((if is_at_hand { f64::NEG_INFINITY } else { apart_m(body) - STAYS_M }, body as u32));
        }
        // One that waited, was woken and waits again is there twice.
        held.retain(|&body| {
            roster.standing(body as usize) == Standing::Held
                && !std::mem::replace(&mut is_seen[body as usize], true)
        });
        for &body in &*held {
            is_seen[body as usize] = false;
            is_chosen[body as usize] = false;
            all.push((apart_m(body as usize), body));
        }
    }

    /// Chooses the nearest, for three quarters of the places or for one, and those whose turn it is.
    fn choose(&mut self, has_few_nearest: bool) {
        let Turns { most, near, all, is_chosen, last, .. } = &mut self.turns;
        let most = (*most).min(all.len());
        let wanted = match near.is_empty() {
            true => 0,
            false if has_few_nearest => most / 4,
            false => most - most / 4,
        };
        let nearest = wanted.min(all.len());
        if nearest > 0 && nearest < all.len() {
            all.select_nth_unstable_by(nearest - 1, |one, other| one.0.total_cmp(&other.0));
        }
        let (chosen, rest) = all.split_at_mut(nearest);
        let others = (most - nearest).min(rest.len());
        let begin = *last;
        let after = move |body: &(f64, u32)| body.1.wrapping_sub(begin).wrapping_sub(1);
        if others > 0 && others < rest.len() {
            rest.select_nth_unstable_by_key(others - 1, after);
        }
        let in_turn = &rest[..others];
        if let Some(&(_, body)) = in_turn.iter().max_by_key(|body| after(body)) {
            *last = body;
        }
        for (_, body) in chosen.iter().chain(in_turn) {
            is_chosen[*body as usize] = true;
        }
    }

    /// Holds who is stepped and was not chosen, and wakes who was.
    fn change_turns(&mut self, entities: &mut [Entity]) {
        let Self { turns, roster, .. } = self;
        let standing = |roster: &Roster, body: u32| roster.standing(body as usize);
        for at in 0..turns.all.len() {
            let body = turns.all[at].1;
            if !turns.is_chosen[body as usize] && standing(roster, body) == Standing::Awake {
                let entity = &mut entities[roster.entities[body as usize]];
                entity.move_to(entity.X_WB);
                turns.hold(body as usize);
            }
        }
        let Turns { all, is_chosen, held, .. } = turns;
        let changes = all.iter().map(|&(_, body)| {
            let body = body as usize;
            (body, if is_chosen[body] { Standing::Awake } else { Standing::Held })
        });
        roster.set_all(changes);
        held.retain(|&body| !is_chosen[body as usize]);
        let is_awake = |body: usize| roster.standing(body) == Standing::Awake;
        let who = who(roster, entities, self.contacts);
        self.pairs.regroup(is_awake, &who);
        self.meet_what_was_driven(entities);
    }

    /// Those whose turn it is now, and near which something was driven while they waited, look for what came near, and are pushed
    /// as deep as it has come: who drives it has worked for that.
    fn meet_what_was_driven(&mut self, entities: &[Entity]) {
        let Self { turns, pairs, roster, broad_phase, contacts, .. } = self;
        let Turns { all, is_chosen, held, held_at_m, driven_way_m, moved, .. } = turns;
        let who = who(roster, entities, *contacts);
        let resumes = |body: u32| is_chosen[body as usize] && held_at_m[body as usize] < *driven_way_m;
        pairs.were_driven_among(moved, resumes, &who);
        for &(_, body) in &*all {
            if resumes(body) {
                pairs.meet(body as usize, &who, broad_phase, true);
            }
        }
        for &(_, body) in &*all {
            if is_chosen[body as usize] {
                held_at_m[body as usize] = f64::INFINITY;
            }
        }
        if held.is_empty() {
            moved.clear();
        }
    }
}

/// Turns last so many ticks.
const TURN: u64 = 16;
/// And so many while something that is driven waits for all near it to have one.
const HURRIED_TURN: u64 = 4;
/// Longest way of something driven, but for a tick, near who waits for its turn: less than contact points are
/// [seen from](REACH_M) \[m\].
const MOST_WAY_M: f64 = 0.5 * REACH_M;
/// Until then it goes so much more slowly than it would.
const SLOW: f64 = 0.125;
/// Places of fingers and of what they hold.
const MOST_NEAR: usize = 16;
/// Advantage of those that are stepped: two that are as near do not take turns \[m\].
const STAYS_M: f64 = 2e-3;
