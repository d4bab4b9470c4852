//! What the socket's thread tells the loop, and what the loop throws back.
//!
//! Two bounded lock-free queues: leases and requests travel to the loop by value; mappings that the loop no
//! longer needs travel back, because unmapping is a system call.

use crate::cycle::Cycle;
use crate::zeroing::DeviceSet;
use rtrb::{Consumer, Producer, RingBuffer};
use shm_abi::{CommanderView, FaultReason};

/// More than can ever be on the way: the socket's thread posts a handful in its poll, the loop collects
/// them every tick.
const CAPACITY: usize = 256;

/// A message to the loop.
#[derive(Debug)]
pub enum Letter {
    /// Obey this commander.
    Grant(CommanderView),
    /// Obey it no more.
    End(u64),
    /// Leave the fault state.
    ClearFault,
    /// These devices are in their zeroing pose; none named: all that count.
    Zero(DeviceSet),
    /// All motors off, now.
    EmergencyStop,
}

/// The socket thread's end.
#[derive(Debug)]
pub struct Sender {
    letters: Producer<Letter>,
    waste: Consumer<CommanderView>,
}

/// The loop's end.
#[derive(Debug)]
pub struct Inbox {
    letters: Consumer<Letter>,
    waste: Producer<CommanderView>,
}

/// Both ends.
pub fn mail() -> (Sender, Inbox) {
    let (letters_in, letters_out) = RingBuffer::new(CAPACITY);
    let (waste_in, waste_out) = RingBuffer::new(CAPACITY);
    (Sender { letters: letters_in, waste: waste_out }, Inbox { letters: letters_out, waste: waste_in })
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
        let mut is_emergency = false;
        // Bounded by what was there when it began, so that a flood of letters takes turns with ticks.
        for _ in 0..self.letters.slots() {
            let Ok(letter) = self.letters.pop() else { break };
            let waste = match letter {
                Letter::Grant(view) => cycle.grant(view),
                Letter::End(lease) => cycle.end_lease(lease),
                Letter::ClearFault => {
                    cycle.clear_fault();
                    None
                }
                Letter::Zero(devices) => {
                    cycle.zero(devices);
                    None
                }
                Letter::EmergencyStop => {
                    is_emergency = true;
                    None
                }
            };
            self.throw_away(waste);
        }
        if is_emergency {
            cycle.fault(FaultReason::EmergencyStop);
        }
        let former = cycle.change_lease();
        self.throw_away(former);
    }

    /// With the queue full the view is dropped here: late once, instead of a leak.
    fn throw_away(&mut self, view: Option<CommanderView>) {
        if let Some(view) = view {
            let _ = self.waste.push(view);
        }
    }
}
