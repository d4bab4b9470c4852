//! From whoever sees events to whoever wants them.
//!
//! Invariants: sending takes a bounded time, without lock or allocation; nothing waits for a subscriber that is slow. Events
//! of one sender arrive in order; what is missing is told where it is missing.

use super::{Class, Event, Filter, Kind};
use rtrb::{Consumer, Producer, RingBuffer};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// The sending end: that of a real-time thread, or of a subscriber with a queue of its own.
#[derive(Debug)]
pub struct EventSender {
    queue: Producer<Event>,
    /// Since the last event that was sent.
    untold: u64,
    lost: Arc<AtomicU64>,
}

/// The other end.
#[derive(Debug)]
pub struct EventReceiver {
    queue: Consumer<Event>,
    lost: Arc<AtomicU64>,
}

/// A queue with so many places, two at least.
pub fn event_queue(places: usize) -> (EventSender, EventReceiver) {
    let (mut queue, mut end) = RingBuffer::new(places.max(2));
    // Each place is written to once: the first touch of a page would otherwise be a fault of the fast thread.
    while queue.push(Event { run_tick: 0, kind: Kind::Reset }).is_ok() {}
    while end.pop().is_ok() {}
    let lost = Arc::new(AtomicU64::new(0));
    (EventSender { queue, untold: 0, lost: lost.clone() }, EventReceiver { queue: end, lost })
}

impl EventSender {
    /// Sends; `false`, and counted, if there is no room.
    pub fn send(&mut self, event: Event) -> bool {
        let needed = if self.untold > 0 { 2 } else { 1 };
        if self.queue.slots() < needed {
            self.lose();
            return false;
        }
        if self.untold > 0 {
            let kind = Kind::Lost { count: std::mem::take(&mut self.untold) };
            // There is room for both.
            let _ = self.queue.push(Event { run_tick: event.run_tick, kind });
        }
        self.queue.push(event).is_ok()
    }

    /// Counts an event that is not sent.
    pub fn lose(&mut self) {
        self.untold += 1;
        self.lost.fetch_add(1, Ordering::Relaxed);
    }

    /// Whether another event might find no room.
    pub fn is_full(&self) -> bool {
        self.queue.slots() < 2
    }

    /// Whether nobody will ever take one.
    pub fn is_abandoned(&self) -> bool {
        self.queue.is_abandoned()
    }
}

impl EventReceiver {
    /// The next event, if it is not of a later tick than this.
    pub fn receive(&mut self, up_to: u64) -> Option<Event> {
        (self.queue.peek().ok()?.run_tick <= up_to).then(|| self.queue.pop().ok())?
    }

    /// How many found no room so far.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Whether no more will come than are there.
    pub fn is_abandoned(&self) -> bool {
        self.queue.is_abandoned()
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
