//! What people change while a run goes on: keys of the thesis' input manager (Melder ch. 7.2.12) and the scene itself.
//!
//! Problem: a key may come in any tick, and a hand is on the device: no key may be felt as a blow.
//!
//! Model: the slow side ([`desk`]) reads orders in words, checks them and makes whatever takes memory or time; they come to
//! the fast thread through a queue ([`queue`]), which takes a few in a tick. There everything is spread over ticks
//! ([`gradual`]): stiffness and damping change by shares, what is moved goes along a smooth path, and a world that takes the
//! place of another one does so while no force is felt. A reset is such an exchange, with the same scene made anew: so
//! everything is where it began, to the bit.
//! Invariants: the fast side neither allocates nor frees: what it is done with goes back to the slow side.

#![allow(non_snake_case)] // Names carry their frame: to_W is a place in W.

pub mod desk;
pub mod gradual;
pub mod order;
pub mod queue;
pub mod words;

use crate::fast_step::FastStep;
use gradual::{FADE_S, Gradual};
use order::{Order, Replacement};
use queue::OrderReceiver;

/// Why a scene takes no orders.
pub(crate) const NEEDS_ONE_LIST: &str = "--orders needs everything that moves in the fast list; allowed: a scene with no more of it than \
                                  lists = { fast_bodies = ... } says (64 if nobody does)";

/// So many orders are taken in a tick.
const ORDERS_A_TICK: usize = 4;

/// The fast side of orders.
pub struct Control {
    orders: OrderReceiver,
    gradual: Gradual,
    /// Who takes over once no force is felt.
    next: Option<Box<Replacement>>,
    /// How much of the forces is felt, 0 to 1.
    strength: f64,
    taken: u64,
}

/// What became of the world in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum World {
    /// It goes on.
    Same,
    /// The same scene was begun anew.
    Reset,
    /// It is another scene.
    Other,
}

impl Control {
    /// For a step with so many entities.
    pub fn new(orders: OrderReceiver, entities: usize) -> Self {
        Self { orders, gradual: Gradual::new(entities), next: None, strength: 1.0, taken: 0 }
    }

    /// How many orders were taken.
    pub fn taken(&self) -> u64 {
        self.taken
    }

    /// Before a tick of this length (s), the run's so many-th.
    pub fn turn(&mut self, step: &mut FastStep, run_tick: u64, dt_s: f64) -> World {
        for _ in 0..ORDERS_A_TICK {
            if self.next.is_some() {
                break;
            }
            let Some(order) = self.orders.take(run_tick) else { break };
            self.taken += 1;
            match order {
                Order::Scale(scale) => self.gradual.scale(&scale),
                Order::Move(moved) => self.gradual.set_out(&moved, step),
                Order::Replace(next) => self.next = Some(next),
            }
        }
        let became = self.fade(step, dt_s);
        step.set_strength(self.strength);
        self.gradual.advance(step, dt_s);
        became
    }

    fn fade(&mut self, step: &mut FastStep, dt_s: f64) -> World {
        let share = dt_s / FADE_S;
        if self.next.is_none() {
            self.strength = (self.strength + share).min(1.0);
            return World::Same;
        }
        self.strength = (self.strength - share).max(0.0);
        // What rounding leaves of it is nothing.
        if self.strength > 0.5 * share {
            return World::Same;
        }
        self.strength = 0.0;
        let Some(mut next) = self.next.take() else { return World::Same };
        std::mem::swap(step, &mut next.step);
        std::mem::swap(&mut self.gradual, &mut next.gradual);
        let became = if next.is_same_scene { World::Reset } else { World::Other };
        if next.is_same_scene {
            self.gradual.go_on_from(&next.gradual, step);
        }
        self.orders.give_back(next);
        became
    }
}
