//! The queues between the two lists.

use super::order::{MOST_ORDERS, SlowOrder};
use physics::{Body, Parcel};
use rtrb::{Consumer, Producer, RingBuffer};

/// Where a body stands that is in the slow list, and how it moves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stand {
    pub(super) body: u32,
    /// How often it had come to the slow list by then: an old one must not place a body that was away meanwhile.
    pub(super) stay: u32,
    pub(super) state: Body,
}

/// The fast side's end.
pub(super) struct FastEnd {
    pub(super) out: Producer<Parcel>,
    pub(super) claims: Producer<u32>,
    pub(super) orders: Producer<SlowOrder>,
    pub(super) back: Consumer<Parcel>,
    pub(super) stands: Consumer<Stand>,
}

/// The slow side's end.
pub(super) struct SlowEnd {
    pub(super) out: Producer<Parcel>,
    pub(super) claims: Consumer<u32>,
    pub(super) orders: Consumer<SlowOrder>,
    pub(super) back: Consumer<Parcel>,
    pub(super) stands: Producer<Stand>,
}

/// Both ends, for so many bodies.
pub(super) fn link(bodies: usize) -> (FastEnd, SlowEnd) {
    // An island has no more parcels than this, but for one in which everything touches everything.
    let parcels = (bodies * PARCELS_OF_BODY + 1).min(MOST_PARCELS);
    let (out, slow_back) = RingBuffer::new(parcels);
    let (slow_out, back) = RingBuffer::new(parcels);
    let (claims, slow_claims) = RingBuffer::new(bodies.clamp(1, MOST_CLAIMS));
    let (slow_stands, stands) = RingBuffer::new(bodies.clamp(1, MOST_STANDS));
    let (orders, slow_orders) = RingBuffer::new(MOST_ORDERS);
    (
        FastEnd { out, claims, orders, back, stands },
        SlowEnd {
            out: slow_out,
            claims: slow_claims,
            orders: slow_orders,
            back: slow_back,
            stands: slow_stands,
        },
    )
}

/// A body, and the pairs that it brings along.
const PARCELS_OF_BODY: usize = 8;
const MOST_PARCELS: usize = 4096;
const MOST_CLAIMS: usize = 1024;
const MOST_STANDS: usize = 4096;
