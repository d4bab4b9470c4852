//! From whoever sees events to whoever wants them.
//!
//! Model: on a clock that waits a queue grows and nothing is lost ([`growing_event_queue`]); in real time it has so many places.
//! Invariants: sending into places takes a bounded time, without lock or allocation; nothing waits for a subscriber that is slow.
//! Events of one sender arrive in order; what is missing is told where it is missing. What would be too many at once for the
//! sender is sent as a whole ([`Unfold`]), and becomes events at the other end, in its place.

use super::{Class, Event, Filter, Kind};
use rtrb::{Consumer, Producer, RingBuffer};
use std::collections::VecDeque;
use std::fmt::Debug;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The sending end: that of a real-time thread, or of a subscriber with a queue of its own.
#[derive(Debug)]
pub struct EventSender {
    queue: Sending,
    /// Since the last event that was sent.
    untold: u64,
    lost: Arc<AtomicU64>,
}

/// The other end.
#[derive(Debug)]
pub struct EventReceiver {
    queue: Receiving,
    /// Events that came as a whole, as far as they have not been taken.
    unfolded: VecDeque<Event>,
    lost: Arc<AtomicU64>,
}

#[derive(Debug)]
enum Sending {
    Places(Producer<Item>),
    Growing(Growing),
}

#[derive(Debug)]
enum Receiving {
    Places(Consumer<Item>),
    Growing(Growing),
}

/// Events that are made where they are received: more than a real-time thread has time for.
pub(super) trait Unfold: Send + Debug {
    /// All of them, which are of this tick of the run.
    fn unfold(self: Box<Self>, run_tick: u64) -> Vec<Event>;
}

/// Something on its way.
#[derive(Debug)]
enum Item {
    One(Event),
    /// So many as it will be, of this tick of the run.
    Whole(u64, Box<dyn Unfold>),
}

impl Item {
    fn run_tick(&self) -> u64 {
        match self {
            Self::One(event) => event.run_tick,
            Self::Whole(run_tick, _) => *run_tick,
        }
    }
}

/// Both ends have it.
type Growing = Arc<Mutex<VecDeque<Item>>>;

fn held(events: &Growing) -> MutexGuard<'_, VecDeque<Item>> {
    events.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A queue with so many places, two at least.
pub fn event_queue(places: usize) -> (EventSender, EventReceiver) {
    let (mut queue, mut end) = RingBuffer::new(places.max(2));
    // Each place is written to once: the first touch of a page would otherwise be a fault of the fast thread.
    while queue.push(Item::One(Event { run_tick: 0, kind: Kind::Reset })).is_ok() {}
    while end.pop().is_ok() {}
    ends(Sending::Places(queue), Receiving::Places(end))
}

/// A queue that has so many places at first and grows, for clocks that wait: it has a lock, and may allocate.
pub fn growing_event_queue(places: usize) -> (EventSender, EventReceiver) {
    let events = Growing::new(Mutex::new(VecDeque::with_capacity(places)));
    ends(Sending::Growing(Arc::clone(&events)), Receiving::Growing(events))
}

fn ends(sending: Sending, receiving: Receiving) -> (EventSender, EventReceiver) {
    let lost = Arc::new(AtomicU64::new(0));
    let sender = EventSender { queue: sending, untold: 0, lost: Arc::clone(&lost) };
    (sender, EventReceiver { queue: receiving, unfolded: VecDeque::new(), lost })
}

impl EventSender {
    /// Sends; `false`, and counted, if there is no room.
    pub fn send(&mut self, event: Event) -> bool {
        let has_room = self.has_room(event.run_tick);
        if has_room {
            self.push(Item::One(event));
        } else {
            self.lose();
        }
        has_room
    }

    /// Sends what will be events of this tick of the run at the other end; it comes back if there is no room.
    pub(super) fn send_whole<T: Unfold + 'static>(
        &mut self,
        run_tick: u64,
        whole: Box<T>,
    ) -> Result<(), Box<T>> {
        if !self.has_room(run_tick) {
            return Err(whole);
        }
        self.push(Item::Whole(run_tick, whole));
        Ok(())
    }

    /// True if one more finds room, behind what is missing before it, which is told.
    fn has_room(&mut self, run_tick: u64) -> bool {
        let needed = if self.untold > 0 { 2 } else { 1 };
        if self.slots() < needed {
            return false;
        }
        if self.untold > 0 {
            let kind = Kind::Lost { count: std::mem::take(&mut self.untold) };
            self.push(Item::One(Event { run_tick, kind }));
        }
        true
    }

    /// There is room.
    fn push(&mut self, item: Item) {
        match &mut self.queue {
            Sending::Places(queue) => drop(queue.push(item)),
            Sending::Growing(events) => held(events).push_back(item),
        }
    }

    fn slots(&self) -> usize {
        match &self.queue {
            Sending::Places(queue) => queue.slots(),
            Sending::Growing(_) => usize::MAX,
        }
    }

    /// Number that has been sent and that nobody has taken yet.
    pub fn waiting(&self) -> usize {
        match &self.queue {
            Sending::Places(queue) => queue.buffer().capacity() - queue.slots(),
            Sending::Growing(events) => held(events).len(),
        }
    }

    /// True if it has room for whatever happens.
    pub(super) fn grows(&self) -> bool {
        matches!(self.queue, Sending::Growing(_))
    }

    /// Counts an event that is not sent.
    pub fn lose(&mut self) {
        self.lose_all(1);
    }

    /// Counts so many.
    pub(super) fn lose_all(&mut self, count: u64) {
        self.untold += count;
        self.lost.fetch_add(count, Ordering::Relaxed);
    }

    /// Whether another event might find no room.
    pub fn is_full(&self) -> bool {
        self.slots() < 2
    }

    /// Whether nobody will ever take one.
    pub fn is_abandoned(&self) -> bool {
        match &self.queue {
            Sending::Places(queue) => queue.is_abandoned(),
            Sending::Growing(events) => Arc::strong_count(events) == 1,
        }
    }
}

