//! What orders do to a fast step: how much of forces is felt, what fingers feel of a surface, who is moved by hand, other
//! friction, time that stands still for objects.
//!
//! Model: what is moved goes where it is driven, tick by tick. An entity without a mass is a plate that carries and pushes; a
//! body is taken hold of for that time, and at rest when it is let go. Whatever comes near it is called over into the fast
//! list first, as what comes near a finger is: so both lists never step what one thing touches, and the slow one need only
//! know where it stands.
//! Invariants: no allocation; what the slow list is told waits here while its queue is full.

#![allow(non_snake_case)] // Frames are capital letters: to_W is a pose in W.

use super::FastStep;
use super::objects::Objects;
use haptics::{Entity, Felt, Friction};
use nalgebra::{Isometry3, Vector3};
use physics::{Aabb, MAX_DRIVEN, Made, Standing};
use world::lists::{FastList, SlowOrder};

/// Around what is moved, everything has to be in the fast list (m).
const AROUND_M: f64 = 0.02;
/// And what could come into its way within this time (s).
const AHEAD_S: f64 = 0.05;
/// No more bodies than this are called over at once for what is moved.
pub const MOST_CALLED: usize = 64;

/// The most that stiffness or damping changes in a tick, as a share of itself.
pub const MOST_SHARE: f64 = 0.01;
/// How long forces take to go before a world is replaced, and to come after that \[s\].
pub const FADE_S: f64 = 0.1;

/// Who has what is to be moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// It can be driven.
    Ready,
    /// It, or something near it, has been called over from the slow list.
    Coming,
    /// More than can be called over at once is near it.
    TooMuch,
}

impl FastStep {
    /// How much of the forces is felt from the next tick on, 0 to 1, and whether objects stand still meanwhile; if they do not,
    /// they get all of them.
    pub fn set_strength(&mut self, strength: f64, stands_still: bool) {
        self.strength = strength;
        if stands_still && !self.objects.stands_still {
            self.objects.manipulation.pause(&mut self.entities);
        }
        self.objects.stands_still = stands_still;
    }

    /// Whether [`Self::drive`] may move an entity: of what has no end everything is near, which two lists cannot share.
    pub fn can_drive(&self, entity: usize) -> bool {
        let has_end = self.objects.broad_phase().around(entity).is_some();
        entity < self.entities.len() && (has_end || self.objects.lists.is_none())
    }

    /// Before an entity is driven for the first time: who has it, and who has what touches it? In each tick until it is
    /// driven; what is not here is called over.
    pub fn call(&mut self, entity: usize) -> Hold {
        self.objects.call(entity)
    }

    /// Takes hold of a body that is [here](Self::call).
    pub fn take_hold(&mut self, entity: usize) {
        let Self { objects, entities, .. } = self;
        let Some(body) = objects.manipulation.body_of(entity) else { return };
        if objects.manipulation.take_hold(body, entities)
            && let Some(lists) = &mut objects.lists
        {
            lists.hand_over.hold(body);
        }
    }

    /// Whether this entity could go to this pose in the next tick: everything that it comes near has to be here. What is not is called
    /// over.
    pub fn look_ahead(&mut self, entity: usize, to_W: &Isometry3<f64>) -> Hold {
        let Self { objects, entities, period_s, .. } = self;
        let Some(is) = entities.get(entity) else { return Hold::Coming };
        let way_W = (to_W.translation.vector - is.X_WB.translation.vector) * (AHEAD_S / *period_s);
        objects.is_clear(entity, &way_W)
    }

    /// How fast this entity may go, as a share of how fast it would: less than 1 near what waits for its turn.
    pub fn pace_of_driven(&mut self, entity: usize) -> f64 {
        // In a pause nobody has a turn.
        if self.objects.is_paused { 1.0 } else { self.objects.manipulation.pace_of_driven(entity) }
    }

    /// In the next tick this entity goes to this pose; says whether it will.
    pub fn drive(&mut self, entity: usize, to_W: Isometry3<f64>) -> bool {
        self.objects.manipulation.drive(entity, to_W)
    }

