//! Events: what happened, in which tick and to whom, told while a run goes on to whoever wants to know.
//!
//! Problem: a study scores grasps, a sound answers a touch, a recording is searched for the moment of slip. None of them
//! should have to find that in rows, and none of them may keep the fast thread waiting.
//!
//! Model: [`Watch`] compares each tick with the one before and tells what is new. An [`EventSender`] takes that without
//! lock, allocation or waiting; what finds no room is counted, and told as [`Kind::Lost`] as soon as there is room again. On
//! clocks that wait there is always room.
//! On the slow side one [`Hub`] hands every event to each [`Subscriber`] whose [`Filter`] lets it through: a closure, or the
//! sending end of another queue.
//!
//! ```
//! use world::events::{Change, Class, Event, Filter, Hub, Kind, event_queue};
//!
//! let (mut fast, events) = event_queue(64);
//! let mut hub = Hub::new(vec![events]);
//! hub.subscribe(Filter::of(&[Class::Trial]), Box::new(|event: &Event| println!("{event:?}")));
//! fast.send(Event { run_tick: 3, kind: Kind::Trial { change: Change::Begins, number: 1 } });
//! fast.send(Event { run_tick: 4, kind: Kind::Key { code: 32, is_pressed: true } });
//! hub.deliver(u64::MAX);
//! assert_eq!((hub.count(Class::Trial), hub.count(Class::Key)), (1, 1));
//! ```

#![allow(non_snake_case)] // Frames are capital letters: force_W is the force in W.

mod bus;
mod event;
mod filter;
mod slow_pairs;
mod watch;

pub use bus::{EventReceiver, EventSender, Hub, Subscriber, event_queue, growing_event_queue};
pub use event::{Change, Class, Event, Facts, Kind, Life, List, Why};
pub use filter::Filter;
pub use physics::PairStanding;
pub use slow_pairs::{FastPairs, SlowPairs, pair_link};
pub use watch::{MOST_TOLD, PairForce, QUIET_S, Touching, Watch};
