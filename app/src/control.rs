//! What people change while a run goes on: keys of the thesis' input manager (Melder ch. 7.2.12) and the scene itself.
//!
//! Problem: a key may come in any tick, and a hand is on the device: no key may be felt as a blow.
//!
//! Model: the slow side ([`desk`]) reads orders in words, checks them and makes whatever takes memory or time; they come to
//! the fast thread through a queue ([`queue`]), which takes a few in a tick. There everything is spread over ticks
//! ([`gradual`]): stiffness and damping change by shares, what is moved goes along a smooth path, and what cannot be spread
//! is done while no force is felt, for which forces fade away and come back: a world that takes the place of another one;
//! and, where a finger feels it, friction, a pause, a body that is taken or let go. A reset is an exchange of worlds, with
//! the same scene made anew: so everything is where it began, to the bit.
//! Devices that are attached to the camera follow it ([`carriage`]).
//! Invariants: orders are done in the order in which they came, but for what somebody wants now while a script waits; the
//! fast side neither allocates nor frees: what it is done with goes back to the slow side.

#![allow(non_snake_case)] // Names carry their frame: to_W is a place in W.

pub mod carriage;
pub mod desk;
pub mod gradual;
pub mod order;
pub mod path;
pub mod queue;
pub mod words;
mod world_maker;

use crate::fast_step::FastStep;
use carriage::Carriage;
use gradual::{FADE_S, Gradual};
use order::{FrictionChange, Order, Replacement, Spent};
use queue::OrderReceiver;
use world::events::Event;

/// So many orders are taken in a tick.
pub const ORDERS_A_TICK: usize = 4;

/// What became of a run's orders.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct OrderTally {
    /// Those that were taken.
    pub taken: u64,
    /// Those of them that could not be done.
    pub undone: u64,
    /// Those whose time had not come when the run ended.
    pub never_reached: u64,
}

impl std::fmt::Display for OrderTally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { taken, undone, never_reached } = self;
        write!(f, "{taken}")?;
        if *undone > 0 {
            write!(f, ", {undone} NOT DONE: too much was moved at once, or touched what was to be moved")?;
        }
        if *never_reached > 0 {
            write!(f, ", and {never_reached} NEVER REACHED: the run ended before their time")?;
        }
        Ok(())
    }
}

/// The fast side of orders.
pub struct Control {
    orders: OrderReceiver,
    gradual: Gradual,
    /// Of devices that go with the camera.
    carriage: Carriage,
    /// What is to be done next, and waits for silence.
    waiting: Option<Waiting>,
    /// How much of the forces is felt, 0 to 1.
    strength: f64,
    taken: u64,
}

/// What may have to wait until no force is felt.
enum Waiting {
    Replace(Box<Replacement>),
    Friction(Box<FrictionChange>),
    Pause(bool),
}

/// What became of orders in a tick.
#[derive(Debug, Default)]
pub struct Turned {
    /// The world was replaced: this is what it was, with what the new one has beside its step. Goes to
    /// [`Control::give_back`].
    pub replaced: Option<Box<Replacement>>,
    /// What is to be told.
    pub told: [Option<Event>; ORDERS_A_TICK],
    /// Orders that were taken, by their numbers in the run.
    pub taken: [Option<u64>; ORDERS_A_TICK],
}

impl std::fmt::Debug for Replacement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Replacement").finish_non_exhaustive()
    }
}

impl Control {
    /// For a step with so many entities.
    pub fn new(orders: OrderReceiver, entities: usize) -> Self {
        Self {
            orders,
            gradual: Gradual::new(entities),
            carriage: Carriage::default(),
            waiting: None,
            strength: 1.0,
            taken: 0,
        }
    }

    /// With devices that go with the camera.
    #[must_use]
    pub fn with_carriage(self, carriage: Carriage) -> Self {
        Self { carriage, ..self }
    }

    /// What became of all orders so far.
    pub fn tally(&self) -> OrderTally {
        let never_reached = self.orders.waiting();
        OrderTally { taken: self.taken, undone: self.gradual.undone(), never_reached }
    }

    /// True if an order is due by this tick of the run that waits for a world.
    pub fn wants_world(&self, run_tick: u64) -> bool {
        self.orders.wants_world(run_tick)
    }

