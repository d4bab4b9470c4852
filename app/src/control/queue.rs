//! The queue of orders from the slow side to the fast one, and the way back for what was replaced.
//!
//! Model: two lanes. What a script has for later waits in one of them, in its order; what somebody wants now goes past it in
//! the other.
//! Invariant: there is always room on the way back: what leaves something over is taken only where there is.

use super::order::{Order, Spent};
use rtrb::{Consumer, Producer, RingBuffer};

/// The slow side's end.
pub struct OrderSender {
    out: Producer<Dated>,
    now: Producer<Dated>,
    back: Consumer<Spent>,
}

/// The fast side's end.
pub struct OrderReceiver {
    orders: Consumer<Dated>,
    now: Consumer<Dated>,
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
    let (back, back_end) = RingBuffer::new(2 * orders);
    (OrderSender { out, now, back: back_end }, OrderReceiver { orders: orders_end, now: now_end, back })
}

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
        let has_room = !self.back.is_full();
        let may_come = |next: &Dated| {
            let leaves_nothing = !matches!(next.order, Order::Replace(_) | Order::Friction(_));
            next.at_tick <= run_tick && (leaves_nothing || has_room)
        };
        let lane =
            [&mut self.now, &mut self.orders].into_iter().find(|lane| lane.peek().is_ok_and(may_come))?;
        lane.pop().ok()
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
