//! The queue of orders from the slow side to the fast one, and the way back for worlds that were replaced.
//!
//! Invariant: there is always room on the way back: a world is taken only where there is.

use super::order::{Order, Replacement};
use rtrb::{Consumer, Producer, RingBuffer};

/// The slow side's end.
pub struct OrderSender {
    out: Producer<(u64, Order)>,
    back: Consumer<Box<Replacement>>,
}

/// The fast side's end.
pub struct OrderReceiver {
    orders: Consumer<(u64, Order)>,
    back: Producer<Box<Replacement>>,
}

/// Both ends, with room for so many orders.
pub fn order_queue(orders: usize) -> (OrderSender, OrderReceiver) {
    let (out, orders_end) = RingBuffer::new(orders);
    let (back, back_end) = RingBuffer::new(orders);
    (OrderSender { out, back: back_end }, OrderReceiver { orders: orders_end, back })
}

impl OrderSender {
    /// Sends an order for this tick of the run, or as soon after as those before it are done. `false`: there is no room.
    pub fn send(&mut self, at_tick: u64, order: Order) -> bool {
        self.free_replaced();
        self.out.push((at_tick, order)).is_ok()
    }

    /// Frees the worlds that were replaced.
    pub fn free_replaced(&mut self) {
        while let Ok(replaced) = self.back.pop() {
            drop(replaced);
        }
    }
}

impl OrderReceiver {
    /// The next order, if it is due.
    pub(super) fn take(&mut self, run_tick: u64) -> Option<Order> {
        let (at_tick, order) = self.orders.peek().ok()?;
        let has_room = !matches!(order, Order::Replace(_)) || !self.back.is_full();
        if *at_tick > run_tick || !has_room {
            return None;
        }
        self.orders.pop().ok().map(|(_, order)| order)
    }

    /// Sends a world back that was replaced.
    pub(super) fn give_back(&mut self, replaced: Box<Replacement>) {
        // There is room: `take` has seen to it, and nobody else pushes.
        let _ = self.back.push(replaced);
    }
}
