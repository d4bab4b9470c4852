//! Room for more contacts between entities than there seemed to be when a scene was loaded.
//!
//! Model: where a tick has no deadline, room is made between two of them. On the real clock the fast thread tells what it
//! wants, a thread without rights makes it, and the fast thread takes it when it is there, some ticks later.
//! Invariant: nothing is allocated or freed by who is [supplied](RoomSupply::serve) by a thread.

use crate::fast_step::FastStep;
use physics::{Room, Wanted};
use rtrb::{Consumer, Producer, RingBuffer};
use std::thread::JoinHandle;
use std::time::Duration;

/// Source of room.
#[derive(Default)]
pub enum RoomSupply {
    /// It is made at once.
    #[default]
    Here,
    /// A thread makes it.
    Thread(RoomThread),
}

/// The thread, as it is seen by who is supplied.
pub struct RoomThread {
    wanted: Option<Producer<Wanted>>,
    made: Consumer<Room>,
    used: Producer<Room>,
    is_asked: bool,
    thread: Option<JoinHandle<()>>,
}

/// Nobody is woken without a reason; this is for a reason that got lost.
const LONGEST_SLEEP: Duration = Duration::from_millis(500);
/// At most one wish and one answer are on their way.
const ON_THE_WAY: usize = 2;

impl RoomSupply {
    /// By a thread of its own.
    ///
    /// # Errors
    /// If the thread cannot be started.
    pub fn start() -> std::io::Result<Self> {
        let (wanted, wishes) = RingBuffer::new(ON_THE_WAY);
        let (answers, made) = RingBuffer::new(ON_THE_WAY);
        let (used, back) = RingBuffer::new(ON_THE_WAY);
        let thread =
            std::thread::Builder::new().name("room".into()).spawn(move || make(wishes, answers, back))?;
        Ok(Self::Thread(RoomThread {
            wanted: Some(wanted),
            made,
            used,
            is_asked: false,
            thread: Some(thread),
        }))
    }

    /// Between two ticks.
    pub fn serve(&mut self, step: &mut FastStep) {
        match self {
            Self::Here => step.make_room(),
            Self::Thread(thread) => thread.serve(step),
        }
    }
}

impl RoomThread {
    fn serve(&mut self, step: &mut FastStep) {
        let Some(wanted) = &mut self.wanted else { return };
        if let Ok(room) = self.made.pop() {
            self.is_asked = false;
            // There is a place for each answer.
            let _ = self.used.push(step.take_room(room));
        } else if self.is_asked {
            return;
        }
        if let Some(more) = step.wanted_room()
            && wanted.push(more).is_ok()
        {
            self.is_asked = true;
        }
        if let Some(thread) = &self.thread
            && (self.is_asked || self.used.slots() < ON_THE_WAY)
        {
            thread.thread().unpark();
        }
    }
}

impl Drop for RoomThread {
    fn drop(&mut self) {
        // It ends when nobody can want anything any more.
        self.wanted = None;
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            let _ = thread.join();
        }
    }
}

fn make(mut wishes: Consumer<Wanted>, mut answers: Producer<Room>, mut back: Consumer<Room>) {
    while !wishes.is_abandoned() {
        while back.pop().is_ok() {}
        while let Ok(wanted) = wishes.pop() {
            // There is a place for each answer.
            let _ = answers.push(wanted.make());
        }
        std::thread::park_timeout(LONGEST_SLEEP);
    }
}
