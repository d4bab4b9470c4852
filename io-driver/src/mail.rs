//! What the socket's thread tells the loop, and what the loop throws back.
//!
//! Model: leases and zeroing travel by value through a bounded lock-free queue; mappings that the loop no longer
//! needs travel back through another, because unmapping is a system call. What must never find a queue full is
//! [`Urgent`].
//! Invariant: whoever posts never waits for the loop; what finds no room is given back.

use crate::cycle::Cycle;
use crate::urgent::Urgent;
use crate::zeroing::DeviceSet;
use rtrb::{Consumer, Producer, RingBuffer};
use shm_abi::{CommanderView, FaultReason};

/// More than come in one tick of a loop that lives.
pub const CAPACITY: usize = 256;

/// A message to the loop.
#[derive(Debug)]
pub enum Letter {
    /// Obey this commander.
    Grant(CommanderView),
    /// These devices are in their zeroing pose; none named: all that count.
    Zero(DeviceSet),
}

/// The socket thread's end.
#[derive(Debug)]
pub struct Sender {
    /// Requests for which there is always room.
    pub urgent: Urgent,
    letters: Producer<Letter>,
    waste: Consumer<CommanderView>,
}

/// The loop's end.
#[derive(Debug)]
pub struct Inbox {
    urgent: Urgent,
    letters: Consumer<Letter>,
    waste: Producer<CommanderView>,
}

/// Both ends.
pub fn mail() -> (Sender, Inbox) {
    let (letters_in, letters_out) = RingBuffer::new(CAPACITY);
    let (waste_in, waste_out) = RingBuffer::new(CAPACITY);
    let urgent = Urgent::default();
    let inbox = Inbox { urgent: urgent.clone(), letters: letters_out, waste: waste_in };
    (Sender { urgent, letters: letters_in, waste: waste_out }, inbox)
}

impl Sender {
    /// Posts a letter; gives it back if the loop has not collected its mail for long.
    pub fn post(&mut self, letter: Letter) -> Result<(), Letter> {
        self.letters.push(letter).map_err(|rtrb::PushError::Full(letter)| letter)
    }

    /// Unmaps what the loop has thrown away.
    pub fn clear_waste(&mut self) {
        while self.waste.pop().is_ok() {}
    }
}

impl Inbox {
    /// Collects all mail, at the start of a tick. An emergency stop comes last, whatever else is there: who asked to
    /// leave a fault in the same tick cannot have known of it.
    pub fn deliver(&mut self, cycle: &mut Cycle) {
        // Taken first, done last: a lease that it says has ended was granted before, by a letter that is there now.
        let asked = self.urgent.take();
        // Bounded by what was there when it began, so that a flood of letters takes turns with ticks.
        for _ in 0..self.letters.slots() {
            match self.letters.pop() {
                Ok(Letter::Grant(view)) => self.throw_away(cycle.grant(view)),
                Ok(Letter::Zero(devices)) => cycle.zero(devices),
                Err(_) => break,
            }
        }
        self.throw_away(cycle.end_lease(asked.ended_lease));
        if asked.clear_fault {
            cycle.clear_fault();
        }
        if asked.emergency_stop {
            cycle.fault(FaultReason::EmergencyStop);
        }
        self.throw_away(cycle.change_lease());
    }

    /// With the queue full the view is dropped here: late once, instead of a leak.
    fn throw_away(&mut self, view: Option<CommanderView>) {
        if let Some(view) = view {
            let _ = self.waste.push(view);
        }
    }
}
