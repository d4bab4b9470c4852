//! The queue of orders from the slow side to the fast one, and the way back for what was replaced.
//!
//! Invariant: there is always room on the way back: what leaves something over is taken only where there is.

use super::order::{Order, Spent};
use rtrb::{Consumer, Producer, RingBuffer};

/// The slow side's end.
pub struct OrderSender {
    out: Producer<Dated>,
    back: Consumer<Spent>,
}

/// The fast side's end.
pub struct OrderReceiver {
    orders: Consumer<Dated>,
    back: Producer<Spent>,
}

/// An order, and the tick of the run that it is for.
pub struct Dated {
    /// Or as soon after as those before it are done.
    pub at_tick: u64,
    /// What is to be done.
    pub order: Order,
}

/// Both ends, with room for so many orders.
pub fn order_queue(orders: usize) -> (OrderSender, OrderReceiver) {
    let (out, orders_end) = RingBuffer::new(orders);
    let (back, back_end) = RingBuffer::new(orders);
    (OrderSender { out, back: back_end }, OrderReceiver { orders: orders_end, back })
}

impl OrderSender {
    /// Sends an order. `false`: there is no room.
    pub fn send(&mut self, order: Dated) -> bool {
        self.free_spent();
        self.out.push(order).is_ok()
    }

    /// Whether there is no room for another order.
    pub fn is_full(&self) -> bool {
        self.out.is_full()
    }

    /// Frees what was replaced.
    pub fn free_spent(&mut self) {
        while let Ok(spent) = self.back.pop() {
            drop(spent);
        }
    }
}

impl OrderReceiver {
    /// The next order, if it is due.
    pub(super) fn take(&mut self, run_tick: u64) -> Option<Dated> {
        let next = self.orders.peek().ok()?;
        let leaves_nothing = !matches!(next.order, Order::Replace(_) | Order::Friction(_));
        let has_room = leaves_nothing || !self.back.is_full();
        if next.at_tick > run_tick || !has_room {
            return None;
        }
        self.orders.pop().ok()
    }

    /// Sends back what was replaced.
    pub(super) fn give_back(&mut self, spent: Spent) {
        // There is room: `take` has seen to it, one at a time, and nobody else pushes.
        let _ = self.back.push(spent);
    }
}