    /// Whether a body was parked here.
    pub fn is_parked(&self, entity: usize) -> bool {
        let manipulation = self.objects.manipulation();
        manipulation.body_of(entity).is_some_and(|body| manipulation.standing(body) == Standing::Parked)
    }

    /// Puts a body that is held somewhere at once.
    pub fn put(&mut self, entity: usize, at_W: Isometry3<f64>) {
        let Self { objects, entities, .. } = self;
        objects.manipulation.put(entity, &at_W, entities);
    }

    /// An entity has come to where it was driven. A body is at rest there and falls, slides or stays as it must.
    pub fn let_go(&mut self, entity: usize) {
        let Self { objects, entities, .. } = self;
        if let Some(body) = objects.manipulation.body_of(entity) {
            objects.manipulation.let_go(body, entities);
            if let Some(lists) = &mut objects.lists {
                lists.hand_over.let_go(body);
            }
        }
    }

    /// How many times the stiffness and damping of an entity fingers feel.
    pub fn felt(&self, entity: usize) -> Option<[f64; 2]> {
        self.entities.get(entity).map(|entity| [entity.felt.stiffness, entity.felt.damping])
    }

    /// Changes that, from the next tick on.
    pub fn set_felt(&mut self, entity: usize, [stiffness, damping]: [f64; 2]) {
        if let Some(entity) = self.entities.get_mut(entity) {
            entity.felt = Felt { stiffness, damping };
        }
    }

    /// Exchanges the friction of an entity for another one, on both sides; `false`, and nothing happens, while the slow side
    /// can be told nothing.
    pub fn exchange_friction(
        &mut self,
        entity: usize,
        other: &mut Friction,
        for_slow: &mut Option<Friction>,
    ) -> bool {
        let Self { objects, entities, .. } = self;
        let Some(changed) = entities.get_mut(entity) else { return true };
        if let Some(lists) = &mut objects.lists {
            if !lists.hand_over.can_order() {
                return false;
            }
            if let Some(friction) = for_slow.take() {
                // There is room.
                let _ = lists.hand_over.order(SlowOrder::Friction { entity: entity as u32, friction });
            }
        }
        std::mem::swap(&mut changed.friction, other);
        objects.manipulation.has_other_friction(entity, entities);
        true
    }

    /// From the next tick on nothing moves by itself, or does again; fingers feel things as if they were fixed meanwhile.
    /// `false`, and nothing happens, while the slow side can be told nothing.
    pub fn pause(&mut self, is_paused: bool) -> bool {
        let Self { objects, entities, .. } = self;
        if let Some(lists) = &mut objects.lists
            && lists.hand_over.order(SlowOrder::Pause(is_paused)).is_err()
        {
            return false;
        }
        objects.is_paused = is_paused;
        if is_paused {
            objects.manipulation.pause(entities);
        }
        true
    }

    /// Whether nothing moves by itself.
    pub fn is_paused(&self) -> bool {
        self.objects.is_paused
    }

    /// Its slow list, which another thread has, is to begin.
    pub fn begin(&mut self) {
        if let Some(lists) = &mut self.objects.lists {
            // It is the first.
            let _ = lists.hand_over.order(SlowOrder::Begin);
        }
    }

    /// Whether a finger would feel it at once if this entity, or any that moves, became another thing.
    pub fn is_felt(&self, entity: Option<usize>) -> bool {
        let objects = &self.objects;
        let moves = |touched: usize| Some(touched) == entity || objects.manipulation.is_body(touched);
        let touches =
            self.fingers.iter().any(|finger| finger.finger.contacts().any(|contact| moves(contact.entity)));
        touches || !objects.pulls.is_empty() || objects.ticks.iter().any(|tick| tick.attached.is_some())
    }