    /// Before a tick of this length (s), the run's so many-th.
    pub fn turn(&mut self, step: &mut FastStep, run_tick: u64, dt_s: f64) -> Turned {
        let mut turned = Turned::default();
        for (told, taken) in turned.told.iter_mut().zip(&mut turned.taken) {
            if self.waiting.is_some() {
                break;
            }
            let Some(dated) = self.orders.take(run_tick) else { break };
            self.taken += 1;
            *taken = Some(dated.number);
            match dated.order {
                Order::Scale(scale) => self.gradual.scale(&scale),
                Order::Move(moved) => self.gradual.set_out(&moved),
                Order::Camera(X_WC) => self.carriage.go_to(&X_WC),
                Order::Tell(kind, at) => {
                    *told = Some(Event { run_tick: at.map_or(run_tick, |at| at.min(run_tick)), kind });
                }
                // The queue has put a world into its place.
                Order::Text | Order::ReplaceByNext => {}
                Order::Replace(next) => self.waiting = Some(Waiting::Replace(next)),
                Order::Friction(change) => self.waiting = Some(Waiting::Friction(change)),
                Order::Pause(is_paused) => self.waiting = Some(Waiting::Pause(is_paused)),
            }
        }
        let is_silent = self.fade(step, dt_s);
        if self.waiting.as_ref().is_some_and(|waiting| is_silent || !needs_silence(waiting, step)) {
            turned.replaced = self.change(step);
        }
        // What is held is to be held when forces come back, though nothing holds it now.
        let stands_still = self.waiting.is_some() || self.gradual.needs_silence();
        step.set_strength(self.strength, stands_still && self.strength < 1.0);
        self.gradual.advance(step, dt_s, is_silent);
        self.carriage.advance(step, dt_s);
        turned
    }

    /// Sends back what was replaced, to be freed.
    pub fn give_back(&mut self, replaced: Box<Replacement>) {
        self.orders.give_back(Spent::World(replaced));
    }

    /// Lets forces go for what needs silence, and come back; says whether there is silence.
    fn fade(&mut self, step: &FastStep, dt_s: f64) -> bool {
        let share = dt_s / FADE_S;
        let waits = self.waiting.as_ref().is_some_and(|waiting| needs_silence(waiting, step));
        if !waits && !self.gradual.needs_silence() {
            self.strength = (self.strength + share).min(1.0);
            return false;
        }
        self.strength = (self.strength - share).max(0.0);
        // What rounding leaves of it is nothing.
        if self.strength <= 0.5 * share {
            self.strength = 0.0;
        }
        self.strength == 0.0
    }

    /// Does what was waiting, as far as the slow side can be told of it.
    fn change(&mut self, step: &mut FastStep) -> Option<Box<Replacement>> {
        match self.waiting.take()? {
            Waiting::Replace(mut next) => {
                std::mem::swap(step, &mut next.step);
                std::mem::swap(&mut self.gradual, &mut next.gradual);
                step.begin();
                self.carriage.hand_over(step);
                if next.other.is_none() {
                    self.gradual.go_on_from(&next.gradual, step);
                    // It is empty, but for its beginning.
                    step.pause(next.step.is_paused());
                }
                return Some(next);
            }
            Waiting::Friction(mut change) => {
                let FrictionChange { entity, friction, for_slow } = &mut *change;
                if step.exchange_friction(*entity, friction, for_slow) {
                    self.orders.give_back(Spent::Friction(change));
                } else {
                    self.waiting = Some(Waiting::Friction(change));
                }
            }
            Waiting::Pause(is_paused) => {
                if !step.pause(is_paused) {
                    self.waiting = Some(Waiting::Pause(is_paused));
                }
            }
        }
        None
    }
}

/// So many ticks of this length (s) after a replacement was ordered the other world has its first one.
pub fn ticks_to_silence(dt_s: f64) -> u64 {
    let (share, mut strength, mut ticks) = (dt_s / FADE_S, 1.0, 0);
    loop {
        strength -= share;
        if strength <= 0.5 * share {
            return ticks;
        }
        ticks += 1;
    }
}

fn needs_silence(waiting: &Waiting, step: &FastStep) -> bool {
    match waiting {
        Waiting::Replace(_) => true,
        Waiting::Friction(change) => step.is_felt(Some(change.entity)),
        Waiting::Pause(_) => step.is_felt(None),
    }
}
