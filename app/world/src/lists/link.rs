//! The queues between the two lists.

use super::order::{MOST_ORDERS, SlowOrder};
use super::places::{Hips, MOST_HIPS, Stand, Stands, stands};
use haptics::Entity;
use physics::{Manipulation, Parcel};
use rtrb::{Consumer, Producer, RingBuffer};

/// A body that the fast side wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Claim {
    pub(super) body: u32,
    /// How often it has gone to the slow list: it may still be on its way there.
    pub(super) stay: u32,
}

/// The fast side's end.
pub(super) struct FastEnd {
    pub(super) out: Producer<Parcel>,
    pub(super) claims: Producer<Claim>,
    pub(super) orders: Producer<SlowOrder>,
    pub(super) back: Consumer<Parcel>,
    pub(super) stands: Stands<Consumer<Stand>>,
    pub(super) hips: Producer<Hips>,
}

/// The slow side's end.
pub(super) struct SlowEnd {
    pub(super) out: Producer<Parcel>,
    pub(super) claims: Consumer<Claim>,
    pub(super) orders: Consumer<SlowOrder>,
    pub(super) back: Consumer<Parcel>,
    pub(super) stands: Stands<Producer<Stand>>,
    pub(super) hips: Consumer<Hips>,
}

/// Both ends, for so many bodies.
pub(super) fn link(bodies: usize) -> (FastEnd, SlowEnd) {
    let parcels = (bodies * PARCELS_OF_BODY).clamp(LEAST_PARCELS, MOST_PARCELS);
    let [(out, slow_back), (slow_out, back)] = [parcels_queue(parcels), parcels_queue(parcels)];
    let (claims, slow_claims) = RingBuffer::new(bodies.clamp(1, MOST_CLAIMS));
    let (slow_stands, stands) = stands(bodies);
    let (orders, slow_orders) = RingBuffer::new(MOST_ORDERS);
    let (hips, slow_hips) = RingBuffer::new(MOST_HIPS);
    (
        FastEnd { out, claims, orders, back, stands, hips },
        SlowEnd {
            out: slow_out,
            claims: slow_claims,
            orders: slow_orders,
            back: slow_back,
            stands: slow_stands,
            hips: slow_hips,
        },
    )
}

/// A queue all of whose memory has been written to: no tick is to find a page that is not there.
fn parcels_queue(parcels: usize) -> (Producer<Parcel>, Consumer<Parcel>) {
    let (mut into, mut out) = RingBuffer::new(parcels);
    while into.push(Parcel::EMPTY).is_ok() {}
    while out.pop().is_ok() {}
    (into, out)
}

/// Sends on what is leaving, as far as there is room and this many parcels; says how many went.
///
/// They are seen by the other side together.
pub(super) fn send(
    into: &mut Producer<Parcel>,
    from: &mut Manipulation,
    entities: &[Entity],
    most: usize,
) -> usize {
    let Ok(room) = into.write_chunk_uninit(into.slots().min(most)) else { return 0 };
    room.fill_from_iter(std::iter::from_fn(|| from.next_parcel(entities)))
}

/// Takes in what has come and says how many parcels; tells of each body that has come, and that has arrived with the rest of
/// its island.
pub(super) fn take_in(
    out: &mut Consumer<Parcel>,
    to: &mut Manipulation,
    entities: &mut [Entity],
    most: Most,
    mut came: impl FnMut(Came),
) -> usize {
    let Ok(parcels) = out.read_chunk(out.slots().min(most.parcels)) else { return 0 };
    let ((first, second), mut count) = (parcels.as_slices(), 0);
    for parcel in first.iter().chain(second) {
        count += 1;
        if let Some(body) = parcel.body() {
            came(Came::Part(body));
        }
        to.accept(parcel, entities, |body| came(Came::Whole(body)));
        if parcel.is_last() && count >= most.with_an_end {
            break;
        }
    }
    parcels.commit(count);
    count
}

/// How many parcels are taken in at once.
#[derive(Debug, Clone, Copy)]
pub(super) struct Most {
    /// At most, of a large island.
    pub(super) parcels: usize,
    /// No further island is begun after so many.
    pub(super) with_an_end: usize,
}

impl Most {
    /// All that there are.
    pub(super) const ALL: Self = Self { parcels: usize::MAX, with_an_end: usize::MAX };
}

/// A body that comes.
#[derive(Debug, Clone, Copy)]
pub(super) enum Came {
    /// It is on its way.
    Part(usize),
    /// It is here, with all of its island.
    Whole(usize),
}

/// A body, and the pairs that it brings along.
const PARCELS_OF_BODY: usize = 16;
const LEAST_PARCELS: usize = 64;
/// Larger islands go in parts.
const MOST_PARCELS: usize = 4096;
const MOST_CLAIMS: usize = 1024;