    /// Whether a finger would feel it at once if this body became another thing: it touches that, or a body beside it.
    pub fn is_felt_at(&self, entity: usize) -> bool {
        let manipulation = self.objects.manipulation();
        let around = manipulation.broad_phase().around(entity);
        let is_beside = |touched: usize| {
            let others = manipulation.broad_phase().around(touched).filter(|_| manipulation.is_body(touched));
            touched == entity
                || others.is_some_and(|box_W| around.is_some_and(|around| around.overlaps(box_W)))
        };
        let touched = self.fingers.iter().flat_map(|finger| finger.finger.contacts());
        let pulled = self.objects.pulls.iter().map(|pull| pull.entity);
        let tied = self.objects.ticks.iter().filter_map(|tick| tick.attached);
        touched.map(|contact| contact.entity).chain(pulled).chain(tied).any(is_beside)
    }

    /// How much the contacts of a finger pressed in the last tick, all together (N); of the finger for which that is most.
    pub fn touch_load_n(&self) -> f64 {
        let of_finger = |finger: &super::DeviceFinger| -> f64 {
            finger.finger.contacts().map(|contact| contact.force_on_user_W.norm()).sum()
        };
        self.fingers.iter().map(of_finger).fold(0.0, f64::max)
    }
}

impl Objects {
    /// Whether the slow list has a body.
    pub(super) fn is_slow(&self, body: usize) -> bool {
        let is_held = || self.lists.as_ref().is_some_and(|lists| lists.hand_over.holds(body));
        self.lists.is_some() && self.manipulation.standing(body).is_away() && !is_held()
    }

    fn call(&mut self, entity: usize) -> Hold {
        let clear = self.is_clear(entity, &Vector3::zeros());
        let body = self.manipulation.body_of(entity).filter(|_| clear != Hold::TooMuch);
        let away = body.filter(|body| self.manipulation.standing(*body).is_away());
        match (&mut self.lists, away) {
            (Some(lists), Some(body)) => {
                lists.hand_over.fetch(body);
                Hold::Coming
            }
            _ => clear,
        }
    }

    /// Whether everything near an entity that is moved this way soon is here; what is not, is called over.
    fn is_clear(&mut self, entity: usize, way_W: &Vector3<f64>) -> Hold {
        let Some(lists) = &mut self.lists else { return Hold::Ready };
        let Some(around) = self.manipulation.broad_phase().around(entity) else { return Hold::Ready };
        let soon: Aabb = around.swept(way_W).grown(AROUND_M);
        let (mut away, mut coming) = (0, false);
        self.manipulation.broad_phase().near(&soon, |other| {
            if let Some(body) = self.manipulation.body_of(other).filter(|_| other != entity)
                && self.manipulation.standing(body).is_away()
            {
                away += 1;
                coming |= !lists.hand_over.holds(body);
            }
        });
        if away > MOST_CALLED {
            return Hold::TooMuch;
        }
        lists.hand_over.call_over(soon);
        // Of bodies that are here the slow list knows nothing.
        coming |= !self.manipulation.is_body(entity) && !self.moved.add(entity);
        if coming { Hold::Coming } else { Hold::Ready }
    }

    /// A tick in which nothing moves by itself.
    pub(super) fn stand(&mut self, entities: &mut [Entity]) {
        self.touches.clear();
        self.clear_pulls();
        self.ticks.iter_mut().for_each(|tick| tick.attached = None);
        self.stepped_s = 0.0;
        self.made = Made::default();
        self.manipulation.step_driven(entities);
    }
}

/// The entities that were moved and of which the slow list has not been told.
#[derive(Debug)]
pub(super) struct Moved(Vec<usize>);

impl Default for Moved {
    fn default() -> Self {
        Self(Vec::with_capacity(2 * MAX_DRIVEN))
    }
}

impl Moved {
    /// `false`: it has to wait.
    fn add(&mut self, entity: usize) -> bool {
        let is_new = !self.0.contains(&entity);
        let has_room = self.0.len() < self.0.capacity();
        if is_new && has_room {
            self.0.push(entity);
        }
        has_room || !is_new
    }

    /// Says where they stand now.
    pub(super) fn tell(&mut self, hand_over: &mut FastList, entities: &[Entity]) {
        self.0.retain(|&entity| {
            let to_W = entities[entity].X_WB;
            hand_over.order(SlowOrder::Move { entity: entity as u32, to_W }).is_err()
        });
    }
}