impl EventReceiver {
    /// The next event, if it is not of a later tick than this.
    pub fn receive(&mut self, up_to: u64) -> Option<Event> {
        loop {
            if let Some(event) = self.unfolded.front() {
                return if event.run_tick <= up_to { self.unfolded.pop_front() } else { None };
            }
            match self.take(up_to)? {
                Item::One(event) => return Some(event),
                Item::Whole(run_tick, whole) => self.unfolded.extend(whole.unfold(run_tick)),
            }
        }
    }

    fn take(&mut self, up_to: u64) -> Option<Item> {
        let is_due = |item: &Item| item.run_tick() <= up_to;
        match &mut self.queue {
            Receiving::Places(queue) => is_due(queue.peek().ok()?).then(|| queue.pop().ok())?,
            Receiving::Growing(events) => {
                let mut events = held(events);
                if is_due(events.front()?) { events.pop_front() } else { None }
            }
        }
    }

    /// Number that waits to be taken.
    pub fn waiting(&self) -> usize {
        let on_the_way = match &self.queue {
            Receiving::Places(queue) => queue.slots(),
            Receiving::Growing(events) => held(events).len(),
        };
        self.unfolded.len() + on_the_way
    }

    /// How many found no room so far.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Whether no more will come than are there.
    pub fn is_abandoned(&self) -> bool {
        match &self.queue {
            Receiving::Places(queue) => queue.is_abandoned(),
            Receiving::Growing(events) => Arc::strong_count(events) == 1,
        }
    }
}

/// Whoever wants events.
pub trait Subscriber: Send {
    /// Takes one; those of one source come in the order of their ticks, but for keys, which are told as of when they were
    /// pressed.
    fn event(&mut self, event: &Event);

    /// Whether it wants no more, and may be forgotten.
    fn is_over(&self) -> bool {
        false
    }
}

impl<F: FnMut(&Event) + Send> Subscriber for F {
    fn event(&mut self, event: &Event) {
        self(event);
    }
}

/// Its own queue: what finds no room there is lost to this one alone.
impl Subscriber for EventSender {
    fn event(&mut self, event: &Event) {
        self.send(*event);
    }
}

/// Takes events from their sources and hands them to all who want them.
#[derive(Default)]
pub struct Hub {
    sources: Vec<EventReceiver>,
    subscribers: Vec<(Filter, Box<dyn Subscriber>)>,
    counts: [u64; Class::ALL.len()],
}

impl Hub {
    /// Of these sources, and nobody who wants anything yet.
    pub fn new(sources: Vec<EventReceiver>) -> Self {
        Self { sources, ..Self::default() }
    }

    /// Another source, behind those that are there.
    pub fn add_source(&mut self, source: EventReceiver) {
        self.sources.push(source);
    }

    /// From now on hands this one what its filter lets through.
    pub fn subscribe(&mut self, filter: Filter, subscriber: Box<dyn Subscriber>) {
        self.subscribers.push((filter, subscriber));
    }

    /// The receiving end of a new queue with so many places, which gets what the filter lets through.
    pub fn subscribe_queue(&mut self, filter: Filter, places: usize) -> EventReceiver {
        let (sender, receiver) = event_queue(places);
        self.subscribe(filter, Box::new(sender));
        receiver
    }

    /// Hands on all events up to this tick, source by source.
    pub fn deliver(&mut self, up_to: u64) {
        self.subscribers.retain(|(_, subscriber)| !subscriber.is_over());
        for source in &mut self.sources {
            while let Some(event) = source.receive(up_to) {
                self.counts[event.kind.class() as usize] += u64::from(!event.kind.is_end());
                for (_, subscriber) in self.subscribers.iter_mut().filter(|(filter, _)| filter.lets(&event)) {
                    subscriber.event(&event);
                }
            }
        }
    }

    /// How many things of a class have happened or begun, as far as their events have been handed on.
    pub fn count(&self, class: Class) -> u64 {
        self.counts[class as usize]
    }

    /// How many found no room on their way here.
    pub fn lost(&self) -> u64 {
        self.sources.iter().map(EventReceiver::lost).sum()
    }
}
