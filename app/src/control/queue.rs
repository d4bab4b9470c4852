//! The queue of orders from the slow side to the fast one, and the way back for what was replaced.
//!
//! Model: two lanes. What a script has for later waits in one of them, in its order; what somebody wants now goes past it in
//! the other.
//! Worlds of a script come by themselves, a few at a time: each takes memory, and a script may have hundreds. An order for the next
//! one waits until that is there.
//! Invariant: there is always room on the way back: what leaves something over is taken only where there is.

use super::order::{Order, Replacement, Spent};
use rtrb::{Consumer, Producer, RingBuffer};

/// The slow side's end.
pub struct OrderSender {
    out: Producer<Dated>,
    now: Producer<Dated>,
    worlds: Producer<Box<Replacement>>,
    back: Consumer<Spent>,
}

/// The fast side's end.
pub struct OrderReceiver {
    orders: Consumer<Dated>,
    now: Consumer<Dated>,
    worlds: Consumer<Box<Replacement>>,
    back: Producer<Spent>,
}

/// An order, and the tick of the run that it is for.
pub struct Dated {
    /// Or as soon after as those before it are done.
    pub at_tick: u64,
    /// What is to be done.
    pub order: Order,
    /// Its number in the run's book.
    pub number: u64,
}

/// Which way an order goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lane {
    /// After all that were sent so.
    InTurn,
    /// Past those that wait for their tick.
    Now,
}

/// Both ends, with room for so many orders in each lane.
pub fn order_queue(orders: usize) -> (OrderSender, OrderReceiver) {
    let (out, orders_end) = RingBuffer::new(orders);
    let (now, now_end) = RingBuffer::new(orders);
    let (worlds, worlds_end) = RingBuffer::new(WORLDS_AHEAD);
    let (back, back_end) = RingBuffer::new(2 * orders);
    let receiver = OrderReceiver { orders: orders_end, now: now_end, worlds: worlds_end, back };
    (OrderSender { out, now, worlds, back: back_end }, receiver)
}

/// Worlds of a script that are made before their time.
const WORLDS_AHEAD: usize = 2;

impl OrderSender {
    /// Sends an order. `false`: there is no room.
    pub fn send(&mut self, order: Dated, lane: Lane) -> bool {
        self.free_spent();
        self.lane(lane).push(order).is_ok()
    }

    /// Whether there is no room for another order.
    pub fn is_full(&mut self, lane: Lane) -> bool {
        self.lane(lane).is_full()
    }

    /// Number of worlds that may still be made before their time.
    pub fn rooms_for_worlds(&self) -> usize {
        self.worlds.slots()
    }

    /// Sends the world for the next order that waits for one; it is dropped where there is no room.
    pub fn send_world(&mut self, world: Box<Replacement>) {
        let _ = self.worlds.push(world);
    }

    fn lane(&mut self, lane: Lane) -> &mut Producer<Dated> {
        match lane {
            Lane::InTurn => &mut self.out,
            Lane::Now => &mut self.now,
        }
    }

    /// Frees what was replaced.
    pub fn free_spent(&mut self) {
        while let Ok(spent) = self.back.pop() {
            drop(spent);
        }
    }
}

impl OrderReceiver {
    /// How many orders wait for their time.
    pub fn waiting(&self) -> u64 {
        (self.orders.slots() + self.now.slots()) as u64
    }

    /// The next order, if it is due.
    pub(super) fn take(&mut self, run_tick: u64) -> Option<Dated> {
        let (has_room, has_world) = (!self.back.is_full(), !self.worlds.is_empty());
        let may_come = |next: &Dated| {
            let has_all = match next.order {
                Order::Replace(_) | Order::Friction(_) => has_room,
                Order::ReplaceByNext => has_room && has_world,
                _ => true,
            };
            next.at_tick <= run_tick && has_all
        };
        let lane =
            [&mut self.now, &mut self.orders].into_iter().find(|lane| lane.peek().is_ok_and(may_come))?;
        let mut dated = lane.pop().ok()?;
        if let Order::ReplaceByNext = dated.order {
            dated.order = Order::Replace(self.worlds.pop().ok()?);
        }
        Some(dated)
    }

    /// True if the next order is due by this tick and waits for a world.
    pub(super) fn wants_world(&self, run_tick: u64) -> bool {
        let waits = |next: &Dated| next.at_tick <= run_tick && matches!(next.order, Order::ReplaceByNext);
        self.worlds.is_empty() && self.orders.peek().is_ok_and(waits)
    }

    /// Sends back what was replaced.
    pub(super) fn give_back(&mut self, spent: Spent) {
        // There is room: `take` has seen to it, one at a time, and nobody else pushes.
        let _ = self.back.push(spent);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_for_now_goes_past_what_waits_for_its_tick() {
        let (mut sender, mut receiver) = order_queue(2);
        let order = |at_tick, number| Dated { at_tick, order: Order::Pause(true), number };
        assert!(sender.send(order(0, 0), Lane::InTurn) && sender.send(order(100, 1), Lane::InTurn));
        assert!(sender.is_full(Lane::InTurn) && !sender.is_full(Lane::Now));
        assert!(sender.send(order(0, 2), Lane::Now) && sender.send(order(0, 3), Lane::Now));
        assert!(!sender.send(order(0, 4), Lane::Now));
        let mut taken = |run_tick| receiver.take(run_tick).map(|dated| dated.number);
        assert_eq!([taken(7), taken(7), taken(7), taken(7)], [Some(2), Some(3), Some(0), None]);
        assert_eq!([taken(99), taken(100), taken(100)], [None, Some(1), None]);
    }
}
